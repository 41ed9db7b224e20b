//! The binary header of a NIfTI file: 348 bytes of version 1, 540 of version 2, in either byte order.

use std::io::{self, Read};

use crate::volume::data_error::invalid;
use crate::volume::layout::SampleType;
use crate::volume::placement::{Placement, Space, Unit};

/// The header of a NIfTI file.
#[derive(Debug)]
pub(super) struct NiftiHeader {
    pub(super) dims: [usize; 3],
    pub(super) n_frames: usize,
    pub(super) n_channels: usize,
    /// Whether the channels of a sample are adjacent.
    pub(super) is_interleaved: bool,
    pub(super) sample_type: SampleType,
    pub(super) big_endian: bool,
    /// Whether the samples are in another file.
    pub(super) is_pair: bool,
    /// Bytes before the samples in their file.
    pub(super) offset: u64,
    pub(super) slope: f64,
    pub(super) intercept: f64,
    pub(super) placement: Placement,
}

/// Byte offsets of the fields of a version.
struct Offsets {
    magic: usize,
    dim: usize,
    datatype: usize,
    pixdim: usize,
    vox_offset: usize,
    slope: usize,
    units: usize,
    qform_code: usize,
    sform_code: usize,
    quatern: usize,
    srow: usize,
}

const VERSION_1: Offsets = Offsets {
    magic: 344,
    dim: 40,
    datatype: 70,
    pixdim: 76,
    vox_offset: 108,
    slope: 112,
    units: 123,
    qform_code: 252,
    sform_code: 254,
    quatern: 256,
    srow: 280,
};

const VERSION_2: Offsets = Offsets {
    magic: 4,
    dim: 16,
    datatype: 12,
    pixdim: 104,
    vox_offset: 168,
    slope: 176,
    units: 500,
    qform_code: 344,
    sform_code: 348,
    quatern: 352,
    srow: 400,
};

/// The bytes of a header, with the number types of its version.
struct NiftiFields {
    bytes: Vec<u8>,
    big_endian: bool,
    is_version_2: bool,
}

impl NiftiFields {
    fn array<const N: usize>(&self, at: usize) -> [u8; N] {
        let mut array = std::array::from_fn(|i| self.bytes.get(at + i).copied().unwrap_or(0));
        if self.big_endian {
            array.reverse();
        }
        array
    }

    fn i16(&self, at: usize) -> i64 {
        i16::from_le_bytes(self.array(at)).into()
    }

    fn i32(&self, at: usize) -> i64 {
        i32::from_le_bytes(self.array(at)).into()
    }

    /// A number that is 32 bits in version 1 and 64 in version 2, the `i`-th from `at` on.
    fn float(&self, at: usize, i: usize) -> f64 {
        if self.is_version_2 {
            f64::from_le_bytes(self.array(at + 8 * i))
        } else {
            f32::from_le_bytes(self.array(at + 4 * i)).into()
        }
    }

    /// A dimension: 16 bits in version 1, 64 in version 2.
    fn dim(&self, at: usize, i: usize) -> i64 {
        if self.is_version_2 {
            i64::from_le_bytes(self.array(at + 8 * i))
        } else {
            self.i16(at + 2 * i)
        }
    }
}

/// Reads a header.
///
/// # Errors
///
/// `InvalidData` if it is another file, ends early, or has unsupported samples.
pub(super) fn read(mut reader: impl Read) -> io::Result<NiftiHeader> {
    let mut bytes = Vec::new();
    reader.by_ref().take(540).read_to_end(&mut bytes).map_err(|e| match e.kind() {
        io::ErrorKind::InvalidInput | io::ErrorKind::UnexpectedEof => {
            invalid(format!("damaged compressed data: {e}"))
        }
        _ => e,
    })?;
    let size: [u8; 4] = bytes.get(..4).and_then(|b| b.try_into().ok()).unwrap_or_default();
    let (is_version_2, big_endian) = match (u32::from_le_bytes(size), u32::from_be_bytes(size)) {
        (348, _) => (false, false),
        (_, 348) => (false, true),
        (540, _) => (true, false),
        (_, 540) => (true, true),
        _ => return Err(invalid("not a NIfTI file: the size of its header is not 348 or 540")),
    };
    let at = if is_version_2 { VERSION_2 } else { VERSION_1 };
    let length = if is_version_2 { 540 } else { 348 };
    if bytes.len() < length {
        return Err(invalid(format!("{} bytes of header, expected {length}", bytes.len())));
    }
    let is_pair = match &bytes[at.magic..at.magic + 4] {
        b"n+1\0" if !is_version_2 => false,
        b"ni1\0" if !is_version_2 => true,
        b"n+2\0" if is_version_2 => false,
        b"ni2\0" if is_version_2 => true,
        _ => return Err(invalid("no NIfTI magic in the header (Analyze files are not supported)")),
    };
    parse(&NiftiFields { bytes, big_endian, is_version_2 }, &at, is_pair)
}

