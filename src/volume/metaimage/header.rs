//! The text header of a MetaImage file: `Key = Value` lines, of which `ElementDataFile` is the last.

use std::collections::BTreeMap;
use std::io::BufRead;

use crate::volume::layout::SampleType;
use crate::volume::placement::{Placement, Space, Unit};
use crate::volume::text::{HeaderLines, exactly, finite, numbered, shortened};

/// Where the samples are.
#[derive(Debug)]
pub(super) enum DataLocation {
    Local,
    File(String),
    /// A file per slice.
    Slices(Vec<String>),
}

/// The header of a MetaImage file.
#[derive(Debug)]
pub(super) struct MetaHeader {
    pub(super) dims: [usize; 3],
    pub(super) n_frames: usize,
    pub(super) n_channels: usize,
    pub(super) sample_type: SampleType,
    pub(super) big_endian: bool,
    pub(super) is_text: bool,
    pub(super) is_compressed: bool,
    /// Bytes before the samples in their file; `None` for -1: the samples end with the file.
    pub(super) header_size: Option<u64>,
    pub(super) data: DataLocation,
    pub(super) placement: Placement,
}

/// Reads a header and leaves `reader` after the line of its last field.
///
/// # Errors
///
/// A description without the name of the file.
pub(super) fn parse(reader: &mut impl BufRead) -> Result<MetaHeader, String> {
    let (fields, listed) = read_fields(reader)?;
    let get = |name: &str| fields.get(name).map(String::as_str);
    let kind = get("objecttype").unwrap_or("Image");
    if !kind.eq_ignore_ascii_case("image") {
        return Err(format!("object of type '{}', expected an image", shortened(kind)));
    }
    let n_axes = get("ndims").ok_or("no 'NDims' field, expected a MetaImage header")?;
    let sizes = get("dimsize").ok_or("no 'DimSize' field")?;
    let (dims, n_frames) = match n_axes {
        "3" => (exactly::<usize, 3>(sizes), 1),
        "4" => match exactly::<usize, 4>(sizes) {
            Some([x, y, z, t]) => (Some([x, y, z]), t),
            None => (None, 1),
        },
        _ => return Err(format!("'NDims' is '{}', expected 3 or 4", shortened(n_axes))),
    };
    let dims = dims.ok_or_else(|| {
        format!("'DimSize' is '{}', expected {n_axes} whole numbers", shortened(sizes))
    })?;
    let type_name = get("elementtype").ok_or("no 'ElementType' field")?;
    let (sample_type, n_of_type) = element_type(type_name)
        .ok_or_else(|| format!("ElementType '{}', expected a number type", shortened(type_name)))?;
    let n_channels = match get("elementnumberofchannels") {
        None => n_of_type,
        Some(n) => n.parse().ok().filter(|n| (1..=1 << 16).contains(n)).ok_or_else(|| {
            format!("'ElementNumberOfChannels' is '{}', expected 1 or more", shortened(n))
        })?,
    };
    let flag = |names: &[&str]| names.iter().any(|name| get(name).is_some_and(is_true));
    let header_size = match get("headersize").unwrap_or("0") {
        "-1" => None,
        n => Some(n.parse().map_err(|_| format!("'HeaderSize' is '{}'", shortened(n)))?),
    };
    let data = data(get("elementdatafile").unwrap_or_default(), listed, dims, n_frames)?;
    Ok(MetaHeader {
        dims,
        n_frames,
        n_channels,
        sample_type,
        big_endian: flag(&["elementbyteordermsb", "binarydatabyteordermsb"]),
        is_text: get("binarydata").is_some_and(|value| !is_true(value)),
        is_compressed: flag(&["compresseddata"]),
        header_size,
        data,
        placement: placement(&get, n_axes == "4")?,
    })
}

fn is_true(value: &str) -> bool {
    value.starts_with(['T', 't', '1', 'Y', 'y'])
}

/// The fields by name in lower case, and the lines after `ElementDataFile = LIST`.
fn read_fields(
    reader: &mut impl BufRead,
) -> Result<(BTreeMap<String, String>, Vec<String>), String> {
    let mut lines = HeaderLines::new(reader);
    let mut fields = BTreeMap::new();
    loop {
        let Some(line) = lines.next()? else {
            return Err("no 'ElementDataFile' field, expected a MetaImage header".to_owned());
        };
        let line = line.trim();
        if line.is_empty() || line.starts_with('#') {
            continue;
        }
        let (name, value) = line
            .split_once(['=', ':'])
            .ok_or_else(|| format!("header line '{}', expected 'Key = Value'", shortened(line)))?;
        let (name, value) = (name.trim().to_ascii_lowercase(), value.trim().to_owned());
        let is_last = name == "elementdatafile";
        let is_list = is_last && value.starts_with("LIST");
        fields.insert(name, value);
        if !is_last {
            continue;
        }
        let mut listed = Vec::new();
        while is_list && let Some(name) = lines.next()? {
            if !name.trim().is_empty() {
                listed.push(name.trim().to_owned());
            }
        }
        return Ok((fields, listed));
    }
}

