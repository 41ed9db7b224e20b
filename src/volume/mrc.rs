//! MRC and CCP4 maps (`.mrc`, `.map`, `.ccp4`, `.rec`), plain or gzip: a header of 1024 bytes, then the samples.
//!
//! Source: "MRC2014: Extensions to the MRC format header" (Cheng et al. 2015), ccpem.ac.uk/mrc_format. Axes are put into the
//! order x, y, z of the cell, from the order in `MAPC`, `MAPR`, `MAPS`; the cell's angles shear the world, which is in
//! angstrom. The first sample is at the origin of the header (words 50 to 52), or if that is 0, at the start (words 5 to 7)
//! in steps of the cell. Bytes (mode 0) have a sign, except in files of IMOD without the flag for it.

use std::fs::File;
use std::io::{self, BufReader, Read};
use std::path::Path;

use flate2::bufread::MultiGzDecoder;

use super::data_error::{invalid, read_error};
use super::decode::permute_axes;
use super::layout::{Channel, Compression, SampleLayout, SampleType};
use super::placement::{Placement, Unit};
use super::read_options::ReadOptions;
use super::samples::SampleGrid;
use super::select::one_of;
use super::stream;
use crate::error::{Error, Result};

/// Bytes of the header.
const HEADER_BYTES: usize = 1024;

/// Word 39 of files of IMOD, and its flag in word 40 for bytes with a sign (bio3d.colorado.edu/imod/doc/mrc_format.txt).
const IMOD_STAMP: i32 = 1_146_047_817;
const IMOD_SIGNED_BYTES: i32 = 1;

/// Reads a map, which is open.
///
/// # Errors
///
/// [`Error::Io`] if it cannot be read; [`Error::Input`] for other files, damaged ones, complex samples, and if a frame of a
/// stack of volumes must be chosen.
pub(crate) fn read(
    path: &Path,
    file: File,
    length: u64,
    options: &ReadOptions,
) -> Result<SampleGrid> {
    let compression = Compression::of_name(path);
    let header = if compression == Compression::Gzip {
        read_header(MultiGzDecoder::new(BufReader::new(file)))
    } else {
        read_header(file)
    };
    let header = header.map_err(|e| read_error(path, e))?;
    let file = File::open(path).map_err(|e| Error::io(path, e))?;
    let layout = header.layout(options).map_err(|e| read_error(path, e))?;
    let samples = stream::read(&mut BufReader::new(file), length, compression, &layout);
    let samples = samples.and_then(|samples| permute_axes(samples, layout.dims, header.order));
    let (samples, dims) = samples.map_err(|e| read_error(path, e))?;
    Ok(SampleGrid { dims, samples, placement: header.placement })
}

/// The header of a map.
struct MrcHeader {
    /// Samples along columns, rows and sections; sections of one volume.
    dims: [usize; 3],
    n_frames: usize,
    sample_type: SampleType,
    big_endian: bool,
    /// Bytes before the samples.
    offset: u64,
    /// Axes of the cell along columns, rows and sections.
    order: [usize; 3],
    placement: Placement,
}

impl MrcHeader {
    fn layout(&self, options: &ReadOptions) -> io::Result<SampleLayout> {
        let frame = one_of("frame", options.frame, self.n_frames)?;
        let mut layout = SampleLayout {
            dims: self.dims,
            sample_type: self.sample_type,
            big_endian: self.big_endian,
            channel: Channel::ONLY,
            skip: 0,
        };
        layout.skip_volumes(frame, self.offset)?;
        Ok(layout)
    }
}

/// The 4-byte words of the header, numbered from 1 as in its definition.
struct Words {
    bytes: [u8; HEADER_BYTES],
    big_endian: bool,
}

impl Words {
    fn word(&self, n: usize) -> [u8; 4] {
        let at = 4 * (n - 1);
        let mut word = std::array::from_fn(|i| self.bytes[at + i]);
        if self.big_endian {
            word.reverse();
        }
        word
    }

    fn int(&self, n: usize) -> i32 {
        i32::from_le_bytes(self.word(n))
    }

    fn three(&self, n: usize) -> [f64; 3] {
        [n, n + 1, n + 2].map(|n| f32::from_le_bytes(self.word(n)).into())
    }
}

fn read_header(mut reader: impl Read) -> io::Result<MrcHeader> {
    let mut bytes = [0; HEADER_BYTES];
    reader.read_exact(&mut bytes).map_err(|e| match e.kind() {
        io::ErrorKind::UnexpectedEof => {
            invalid(format!("not a map: fewer than {HEADER_BYTES} bytes"))
        }
        io::ErrorKind::InvalidInput => invalid(format!("damaged compressed data: {e}")),
        _ => e,
    })?;
    let is_order = |words: &Words| {
        let mut axes = [17, 18, 19].map(|n| words.int(n));
        axes.sort_unstable();
        let modes = [0, 1, 2, 3, 4, 6, 12, 101];
        (axes == [1, 2, 3] || axes == [0, 0, 0]) && modes.contains(&words.int(4))
    };
    // The machine stamp is often wrong; the axes and the mode are small numbers in one byte order only.
    let orders = [false, true].map(|big_endian| Words { bytes, big_endian });
    let words = orders
        .into_iter()
        .find(is_order)
        .ok_or_else(|| invalid("not an MRC or CCP4 map: unknown axis order or mode"))?;
    parse(&words)
}