fn parse(fields: &NiftiFields, at: &Offsets, is_pair: bool) -> io::Result<NiftiHeader> {
    let n_axes = fields.dim(at.dim, 0);
    if !(3..=7).contains(&n_axes) {
        return Err(invalid(format!("{n_axes} dimensions, expected 3 to 7")));
    }
    let mut all = [1usize; 8];
    for (i, size) in all.iter_mut().enumerate().take(n_axes as usize + 1).skip(1) {
        // Some writers leave the number of frames 0.
        let found = fields.dim(at.dim, i);
        let found = if found == 0 && i > 3 { 1 } else { found };
        *size = usize::try_from(found).ok().filter(|&n| n > 0).ok_or_else(|| {
            invalid(format!("dimension {i} is {found}, expected a number above 0"))
        })?;
    }
    let code = fields.i16(at.datatype);
    let (sample_type, n_colours) = sample_type(code)?;
    let beyond = all[6].saturating_mul(all[7]);
    if (n_colours > 1 && all[5] > 1) || beyond > 1 {
        return Err(invalid(
            "samples with more than frames and channels, expected at most 5 dimensions",
        ));
    }
    let offset = if fields.is_version_2 {
        i64::from_le_bytes(fields.array(at.vox_offset)) as f64
    } else {
        fields.float(at.vox_offset, 0)
    };
    // Some writers leave the offset 0; the header precedes the samples in any case.
    let min_offset = match (is_pair, fields.is_version_2) {
        (true, _) => 0.0,
        (false, true) => 544.0,
        (false, false) => 352.0,
    };
    if offset.is_nan() || offset.abs() >= 1e15 {
        return Err(invalid(format!("samples at byte {offset}, expected an offset in the file")));
    }
    let width = if fields.is_version_2 { 8 } else { 4 };
    let (slope, intercept) = (fields.float(at.slope, 0), fields.float(at.slope + width, 0));
    let is_scaled = slope != 0.0 && slope.is_finite() && intercept.is_finite();
    Ok(NiftiHeader {
        dims: [all[1], all[2], all[3]],
        n_frames: all[4],
        n_channels: n_colours.max(all[5]),
        is_interleaved: n_colours > 1,
        sample_type,
        big_endian: fields.big_endian,
        is_pair,
        offset: offset.max(min_offset) as u64,
        slope: if is_scaled { slope } else { 1.0 },
        intercept: if is_scaled { intercept } else { 0.0 },
        placement: placement(fields, at),
    })
}

/// The number type of a data type code, and how many of them make a sample.
fn sample_type(code: i64) -> io::Result<(SampleType, usize)> {
    Ok(match code {
        2 => (SampleType::U8, 1),
        4 => (SampleType::I16, 1),
        8 => (SampleType::I32, 1),
        16 => (SampleType::F32, 1),
        64 => (SampleType::F64, 1),
        128 => (SampleType::U8, 3),
        256 => (SampleType::I8, 1),
        512 => (SampleType::U16, 1),
        768 => (SampleType::U32, 1),
        1024 => (SampleType::I64, 1),
        1280 => (SampleType::U64, 1),
        2304 => (SampleType::U8, 4),
        32 | 1792 | 2048 => return Err(invalid("complex samples, expected real numbers")),
        1536 => return Err(invalid("samples of 128 bits, expected at most 64")),
        _ => return Err(invalid(format!("unknown data type {code}"))),
    })
}

/// The sform if it is filled in, else the qform, else the spacing alone.
fn placement(fields: &NiftiFields, at: &Offsets) -> Placement {
    let code = |at: usize| if fields.is_version_2 { fields.i32(at) } else { fields.i16(at) };
    let units =
        if fields.is_version_2 { fields.i32(at.units) } else { i64::from(fields.bytes[at.units]) };
    let unit = match units & 7 {
        1 => Unit::M,
        2 => Unit::Mm,
        3 => Unit::Um,
        _ => Unit::Unknown,
    };
    let row = |i: usize, j: usize| fields.float(at.srow, 4 * i + j);
    let steps: [[f64; 3]; 3] = std::array::from_fn(|a| [row(0, a), row(1, a), row(2, a)]);
    // A form without a step along an axis was not filled in.
    let is_filled = steps.iter().all(|step| step.iter().any(|&x| x != 0.0));
    if code(at.sform_code) > 0 && !is_filled {
        log::warn!("an empty sform in the header: the qform or the spacing is used");
    }
    if code(at.sform_code) > 0 && is_filled {
        let placed = Placement::from_steps([row(0, 3), row(1, 3), row(2, 3)], steps);
        return Placement { unit, ..placed }.of_patient(Space::Ras);
    }
    let spacing = [1, 2, 3].map(|a| fields.float(at.pixdim, a).abs());
    let spacing = spacing.map(|s| if s > 0.0 { s } else { 1.0 });
    if code(at.qform_code) > 0 {
        let mut direction = rotation([0, 1, 2].map(|i| fields.float(at.quatern, i)));
        if fields.float(at.pixdim, 0) < 0.0 {
            direction[2] = direction[2].map(|x| -x);
        }
        let origin = [3, 4, 5].map(|i| fields.float(at.quatern, i));
        let placed = Placement { origin, spacing, direction, unit, ..Placement::IDENTITY };
        return placed.of_patient(Space::Ras);
    }
    Placement { spacing, unit, ..Placement::IDENTITY }
}

/// The columns of the rotation matrix of a unit quaternion; its real part is not stored.
fn rotation([b, c, d]: [f64; 3]) -> [[f64; 3]; 3] {
    let rest = 1.0 - (b * b + c * c + d * d);
    let (a, [b, c, d]) = if rest < 1e-7 {
        // A turn by 180 degrees, up to rounding.
        let length = (b * b + c * c + d * d).sqrt();
        (0.0, [b, c, d].map(|x| x / length))
    } else {
        (rest.sqrt(), [b, c, d])
    };
    [
        [a * a + b * b - c * c - d * d, 2.0 * (b * c + a * d), 2.0 * (b * d - a * c)],
        [2.0 * (b * c - a * d), a * a + c * c - b * b - d * d, 2.0 * (c * d + a * b)],
        [2.0 * (b * d + a * c), 2.0 * (c * d - a * b), a * a + d * d - b * b - c * c],
    ]
}
