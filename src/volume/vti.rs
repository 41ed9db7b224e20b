//! VTK XML image data (`.vti`).
//!
//! Source: "VTK XML formats" (docs.vtk.org) and `vtkXMLImageDataReader`. Point or cell data of one piece are read: text,
//! base64, or appended, raw or base64, each uncompressed or in blocks of zlib, with 32 or 64 bit lengths in either byte
//! order. Appended raw data are not valid XML, so the parser does not see anything after their tag.

mod array;
mod blocks;
mod xml;

use std::fs::File;
use std::io::{self, BufRead, BufReader, Read, Seek, SeekFrom};

use quick_xml::events::{BytesStart, Event};

use super::bits;
use super::data_error::invalid;
use super::layout::{Channel, SampleLayout};
use super::placement::Placement;
use super::read_options::ReadOptions;
use super::samples::{SampleGrid, Samples};
use super::select::{by_name, one_of};
use super::text::{exactly, finite, shortened};
use array::{ArrayData, VtiArray};
use blocks::VtiEncoding;
use xml::{attribute, wrong_xml};

/// The XML before the appended samples.
struct VtiHeader {
    extent: [i64; 6],
    placement: Placement,
    encoding: VtiEncoding,
    arrays: Vec<VtiArray>,
    /// The active array of the points.
    active: Option<String>,
}

/// Reads a VTI file.
///
/// # Errors
///
/// `InvalidData` for anything but image data of one piece, damaged files, and if an array or channel must be chosen.
pub(super) fn read(file: File, options: &ReadOptions) -> io::Result<SampleGrid> {
    let mut parser = Parser::new(BufReader::new(file), options.array.as_deref());
    let (head, appended) = parser.head()?;
    let VtiHeader { extent, mut placement, encoding, arrays, active } = head;
    if arrays.is_empty() {
        return Err(invalid("no array of points or cells, expected samples"));
    }
    let names: Vec<&str> = arrays.iter().map(|array| array.name.as_str()).collect();
    let chosen = by_name(&names, options.array.as_deref(), active.as_deref())?;
    let array = &arrays[chosen];
    let index = one_of("channel", options.channel, array.n_channels)?;
    let cells = usize::from(array.is_of_cells);
    let mut dims = [0; 3];
    for a in 0..3 {
        let n = extent[2 * a + 1].checked_sub(extent[2 * a]).filter(|n| *n >= 0);
        let n = n.and_then(|n| usize::try_from(n).ok()).and_then(|n| (n + 1).checked_sub(cells));
        dims[a] =
            n.ok_or_else(|| invalid(format!("extent {extent:?}, expected ascending pairs")))?;
    }
    // The samples of cells are at their centres.
    let first = [0, 1, 2].map(|a| extent[2 * a] as f64 + 0.5 * cells as f64);
    placement.origin = placement.world(first);
    let channel = Channel { index, of: array.n_channels };
    let (sample_type, big_endian) = (array.sample_type()?, encoding.big_endian);
    let layout = SampleLayout { dims, sample_type, big_endian, channel, skip: 0 };
    // Bits are read as the bytes that hold them.
    let is_packed = array.is_of_bits() && !matches!(array.data, ArrayData::Text(_));
    let stored = if is_packed { bits::layout(&layout)? } else { layout };
    let samples = match &array.data {
        ArrayData::Text(text) => array::read_text(text, &stored)?,
        ArrayData::Base64(text) => blocks::read_base64(text.as_bytes(), encoding, &stored)?,
        ArrayData::Appended(offset) => {
            let is_base64 = appended.ok_or_else(|| invalid("no appended data in the file"))?;
            read_appended(parser.into_inner(), is_base64, *offset, encoding, &stored)?
        }
    };
    let samples = if is_packed { bits::unpack(&samples, &layout)? } else { samples };
    Ok(SampleGrid { dims, samples, placement })
}

fn read_appended(
    mut reader: BufReader<File>,
    is_base64: bool,
    offset: u64,
    encoding: VtiEncoding,
    layout: &SampleLayout,
) -> io::Result<Samples> {
    // The data start after white space and an underscore.
    loop {
        let mut byte = [0];
        reader.read_exact(&mut byte)?;
        match byte[0] {
            b'_' => break,
            b if b.is_ascii_whitespace() => {}
            _ => return Err(invalid("appended data that do not start with '_'")),
        }
    }
    let length = reader.get_ref().metadata()?.len();
    let start = reader.stream_position()?.saturating_add(offset);
    if start > length {
        return Err(invalid(format!("appended data at byte {offset}, beyond the end of the file")));
    }
    reader.seek(SeekFrom::Start(start))?;
    let left = length - start;
    if !is_base64 {
        return blocks::read(&mut reader, left, encoding, layout);
    }
    // Up to the end of the text; twice the size and a megabyte leave room for base64 and padding.
    let max_bytes = layout.size()?.1.saturating_mul(2).saturating_add(1 << 20).min(left);
    let mut text = Vec::new();
    reader.take(max_bytes).read_to_end(&mut text)?;
    let end = text.iter().position(|&b| b == b'<').unwrap_or(text.len());
    blocks::read_base64(&text[..end], encoding, layout)
}

/// Parses the XML up to the appended samples.
struct Parser<'a, R: BufRead> {
    reader: quick_xml::Reader<R>,
    /// The chosen array: the text of others is not kept.
    wanted: Option<&'a str>,
}

impl<'a, R: BufRead> Parser<'a, R> {
    fn new(reader: R, wanted: Option<&'a str>) -> Self {
        Parser { reader: quick_xml::Reader::from_reader(reader), wanted }
    }

    fn into_inner(self) -> R {
        self.reader.into_inner()
    }

