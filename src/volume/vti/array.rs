//! An array of a VTI file.

use std::io;

use quick_xml::events::BytesStart;

use super::attribute;
use crate::volume::Samples;
use crate::volume::decode::{SampleType, invalid, picked};
use crate::volume::stream::Layout;
use crate::volume::text::{self, shortened};

/// Where the samples of an array are.
#[derive(Debug)]
pub(super) enum Place {
    /// In its element, as numbers.
    Text(String),
    /// In its element, as base64.
    Base64(String),
    /// So many bytes into what is appended.
    Appended(u64),
}

#[derive(Debug)]
pub(super) struct Array {
    pub(super) name: String,
    pub(super) is_of_cells: bool,
    pub(super) n_channels: usize,
    pub(super) place: Place,
    type_name: String,
}

/// What the tag of an array tells.
pub(super) fn of_tag(tag: &BytesStart<'_>, is_of_cells: bool) -> io::Result<Array> {
    let text = |name: &str| Ok::<_, io::Error>(attribute(tag, name)?.unwrap_or_default());
    let n_channels = match text("NumberOfComponents")?.as_str() {
        "" => 1,
        n => n.parse().ok().filter(|n| (1..=1 << 16).contains(n)).ok_or_else(|| {
            invalid(format!("NumberOfComponents '{}', expected 1 or more", shortened(n)))
        })?,
    };
    let place = match text("format")?.as_str() {
        "ascii" | "" => Place::Text(String::new()),
        "binary" => Place::Base64(String::new()),
        "appended" => {
            let offset = text("offset")?;
            Place::Appended(offset.trim().parse().map_err(|_| {
                invalid(format!("offset '{}', expected a number", shortened(&offset)))
            })?)
        }
        other => {
            let other = shortened(other);
            return Err(invalid(format!("format '{other}', expected ascii, binary or appended")));
        }
    };
    Ok(Array { name: text("Name")?, is_of_cells, n_channels, place, type_name: text("type")? })
}

impl Array {
    /// The type is looked at only where the array is chosen.
    pub(super) fn sample_type(&self) -> io::Result<SampleType> {
        SampleType::from_name(&self.type_name).ok_or_else(|| {
            invalid(format!("type '{}', expected a number type", shortened(&self.type_name)))
        })
    }

    /// Takes text of its element.
    pub(super) fn add_text(&mut self, more: &str) {
        if let Place::Text(text) | Place::Base64(text) = &mut self.place {
            text.push_str(more);
        }
    }
}

/// Samples written as numbers.
pub(super) fn of_text(text: &str, layout: &Layout) -> io::Result<Samples> {
    let (n, _) = layout.size()?;
    let all = n.checked_mul(layout.channel.of).ok_or_else(|| invalid("too many samples"))?;
    let samples = text::samples(text.as_bytes(), layout.sample_type, all, &layout.what())?;
    Ok(picked(samples, layout.channel))
}
