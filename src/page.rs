//! A spectrum as one web page: a file that anyone opens, with nothing behind it.
//!
//! The page holds the spectrum, the shaders that draw it, plain scripts (`page/*.js`) and styles;
//! it needs no server and asks the network for nothing, which its content security policy
//! enforces. The volume is not in it. It draws with the WGSL of [`crate::render`] where there is
//! WebGPU, with a twin of it in GLSL where there is WebGL2, and shows a still picture where there
//! is neither.
//!
//! The spectrum lies in the page as its columns in the file do, predicted and deflated (`data`),
//! but rounded more: positions count steps of [`Page::step`] voxels instead of quanta. A page is
//! looked at, and coarser numbers are shorter.
//!
//! # Invariants
//!
//! Whatever comes from outside (title, caption, credit, names in the spectrum) is text in the page,
//! never markup; equal input gives equal bytes.

mod curves;
mod data;
mod field;
mod first;
mod knots;
mod letters;
mod names;
mod part;
mod script;
mod split;
mod template;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD as BASE64;

use crate::color::{Color, ColorSources, Map, ScaleEnd, ScaleEnds, to_srgb};
use crate::error::{Error, Result};
use crate::render::{Background, Camera, Clip, Image, Light, Memory, Surface, plain_color};
use crate::setters::setters;
use crate::spectrum::{Keep, Spectrum};
use crate::volume::{Histogram, Statistics};

use field::Field;

pub use data::DEFAULT_STEP;
pub use knots::with_fewer_knots;
pub use part::part;
pub use script::script;
pub use split::{Split, is_split_name, split};

/// What a page says and how it looks.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Page<'a> {
    /// Heading and name of the page.
    pub title: &'a str,
    /// What is to be seen, below the picture.
    pub caption: Option<&'a str>,
    /// Whose work it is, at the bottom.
    pub credit: Option<&'a str>,
    /// The isovalue it opens at, one of the range.
    pub isovalue: f64,
    /// Positions are rounded to whole multiples of this many voxels.
    pub step: f64,
    /// Whether caps are left out at first, so that one looks into the volume at its border.
    pub open: bool,
    /// The direction from which the surface is seen at first; the distance is a multiple of the one at which it fits. What it
    /// says of parallel projection holds at first, too.
    pub camera: Camera,
    /// What the colours show at first; none of [`Color::Distance`] and [`Color::Normal`].
    pub color: Color,
    /// The map that shows it; without it the usual one.
    pub map: Option<Map>,
    /// What is told of the ends of its scale.
    pub ends: ScaleEnds,
    /// A second field that colours can show.
    pub field: Option<&'a ColorSources>,
    /// Whether the box of the volume, the axes of the world and a scale bar are drawn at first.
    pub axes: bool,
    /// How the surface looks at first beside its colours.
    pub look: Look,
    /// Which components are shown at first, sizes and places in the voxel frame.
    pub keep: Keep,
    /// The samples of the volume, to be seen behind the curves.
    pub samples: Option<&'a Histogram>,
    /// What is known of the samples: what typed isovalues such as `p99` mean.
    pub statistics: Option<&'a Statistics>,
    /// Isovalues that are offered, each with its name; of the range.
    pub marks: &'a [(f64, String)],
    /// Shown where nothing can be drawn.
    pub still: Option<&'a Image>,
}

