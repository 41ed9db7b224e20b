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
mod part;
mod template;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD as BASE64;

use crate::color::{Color, End, Ends, Map, Sources};
use crate::error::{Error, Result};
use crate::render::{Camera, Image, Memory};
use crate::spectrum::{Keep, Spectrum};
use crate::volume::{Histogram, Statistics};

use field::Field;

pub use data::DEFAULT_STEP;
pub use knots::with_fewer_knots;
pub use part::part;

/// The scripts, in the order in which they stand in the page; one subject each.
const SCRIPTS: [&str; 23] = [
    include_str!("../page/letters.js"),
    include_str!("../page/file.js"),
    include_str!("../page/connectivity.js"),
    include_str!("../page/samples.js"),
    include_str!("../page/trajectories.js"),
    include_str!("../page/active.js"),
    include_str!("../page/normals.js"),
    include_str!("../page/surface.js"),
    include_str!("../page/mesh.js"),
    include_str!("../page/components.js"),
    include_str!("../page/camera.js"),
    include_str!("../page/colors.js"),
    include_str!("../page/webgpu.js"),
    include_str!("../page/webgl2.js"),
    include_str!("../page/plot.js"),
    include_str!("../page/overlay.js"),
    include_str!("../page/download.js"),
    include_str!("../page/controls.js"),
    include_str!("../page/embed.js"),
    include_str!("../page/viewer.js"),
    include_str!("../page/address.js"),
    include_str!("../page/decode.js"),
    include_str!("../page/main.js"),
];

/// The mesh that is seen first stands in the page by itself where it takes at most this part of the
/// whole spectrum's bytes.
const LARGEST_FIRST: usize = 4;

/// What a page says and how it looks.
#[derive(Clone, Debug)]
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
    /// The direction from which the surface is seen at first; the distance is a multiple of the one at which it fits.
    pub camera: Camera,
    /// What the colours show at first; none of [`Color::Distance`] and [`Color::Normal`].
    pub color: Color,
    /// The map that shows it; without it the usual one.
    pub map: Option<Map>,
    /// What is told of the ends of its scale.
    pub ends: Ends,
    /// A second field that colours can show.
    pub field: Option<&'a Sources>,
    /// Whether the box of the volume, the axes of the world and a scale bar are drawn at first.
    pub axes: bool,
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

/// What a page is made of, bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sizes {
    /// The whole page.
    pub page: usize,
    /// The scripts.
    pub script: usize,
    /// The spectrum, compressed, before it becomes letters.
    pub data: usize,
    /// The mesh that is seen first, compressed, before it becomes letters.
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
    if !(page.step > 0.0 && page.step.is_finite()) {
        return Err(Error::Usage(format!("step of {} voxels, expected more than 0", page.step)));
    }
    spectrum.check_isovalue(page.isovalue)?;
    page.keep.check()?;
    page.camera.check()?;
    let Camera { azimuth, elevation, distance, .. } = page.camera;
    if matches!(page.color, Color::Distance | Color::Normal) {
        let name = page.color.name();
        return Err(Error::Usage(format!("a page cannot show the color {name}")));
    }
    let field = page.field.and_then(|sources| Field::of(sources, page.ends));
    let data = data::compressed(spectrum, page.step, field.as_ref().map(|field| &field.codes[..]))?;
    let first = first::compressed(spectrum, page.isovalue, page.step, field.as_ref())?;
    // Not where it would make the page much larger.
    let first = first.filter(|first| first.len() <= data.len() / LARGEST_FIRST).unwrap_or_default();
    let still = match page.still {
        Some(image) => {
            let mut bytes = Vec::new();
            image.encode_png(&mut bytes).map_err(|e| Error::io("still picture", e))?;
            bytes
        }
        None => Vec::new(),
    };
    let curves = curves::curves(spectrum)?;
    let at = |end: Option<End>| match end {
        Some(End::At(x)) => Some(x),
        _ => None,
    };
    let color = serde_json::json!({
        "color": page.color.name(),
        "map": page.map.map(Map::name),
        "low": at(page.ends.low),
        "high": at(page.ends.high),
    });
    let about = serde_json::json!({
        "step": page.step,
        "along": data::ALONG,
        "open": page.open,
        "isovalue": page.isovalue,
        "keep": page.keep,
        "axes": page.axes,
        "maps": Map::ALL.iter().map(|map| (map.name().to_owned(), map.codes().into())).collect::<serde_json::Map<_, _>>(),
        "field": field.as_ref().map(Field::about),
        "color": color,
        "basis": page.camera.up.map(|_| page.camera.basis(&spectrum.volume).to_cols_array_2d()),
        "view": { "azimuth": azimuth, "elevation": elevation, "distance": distance },
        "knots": spectrum.knots.len(),
        "most_triangles": Memory::of(spectrum).most_triangles,
        "histogram": page.samples.map(|samples| curves::histogram(samples, spectrum.range)),
        "samples": page.statistics,
        "marks": page.marks,
        "suggested": curves::suggested(spectrum, &curves, page.statistics),
        "curves": curves,
    });
    let script = script();
    let text = template::filled(&template::Parts {
        page,
        about: &about.to_string(),
        first: &letters::letters(&first),
        data: &letters::letters(&data),
        script: &script,
        still: &BASE64.encode(&still),
    });
    let sizes = Sizes {
        page: text.len(),
        script: script.len(),
        data: data.len(),
        first: first.len(),
        still: still.len(),
    };
    Ok((text, sizes))
}

/// All scripts as one, which leaves no name behind; without comments on lines of their own, without indentation, and
/// without ends of lines inside of brackets and spaces after commas, which who reads the page has no use for.
pub fn script() -> String {
    let mut script = String::from("(() => {\n\"use strict\";\n");
    let mut is_comment = false;
    let mut before = "";
    for line in SCRIPTS.iter().flat_map(|script| script.lines()) {
        let text = line.trim();
        is_comment |= text.starts_with("/**");
        if !(is_comment || text.starts_with("//") || text.is_empty()) {
            // Behind an opening bracket or a comma, and before a closing one, a statement goes on; but nothing is to come
            // into a comment at the end of a line.
            let goes_on =
                before.ends_with(['{', '(', '[', ',']) || text.starts_with(['}', ')', ']']);
            if goes_on && !before.contains("//") && !before.is_empty() {
                script.pop();
            }
            script.push_str(&without_spaces_after_commas(text));
            script.push('\n');
            before = text;
        }
        is_comment &= !text.ends_with("*/");
    }
    script.push_str("})();\n");
    script
}

/// A line of a script as it is, but for spaces after commas that stand in no text.
fn without_spaces_after_commas(line: &str) -> String {
    let has_text = line.contains(['"', '\'']);
    // Where a text may go over several lines, or a regular expression hold a quote, all stays.
    if line.contains('`') || has_text && line.contains('/') {
        return line.to_owned();
    }
    let mut shorter = String::with_capacity(line.len());
    let mut quote = None;
    for c in line.chars() {
        match quote {
            None if c == ' ' && shorter.ends_with(',') => continue,
            None if c == '"' || c == '\'' => quote = Some(c),
            Some(open) if c == open => quote = None,
            _ => {}
        }
        shorter.push(c);
    }
    shorter
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spaces_stay_in_texts() {
        let of = without_spaces_after_commas;
        assert_eq!(of("f(a, b, \"c, d\", ['e, f', g])"), "f(a,b,\"c, d\",['e, f',g])");
        assert_eq!(of("x = `${a}, b`, c"), "x = `${a}, b`, c");
        assert_eq!(of("/[\"',] /.test(a), b"), "/[\"',] /.test(a), b");
    }
}