    /// The header, and if there are appended data, whether they are base64.
    fn head(&mut self) -> io::Result<(VtiHeader, Option<bool>)> {
        let mut head = VtiHeader {
            extent: [0; 6],
            placement: Placement::IDENTITY,
            encoding: VtiEncoding::PLAIN,
            arrays: Vec::new(),
            active: None,
        };
        let (mut buffer, mut is_image, mut of_cells, mut n_pieces) = (Vec::new(), false, None, 0);
        // The number of elements around the parser from an array on.
        let mut depth = 0;
        loop {
            buffer.clear();
            let event = self.reader.read_event_into(&mut buffer);
            let event = event.map_err(|e| wrong_xml(&e.to_string()))?;
            let is_start = matches!(event, Event::Start(_));
            match event {
                // Elements in an array describe it.
                Event::Start(_) if depth > 0 => depth += 1,
                Event::Start(tag) | Event::Empty(tag) if depth == 0 => {
                    match tag.local_name().as_ref() {
                        "VTKFile" => head.encoding = encoding(&tag)?,
                        "ImageData" => {
                            is_image = true;
                            (head.extent, head.placement) = frame(&tag)?;
                        }
                        "Piece" => {
                            n_pieces += 1;
                            check_piece(&tag, head.extent, n_pieces)?;
                        }
                        "PointData" => {
                            of_cells = Some(false);
                            head.active = attribute(&tag, "Scalars")?;
                        }
                        "CellData" => of_cells = Some(true),
                        "DataArray" if of_cells.is_some() => {
                            head.arrays.push(array::parse_tag(&tag, of_cells == Some(true))?);
                            depth = usize::from(is_start);
                        }
                        "AppendedData" => {
                            check_image(is_image)?;
                            return Ok((head, Some(is_base64(&tag)?)));
                        }
                        _ => {}
                    }
                }
                Event::Text(text) if depth == 1 => {
                    if let Some(array) = head.arrays.last_mut()
                        && self.wanted.is_none_or(|wanted| wanted == array.name)
                    {
                        array.add_text(&text);
                    }
                }
                Event::End(_) if depth > 0 => depth -= 1,
                Event::End(tag) => match tag.local_name().as_ref() {
                    "PointData" | "CellData" => of_cells = None,
                    "VTKFile" => break,
                    _ => {}
                },
                Event::Eof => return Err(invalid("the file ends before its last tag")),
                _ => {}
            }
        }
        check_image(is_image)?;
        Ok((head, None))
    }
}

fn check_image(is_image: bool) -> io::Result<()> {
    if is_image { Ok(()) } else { Err(invalid("no ImageData in the file, expected a VTI file")) }
}

fn encoding(tag: &BytesStart<'_>) -> io::Result<VtiEncoding> {
    let mut encoding = VtiEncoding::PLAIN;
    if attribute(tag, "type")?.is_some_and(|kind| kind != "ImageData") {
        return Err(invalid("a VTK file of another kind, expected ImageData"));
    }
    encoding.big_endian = attribute(tag, "byte_order")?.as_deref() == Some("BigEndian");
    encoding.length_bytes = match attribute(tag, "header_type")?.as_deref() {
        None | Some("UInt32") => 4,
        Some("UInt64") => 8,
        Some(other) => {
            return Err(invalid(format!(
                "header_type '{}', expected UInt32 or UInt64",
                shortened(other)
            )));
        }
    };
    encoding.is_compressed = match attribute(tag, "compressor")?.as_deref() {
        None | Some("") => false,
        Some("vtkZLibDataCompressor") => true,
        Some(other) => {
            return Err(invalid(format!(
                "compressor '{}', expected vtkZLibDataCompressor",
                shortened(other)
            )));
        }
    };
    Ok(encoding)
}

/// Extent and placement of the image.
fn frame(tag: &BytesStart<'_>) -> io::Result<([i64; 6], Placement)> {
    let wrong =
        |name: &str, text: &str| invalid(format!("{name} '{}', expected numbers", shortened(text)));
    let three = |name: &str, default: [f64; 3]| match attribute(tag, name)? {
        Some(text) => finite::<3>(&text).ok_or_else(|| wrong(name, &text)),
        None => Ok(default),
    };
    let text = attribute(tag, "WholeExtent")?.unwrap_or_default();
    let extent = exactly::<i64, 6>(&text).ok_or_else(|| wrong("WholeExtent", &text))?;
    if extent.iter().any(|x| x.unsigned_abs() > 1 << 40) {
        return Err(wrong("WholeExtent", &text));
    }
    let mut placement = Placement::IDENTITY;
    placement.origin = three("Origin", [0.0; 3])?;
    placement.spacing = three("Spacing", [1.0; 3])?;
    if let Some(text) = attribute(tag, "Direction")? {
        // Row by row; the directions of the axes are the columns.
        let m = finite::<9>(&text).ok_or_else(|| wrong("Direction", &text))?;
        placement.direction = [0, 1, 2].map(|a| [m[a], m[3 + a], m[6 + a]]);
    }
    Ok((extent, placement.with_positive_spacing()))
}

fn check_piece(tag: &BytesStart<'_>, whole: [i64; 6], n: usize) -> io::Result<()> {
    let text = attribute(tag, "Extent")?.unwrap_or_default();
    if n > 1 || exactly::<i64, 6>(&text) != Some(whole) {
        return Err(invalid("an image in several pieces, expected one"));
    }
    Ok(())
}

/// Whether appended data are base64, not raw.
fn is_base64(tag: &BytesStart<'_>) -> io::Result<bool> {
    match attribute(tag, "encoding")?.as_deref() {
        Some("raw") => Ok(false),
        Some("base64") | None => Ok(true),
        Some(other) => {
            Err(invalid(format!("appended data as '{}', expected raw or base64", shortened(other))))
        }
    }
}
