//! OME-XML: sizes, order and spacing of the first image, and the pages of its planes.
//!
//! Source: the OME-TIFF specification (docs.openmicroscopy.org), "The TiffData element". IFD is the first page of an element
//! (0 if it is missing), PlaneCount the number of its pages: without it 1 if there is an IFD, else all. Pages follow each
//! other in the order of the image's planes. A UUID in an element names the file of these pages.

use std::io;

use quick_xml::events::{BytesStart, Event};

use super::described::{Described, Writer};
use super::planes::{MappedPages, PlaneOrder};
use crate::volume::data_error::invalid;
use crate::volume::placement::Unit;
use crate::volume::text::shortened;

/// Reads OME-XML.
///
/// # Errors
///
/// `InvalidData` for damaged XML, and without an image.
pub(super) fn read(text: &str) -> io::Result<Described> {
    let mut reader = quick_xml::Reader::from_str(text);
    let mut parts = Parts::default();
    loop {
        match reader.read_event() {
            Ok(Event::Start(tag)) => parts.start(&tag)?,
            Ok(Event::Empty(tag)) => {
                parts.start(&tag)?;
                parts.end(tag.local_name().as_ref());
            }
            Ok(Event::Text(text)) if parts.is_in_uuid => parts.uuid.push_str(text.trim()),
            Ok(Event::End(tag)) => parts.end(tag.local_name().as_ref()),
            Ok(Event::Eof) => break,
            Ok(_) => {}
            // What follows the first image is not needed.
            Err(_) if parts.n_finished > 0 => break,
            Err(e) => return Err(invalid(format!("OME-XML: {}", shortened(&e.to_string())))),
        }
    }
    parts.described()
}

/// The elements that are read.
#[derive(Default)]
struct Parts {
    /// The identifier of this file: that of the root, else the first of all pages.
    own_uuid: Option<String>,
    described: Option<Described>,
    metadata_file: Option<String>,
    n_images: usize,
    n_finished: usize,
    /// Pages of the first image, and the identifier of their file.
    mapped: Vec<(MappedPages, String)>,
    /// Whether an element has more than the default of all attributes.
    is_mapped: bool,
    is_in_uuid: bool,
    uuid: String,
}

impl Parts {
    fn start(&mut self, tag: &BytesStart<'_>) -> io::Result<()> {
        let is_first = self.n_images == 1 && self.n_finished == 0;
        match tag.local_name().as_ref() {
            "OME" => self.own_uuid = find(tag, "UUID"),
            "BinaryOnly" => self.metadata_file = find(tag, "MetadataFile"),
            "Image" => self.n_images += 1,
            "Pixels" if self.described.is_none() => {
                self.n_images = self.n_images.max(1);
                self.described = Some(of_pixels(tag)?);
            }
            "TiffData" if is_first => {
                let one = mapped_pages(tag)?;
                self.is_mapped |= one.n_pages.is_some();
                self.mapped.push((one, String::new()));
            }
            "UUID" if is_first => (self.is_in_uuid, self.uuid) = (true, String::new()),
            _ => {}
        }
        Ok(())
    }

    fn end(&mut self, name: &str) {
        match name {
            "Pixels" => self.n_finished += 1,
            "UUID" if self.is_in_uuid => {
                self.is_in_uuid = false;
                if let Some((_, uuid)) = self.mapped.last_mut() {
                    uuid.clone_from(&self.uuid);
                }
                self.own_uuid.get_or_insert_with(|| self.uuid.clone());
            }
            _ => {}
        }
    }

    fn described(self) -> io::Result<Described> {
        let Some(mut described) = self.described else {
            let metadata_file =
                self.metadata_file.ok_or_else(|| invalid("OME-XML without Pixels"))?;
            return Ok(Described { metadata_file: Some(metadata_file), ..Described::default() });
        };
        let own = self.own_uuid.unwrap_or_default();
        let is_here = |uuid: &str| uuid.is_empty() || uuid == own;
        described.is_in_parts = self.mapped.iter().any(|(_, uuid)| !is_here(uuid));
        // One element for all pages of a file with one image says nothing.
        if self.is_mapped || self.n_images > 1 || described.is_in_parts {
            let here = self.mapped.into_iter().filter(|(_, uuid)| is_here(uuid));
            described.mapped = here.map(|(pages, _)| pages).collect();
        }
        Ok(described)
    }
}

/// An attribute of a tag.
fn find(tag: &BytesStart<'_>, name: &str) -> Option<String> {
    let found = tag.try_get_attribute(name).ok().flatten()?;
    quick_xml::escape::unescape(&found.value).ok().map(|value| value.into_owned())
}

/// An attribute that is a number of at least `least`.
fn number(tag: &BytesStart<'_>, name: &str, least: usize) -> io::Result<Option<usize>> {
    let Some(text) = find(tag, name) else { return Ok(None) };
    let n = text.trim().parse().ok().filter(|n: &usize| (least..=1 << 20).contains(n));
    let wrong = || invalid(format!("OME-XML: {name} '{}', expected a count", shortened(&text)));
    n.ok_or_else(wrong).map(Some)
}

fn mapped_pages(tag: &BytesStart<'_>) -> io::Result<MappedPages> {
    let at = |name: &str| number(tag, name, 0);
    let (ifd, count) = (at("IFD")?, at("PlaneCount")?);
    let first = |name: &str| Ok::<_, io::Error>(at(name)?.unwrap_or(0));
    let first = [first("FirstZ")?, first("FirstC")?, first("FirstT")?];
    Ok(MappedPages { first_page: ifd.unwrap_or(0), first, n_pages: count.or(ifd.map(|_| 1)) })
}

/// Sizes and spacing of an image.
fn of_pixels(tag: &BytesStart<'_>) -> io::Result<Described> {
    let find = |name: &str| find(tag, name);
    let count = |name: &str| Ok::<_, io::Error>(number(tag, name, 1)?.unwrap_or(1));
    let text = find("DimensionOrder").unwrap_or_default();
    let axes = text.strip_prefix("XY").and_then(PlaneOrder::axes).ok_or_else(|| {
        invalid(format!("OME-XML: DimensionOrder '{}', expected e.g. XYZCT", shortened(&text)))
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
    let order = PlaneOrder {
        n_slices: count("SizeZ")?,
        n_channels: count("SizeC")?,
        n_frames: count("SizeT")?,
        axes,
    };
    Ok(Described {
        writer: Writer::Ome,
        order: Some(order),
        spacing,
        unit: if spacing.iter().any(Option::is_some) { unit } else { Unit::Unknown },
        ..Described::default()
    })
}
