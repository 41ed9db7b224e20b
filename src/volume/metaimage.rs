//! MetaImage: a text header, then the samples in the same file (`.mha`), in another one, or in one per slice (`.mhd`).
//!
//! Source: the MetaIO documentation (itk.org/Wiki/MetaIO/Documentation) and, for what it leaves open, ITK, which wrote most
//! of these files: the world is LPS in millimetres, the rows of `TransformMatrix` are the directions of the axes.

mod header;

use std::fs::File;
use std::io::{self, BufRead, BufReader, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use super::data_error::{invalid, read_error};
use super::layout::{Channel, Compression, SampleLayout, size_of_grid};
use super::plain::PlainSamples;
use super::read_options::ReadOptions;
use super::samples::{SampleGrid, Samples};
use super::select::one_of;
use super::stream;
use super::text;
use crate::error::{Error, Result};
use crate::input;
use header::{DataLocation, MetaHeader};

/// Reads a MetaImage file, which is open, and its files of samples.
///
/// # Errors
///
/// [`Error::Io`] if a file cannot be read; [`Error::Input`] for other or damaged files, and if a frame or channel must be
/// chosen.
pub(crate) fn read(path: &Path, file: File, options: &ReadOptions) -> Result<SampleGrid> {
    let mut reader = BufReader::new(file);
    let header = header::parse(&mut reader)
        .map_err(|message| Error::input(format!("{}: {message}", path.display())))?;
    let layout = layout(&header, options).map_err(|e| read_error(path, e))?;
    let samples = match &header.data {
        DataLocation::Local => {
            read_one(&mut reader, &header, &layout).map_err(|e| read_error(path, e))?
        }
        DataLocation::File(name) => {
            let data = input::sibling(path, name);
            let mut reader = BufReader::new(input::open(&data)?.0);
            read_one(&mut reader, &header, &layout).map_err(|e| read_error(&data, e))?
        }
        DataLocation::Slices(names) => read_slices(path, names, &header, &layout)?,
    };
    Ok(SampleGrid { dims: header.dims, samples, placement: header.placement })
}

/// Where the samples of a MetaImage file are, if they are uncompressed, of one number each and in one file.
pub(super) fn plain(path: &Path) -> Result<Option<PlainSamples>> {
    let mut reader = BufReader::new(input::open(path)?.0);
    let header = header::parse(&mut reader)
        .map_err(|message| Error::input(format!("{}: {message}", path.display())))?;
    let MetaHeader { dims, sample_type, big_endian, placement, .. } = header;
    if header.is_text || header.is_compressed || header.n_channels != 1 || header.n_frames != 1 {
        return Ok(None);
    }
    let (data, before) = match &header.data {
        DataLocation::Local => {
            let before = reader.stream_position().map_err(|e| Error::io(path, e))?;
            (path.to_owned(), before)
        }
        DataLocation::File(name) => (input::sibling(path, name), 0),
        DataLocation::Slices(_) => return Ok(None),
    };
    let left = input::open(&data)?.1.saturating_sub(before);
    let all = size_of_grid(dims, sample_type).map_or(u64::MAX, |(_, bytes)| bytes as u64);
    // -1: the samples end with the file.
    let skip = header.header_size.unwrap_or(left.saturating_sub(all));
    let start = before.saturating_add(skip);
    Ok(Some(PlainSamples { path: data, start, dims, sample_type, big_endian, placement }))
}

/// The files with the samples; none if these follow the header.
pub(crate) fn data_files(path: &Path) -> Vec<PathBuf> {
    let header =
        input::open(path).ok().and_then(|(f, _)| header::parse(&mut BufReader::new(f)).ok());
    match header.map(|header| header.data) {
        Some(DataLocation::File(name)) => vec![input::sibling(path, &name)],
        Some(DataLocation::Slices(names)) => {
            names.iter().map(|name| input::sibling(path, name)).collect()
        }
        Some(DataLocation::Local) | None => Vec::new(),
    }
}

fn layout(header: &MetaHeader, options: &ReadOptions) -> io::Result<SampleLayout> {
    let channel = one_of("channel", options.channel, header.n_channels)?;
    let mut layout = SampleLayout {
        dims: header.dims,
        sample_type: header.sample_type,
        big_endian: header.big_endian,
        channel: Channel { index: channel, of: header.n_channels },
        skip: 0,
    };
    let frame = one_of("frame", options.frame, header.n_frames)?;
    layout.skip_volumes(frame, 0)?;
    Ok(layout)
}

/// Reads the samples from the position of `reader` on.
fn read_one(
    reader: &mut BufReader<File>,
    header: &MetaHeader,
    layout: &SampleLayout,
) -> io::Result<Samples> {
    let start = reader.stream_position()?;
    let left = reader.get_ref().metadata()?.len().saturating_sub(start);
    if header.is_text {
        return read_text(reader, left, layout);
    }
    // -1: the samples end with the file.
    let skip = match header.header_size {
        Some(skip) => skip,
        None => {
            let all = layout.size()?.1.saturating_mul(header.n_frames as u64);
            left.saturating_sub(all)
        }
    };
    if skip > left {
        return Err(invalid(format!("{left} bytes, expected {skip} before the samples")));
    }
    reader.seek(SeekFrom::Start(start + skip))?;
    let compression = if header.is_compressed { Compression::Zlib } else { Compression::None };
    if header.is_compressed && reader.fill_buf()?.starts_with(&[0x1f, 0x8b]) {
        return stream::read(reader, left - skip, Compression::Gzip, layout);
    }
    stream::read(reader, left - skip, compression, layout)
}

fn read_text(
    reader: &mut BufReader<File>,
    left: u64,
    layout: &SampleLayout,
) -> io::Result<Samples> {
    if layout.channel.of > 1 || layout.skip > 0 {
        return Err(invalid("text of several frames or channels, expected one"));
    }
    text::read_samples(reader, left, layout.sample_type, layout.size()?.0, &layout.describe())
}

/// Reads one file after the other, each with a slice.
fn read_slices(
    path: &Path,
    names: &[String],
    header: &MetaHeader,
    layout: &SampleLayout,
) -> Result<Samples> {
    let n_slices = header.dims[2] * header.n_frames;
    let is_plain = !header.is_compressed && !header.is_text;
    if names.len() != n_slices || !is_plain {
        let kind = if is_plain { "plain" } else { "compressed or text" };
        return Err(Error::input(format!(
            "{}: {} {kind} files of slices, expected {n_slices} plain ones",
            path.display(),
            names.len()
        )));
    }
    let slice = SampleLayout { dims: [header.dims[0], header.dims[1], 1], skip: 0, ..*layout };
    let n_bytes = slice.size().map_err(|e| read_error(path, e))?.1;
    let frame = (layout.skip / n_bytes.max(1)) as usize;
    let mut slices = SliceFiles {
        files: names[frame..frame + header.dims[2]]
            .iter()
            .map(|n| input::sibling(path, n))
            .collect(),
        next: 0,
        open: None,
        n_bytes,
        header_size: header.header_size,
    };
    let mut n_backed = 0;
    for file in &slices.files {
        n_backed += input::open(file)?.1;
    }
    let all = SampleLayout { skip: 0, ..*layout };
    let read = stream::read_decompressed(&mut slices, n_backed, &all);
    let at = slices.files[slices.next.saturating_sub(1).min(slices.files.len() - 1)].clone();
    read.map_err(|e| read_error(&at, e))
}

/// A reader of the samples of many files, one after the other.
struct SliceFiles {
    files: Vec<PathBuf>,
    next: usize,
    open: Option<io::Take<BufReader<File>>>,
    n_bytes: u64,
    header_size: Option<u64>,
}

impl SliceFiles {
    /// Opens the next file at its samples; false after the last.
    fn advance(&mut self) -> io::Result<bool> {
        let Some(file) = self.files.get(self.next) else { return Ok(false) };
        self.next += 1;
        let (mut file, length) = input::open(file).map_err(|e| io::Error::other(e.to_string()))?;
        let skip = self.header_size.unwrap_or(length.saturating_sub(self.n_bytes));
        let found = length.saturating_sub(skip);
        if found < self.n_bytes {
            let expected = self.n_bytes;
            return Err(invalid(format!("{found} bytes of samples, expected {expected}")));
        }
        file.seek(SeekFrom::Start(skip))?;
        self.open = Some(BufReader::new(file).take(self.n_bytes));
        Ok(true)
    }
}

impl Read for SliceFiles {
    fn read(&mut self, wanted: &mut [u8]) -> io::Result<usize> {
        loop {
            let n = match &mut self.open {
                Some(open) => open.read(wanted)?,
                None => 0,
            };
            if n > 0 || wanted.is_empty() || !self.advance()? {
                return Ok(n);
            }
        }
    }
}
