//! NRRD ("nearly raw raster data"): a text header, then the samples in the same file (`.nrrd`) or
//! in others (`.nhdr`, or any header with a `data file` field), each with some slices.
//!
//! Scalar 3-D arrays of every number type in both byte orders are read, encoded raw, gzip or
//! text; of 4-D arrays one entry of the first or last axis, a channel or a frame. The file's own space (`space: left-posterior-superior`, `RAS`, ...) is kept as the world
//! frame: no axis is flipped, so an exported mesh has the position that the file gives, in the file's
//! convention. Only left-anterior-superior becomes RAS.

mod axes;
mod fields;
mod header;

use std::fs::File;
use std::io::{self, BufRead, BufReader, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use super::data_error::{invalid, read_error};
use super::decode::select_channel;
use super::layout::{Channel, Compression, SampleLayout};
use super::read_options::ReadOptions;
use super::samples::{SampleGrid, Samples};
use super::select::one_of;
use super::{stream, text};
use crate::error::{Error, Result};
use crate::input;
use axes::FourthAxis;
use header::{NrrdEncoding, NrrdHeader};

/// Reads a NRRD file, which is open, and, where the header is detached, its files of samples.
///
/// # Errors
///
/// [`Error::Io`] if a file cannot be read; [`Error::Input`] for anything but a scalar 3-D or 4-D array,
/// for damaged headers, for data that are shorter or longer than the header declares, and if a frame or channel must be chosen.
pub(crate) fn read(path: &Path, file: File, options: &ReadOptions) -> Result<SampleGrid> {
    let mut reader = BufReader::new(file);
    let header = header::parse(&mut reader)
        .map_err(|message| Error::input(format!("{}: {message}", path.display())))?;
    let NrrdHeader { dims, placement, .. } = header;
    let entry = entry(header.fourth, options).map_err(|e| read_error(path, e))?;
    let n_files = header.data_files.len();
    if n_files == 0 {
        let samples = read_data(&mut reader, &header, dims, entry);
        let samples = samples.map_err(|e| read_error(path, e))?;
        return Ok(SampleGrid { dims, samples, placement });
    }
    // Frames may have a file each.
    let (names, part, entry) = if entry.n_frames > 1 {
        let is_each = n_files == entry.n_frames;
        let own = if is_each { entry.frame } else { 0 };
        let entry = if is_each { Entry { frame: 0, n_frames: 1, ..entry } } else { entry };
        (&header.data_files[own..=own], dims, entry)
    } else {
        (&header.data_files[..], [dims[0], dims[1], dims[2] / n_files], entry)
    };
    let mut all: Option<Samples> = None;
    for name in names {
        let data_path = input::sibling(path, name);
        let mut reader = BufReader::new(input::open(&data_path)?.0);
        let read = read_data(&mut reader, &header, part, entry);
        Samples::append_to(&mut all, read).map_err(|e| read_error(&data_path, e))?;
    }
    let samples = all.ok_or_else(|| Error::internal("no file of samples"))?;
    Ok(SampleGrid { dims, samples, placement })
}

/// The entry of a fourth axis that is read.
#[derive(Clone, Copy, Debug)]
struct Entry {
    channel: Channel,
    frame: usize,
    n_frames: usize,
}

/// The entry that the options choose: a frame or a channel, since headers rarely say which of both the axis is.
fn entry(fourth: Option<FourthAxis>, options: &ReadOptions) -> io::Result<Entry> {
    let one = Entry { channel: Channel::ONLY, frame: 0, n_frames: 1 };
    let (what, given) = match (options.frame, options.channel) {
        (None, Some(channel)) => ("channel", Some(channel)),
        (frame, _) => ("frame", frame),
    };
    let Some(FourthAxis { n, is_fastest }) = fourth else {
        return one_of(what, given, 1).map(|_| one);
    };
    if options.frame.is_some() && options.channel.is_some() {
        return Err(invalid("--frame and --channel for one axis, expected one of them"));
    }
    let index = one_of(what, given, n)?;
    Ok(match is_fastest {
        true => Entry { channel: Channel { index, of: n }, ..one },
        false => Entry { frame: index, n_frames: n, ..one },
    })
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
    entry: Entry,
) -> io::Result<Samples> {
    for _ in 0..header.line_skip {
        if reader.skip_until(b'\n')? == 0 {
            return Err(invalid(format!("fewer than the {} lines to skip", header.line_skip)));
        }
    }
    let start = reader.stream_position()?;
    let left = reader.get_ref().metadata()?.len().saturating_sub(start);
    let NrrdHeader { sample_type, big_endian, .. } = *header;
    let Entry { channel, frame, n_frames } = entry;
    let mut layout = SampleLayout { dims, sample_type, big_endian, channel, skip: 0 };
    let (n, one) = layout.size()?;
    let too_many =
        || invalid(format!("{n_frames} of {}, more than memory can hold", layout.describe()));
    let n_bytes = one.checked_mul(n_frames as u64).ok_or_else(too_many)?;
    match header.encoding {
        NrrdEncoding::Raw => {
            let skip = header.byte_skip.unwrap_or(left.saturating_sub(n_bytes));
            let found = left.saturating_sub(skip);
            if found != n_bytes {
                return Err(layout.wrong_length(found, n_bytes));
            }
            layout.skip_volumes(frame, 0)?;
            reader.seek(SeekFrom::Start(start + skip))?;
            stream::read(reader, found, Compression::None, &layout)
        }
        NrrdEncoding::Gzip => {
            let skip = match header.byte_skip {
                Some(skip) => skip,
                None => {
                    let skip = stream::gzip_bytes(reader)?.checked_sub(n_bytes);
                    reader.seek(SeekFrom::Start(start))?;
                    skip.ok_or_else(|| {
                        invalid(format!(
                            "the compressed data end early, expected {n_bytes} bytes for {}",
                            layout.describe()
                        ))
                    })?
                }
            };
            layout.skip_volumes(frame, skip)?;
            if frame + 1 < n_frames {
                return stream::read(reader, left, Compression::Gzip, &layout);
            }
            stream::read_gzip_to_end(reader, left, &layout)
        }
        NrrdEncoding::Text => {
            let skip = header.byte_skip.unwrap_or(0).min(left);
            reader.seek(SeekFrom::Start(start + skip))?;
            let each = n.saturating_mul(channel.of);
            let all = each.saturating_mul(n_frames);
            let what = layout.describe();
            let samples = text::read_samples(reader, left - skip, sample_type, all, &what)?;
            let samples = if n_frames > 1 { samples.part(frame * each, each) } else { samples };
            Ok(select_channel(samples, channel))
        }
    }
}
