//! The options of a page: its texts, first state and appearance.

use crate::color::{Color, ColorSources, Map, ScaleEnds, to_srgb};
use crate::error::{Error, Result};
use crate::render::{
    Background, Camera, Clip, Image, Light, Style, StyleValues, Surface, plain_color,
};
use crate::setters::setters;
use crate::spectrum::{Keep, Spectrum};
use crate::volume::{Histogram, Statistics, Volume};

use super::data::DEFAULT_STEP;

/// The options of a page.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Page<'a> {
    /// Heading and title of the page.
    pub title: &'a str,
    /// Text below the picture.
    pub caption: Option<&'a str>,
    /// Authors and sources, at the bottom.
    pub credit: Option<&'a str>,
    /// The isovalue that the page opens with, in the range of the spectrum.
    pub isovalue: f64,
    /// Positions are rounded to whole multiples of this many voxels.
    pub step: f64,
    /// Whether caps are hidden at first, so that the inside is visible at the border of the volume.
    pub open: bool,
    /// The first camera. Its distance is a multiple of the distance at which the surface fits the picture.
    pub camera: Camera,
    /// The quantity that colours show at first; not [`Color::Distance`] or [`Color::Normal`].
    pub color: Color,
    /// The colour map; the default of the quantity if `None`.
    pub map: Option<Map>,
    /// The ends of the colour scale.
    pub ends: ScaleEnds,
    /// A second field that colours can show.
    pub field: Option<&'a ColorSources>,
    /// Whether the box of the volume, the axes of the world and a scale bar are shown at first.
    pub axes: bool,
    /// Initial appearance of the surface.
    pub look: Look,
    /// The components that are shown at first, sizes and places in the voxel frame.
    pub keep: Keep,
    /// The histogram of the samples, which is drawn behind the curves.
    pub samples: Option<&'a Histogram>,
    /// Statistics of the samples, by which typed isovalues such as `p99` are resolved.
    pub statistics: Option<&'a Statistics>,
    /// The volume, of which the page shows slices: its samples, rounded to 8 bits, are in the page.
    pub slice: Option<&'a Volume>,
    /// Isovalues that are shown as buttons, with their names; in the range of the spectrum.
    pub marks: &'a [(f64, String)],
    /// A picture for browsers that cannot draw the surface.
    pub still: Option<&'a Image>,
}

impl<'a> Page<'a> {
    /// A page with a title that opens with an isovalue; all other options have their defaults.
    pub fn new(title: &'a str, isovalue: f64) -> Self {
        Page {
            title,
            caption: None,
            credit: None,
            isovalue,
            step: DEFAULT_STEP,
            open: false,
            camera: Camera::default(),
            color: Color::None,
            map: None,
            ends: ScaleEnds::default(),
            field: None,
            axes: false,
            look: Look::default(),
            keep: Keep::default(),
            samples: None,
            statistics: None,
            slice: None,
            marks: &[],
            still: None,
        }
    }

