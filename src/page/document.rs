//! Writes the HTML of a page.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD as BASE64;
use serde_json::{Value, json};

use super::curves::{self, Curves};
use super::data;
use super::field::PageField;
use super::first::{FirstRange, first_range};
use super::link::Link;
use super::options::{Page, styles_to_json};
use super::script;
use super::slice::SliceSamples;
use super::template;
use crate::color::{Color, Map, ScaleEnd};
use crate::error::{Error, Result};
use crate::render::Memory;
use crate::spectrum::Spectrum;

/// The sizes of the parts of a page, bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Sizes {
    /// The whole page.
    pub page: usize,
    /// The scripts.
    pub script: usize,
    /// The compressed spectrum, in the page (before base64) or in the linked file.
    pub data: usize,
    /// The compressed isovalues that are shown first, before base64.
    pub first: usize,
    /// The still picture, before base64.
    pub still: usize,
    /// The compressed samples of slices, before base64.
    pub slice: usize,
}

/// Where a page finds its isovalues.
enum Isovalues<'a> {
    /// In itself: the compressed spectrum.
    Embedded(&'a [u8]),
    /// In a file on a server.
    Linked(&'a Link),
}

/// Writes a spectrum as a page, and returns the HTML and the sizes of its parts.
///
/// # Errors
///
/// [`Error::Usage`] if the step is not a positive number, or for options that a page does not have; [`Error::Range`] if an
/// isovalue is outside the spectrum's range; [`Error::Input`] if the spectrum does not pass [`Spectrum::check`] or is too large
/// for so small a step.
pub fn html(spectrum: &Spectrum, page: &Page) -> Result<(String, Sizes)> {
    page.check(spectrum)?;
    let field = page.field.and_then(|sources| PageField::new(sources, page.ends));
    let codes = field.as_ref().map(|field| &field.codes[..]);
    let data = data::compressed(spectrum, page.step, codes)?;
    assemble(spectrum, page, field.as_ref(), Isovalues::Embedded(&data))
}

/// Writes a page that is linked to the file of a spectrum, and returns the HTML and the sizes of its parts.
///
/// # Errors
///
/// As [`html`]; [`Error::Usage`] for a second field, which the file does not have.
pub fn linked(spectrum: &Spectrum, page: &Page, link: &Link) -> Result<(String, Sizes)> {
    page.check(spectrum)?;
    if page.field.is_some_and(|sources| sources.field.is_some()) {
        let message = "a page that is linked to a file shows no second field";
        return Err(Error::Usage(message.to_owned()));
    }
    assemble(spectrum, page, None, Isovalues::Linked(link))
}

/// Writes the page around a spectrum that is compressed already.
fn assemble(
    spectrum: &Spectrum,
    page: &Page,
    field: Option<&PageField>,
    isovalues: Isovalues,
) -> Result<(String, Sizes)> {
    let (data, n_bytes, link) = match isovalues {
        Isovalues::Embedded(data) => (data, data.len(), None),
        Isovalues::Linked(link) => (&[][..], link.n_bytes(), Some(link)),
    };
    let first = first_range(spectrum, page.isovalue, page.step, field, n_bytes)?;
    let mut still = Vec::new();
    if let Some(image) = page.still {
        image.encode_png(&mut still).map_err(|e| Error::io("still picture", e))?;
    }
    let script = script::script(link.is_some());
    let slice = page.slice.map(SliceSamples::of);
    let mut about = about(spectrum, page, field, first.as_ref(), link)?;
    about["slice"] = slice.as_ref().map(SliceSamples::to_json).into();
    let slice = slice.map(|slice| slice.bytes).unwrap_or_default();
    let first = first.map(|first| first.bytes).unwrap_or_default();
    let text = template::fill(&template::Parts {
        page,
        about: &about.to_string(),
        first: &BASE64.encode(&first),
        data: &BASE64.encode(data),
        connect: link.map(Link::origin),
        script: &script,
        still: &BASE64.encode(&still),
        slice: &BASE64.encode(&slice),
    });
    let sizes = Sizes {
        page: text.len(),
        script: script.len(),
        data: n_bytes,
        first: first.len(),
        still: still.len(),
        slice: slice.len(),
    };
    Ok((text, sizes))
}

/// What the scripts read in the element `about`.
fn about(
    spectrum: &Spectrum,
    page: &Page,
    field: Option<&PageField>,
    first: Option<&FirstRange>,
    link: Option<&Link>,
) -> Result<Value> {
    let camera = &page.camera;
    let view = json!({
        "azimuth": camera.azimuth,
        "elevation": camera.elevation,
        "distance": camera.distance,
    });
    let maps: serde_json::Map<_, _> =
        Map::ALL.iter().map(|map| (map.name().to_owned(), map.codes().into())).collect();
    let curves = Curves::of(spectrum)?;
    let mut about = json!({
        "step": page.step,
        "open": page.open,
        "isovalue": page.isovalue,
        "first": first.map(|first| first.range),
        "keep": page.keep,
        "axes": page.axes,
        "orthographic": camera.orthographic,
        "look": page.look.to_json(spectrum)?,
        "styles": styles_to_json(),
        "maps": maps,
        "field": field.map(PageField::to_json),
        "color": coloring(page),
        "basis": camera.up.map(|_| camera.basis(spectrum.volume()).to_cols_array_2d()),
        "view": view,
        "knots": spectrum.knots().len(),
        "max_triangles": Memory::of(spectrum).most_triangles,
        "histogram": page.samples.map(|samples| curves::histogram(samples, spectrum.range())),
        "samples": page.statistics,
        "marks": page.marks,
        "suggested": curves.suggested(spectrum, page.statistics),
        "extent": curves.extent(),
        "curves": curves,
        "words": curves::words(),
    });
    if let Some(link) = link {
        about["link"] = link.to_json();
    }
    Ok(about)
}

/// The quantity that colours show at first, with its map and the ends of its scale.
fn coloring(page: &Page) -> Value {
    // The scale of a second field is fixed by all of its knots: src/page/field.rs.
    let is_field = page.color == Color::Field;
    let end = |end: Option<ScaleEnd>| match end? {
        ScaleEnd::At(x) => Some(json!(x)),
        ScaleEnd::Percentile(p) => (!is_field).then(|| format!("p{p}").into()),
    };
    json!({
        "color": page.color.name(),
        "map": page.map.map(Map::name),
        "low": end(page.ends.low),
        "high": end(page.ends.high),
        "center": page.ends.center.filter(|_| !is_field),
    })
}
