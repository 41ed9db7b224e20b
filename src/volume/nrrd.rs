//! NRRD ("nearly raw raster data"): a text header, then the samples in the same file (`.nrrd`) or
//! in others (`.nhdr`, or any header with a `data file` field), each with some slices.
//!
//! Scalar 3-D arrays of every number type in both byte orders are read, encoded raw, gzip or
//! text. The file's own space (`space: left-posterior-superior`, `RAS`, ...) is kept as the world
//! frame: no axis is flipped, so an exported mesh has the position that the file gives, in the file's
//! convention. Only left-anterior-superior becomes RAS.

mod header;

use std::fs::File;
use std::io::{self, BufRead, BufReader, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use super::data_error::{invalid, read_error};
use super::layout::{Channel, Compression, SampleLayout};
use super::samples::{SampleGrid, Samples};
use super::{stream, text};
use crate::error::{Error, Result};
use crate::input;
use header::{NrrdEncoding, NrrdHeader};

/// Reads a NRRD file, which is open, and, where the header is detached, its files of samples.
///
/// # Errors
///
/// [`Error::Io`] if a file cannot be read; [`Error::Input`] for anything but a scalar 3-D array,
/// for damaged headers and for data that are shorter or longer than the header declares.
pub(crate) fn read(path: &Path, file: File) -> Result<SampleGrid> {
    let mut reader = BufReader::new(file);
    let header = header::parse(&mut reader)
        .map_err(|message| Error::input(format!("{}: {message}", path.display())))?;
    let NrrdHeader { dims, placement, .. } = header;
    if header.data_files.is_empty() {
        let samples = read_data(&mut reader, &header, dims).map_err(|e| read_error(path, e))?;
        return Ok(SampleGrid { dims, samples, placement });
    }
    let part = [dims[0], dims[1], dims[2] / header.data_files.len()];
    let mut all: Option<Samples> = None;
    for name in &header.data_files {
        let data_path = input::sibling(path, name);
        let mut reader = BufReader::new(input::open(&data_path)?.0);
        let read = read_data(&mut reader, &header, part);
        Samples::append_to(&mut all, read).map_err(|e| read_error(&data_path, e))?;
    }
    let samples = all.ok_or_else(|| Error::internal("no file of samples"))?;
    Ok(SampleGrid { dims, samples, placement })
}

/// The files with the samples; none if these follow the header.
pub(crate) fn data_files(path: &Path) -> Vec<PathBuf> {
    let header =
        input::open(path).ok().and_then(|(file, _)| header::parse(&mut BufReader::new(file)).ok());
    let names = header.map(|header| header.data_files).unwrap_or_default();
    names.iter().map(|name| input::sibling(path, name)).collect()
}

/// Reads `dims` samples from the position of `reader` on.
fn read_data(
    reader: &mut BufReader<File>,
    header: &NrrdHeader,
    dims: [usize; 3],
) -> io::Result<Samples> {
    for _ in 0..header.line_skip {
        if reader.skip_until(b'\n')? == 0 {
            return Err(invalid(format!("fewer than the {} lines to skip", header.line_skip)));
        }
    }
    let start = reader.stream_position()?;
    let left = reader.get_ref().metadata()?.len().saturating_sub(start);
    let NrrdHeader { sample_type, big_endian, .. } = *header;
    let mut layout =
        SampleLayout { dims, sample_type, big_endian, channel: Channel::ONLY, skip: 0 };
    let (n, n_bytes) = layout.size()?;
    match header.encoding {
        NrrdEncoding::Raw => {
            let skip = header.byte_skip.unwrap_or(left.saturating_sub(n_bytes));
            let found = left.saturating_sub(skip);
            if found != n_bytes {
                return Err(layout.wrong_length(found, n_bytes));
            }
            reader.seek(SeekFrom::Start(start + skip))?;
            stream::read(reader, found, Compression::None, &layout)
        }
        NrrdEncoding::Gzip => {
            layout.skip = header.byte_skip.unwrap_or(0);
            stream::read_gzip_to_end(reader, left, &layout)
        }
        NrrdEncoding::Text => {
            let skip = header.byte_skip.unwrap_or(0).min(left);
            reader.seek(SeekFrom::Start(start + skip))?;
            text::read_samples(reader, left - skip, sample_type, n, &layout.describe())
        }
    }
}
