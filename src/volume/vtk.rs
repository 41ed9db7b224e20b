//! Legacy VTK files (`.vtk`) of structured points, text or binary.
//!
//! Source: "Simple Legacy Formats" (docs.vtk.org), and `vtkDataReader`. Binary numbers are big endian. Arrays of points and of
//! cells are read: `SCALARS`, `COLOR_SCALARS`, `VECTORS`, `NORMALS`, `TEXTURE_COORDINATES`, `TENSORS` and `FIELD`. Keywords are in
//! any case, and names are encoded as in addresses.

use std::fs::File;
use std::io::{self, BufRead, BufReader, Read, Seek};

use super::bits;
use super::data_error::invalid;
use super::decode::select_channel;
use super::layout::{Channel, Compression, SampleLayout, SampleType};
use super::placement::Placement;
use super::read_options::ReadOptions;
use super::samples::SampleGrid;
use super::select::{by_name, one_of};
use super::stream;
use super::text;
use super::text::{exactly, finite, shortened};

/// Longest line, in bytes.
const MAX_LINE_BYTES: u64 = 1 << 16;

/// Most arrays of a file: bounds the memory for their names.
const MAX_ARRAYS: usize = 4096;

/// An array, and the byte at which its numbers start.
struct VtkArray {
    name: String,
    sample_type: Option<SampleType>,
    type_name: String,
    /// Whether a number is a bit; as text it is 0 or 1.
    is_of_bits: bool,
    n_channels: usize,
    is_of_cells: bool,
    start: u64,
}

impl VtkArray {
    /// Bytes of `n` samples in a binary file.
    fn n_bytes(&self, n: usize) -> io::Result<u64> {
        let n = (n as u64).saturating_mul(self.n_channels as u64);
        if self.is_of_bits {
            return Ok(n.div_ceil(8));
        }
        let size = self.sample_type.map(SampleType::n_bytes).ok_or_else(|| self.unknown_type())?;
        Ok(n.saturating_mul(size as u64))
    }

    fn unknown_type(&self) -> io::Error {
        invalid(format!("unknown number type '{}'", shortened(&self.type_name)))
    }
}

struct Lines {
    reader: BufReader<File>,
    length: u64,
}

impl Lines {
    /// The next line that is not empty; `None` at the end.
    fn next(&mut self) -> io::Result<Option<String>> {
        loop {
            let mut line = Vec::new();
            let n = self.reader.by_ref().take(MAX_LINE_BYTES).read_until(b'\n', &mut line)?;
            if n as u64 == MAX_LINE_BYTES {
                return Err(invalid(format!("a line of more than {MAX_LINE_BYTES} bytes")));
            }
            let text = String::from_utf8_lossy(&line).trim().to_owned();
            if n == 0 || !text.is_empty() {
                return Ok((n > 0).then_some(text));
            }
        }
    }

    fn position(&mut self) -> io::Result<u64> {
        self.reader.stream_position()
    }

    /// Goes to the end of numbers.
    fn skip_to(&mut self, start: u64, end: u64) -> io::Result<()> {
        if end > self.length {
            let left = self.length.saturating_sub(start);
            return Err(invalid(format!("{left} bytes of samples, expected {}", end - start)));
        }
        self.reader.seek(io::SeekFrom::Start(end)).map(|_| ())
    }
}

/// Reads a legacy VTK file.
///
/// # Errors
///
/// `InvalidData` for anything but structured points, damaged files, and if an array or channel must be chosen.
pub(super) fn read(file: File, length: u64, options: &ReadOptions) -> io::Result<SampleGrid> {
    let lines = &mut Lines { reader: BufReader::new(file), length };
    let first = lines.next()?.unwrap_or_default();
    if !first.to_ascii_lowercase().starts_with("# vtk datafile version") {
        return Err(invalid("not a VTK file: the first line is not '# vtk DataFile Version'"));
    }
    // The title may be empty.
    let mut title = Vec::new();
    lines.reader.by_ref().take(MAX_LINE_BYTES).read_until(b'\n', &mut title)?;
    let is_text = match lines.next()?.map(|line| line.to_ascii_uppercase()).as_deref() {
        Some("ASCII") => true,
        Some("BINARY") => false,
        _ => return Err(invalid("the third line is neither ASCII nor BINARY")),
    };
    let mut head = VtkHeader::default();
    let mut arrays = Vec::new();
    while let Some(line) = lines.next()? {
        let keyword = keyword(&line);
        let words: Vec<&str> =
            std::iter::once(keyword.as_str()).chain(line.split_whitespace().skip(1)).collect();
        head.parse_line(&words, &line)?;
        match parse_array_line(&words, &line, lines, &head, is_text)? {
            Some(ArrayLine::Array(array)) => {
                skip_numbers(lines, &array, head.section.map_or(0, |(_, n)| n), is_text)?;
                arrays.push(array);
            }
            Some(ArrayLine::Fields(n)) => read_fields(lines, n, is_text, &head, &mut arrays)?,
            Some(ArrayLine::Table(n)) => skip_table(lines, n, is_text)?,
            None => continue,
        }
        if arrays.len() > MAX_ARRAYS {
            return Err(invalid(format!("more than {MAX_ARRAYS} arrays")));
        }
    }
    read_chosen(lines, head, &arrays, is_text, options)
}

