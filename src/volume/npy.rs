//! NumPy's `.npy`: one array, C or Fortran order, any number type, both byte orders.
//!
//! Source: NEP 1, "A simple file format for NumPy arrays", and `numpy/lib/format.py`.
//!
//! # Axes
//!
//! Element `a[i, j, k]` is the sample at z = i, y = j, x = k, so an array has the
//! shape (nz, ny, nx). That is what `numpy.fromfile(...).reshape(nz, ny, nx)` gives for a RAW
//! file, and what image stacks have. It holds for Fortran order too: the order in memory is
//! invisible to NumPy's users and two equal arrays must be one volume. Arrays indexed `a[x, y, z]`
//! (from NIfTI readers) must be saved as `a.T`; otherwise the volume is mirrored.
//!
//! Arrays in C order are read straight into the volume; for Fortran order, whose z is fastest, a
//! second copy exists while the samples are reordered.

use std::fs::File;
use std::io::{self, BufReader, Read};
use std::path::Path;

use super::data_error::{invalid, read_error};
use super::decode::read_samples;
use super::layout::{SampleType, size_of_grid};
use super::memory::try_filled_vec;
use super::placement::Placement;
use super::plain::PlainSamples;
use super::samples::{SampleGrid, Samples, with_samples};
use crate::error::Result;

/// Longest header accepted, in bytes. That of a plain array takes 128.
const MAX_HEADER_BYTES: usize = 1 << 16;

/// The header of an array.
#[derive(Debug, PartialEq)]
struct NpyHeader {
    /// As NumPy spells it, e.g. `<f4`.
    descr: String,
    fortran_order: bool,
    shape: Vec<u64>,
}

/// Reads a `.npy` file, which is open and has `length` bytes.
///
/// # Errors
///
/// `InvalidData` for anything but a 3-D array of real numbers, and for a file that is not exactly as long as its shape needs.
pub(super) fn read(file: File, length: u64) -> io::Result<SampleGrid> {
    read_array(&mut BufReader::new(file), length, 1)
}

/// Where the samples of a `.npy` file are, if x is fastest.
pub(super) fn plain(path: &Path) -> Result<Option<PlainSamples>> {
    let found = || {
        let (file, length) = crate::input::open(path).map_err(io::Error::other)?;
        let (text, start) = header_text(&mut BufReader::new(file))?;
        let header = parse_header(&text).map_err(invalid)?;
        let (sample_type, big_endian) = type_of(&header.descr).map_err(invalid)?;
        let dims = dims_of(&header.shape).map_err(invalid)?;
        let path = path.to_owned();
        let placement = Placement::default();
        let plain = PlainSamples { path, start, dims, sample_type, big_endian, placement };
        // A longer file is rejected by `read`.
        let is_plain = !header.fortran_order && plain.end().is_some_and(|end| end >= length);
        Ok(is_plain.then_some(plain))
    };
    found().map_err(|e| read_error(path, e))
}

/// Reads the array of a stream of `length` bytes, of which the file has at least every `ratio`-th.
///
/// # Errors
///
/// `InvalidData` as [`read`], and errors of the stream.
pub(super) fn read_array(
    reader: &mut impl Read,
    length: u64,
    ratio: u64,
) -> io::Result<SampleGrid> {
    let (text, n_before) = header_text(reader)?;
    let header = parse_header(&text).map_err(invalid)?;
    let (sample_type, big_endian) = type_of(&header.descr).map_err(invalid)?;
    let dims = dims_of(&header.shape).map_err(invalid)?;
    let found = length.saturating_sub(n_before);
    let size = size_of_grid(dims, sample_type);
    let n = size.filter(|&(_, bytes)| bytes as u64 == found).map(|(n, _)| n).ok_or_else(|| {
        let expected =
            size.map_or("more than memory can hold".to_owned(), |(_, bytes)| bytes.to_string());
        let shape = &header.shape;
        invalid(format!(
            "{found} bytes of samples, expected {expected} for shape {shape:?} {sample_type}"
        ))
    })?;
    let n_backed = n / usize::try_from(ratio).unwrap_or(usize::MAX).max(1);
    let stored = read_samples(reader, sample_type, big_endian, n, n_backed)?;
    let samples = if header.fortran_order { x_fastest(&stored, dims)? } else { stored };
    Ok(SampleGrid { dims, samples, placement: Placement::default() })
}