    setters! {
        with_step(step: f64),
        with_open(open: bool),
        with_camera(camera: Camera),
        with_color(color: Color),
        with_ends(ends: ScaleEnds),
        with_axes(axes: bool),
        with_look(look: Look),
        with_keep(keep: Keep),
        with_marks(marks: &'a [(f64, String)]);
        optional:
        with_caption(caption: &'a str),
        with_credit(credit: &'a str),
        with_map(map: Map),
        with_field(field: &'a ColorSources),
        with_samples(samples: &'a Histogram),
        with_statistics(statistics: &'a Statistics),
        with_slice(slice: &'a Volume),
        with_still(still: &'a Image),
    }

    /// Checks the options against each other and against a spectrum.
    pub(super) fn check(&self, spectrum: &Spectrum) -> Result<()> {
        if !(self.step > 0.0 && self.step.is_finite()) {
            return Err(Error::Usage(format!(
                "step of {} voxels, expected more than 0",
                self.step
            )));
        }
        spectrum.check_isovalue(self.isovalue)?;
        self.ends.check()?;
        self.keep.check()?;
        self.camera.check()?;
        if let Some(volume) = self.slice
            && volume.dims() != spectrum.volume().dims
        {
            return Err(Error::Usage(format!(
                "{}: {:?} samples, expected {:?} as the spectrum's volume has",
                volume.name(),
                volume.dims(),
                spectrum.volume().dims
            )));
        }
        Page::check_color(self.color)
    }

    /// Checks that a page can show a quantity: the distance needs the volume, which a page does not contain.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`] for [`Color::Distance`] and [`Color::Normal`].
    pub fn check_color(color: Color) -> Result<()> {
        if matches!(color, Color::Distance | Color::Normal) {
            let name = color.name();
            return Err(Error::Usage(format!(
                "a page cannot show the color {name}, expected none, quality, lifetime, curvature or component"
            )));
        }
        Ok(())
    }
}

/// Initial appearance of the surface of a page; the reader can change all of it.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Look {
    /// Whether ambient occlusion darkens hollows; if the reader's browser draws with WebGPU on a GPU if `None`.
    pub occlusion: Option<bool>,
    /// Whether the edges of triangles are drawn.
    pub wireframe: bool,
    /// Whether lines show where the surface turns away from the eye.
    pub silhouette: bool,
    /// The opacity of the surface, 0 to 1.
    pub opacity: f32,
    /// A plane across an axis of the volume; the surface beyond it is not drawn.
    pub clip: Option<Clip>,
    /// The position of the main light.
    pub light: Light,
    /// The background; light or dark as the reader's browser prefers if `None`.
    pub background: Option<Background>,
    /// Linear red, green and blue of a surface without a colour map; the default colour if `None`.
    pub front: Option<[f32; 3]>,
    /// Isosurfaces that are shown together with the one of the slider.
    pub also: Vec<Surface>,
}

impl Default for Look {
    fn default() -> Self {
        Look {
            occlusion: None,
            wireframe: false,
            silhouette: false,
            opacity: 1.0,
            clip: None,
            light: Light::default(),
            background: None,
            front: None,
            also: Vec::new(),
        }
    }
}

impl Look {
    /// The look in the form that `page/scene.js` reads.
    pub(super) fn to_json(&self, spectrum: &Spectrum) -> Result<serde_json::Value> {
        let opacity_of = |surface: &Surface| surface.opacity.unwrap_or(self.opacity);
        for opacity in self.also.iter().map(opacity_of).chain([self.opacity]) {
            if !(0.0..=1.0).contains(&opacity) {
                return Err(Error::Usage(format!("opacity {opacity}, expected 0 to 1")));
            }
        }
        let also = self.also.iter().enumerate().map(|(i, surface)| {
            spectrum.check_isovalue(surface.isovalue)?;
            let front = hex_of(surface.color.unwrap_or_else(|| plain_color(i + 1)));
            let opacity = rounded(opacity_of(surface));
            Ok(serde_json::json!({ "isovalue": surface.isovalue, "front": front, "opacity": opacity }))
        });
        Ok(serde_json::json!({
            "occlusion": self.occlusion,
            "wireframe": self.wireframe,
            "silhouette": self.silhouette,
            "opacity": rounded(self.opacity),
            "clip": self.clip.map(|clip| clip_to_json(clip, spectrum)).transpose()?,
            "light": self.light.name(),
            "background": background_to_json(self.background),
            "front": self.front.map(hex_of),
            "also": also.collect::<Result<Vec<_>>>()?,
        }))
    }
}

/// The styles that the reader can choose, in the form of a look.
pub(super) fn styles_to_json() -> serde_json::Value {
    let style_to_json = |style: Style| {
        let StyleValues { background, light, front, occlusion } = style.values();
        let values = serde_json::json!({
            "background": background_to_json(background),
            "light": light.name(),
            "front": front.map(hex_of),
            "occlusion": occlusion,
        });
        (style.name().to_owned(), values)
    };
    Style::ALL.into_iter().map(style_to_json).collect::<serde_json::Map<_, _>>().into()
}

fn background_to_json(background: Option<Background>) -> &'static str {
    background.map_or("auto", Background::name)
}

/// An opacity with three decimals, enough for every setting.
fn rounded(opacity: f32) -> f64 {
    (1000.0 * f64::from(opacity)).round() / 1000.0
}

/// The six hexadecimal digits of a linear colour in sRGB.
fn hex_of(linear: [f32; 3]) -> String {
    linear.map(to_srgb).iter().map(|byte| format!("{byte:02x}")).collect()
}

/// A clip plane as an axis, a share of the volume's length along it, and a side.
fn clip_to_json(clip: Clip, spectrum: &Spectrum) -> Result<serde_json::Value> {
    let axes: Vec<usize> = (0..3).filter(|&axis| clip.normal[axis] != 0.0).collect();
    let &[axis] = &axes[..] else {
        return Err(Error::Usage("a page cuts across an axis of the volume only".to_owned()));
    };
    let placement = &spectrum.volume().placement;
    let size = (spectrum.volume().dims[axis] as f64 - 1.0) * placement.cell_size()[axis];
    let share = (clip.offset / clip.normal[axis] / size).clamp(0.0, 1.0);
    Ok(serde_json::json!({ "axis": axis, "share": share, "turned": clip.normal[axis] < 0.0 }))
}