/// Reads the samples of the chosen array.
fn read_chosen(
    lines: &mut Lines,
    head: VtkHeader,
    arrays: &[VtkArray],
    is_text: bool,
    options: &ReadOptions,
) -> io::Result<SampleGrid> {
    if arrays.is_empty() {
        return Err(invalid("no array of points or cells, expected samples"));
    }
    let names: Vec<&str> = arrays.iter().map(|array| array.name.as_str()).collect();
    let wanted = options.array.as_deref().map(decode_name);
    let array = &arrays[by_name(&names, wanted.as_deref(), None)?];
    let layout = head.layout(array, options)?;
    lines.reader.seek(io::SeekFrom::Start(array.start))?;
    let left = lines.length.saturating_sub(array.start);
    let samples = if is_text {
        let (n, _) = layout.size()?;
        let what = layout.describe();
        let all = n.saturating_mul(layout.channel.of);
        text::check_text_length(left, all, &what)?;
        let numbers = words(&mut lines.reader, all, &what)?;
        select_channel(text::samples(&numbers, layout.sample_type, all, &what)?, layout.channel)
    } else if array.is_of_bits {
        let stored = bits::layout(&layout)?;
        let bytes = stream::read(&mut lines.reader, left, Compression::None, &stored)?;
        bits::unpack(&bytes, &layout)?
    } else {
        stream::read(&mut lines.reader, left, Compression::None, &layout)?
    };
    let mut placement = head.placement;
    if array.is_of_cells {
        placement.origin = placement.world([0.5; 3]);
    }
    let placement = placement.with_positive_spacing();
    Ok(SampleGrid { dims: layout.dims, samples, placement })
}

/// The lines before the arrays.
#[derive(Default)]
struct VtkHeader {
    dims: Option<[usize; 3]>,
    placement: Placement,
    /// Whether arrays are of cells, and their number of samples, after a line of `POINT_DATA` or `CELL_DATA`.
    section: Option<(bool, usize)>,
}

impl VtkHeader {
    fn parse_line(&mut self, words: &[&str], line: &str) -> io::Result<()> {
        let wrong = || invalid(format!("line '{}', expected numbers", shortened(line)));
        let rest = line.split_once(char::is_whitespace).map_or("", |(_, rest)| rest);
        match words[0] {
            "DATASET"
                if !words.get(1).is_some_and(|w| w.eq_ignore_ascii_case("STRUCTURED_POINTS")) =>
            {
                let found = shortened(rest);
                return Err(invalid(format!("a data set of {found}, expected STRUCTURED_POINTS")));
            }
            "DIMENSIONS" => self.dims = Some(exactly(rest).ok_or_else(wrong)?),
            "ORIGIN" => self.placement.origin = finite(rest).ok_or_else(wrong)?,
            "SPACING" | "ASPECT_RATIO" => {
                self.placement.spacing = finite(rest).ok_or_else(wrong)?;
            }
            "POINT_DATA" | "CELL_DATA" => {
                let [n] = exactly(rest).ok_or_else(wrong)?;
                self.section = Some((words[0] == "CELL_DATA", n));
            }
            _ => {}
        }
        Ok(())
    }

    fn layout(&self, array: &VtkArray, options: &ReadOptions) -> io::Result<SampleLayout> {
        let dims = self.dims.ok_or_else(|| invalid("no line of DIMENSIONS"))?;
        let cells = usize::from(array.is_of_cells);
        let index = one_of("channel", options.channel, array.n_channels)?;
        Ok(SampleLayout {
            dims: dims.map(|n| n.saturating_sub(cells)),
            sample_type: array.sample_type.ok_or_else(|| array.unknown_type())?,
            big_endian: true,
            channel: Channel { index, of: array.n_channels },
            skip: 0,
        })
    }
}