/// The number type of a name, and how many of them make a sample.
fn element_type(name: &str) -> Option<(SampleType, usize)> {
    let name = name.strip_prefix("MET_")?;
    let (name, n) = match name.strip_suffix("_ARRAY") {
        Some(name) => (name, 3),
        None => (name, 1),
    };
    let sample_type = match name {
        "UCHAR" => SampleType::U8,
        "CHAR" | "ASCII_CHAR" => SampleType::I8,
        "USHORT" => SampleType::U16,
        "SHORT" => SampleType::I16,
        // 4 bytes on every system.
        "UINT" | "ULONG" => SampleType::U32,
        "INT" | "LONG" => SampleType::I32,
        "ULONG_LONG" => SampleType::U64,
        "LONG_LONG" => SampleType::I64,
        "FLOAT" => SampleType::F32,
        "DOUBLE" => SampleType::F64,
        _ => return None,
    };
    Some((sample_type, n))
}

/// Longest name of a data file, in bytes: that of most file systems.
const MAX_NAME_BYTES: usize = 256;

/// Whether a text may name a file: a damaged header continues in the samples.
fn is_name(text: &str) -> bool {
    text.len() <= MAX_NAME_BYTES && !text.contains(char::is_control)
}

fn data(
    named: &str,
    listed: Vec<String>,
    dims: [usize; 3],
    n_frames: usize,
) -> Result<DataLocation, String> {
    if let Some(name) = listed.iter().map(String::as_str).chain([named]).find(|n| !is_name(n)) {
        return Err(format!("'{}' is no name of a file", shortened(name)));
    }
    let words: Vec<&str> = named.split_whitespace().collect();
    match words[..] {
        [] => Err("an empty 'ElementDataFile', expected LOCAL, LIST or a file".to_owned()),
        ["LOCAL" | "Local" | "local"] => Ok(DataLocation::Local),
        ["LIST"] | ["LIST", "2" | "2D"] => Ok(DataLocation::Slices(listed)),
        ["LIST", ..] => Err(format!("'{}', expected a list of slices", shortened(named))),
        // `slice%03d.raw 1 60 1`.
        [pattern, first, last, ..] if pattern.contains('%') => {
            let step = words.get(3).copied().unwrap_or("1");
            let n_slices = dims[2].saturating_mul(n_frames);
            numbered(pattern, [first, last, step], n_slices).map(DataLocation::Slices).ok_or_else(
                || format!("'{}', expected e.g. slice%03d.raw 1 60 1", shortened(named)),
            )
        }
        _ => Ok(DataLocation::File(named.to_owned())),
    }
}

fn placement<'a>(
    get: &impl Fn(&str) -> Option<&'a str>,
    has_time: bool,
) -> Result<Placement, String> {
    let three = |names: &[&str], default: [f64; 3]| -> Result<[f64; 3], String> {
        let Some((name, text)) = names.iter().find_map(|&name| Some((name, get(name)?))) else {
            return Ok(default);
        };
        let numbers = if has_time {
            finite::<4>(text).map(|[x, y, z, _]| [x, y, z])
        } else {
            finite::<3>(text)
        };
        numbers.ok_or_else(|| format!("'{name}' is '{}', expected numbers", shortened(text)))
    };
    let spacing = three(&["elementspacing", "elementsize"], [1.0; 3])?;
    let origin = three(&["offset", "origin", "position"], [0.0; 3])?;
    let matrix = ["transformmatrix", "rotation", "orientation"];
    let mut direction = Placement::IDENTITY.direction;
    if let Some(text) = matrix.iter().find_map(|name| get(name)) {
        let rows = if has_time {
            finite::<16>(text).map(|m| [0, 1, 2].map(|a| [m[4 * a], m[4 * a + 1], m[4 * a + 2]]))
        } else {
            finite::<9>(text).map(|m| [0, 1, 2].map(|a| [m[3 * a], m[3 * a + 1], m[3 * a + 2]]))
        };
        direction = rows.ok_or_else(|| {
            format!("'TransformMatrix' is '{}', expected a square of numbers", shortened(text))
        })?;
    }
    let unit = get("distanceunits").and_then(Unit::from_name).unwrap_or(Unit::Mm);
    let placed = Placement { origin, spacing, direction, unit, ..Placement::IDENTITY };
    Ok(placed.of_patient(Space::Lps))
}
