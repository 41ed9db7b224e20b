//! NRRD ("nearly raw raster data"): a text header, then the samples in the same file (`.nrrd`) or
//! in others (`.nhdr`, or any header with a `data file` field), each with some slices.
//!
//! Read are scalar 3-D arrays of every number type in both byte orders, encoded raw, gzip or
//! text. The file's own space (`space: left-posterior-superior`, `RAS`, ...) is kept as the world
//! frame: no axis is flipped, so an exported mesh lies where the file says in the file's
//! convention; only left-anterior-superior becomes RAS.
//!
//! A header is free to lie, so its size is held against the length of the file before memory is
//! taken: exactly for raw data, and by the greatest possible compression (1032 to 1 for deflate,
//! zlib technical notes) for gzip, of which no byte beyond that size is inflated, and whose memory grows with what
//! is inflated.

mod header;

use std::fs::File;
use std::io::{self, BufRead, BufReader, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use flate2::bufread::MultiGzDecoder;

use crate::error::{Error, Result};
use crate::input;
use crate::volume::decode::{invalid, read_error, read_samples, reserve, size_of_grid};
use crate::volume::stream::DEFLATE_RATIO;
use crate::volume::text;
use crate::volume::{Placement, Samples};
use header::{Encoding, Header};

/// Reads a NRRD file, which is open, and, where the header is detached, the files of samples it names.
///
/// # Errors
///
/// [`Error::Io`] if a file cannot be read; [`Error::Input`] for anything but a scalar 3-D array,
/// for damaged headers and for data that are shorter or longer than the header says.
pub(crate) fn read(path: &Path, file: File) -> Result<([usize; 3], Samples, Placement)> {
    let mut reader = BufReader::new(file);
    let header = header::parse(&mut reader)
        .map_err(|message| Error::input(format!("{}: {message}", path.display())))?;
    if header.data_files.is_empty() {
        let samples = read_data(&mut reader, &header, header.dims);
        let samples = samples.map_err(|e| read_error(path, e))?;
        return Ok((header.dims, samples, header.placement));
    }
    let [nx, ny, nz] = header.dims;
    let part = [nx, ny, nz / header.data_files.len()];
    let mut samples: Option<Samples> = None;
    for name in &header.data_files {
        let data_path = beside(path, name);
        let mut reader = BufReader::new(input::open(&data_path)?.0);
        let read = read_data(&mut reader, &header, part);
        let read = read.and_then(|more| match &mut samples {
            Some(samples) => samples.append(more),
            None => {
                samples = Some(more);
                Ok(())
            }
        });
        read.map_err(|e| read_error(&data_path, e))?;
    }
    let samples = samples.ok_or_else(|| Error::internal("files of samples without one"))?;
    Ok((header.dims, samples, header.placement))
}

/// The files that hold the samples where they are others than that of the header.
pub(crate) fn data_files(path: &Path) -> Vec<PathBuf> {
    let header =
        input::open(path).ok().and_then(|(file, _)| header::parse(&mut BufReader::new(file)).ok());
    let names = header.map(|header| header.data_files).unwrap_or_default();
    names.iter().map(|name| beside(path, name)).collect()
}

/// A file whose name is told by a header.
fn beside(path: &Path, name: &str) -> PathBuf {
    path.parent().unwrap_or(Path::new("")).join(name)
}

/// The samples of so many behind the position of `reader`.
fn read_data(
    reader: &mut BufReader<File>,
    header: &Header,
    dims: [usize; 3],
) -> io::Result<Samples> {
    for _ in 0..header.line_skip {
        if reader.skip_until(b'\n')? == 0 {
            return Err(invalid(format!("fewer than the {} lines to skip", header.line_skip)));
        }
    }
    let position = reader.stream_position()?;
    let left = reader.get_ref().metadata()?.len().saturating_sub(position);
    let [x, y, z] = dims;
    let what = format!("{x}x{y}x{z} {}", header.sample_type);
    let (n, n_bytes) = size_of_grid(dims, header.sample_type)
        .ok_or_else(|| invalid(format!("{what} samples, more than memory can hold")))?;
    match header.encoding {
        Encoding::Raw => read_raw(reader, header, left, (n, n_bytes as u64), &what),
        Encoding::Gzip => read_gzip(reader, header, left, (n, n_bytes as u64), &what),
        Encoding::Text => read_text(reader, header, left, n, &what),
    }
}

fn read_raw(
    reader: &mut BufReader<File>,
    header: &Header,
    left: u64,
    (n, n_bytes): (usize, u64),
    what: &str,
) -> io::Result<Samples> {
    let skip = header.byte_skip.unwrap_or(left.saturating_sub(n_bytes));
    let found = left.saturating_sub(skip);
    if found != n_bytes {
        return Err(invalid(format!("{found} bytes of samples, expected {n_bytes} for {what}")));
    }
    let start = reader.stream_position()? + skip;
    reader.seek(SeekFrom::Start(start))?;
    read_samples(reader, header.sample_type, header.big_endian, n, n)
}

fn read_gzip(
    reader: &mut BufReader<File>,
    header: &Header,
    left: u64,
    (n, n_bytes): (usize, u64),
    what: &str,
) -> io::Result<Samples> {
    let skip = header.byte_skip.unwrap_or(0);
    if n_bytes.saturating_add(skip) > left.saturating_mul(DEFLATE_RATIO) {
        return Err(invalid(format!(
            "{left} bytes of gzip data, too few for the {n_bytes} bytes of {what}"
        )));
    }
    let describe = |e: io::Error| match e.kind() {
        io::ErrorKind::UnexpectedEof => {
            invalid(format!("the gzip data end early, expected {n_bytes} bytes for {what}"))
        }
        // What flate2 says of a stream that is no gzip, or whose checksum is wrong.
        io::ErrorKind::InvalidInput => invalid(format!("damaged gzip data: {e}")),
        _ => e,
    };
    let mut inflated = MultiGzDecoder::new(reader);
    io::copy(&mut inflated.by_ref().take(skip), &mut io::sink()).map_err(describe)?;
    // Samples rarely deflate to more than they were.
    let n_earned = usize::try_from(left).unwrap_or(usize::MAX) / header.sample_type.n_bytes();
    let samples = read_samples(&mut inflated, header.sample_type, header.big_endian, n, n_earned)
        .map_err(describe)?;
    // Reading past the end also checks the checksum behind the data.
    if inflated.read(&mut [0]).map_err(describe)? != 0 {
        return Err(invalid(format!("the gzip data hold more than the {n_bytes} bytes of {what}")));
    }
    Ok(samples)
}

fn read_text(
    reader: &mut BufReader<File>,
    header: &Header,
    left: u64,
    n: usize,
    what: &str,
) -> io::Result<Samples> {
    // A number and the space behind it take two bytes.
    if n as u64 > left / 2 + 1 {
        return Err(invalid(format!("{left} bytes of text, too few for {what}")));
    }
    let skip = header.byte_skip.unwrap_or(0).min(left);
    let mut bytes = reserve(usize::try_from(left - skip).unwrap_or(usize::MAX), 0u8)?;
    let start = reader.stream_position()? + skip;
    reader.seek(SeekFrom::Start(start))?;
    reader.read_exact(&mut bytes)?;
    text::samples(&bytes, header.sample_type, n, what)
}