/// A line that starts arrays.
enum ArrayLine {
    Array(VtkArray),
    /// The number of arrays of a field, each with its own line.
    Fields(usize),
    /// The number of colours of a table, which is skipped.
    Table(usize),
}

/// The first word of a line, which is not empty, in upper case.
fn keyword(line: &str) -> String {
    line.split_whitespace().next().unwrap_or_default().to_ascii_uppercase()
}

/// A name in which VTK has written bytes such as spaces as `%20`.
fn decode_name(name: &str) -> String {
    let bytes = name.as_bytes();
    let (mut decoded, mut at) = (Vec::new(), 0);
    while at < bytes.len() {
        let code = bytes.get(at + 1..at + 3).filter(|_| bytes[at] == b'%');
        let code = code.and_then(|digits| std::str::from_utf8(digits).ok());
        match code.and_then(|digits| u8::from_str_radix(digits, 16).ok()) {
            Some(byte) => {
                decoded.push(byte);
                at += 3;
            }
            None => {
                decoded.push(bytes[at]);
                at += 1;
            }
        }
    }
    String::from_utf8(decoded).unwrap_or_else(|_| name.to_owned())
}

fn parse_array_line(
    words: &[&str],
    line: &str,
    lines: &mut Lines,
    head: &VtkHeader,
    is_text: bool,
) -> io::Result<Option<ArrayLine>> {
    let wrong = || invalid(format!("line '{}', which is not valid VTK", shortened(line)));
    if let ["FIELD", _, n] = words {
        return Ok(Some(ArrayLine::Fields(n.parse().map_err(|_| wrong())?)));
    }
    let Some((is_of_cells, _)) = head.section else { return Ok(None) };
    let (name, type_name, n_channels) = match words {
        ["SCALARS", name, type_name] => (name, type_name, 1),
        ["SCALARS", name, type_name, n] => (name, type_name, n.parse().map_err(|_| wrong())?),
        ["VECTORS" | "NORMALS", name, type_name] => (name, type_name, 3),
        ["TENSORS", name, type_name] => (name, type_name, 9),
        ["TENSORS6", name, type_name] => (name, type_name, 6),
        ["GLOBAL_IDS" | "PEDIGREE_IDS" | "EDGE_FLAGS", name, type_name] => (name, type_name, 1),
        ["TEXTURE_COORDINATES", name, n, type_name] => {
            (name, type_name, n.parse().map_err(|_| wrong())?)
        }
        // As text fractions of 1, else bytes.
        ["COLOR_SCALARS", name, n] => {
            let type_name = if is_text { &"float" } else { &"unsigned_char" };
            (name, type_name, n.parse().map_err(|_| wrong())?)
        }
        ["LOOKUP_TABLE", _, n] => {
            return Ok(Some(ArrayLine::Table(n.parse().map_err(|_| wrong())?)));
        }
        ["METADATA"] => {
            skip_metadata(lines)?;
            return Ok(None);
        }
        _ => return Ok(None),
    };
    if words[0] == "SCALARS" {
        let table = lines.next()?.unwrap_or_default();
        if keyword(&table) != "LOOKUP_TABLE" {
            return Err(invalid(format!("line '{}', expected LOOKUP_TABLE", shortened(&table))));
        }
    }
    let start = lines.position()?;
    array(name, type_name, n_channels, is_of_cells, start)
        .map(|array| Some(ArrayLine::Array(array)))
}

/// Skips metadata, which end with an empty line.
fn skip_metadata(lines: &mut Lines) -> io::Result<()> {
    let mut line = vec![0];
    while !line.trim_ascii().is_empty() {
        line.clear();
        lines.reader.by_ref().take(MAX_LINE_BYTES).read_until(b'\n', &mut line)?;
    }
    Ok(())
}

/// Skips a table of `n` colours of four numbers.
fn skip_table(lines: &mut Lines, n: usize, is_text: bool) -> io::Result<()> {
    let n = n.saturating_mul(4);
    if is_text {
        return skip_words(&mut lines.reader, n);
    }
    let start = lines.position()?;
    lines.skip_to(start, start.saturating_add(n as u64))
}