impl<'a> Page<'a> {
    /// A page with a title that opens at an isovalue, which must be in the range of the spectrum.
    pub fn new(title: &'a str, isovalue: f64) -> Page<'a> {
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
        with_still(still: &'a Image),
    }
}

/// How a page looks at first; the reader may change all of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Look {
    /// Whether hollows are darkened.
    pub occlusion: bool,
    /// Whether the edges of triangles are drawn.
    pub wireframe: bool,
    /// How much of what lies behind the surface hides, 0 to 1.
    pub opacity: f32,
    /// A plane across an axis of the volume beyond which nothing is drawn.
    pub clip: Option<Clip>,
    /// Where the main light is.
    pub light: Light,
    /// What lies behind the surface; without it what the reader's page is like, light or dark.
    pub background: Option<Background>,
    /// Linear red, green and blue of the surface where it is plain; without it the usual colour.
    pub front: Option<[f32; 3]>,
    /// Other isosurfaces beside that of the slider.
    pub also: Vec<Surface>,
}

impl Default for Look {
    fn default() -> Self {
        Look {
            occlusion: false,
            wireframe: false,
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
    /// As the page's scripts read it.
    fn about(&self, spectrum: &Spectrum) -> Result<serde_json::Value> {
        let opaque = |opacity: Option<f32>| opacity.unwrap_or(self.opacity);
        for opacity in self.also.iter().map(|s| opaque(s.opacity)).chain([self.opacity]) {
            if !(0.0..=1.0).contains(&opacity) {
                return Err(Error::Usage(format!("opacity {opacity}, expected 0 to 1")));
            }
        }
        let also = self.also.iter().enumerate().map(|(i, surface)| {
            spectrum.check_isovalue(surface.isovalue)?;
            let front = code_of(surface.color.unwrap_or_else(|| plain_color(i + 1)));
            let opacity = opaque(surface.opacity);
            Ok(serde_json::json!({ "isovalue": surface.isovalue, "front": front, "opacity": short(opacity) }))
        });
        Ok(serde_json::json!({
            "occlusion": self.occlusion,
            "wireframe": self.wireframe,
            "opacity": short(self.opacity),
            "clip": self.clip.map(|clip| clip_across(clip, spectrum)).transpose()?,
            "light": self.light.name(),
            "background": self.background.map(Background::name),
            "front": self.front.map(code_of),
            "also": also.collect::<Result<Vec<_>>>()?,
        }))
    }
}

/// A share with as many digits as anyone sets.
fn short(share: f32) -> f64 {
    (1000.0 * f64::from(share)).round() / 1000.0
}

/// A linear colour as style sheets spell it, without the sign before.
fn code_of(linear: [f32; 3]) -> String {
    linear.map(to_srgb).iter().map(|byte| format!("{byte:02x}")).collect()
}

/// A plane as the page knows it: across an axis, at a share of the volume's length.
fn clip_across(clip: Clip, spectrum: &Spectrum) -> Result<serde_json::Value> {
    let across: Vec<usize> = (0..3).filter(|&axis| clip.normal[axis] != 0.0).collect();
    let &[axis] = &across[..] else {
        return Err(Error::Usage("a page cuts across an axis of the volume only".to_owned()));
    };
    let placement = &spectrum.volume().placement;
    let size =
        (spectrum.volume().dims[axis] as f64 - 1.0) * placement.spacing[axis] / placement.voxel();
    let share = (clip.offset / clip.normal[axis] / size).clamp(0.0, 1.0);
    Ok(serde_json::json!({ "axis": axis, "share": share, "turned": clip.normal[axis] < 0.0 }))
}

/// What a page is made of, bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Sizes {
    /// The whole page.
    pub page: usize,
    /// The scripts.
    pub script: usize,
    /// The spectrum, compressed, before it becomes letters, in the page or beside it.
    pub data: usize,
    /// What is seen first, compressed, before it becomes letters.
    pub first: usize,
    /// The still picture, before base64.
    pub still: usize,
}

/// The page of a spectrum, and what its bytes are.
///
/// # Errors
///
/// [`Error::Usage`] if the step is not a positive number; [`Error::Range`] if the isovalue lies
/// outside the spectrum's range; [`Error::Input`] if the spectrum does
/// not pass [`Spectrum::check`] or reaches too many steps.
pub fn html(spectrum: &Spectrum, page: &Page) -> Result<(String, Sizes)> {
    check(spectrum, page)?;
    let field = page.field.and_then(|sources| Field::of(sources, page.ends));
    let codes = field.as_ref().map(|field| &field.codes[..]);
    let data = data::compressed(spectrum, page.step, codes)?;
    filled(spectrum, page, field.as_ref(), Isovalues::Inside(&data))
}

fn check(spectrum: &Spectrum, page: &Page) -> Result<()> {
    if !(page.step > 0.0 && page.step.is_finite()) {
        return Err(Error::Usage(format!("step of {} voxels, expected more than 0", page.step)));
    }
    spectrum.check_isovalue(page.isovalue)?;
    page.keep.check()?;
    page.camera.check()?;
    if matches!(page.color, Color::Distance | Color::Normal) {
        let name = page.color.name();
        return Err(Error::Usage(format!("a page cannot show the color {name}")));
    }
    Ok(())
}

/// Where a page has its isovalues from.
enum Isovalues<'a> {
    /// The page itself, compressed.
    Inside(&'a [u8]),
    /// Files beside it: what its scripts are told of these, and how many bytes they have, compressed.
    Beside(serde_json::Value, usize),
}

/// The page around a spectrum that is packed already.
fn filled(
    spectrum: &Spectrum,
    page: &Page,
    field: Option<&Field>,
    isovalues: Isovalues,
) -> Result<(String, Sizes)> {
    let (data, n_bytes, chunks) = match isovalues {
        Isovalues::Inside(data) => (data, data.len(), None),
        Isovalues::Beside(chunks, n_bytes) => (&[][..], n_bytes, Some(chunks)),
    };
    let Camera { azimuth, elevation, distance, .. } = page.camera;
    let first = first::first(spectrum, page.isovalue, page.step, field, n_bytes)?;
    let (first, first_range) = first.map_or_else(Default::default, |f| (f.bytes, Some(f.range)));
    let still = match page.still {
        Some(image) => {
            let mut bytes = Vec::new();
            image.encode_png(&mut bytes).map_err(|e| Error::io("still picture", e))?;
            bytes
        }
        None => Vec::new(),
    };
    let curves = curves::curves(spectrum)?;
    // Those of a field are found among all its knots, of all isovalues.
    let is_field = page.color == Color::Field;
    let at = |end: Option<ScaleEnd>| match end? {
        ScaleEnd::At(x) => Some(serde_json::json!(x)),
        ScaleEnd::Percentile(p) => (!is_field).then(|| format!("p{p}").into()),
    };
    let color = serde_json::json!({
        "color": page.color.name(),
        "map": page.map.map(Map::name),
        "low": at(page.ends.low),
        "high": at(page.ends.high),
        "center": page.ends.center.filter(|_| !is_field),
    });
    let mut about = serde_json::json!({
        "step": page.step,
        "along": data::ALONG,
        "open": page.open,
        "isovalue": page.isovalue,
        "first": first_range,
        "keep": page.keep,
        "axes": page.axes,
        "orthographic": page.camera.orthographic,
        "look": page.look.about(spectrum)?,
        "maps": Map::ALL.iter().map(|map| (map.name().to_owned(), map.codes().into())).collect::<serde_json::Map<_, _>>(),
        "field": field.map(Field::about),
        "color": color,
        "basis": page.camera.up.map(|_| page.camera.basis(spectrum.volume()).to_cols_array_2d()),
        "view": { "azimuth": azimuth, "elevation": elevation, "distance": distance },
        "knots": spectrum.knots().len(),
        "most_triangles": Memory::of(spectrum).most_triangles,
        "histogram": page.samples.map(|samples| curves::histogram(samples, spectrum.range())),
        "samples": page.statistics,
        "marks": page.marks,
        "suggested": curves::suggested(spectrum, &curves, page.statistics),
        "curves": curves,
    });
    let is_split = chunks.is_some();
    if let Some(chunks) = chunks {
        about["chunks"] = chunks;
    }
    let script = if is_split { script::of_split() } else { script() };
    let text = template::filled(&template::Parts {
        page,
        about: &about.to_string(),
        first: &letters::letters(&first),
        data: &letters::letters(data),
        is_split,
        script: &script,
        still: &BASE64.encode(&still),
    });
    let sizes = Sizes {
        page: text.len(),
        script: script.len(),
        data: n_bytes,
        first: first.len(),
        still: still.len(),
    };
    Ok((text, sizes))
}
