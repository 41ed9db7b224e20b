//! MetaImage: a text header, then the samples in the same file (`.mha`), in another one, or in one per slice (`.mhd`).
//!
//! Source: the MetaIO documentation (itk.org/Wiki/MetaIO/Documentation) and, where it is silent, ITK, which wrote most of
//! these files: the world is LPS in millimetres, the rows of `TransformMatrix` are the directions of the axes.

mod header;

use std::fs::File;
use std::io::{self, BufRead, BufReader, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use super::decode::{invalid, read_error, reserve, size_of_grid};
use super::select::one_of;
use super::slabs::Plain;
use super::stream::{self, Channel, Layout, Packing};
use super::{Grid, ReadOptions, Samples, text};
use crate::error::{Error, Result};
use crate::input;
use header::{Data, Header};

/// Reads a MetaImage file, which is open, and the files of samples that it names.
///
/// # Errors
///
/// [`Error::Io`] if a file cannot be read; [`Error::Input`] for other or damaged files, and where a frame or channel must be
/// chosen.
pub(crate) fn read(path: &Path, (file, _): (File, u64), options: &ReadOptions) -> Result<Grid> {
    let mut reader = BufReader::new(file);
    let header = header::parse(&mut reader)
        .map_err(|message| Error::input(format!("{}: {message}", path.display())))?;
    let layout = layout(&header, options).map_err(|e| read_error(path, e))?;
    let samples = match &header.data {
        Data::Local => read_one(&mut reader, &header, &layout).map_err(|e| read_error(path, e))?,
        Data::File(name) => {
            let data = folder(path).join(name);
            let mut reader = BufReader::new(input::open(&data)?.0);
            read_one(&mut reader, &header, &layout).map_err(|e| read_error(&data, e))?
        }
        Data::Slices(names) => read_slices(path, names, &header, &layout)?,
    };
    Ok((header.dims, samples, header.placement))
}

/// Where the samples of a MetaImage file are, if they are plain, of one number each and in one file.
///
/// # Errors
///
/// As [`read`].
pub(super) fn plain(path: &Path) -> Result<Option<Plain>> {
    let mut reader = BufReader::new(input::open(path)?.0);
    let header = header::parse(&mut reader)
        .map_err(|message| Error::input(format!("{}: {message}", path.display())))?;
    let Header { dims, sample_type, big_endian, placement, .. } = header;
    if header.is_text || header.is_packed || header.n_channels != 1 || header.n_frames != 1 {
        return Ok(None);
    }
    let (data, before) = match &header.data {
        Data::Local => {
            let before = reader.stream_position().map_err(|e| Error::io(path, e))?;
            (path.to_owned(), before)
        }
        Data::File(name) => (folder(path).join(name), 0),
        Data::Slices(_) => return Ok(None),
    };
    let left = input::open(&data)?.1.saturating_sub(before);
    let all = size_of_grid(dims, sample_type).map_or(u64::MAX, |(_, bytes)| bytes as u64);
    // -1: the samples are the end of the file.
    let skip = header.header_size.unwrap_or(left.saturating_sub(all));
    let start = before.saturating_add(skip);
    Ok(Some(Plain { path: data, start, dims, sample_type, big_endian, placement }))
}

/// The files that hold the samples where they are others than that of the header.
pub(crate) fn others(path: &Path) -> Vec<PathBuf> {
    let header =
        input::open(path).ok().and_then(|(f, _)| header::parse(&mut BufReader::new(f)).ok());
    match header.map(|header| header.data) {
        Some(Data::File(name)) => vec![folder(path).join(name)],
        Some(Data::Slices(names)) => names.iter().map(|name| folder(path).join(name)).collect(),
        Some(Data::Local) | None => Vec::new(),
    }
}

fn folder(path: &Path) -> &Path {
    path.parent().unwrap_or(Path::new(""))
}

fn layout(header: &Header, options: &ReadOptions) -> io::Result<Layout> {
    let channel = one_of("channel", options.channel, header.n_channels)?;
    let mut layout = Layout {
        dims: header.dims,
        sample_type: header.sample_type,
        big_endian: header.big_endian,
        channel: Channel { index: channel, of: header.n_channels },
        skip: 0,
    };
    let frame = one_of("frame", options.frame, header.n_frames)?;
    let before = layout.size()?.1.checked_mul(frame as u64);
    layout.skip = before.ok_or_else(|| invalid(format!("no frame {frame} in a file")))?;
    Ok(layout)
}

/// The samples behind the position of `reader`.
fn read_one(reader: &mut BufReader<File>, header: &Header, layout: &Layout) -> io::Result<Samples> {
    let start = reader.stream_position()?;
    let left = reader.get_ref().metadata()?.len().saturating_sub(start);
    if header.is_text {
        return read_text(reader, left, layout);
    }
    // -1: the samples are the end of the file.
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
    let packing = if header.is_packed { Packing::Zlib } else { Packing::Plain };
    if header.is_packed && reader.fill_buf()?.starts_with(&[0x1f, 0x8b]) {
        return stream::read(reader, left - skip, Packing::Gzip, layout);
    }
    stream::read(reader, left - skip, packing, layout)
}

fn read_text(reader: &mut BufReader<File>, left: u64, layout: &Layout) -> io::Result<Samples> {
    if layout.channel.of > 1 || layout.skip > 0 {
        return Err(invalid("text of several frames or channels, expected one"));
    }
    let mut bytes = reserve(usize::try_from(left).unwrap_or(usize::MAX), 0u8)?;
    reader.read_exact(&mut bytes)?;
    text::samples(&bytes, layout.sample_type, layout.size()?.0, &layout.what())
}

/// One file after the other, each a slice.
fn read_slices(path: &Path, names: &[String], header: &Header, layout: &Layout) -> Result<Samples> {
    let n_slices = header.dims[2] * header.n_frames;
    if names.len() != n_slices || header.is_packed || header.is_text {
        let kind = if header.is_packed || header.is_text { "packed or text" } else { "plain" };
        return Err(Error::input(format!(
            "{}: {} {kind} files of slices, expected {n_slices} plain ones",
            path.display(),
            names.len()
        )));
    }
    let slice = Layout { dims: [header.dims[0], header.dims[1], 1], skip: 0, ..*layout };
    let n_bytes = slice.size().map_err(|e| read_error(path, e))?.1;
    let frame = (layout.skip / n_bytes.max(1)) as usize;
    let mut slices = Slices {
        files: names[frame..frame + header.dims[2]].iter().map(|n| folder(path).join(n)).collect(),
        next: 0,
        open: None,
        n_bytes,
        header_size: header.header_size,
    };
    let mut n_earned = 0;
    for file in &slices.files {
        n_earned += input::open(file)?.1;
    }
    let all = Layout { skip: 0, ..*layout };
    let read = stream::unpacked(&mut slices, n_earned, &all);
    let at = slices.files[slices.next.saturating_sub(1).min(slices.files.len() - 1)].clone();
    read.map_err(|e| read_error(&at, e))
}

/// The samples of many files in a row.
struct Slices {
    files: Vec<PathBuf>,
    next: usize,
    open: Option<io::Take<BufReader<File>>>,
    n_bytes: u64,
    header_size: Option<u64>,
}

impl Slices {
    /// Opens the next file, at its samples.
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

impl Read for Slices {
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