fn array(
    name: &str,
    type_name: &str,
    n: usize,
    is_of_cells: bool,
    start: u64,
) -> io::Result<VtkArray> {
    if !(1..=1 << 16).contains(&n) {
        return Err(invalid(format!("{n} numbers per sample, expected 1 or more")));
    }
    let sample_type = match type_name.to_ascii_lowercase().as_str() {
        "unsigned_char" | "bit" => Some(SampleType::U8),
        "char" | "signed_char" => Some(SampleType::I8),
        "unsigned_short" => Some(SampleType::U16),
        "short" => Some(SampleType::I16),
        "unsigned_int" => Some(SampleType::U32),
        "int" => Some(SampleType::I32),
        "unsigned_long" | "vtktypeuint64" => Some(SampleType::U64),
        "long" | "vtktypeint64" | "vtkidtype" => Some(SampleType::I64),
        "float" => Some(SampleType::F32),
        "double" => Some(SampleType::F64),
        _ => None,
    };
    let (name, type_name) = (decode_name(name), type_name.to_owned());
    let is_of_bits = type_name.eq_ignore_ascii_case("bit");
    Ok(VtkArray { name, sample_type, type_name, is_of_bits, n_channels: n, is_of_cells, start })
}

/// Skips the numbers of an array.
fn skip_numbers(
    lines: &mut Lines,
    array: &VtkArray,
    n_samples: usize,
    is_text: bool,
) -> io::Result<()> {
    if is_text {
        return skip_words(&mut lines.reader, n_samples.saturating_mul(array.n_channels));
    }
    let end = array.start.saturating_add(array.n_bytes(n_samples)?);
    lines.skip_to(array.start, end)
}

/// Reads the arrays of a field; arrays that are not of points or cells are skipped.
fn read_fields(
    lines: &mut Lines,
    n: usize,
    is_text: bool,
    head: &VtkHeader,
    arrays: &mut Vec<VtkArray>,
) -> io::Result<()> {
    for _ in 0..n {
        let line = lines.next()?.ok_or_else(|| invalid("the file ends inside a field"))?;
        let line = if keyword(&line) == "METADATA" {
            skip_metadata(lines)?;
            lines.next()?.unwrap_or_default()
        } else {
            line
        };
        let words: Vec<&str> = line.split_whitespace().collect();
        let wrong =
            || invalid(format!("line '{}', expected an array of a field", shortened(&line)));
        let [name, n_channels, n_samples, type_name] = words[..] else { return Err(wrong()) };
        let n_channels = n_channels.parse().map_err(|_| wrong())?;
        let n_samples = n_samples.parse().map_err(|_| wrong())?;
        let start = lines.position()?;
        let is_of_cells = head.section.is_some_and(|(is_of_cells, _)| is_of_cells);
        let array = array(name, type_name, n_channels, is_of_cells, start)?;
        skip_numbers(lines, &array, n_samples, is_text)?;
        if head.section.is_some_and(|(_, n)| n == n_samples) {
            arrays.push(array);
        }
        if arrays.len() > MAX_ARRAYS {
            return Err(invalid(format!("more than {MAX_ARRAYS} arrays")));
        }
    }
    Ok(())
}

/// The next `n` words of a text, separated by white space.
fn words(reader: &mut impl BufRead, n: usize, what: &str) -> io::Result<Vec<u8>> {
    let mut found = Vec::new();
    let n_found = each_word(reader, n, |part| found.extend_from_slice(part))?;
    if n_found < n {
        return Err(invalid(format!("{n_found} numbers, expected {n} for {what}")));
    }
    Ok(found)
}

fn skip_words(reader: &mut impl BufRead, n: usize) -> io::Result<()> {
    let n_found = each_word(reader, n, |_| {})?;
    if n_found < n { Err(invalid(format!("{n_found} numbers, expected {n}"))) } else { Ok(()) }
}

/// Passes the bytes of the next `n` words, with white space, to a function. Returns the number of words.
fn each_word(
    reader: &mut impl BufRead,
    n: usize,
    mut take: impl FnMut(&[u8]),
) -> io::Result<usize> {
    let (mut n_found, mut is_inside) = (0, false);
    while n_found < n {
        let bytes = reader.fill_buf()?;
        if bytes.is_empty() {
            return Ok(n_found + usize::from(is_inside));
        }
        let mut end = 0;
        while end < bytes.len() && n_found < n {
            let is_space = bytes[end].is_ascii_whitespace();
            n_found += usize::from(is_inside && is_space);
            is_inside = !is_space;
            end += 1;
        }
        take(&bytes[..end]);
        reader.consume(end);
    }
    Ok(n_found)
}