/// Reads the text of the header, up to the first sample. Returns the bytes before it, too.
fn header_text(reader: &mut impl Read) -> io::Result<(String, u64)> {
    let short = |e: io::Error| match e.kind() {
        io::ErrorKind::UnexpectedEof => invalid("the header ends early"),
        _ => e,
    };
    let mut magic = [0; 8];
    reader.read_exact(&mut magic).map_err(short)?;
    if magic[..6] != *b"\x93NUMPY" {
        return Err(invalid("not a .npy file: it does not start with \\x93NUMPY"));
    }
    let (n, n_before) = match magic[6] {
        1 => {
            let mut n = [0; 2];
            reader.read_exact(&mut n).map_err(short)?;
            (usize::from(u16::from_le_bytes(n)), 10)
        }
        2 | 3 => {
            let mut n = [0; 4];
            reader.read_exact(&mut n).map_err(short)?;
            (u32::from_le_bytes(n) as usize, 12)
        }
        version => return Err(invalid(format!(".npy version {version}, expected 1 to 3"))),
    };
    if n > MAX_HEADER_BYTES {
        let message = format!("a header of {n} bytes, expected at most {MAX_HEADER_BYTES}");
        return Err(invalid(message));
    }
    let mut text = vec![0; n];
    reader.read_exact(&mut text).map_err(short)?;
    let text = String::from_utf8(text).map_err(|_| invalid("the header is not text"))?;
    Ok((text, n_before + n as u64))
}

/// Parses `{'descr': '<f4', 'fortran_order': False, 'shape': (2, 3, 4), }`.
///
/// Only this form of Python literal is supported, which NumPy writes: without nesting, which could exhaust the stack.
fn parse_header(text: &str) -> Result<NpyHeader, String> {
    let damaged = || "the header is not a dictionary of descr, fortran_order and shape".to_owned();
    let (mut descr, mut fortran_order, mut shape) = (None, None, None);
    let inside = text.trim().strip_prefix('{').and_then(|t| t.strip_suffix('}'));
    let mut rest = inside.ok_or_else(damaged)?.trim();
    while !rest.is_empty() {
        let (key, after) = quoted(rest).ok_or_else(damaged)?;
        rest = after.trim_start().strip_prefix(':').ok_or_else(damaged)?.trim_start();
        match key {
            "descr" if rest.starts_with('[') => {
                return Err("a structured array, expected one of numbers".to_owned());
            }
            "descr" => {
                let (value, after) = quoted(rest).ok_or_else(damaged)?;
                descr = Some(value.to_owned());
                rest = after;
            }
            "fortran_order" => {
                let word = if rest.starts_with("True") { "True" } else { "False" };
                fortran_order = Some(word == "True");
                rest = rest.strip_prefix(word).ok_or_else(damaged)?;
            }
            "shape" => {
                let (inside, after) =
                    rest.strip_prefix('(').and_then(|t| t.split_once(')')).ok_or_else(damaged)?;
                shape = Some(parse_shape(inside).ok_or_else(damaged)?);
                rest = after;
            }
            _ => return Err(damaged()),
        }
        rest = rest.trim_start();
        match rest.strip_prefix(',') {
            Some(after) => rest = after.trim_start(),
            None if rest.is_empty() => {}
            None => return Err(damaged()),
        }
    }
    match (descr, fortran_order, shape) {
        (Some(descr), Some(fortran_order), Some(shape)) => {
            Ok(NpyHeader { descr, fortran_order, shape })
        }
        _ => Err(damaged()),
    }
}

/// A string in quotes of either kind, and what follows it.
fn quoted(text: &str) -> Option<(&str, &str)> {
    let quote = text.chars().next().filter(|c| matches!(c, '\'' | '"'))?;
    text[1..].split_once(quote)
}

/// The numbers of a tuple; Python 2 wrote some with a suffix L.
fn parse_shape(inside: &str) -> Option<Vec<u64>> {
    let inside = inside.trim();
    let inside = inside.strip_suffix(',').unwrap_or(inside);
    if inside.is_empty() {
        return Some(Vec::new());
    }
    inside.split(',').map(|d| d.trim().trim_end_matches('L').parse().ok()).collect()
}