fn parse(words: &Words) -> io::Result<MrcHeader> {
    let mut dims = [0; 3];
    for (n, word) in dims.iter_mut().zip(1..) {
        let found = words.int(word);
        *n = usize::try_from(found)
            .map_err(|_| invalid(format!("{found} samples along an axis")))?;
    }
    let sample_type = match words.int(4) {
        0 if is_unsigned(words) => SampleType::U8,
        0 => SampleType::I8,
        1 => SampleType::I16,
        2 => SampleType::F32,
        6 => SampleType::U16,
        12 => SampleType::F16,
        mode @ (3 | 4) => {
            return Err(invalid(format!("mode {mode}, complex samples, expected real ones")));
        }
        mode => return Err(invalid(format!("mode {mode}, expected 0, 1, 2, 6 or 12"))),
    };
    let extended = words.int(24);
    let extended = u64::try_from(extended)
        .map_err(|_| invalid(format!("an extended header of {extended} bytes")))?;
    let order = match [17, 18, 19].map(|n| words.int(n)) {
        [0, 0, 0] => [0, 1, 2],
        axes => axes.map(|axis| axis as usize - 1),
    };
    // A space group above 400 marks a stack of volumes; word 10 is the number of sections of each.
    let sections = usize::try_from(words.int(10)).unwrap_or(0);
    let is_stack = (401..=630).contains(&words.int(23)) && sections > 0;
    let n_frames = if is_stack { dims[2] / sections } else { 1 };
    if is_stack {
        dims[2] = sections;
    }
    Ok(MrcHeader {
        dims,
        n_frames,
        sample_type,
        big_endian: words.big_endian,
        offset: HEADER_BYTES as u64 + extended,
        order,
        placement: placement(words, dims, order)?,
    })
}

/// Whether samples of mode 0 have no sign: in files of IMOD unless a flag says otherwise, and where the header has values that
/// bytes with a sign cannot have (ITK).
fn is_unsigned(words: &Words) -> bool {
    if words.int(39) == IMOD_STAMP {
        return words.int(40) & IMOD_SIGNED_BYTES == 0;
    }
    let [low, high, _] = words.three(20);
    0.0 <= low && low <= high && f64::from(i8::MAX) < high && high <= f64::from(u8::MAX)
}

/// The placement of the samples in the axes of the cell.
fn placement(words: &Words, dims: [usize; 3], order: [usize; 3]) -> io::Result<Placement> {
    let (lengths, angles) = (words.three(11), words.three(14));
    let mut steps = cell_vectors(angles)
        .ok_or_else(|| invalid(format!("cell angles {angles:?}, which no cell has")))?;
    for a in 0..3 {
        // Without a number of intervals along the cell there are as many as samples.
        let along = order.iter().position(|&axis| axis == a).map_or(0, |i| dims[i]);
        let n = match words.int(8 + a) {
            n if n > 0 => f64::from(n),
            _ => along as f64,
        };
        let step = if lengths[a] > 0.0 { lengths[a] / n } else { 1.0 };
        steps[a] = steps[a].map(|x| x * step);
    }
    let mut origin = words.three(50);
    if origin == [0.0; 3] {
        let mut start = [0.0; 3];
        (0..3).for_each(|i| start[order[i]] = f64::from(words.int(5 + i)));
        origin = std::array::from_fn(|i| (0..3).map(|a| steps[a][i] * start[a]).sum());
    }
    Ok(Placement { unit: Unit::Angstrom, ..Placement::from_steps(origin, steps) })
}

/// Unit vectors along the edges of a cell: the first along x, the second in the plane of x and y. `None` for impossible
/// angles.
fn cell_vectors(angles: [f64; 3]) -> Option<[[f64; 3]; 3]> {
    let angles = if angles == [0.0; 3] { [90.0; 3] } else { angles };
    // Right angles exactly.
    let cosine = |angle: f64| if angle == 90.0 { 0.0 } else { angle.to_radians().cos() };
    let [alpha, beta, gamma] = angles.map(cosine);
    let sine = (1.0 - gamma * gamma).sqrt();
    let across = (alpha - beta * gamma) / sine;
    let up = (1.0 - beta * beta - across * across).sqrt();
    let vectors = [[1.0, 0.0, 0.0], [gamma, sine, 0.0], [beta, across, up]];
    vectors.as_flattened().iter().all(|x| x.is_finite()).then_some(vectors)
}
