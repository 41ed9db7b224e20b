//! An array of a VTI file.

use std::io;

use quick_xml::events::BytesStart;

use super::xml::attribute;
use crate::volume::data_error::invalid;
use crate::volume::decode::select_channel;
use crate::volume::layout::{SampleLayout, SampleType};
use crate::volume::samples::Samples;
use crate::volume::text;
use crate::volume::text::shortened;

/// The samples of an array.
#[derive(Debug)]
pub(super) enum ArrayData {
    /// In its element, as numbers.
    Text(String),
    /// In its element, as base64.
    Base64(String),
    /// At this byte of the appended data.
    Appended(u64),
}

#[derive(Debug)]
pub(super) struct VtiArray {
    pub(super) name: String,
    pub(super) is_of_cells: bool,
    pub(super) n_channels: usize,
    pub(super) data: ArrayData,
    type_name: String,
}

/// Parses the tag of an array.
pub(super) fn parse_tag(tag: &BytesStart<'_>, is_of_cells: bool) -> io::Result<VtiArray> {
    let text = |name: &str| Ok::<_, io::Error>(attribute(tag, name)?.unwrap_or_default());
    let n_channels = match text("NumberOfComponents")?.as_str() {
        "" => 1,
        n => n.parse().ok().filter(|n| (1..=1 << 16).contains(n)).ok_or_else(|| {
            invalid(format!("NumberOfComponents '{}', expected 1 or more", shortened(n)))
        })?,
    };
    let data = match text("format")?.as_str() {
        "ascii" | "" => ArrayData::Text(String::new()),
        "binary" => ArrayData::Base64(String::new()),
        "appended" => {
            let offset = text("offset")?;
            ArrayData::Appended(offset.trim().parse().map_err(|_| {
                invalid(format!("offset '{}', expected a number", shortened(&offset)))
            })?)
        }
        other => {
            let other = shortened(other);
            return Err(invalid(format!("format '{other}', expected ascii, binary or appended")));
        }
    };
    Ok(VtiArray { name: text("Name")?, is_of_cells, n_channels, data, type_name: text("type")? })
}

impl VtiArray {
    /// The number type, which only the chosen array needs.
    pub(super) fn sample_type(&self) -> io::Result<SampleType> {
        if self.is_of_bits() {
            return Ok(SampleType::U8);
        }
        SampleType::from_name(&self.type_name).ok_or_else(|| {
            invalid(format!("type '{}', expected a number type", shortened(&self.type_name)))
        })
    }

    /// Whether a number is a bit.
    pub(super) fn is_of_bits(&self) -> bool {
        self.type_name == "Bit"
    }

    /// Appends text of the element.
    pub(super) fn add_text(&mut self, more: &str) {
        if let ArrayData::Text(text) | ArrayData::Base64(text) = &mut self.data {
            text.push_str(more);
        }
    }
}

/// Reads samples that are text.
pub(super) fn read_text(text: &str, layout: &SampleLayout) -> io::Result<Samples> {
    let (n, _) = layout.size()?;
    let all = n.checked_mul(layout.channel.of).ok_or_else(|| invalid("too many samples"))?;
    let samples = text::samples(text.as_bytes(), layout.sample_type, all, &layout.describe())?;
    Ok(select_channel(samples, layout.channel))
}