/// Sample type and whether it is big endian, from a type string such as `<f4`.
fn type_of(descr: &str) -> Result<(SampleType, bool), String> {
    let unknown = || {
        let start: String = descr.chars().take(20).flat_map(char::escape_default).collect();
        format!("array type '{start}', expected real numbers such as '<f4' or '|u1'")
    };
    let order = descr.chars().next().filter(|c| matches!(c, '<' | '>' | '|' | '='));
    let sample_type = match order.map_or(descr, |_| &descr[1..]) {
        "u1" | "b1" | "?" => SampleType::U8,
        "i1" => SampleType::I8,
        "u2" => SampleType::U16,
        "i2" => SampleType::I16,
        "u4" => SampleType::U32,
        "i4" => SampleType::I32,
        "u8" => SampleType::U64,
        "i8" => SampleType::I64,
        "f2" => SampleType::F16,
        "f4" => SampleType::F32,
        "f8" => SampleType::F64,
        _ => return Err(unknown()),
    };
    match order {
        Some('<' | '>') => Ok((sample_type, order == Some('>'))),
        _ if sample_type.n_bytes() == 1 => Ok((sample_type, false)),
        _ => Err(unknown()),
    }
}

/// Dimensions (x, y, z) of an array of shape (nz, ny, nx).
fn dims_of(shape: &[u64]) -> Result<[usize; 3], String> {
    let &[nz, ny, nx] = shape else {
        let start = &shape[..shape.len().min(8)];
        return Err(format!("an array of {} axes {start:?}, expected 3", shape.len()));
    };
    let mut dims = [0; 3];
    for (d, n) in dims.iter_mut().zip([nx, ny, nz]) {
        *d = usize::try_from(n)
            .map_err(|_| format!("an axis of {n} samples, more than memory can hold"))?;
    }
    Ok(dims)
}

/// Samples with z fastest, reordered to have x fastest.
fn x_fastest(samples: &Samples, dims: [usize; 3]) -> io::Result<Samples> {
    Ok(with_samples!(samples, s => transposed(s, dims)?.into()))
}

/// The transpose of each x-z slice, in square blocks that fit the cache.
fn transposed<T: Copy + Default>(z_fastest: &[T], [nx, ny, nz]: [usize; 3]) -> io::Result<Vec<T>> {
    const BLOCK: usize = 32;
    let mut x_fastest = try_filled_vec(z_fastest.len(), T::default())?;
    for z0 in (0..nz).step_by(BLOCK) {
        for y in 0..ny {
            for x0 in (0..nx).step_by(BLOCK) {
                for z in z0..nz.min(z0 + BLOCK) {
                    for x in x0..nx.min(x0 + BLOCK) {
                        x_fastest[x + nx * (y + ny * z)] = z_fastest[z + nz * (y + ny * x)];
                    }
                }
            }
        }
    }
    Ok(x_fastest)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_header_is_the_one_numpy_writes() {
        let known =
            NpyHeader { descr: "<f4".to_owned(), fortran_order: true, shape: vec![2, 3, 4] };
        let text = "{'descr': '<f4', 'fortran_order': True, 'shape': (2, 3, 4), }          \n";
        assert_eq!(parse_header(text), Ok(known));
        let python2 = "{\"shape\": (2L, 3L), \"descr\": \"|u1\", \"fortran_order\": False}";
        assert_eq!(parse_header(python2).map(|h| h.shape), Ok(vec![2, 3]));
        for damaged in [
            "",
            "{",
            "}{",
            "{}",
            "{'descr': '<f4'}",
            "{'descr': '<f4', 'fortran_order': Maybe, 'shape': (1,)}",
            "{'descr': '<f4', 'fortran_order': True, 'shape': (-1,)}",
            "{'descr': '<f4', 'fortran_order': True, 'shape': ((((((1,)}",
            "{'descr': '<f4' 'fortran_order': True, 'shape': (1,)}",
            "{'descr': 'é",
        ] {
            assert!(parse_header(damaged).is_err(), "{damaged}");
        }
    }

    #[test]
    fn only_real_numbers_with_a_byte_order_are_samples() {
        assert_eq!(type_of("<f4"), Ok((SampleType::F32, false)));
        assert_eq!(type_of(">i2"), Ok((SampleType::I16, true)));
        assert_eq!(type_of("|b1"), Ok((SampleType::U8, false)));
        for other in ["<c8", "|O", "<U3", "|S4", "", "é", "f4", "|f4", "<f16"] {
            assert!(type_of(other).is_err(), "{other}");
        }
    }
}
