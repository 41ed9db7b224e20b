//! The description of a TIFF file's first page: OME-XML, the lines of ImageJ, or anything.

use std::io;

use quick_xml::events::{BytesStart, Event};

use crate::volume::data_error::invalid;
use crate::volume::placement::Unit;
use crate::volume::text::shortened;

/// Pages and spacing by the description.
#[derive(Debug, Default)]
pub(super) struct Described {
    /// Whether it is OME-XML or of ImageJ.
    pub(super) is_any: bool,
    pub(super) is_imagej: bool,
    /// Number of pages.
    pub(super) n_pages: Option<usize>,
    n_channels: usize,
    n_frames: usize,
    /// The fastest of Z, C and T first.
    axes: [char; 3],
    /// Along x, y, z.
    pub(super) spacing: [Option<f64>; 3],
    pub(super) unit: Unit,
}

/// The order of slices, channels and frames among the pages.
#[derive(Clone, Copy, Debug)]
pub(super) struct PageOrder {
    pub(super) n_slices: usize,
    pub(super) n_channels: usize,
    pub(super) n_frames: usize,
    axes: [char; 3],
}

impl PageOrder {
    /// The index of a page.
    pub(super) fn page(&self, channel: usize, slice: usize, frame: usize) -> usize {
        let mut page = 0;
        for axis in self.axes.iter().rev() {
            let (at, of) = match axis {
                'C' => (channel, self.n_channels),
                'T' => (frame, self.n_frames),
                _ => (slice, self.n_slices),
            };
            page = page * of + at;
        }
        page
    }
}

impl Described {
    /// The order of `n_pages` pages.
    ///
    /// # Errors
    ///
    /// `InvalidData` if channels and frames do not divide them, or the description has another number.
    pub(super) fn order(&self, n_pages: usize) -> io::Result<PageOrder> {
        let (n_channels, n_frames) = (self.n_channels.max(1), self.n_frames.max(1));
        let each = n_channels.saturating_mul(n_frames);
        if !n_pages.is_multiple_of(each) || self.n_pages.is_some_and(|n| n != n_pages) {
            let in_all = self.n_pages.map_or(String::new(), |n| format!(", {n} in all"));
            return Err(invalid(format!(
                "{n_pages} pages, expected {n_channels} channels of {n_frames} frames{in_all} by the description (files in several parts are not supported)"
            )));
        }
        let axes = if self.is_any { self.axes } else { ['Z', 'C', 'T'] };
        Ok(PageOrder { n_slices: n_pages / each, n_channels, n_frames, axes })
    }
}

/// Reads a description.
///
/// # Errors
///
/// `InvalidData` for damaged OME-XML.
pub(super) fn read(text: &str) -> io::Result<Described> {
    if text.starts_with("ImageJ=") {
        return Ok(of_imagej(text));
    }
    if text.contains("<OME") { of_ome(text) } else { Ok(Described::default()) }
}

fn of_imagej(text: &str) -> Described {
    let find = |key: &str| {
        let mut lines = text.lines().filter_map(|line| line.split_once('='));
        lines.find(|(name, _)| *name == key).map(|(_, value)| value.trim())
    };
    let count = |key: &str| find(key).and_then(|n| n.parse().ok()).filter(|&n: &usize| n > 0);
    let spacing = find("spacing").and_then(|s| s.parse::<f64>().ok()).map(f64::abs);
    Described {
        is_any: true,
        is_imagej: true,
        n_pages: Some(count("images").unwrap_or(1)),
        n_channels: count("channels").unwrap_or(1),
        n_frames: count("frames").unwrap_or(1),
        axes: ['C', 'Z', 'T'],
        spacing: [None, None, spacing],
        unit: find("unit").and_then(Unit::from_name).unwrap_or_default(),
    }
}

fn of_ome(text: &str) -> io::Result<Described> {
    let mut reader = quick_xml::Reader::from_str(text);
    loop {
        let event = reader
            .read_event()
            .map_err(|e| invalid(format!("OME-XML: {}", shortened(&e.to_string()))))?;
        match event {
            Event::Start(tag) | Event::Empty(tag) if tag.local_name().as_ref() == "Pixels" => {
                return of_pixels(&tag);
            }
            Event::Eof => return Err(invalid("OME-XML without Pixels")),
            _ => {}
        }
    }
}

/// The element of the first image.
fn of_pixels(tag: &BytesStart<'_>) -> io::Result<Described> {
    let find = |name: &str| {
        let found = tag.try_get_attribute(name).ok().flatten()?;
        quick_xml::escape::unescape(&found.value).ok().map(|value| value.into_owned())
    };
    let count = |name: &str| {
        let text = find(name).unwrap_or_else(|| "1".to_owned());
        let n = text.parse().ok().filter(|n: &usize| (1..=1 << 20).contains(n));
        n.ok_or_else(|| {
            invalid(format!("OME-XML: {name} '{}', expected a count", shortened(&text)))
        })
    };
    let order = find("DimensionOrder").unwrap_or_default();
    let axes: Option<[char; 3]> =
        order.strip_prefix("XY").and_then(|rest| rest.chars().collect::<Vec<_>>().try_into().ok());
    let axes = axes.filter(|axes| ['Z', 'C', 'T'].iter().all(|axis| axes.contains(axis)));
    let axes = axes.ok_or_else(|| {
        invalid(format!("OME-XML: DimensionOrder '{}', expected e.g. XYZCT", shortened(&order)))
    })?;
    let unit_of = |name: &str| match find(&format!("{name}Unit")) {
        None => Unit::Um,
        Some(unit) => Unit::from_name(&unit).unwrap_or_default(),
    };
    let names = ["PhysicalSizeX", "PhysicalSizeY", "PhysicalSizeZ"];
    let unit = unit_of(names[0]);
    let spacing = names.map(|name| {
        let size: f64 = find(name)?.parse().ok()?;
        // All in the unit of the first.
        match (unit_of(name).in_mm(), unit.in_mm()) {
            (Some(a), Some(b)) if a != b => Some(size * a / b),
            _ => Some(size),
        }
    });
    let (n_slices, n_frames) = (count("SizeZ")?, count("SizeT")?);
    // Colours of one page are channels of the image.
    let n_channels = count("SizeC")?;
    Ok(Described {
        is_any: true,
        is_imagej: false,
        n_pages: None,
        n_channels: if channels_are_colours(n_channels, tag) { 1 } else { n_channels },
        n_frames,
        axes,
        spacing,
        unit: if spacing.iter().any(Option::is_some) { unit } else { Unit::Unknown },
    }
    .of(n_slices))
}

/// Whether the channels are colours of each page.
fn channels_are_colours(n_channels: usize, tag: &BytesStart<'_>) -> bool {
    let interleaved = tag.try_get_attribute("Interleaved").ok().flatten();
    n_channels > 1 && interleaved.is_some_and(|value| value.value == "true")
}

impl Described {
    /// With the number of pages that follows from that of slices.
    fn of(mut self, n_slices: usize) -> Self {
        self.n_pages =
            n_slices.checked_mul(self.n_channels).and_then(|n| n.checked_mul(self.n_frames));
        self
    }
}
