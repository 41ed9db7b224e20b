//! The layout of samples in a file: number type, byte order, channel, compression.

use std::fmt;
use std::io;
use std::path::Path;

use super::data_error::invalid;

/// A number type of volume files.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum SampleType {
    U8,
    I8,
    U16,
    I16,
    U32,
    I32,
    U64,
    I64,
    F16,
    F32,
    F64,
}

/// All types with their names in messages, flags and file names.
const NAMES: [(&str, SampleType); 11] = [
    ("uint8", SampleType::U8),
    ("int8", SampleType::I8),
    ("uint16", SampleType::U16),
    ("int16", SampleType::I16),
    ("uint32", SampleType::U32),
    ("int32", SampleType::I32),
    ("uint64", SampleType::U64),
    ("int64", SampleType::I64),
    ("float16", SampleType::F16),
    ("float32", SampleType::F32),
    ("float64", SampleType::F64),
];

impl SampleType {
    /// The type of a name: `uint8`, `float32`, ..., in any case, or short: `u8`, `f32`.
    pub(crate) fn from_name(name: &str) -> Option<Self> {
        let name = name.to_ascii_lowercase();
        let short = |long: &str| {
            let digits = long.trim_start_matches(|c: char| c.is_ascii_alphabetic());
            format!("{}{digits}", &long[..1])
        };
        NAMES.iter().find(|(long, _)| name == *long || name == short(long)).map(|&(_, t)| t)
    }

    /// The names of all types, for messages.
    pub(crate) fn list() -> String {
        NAMES.map(|(name, _)| name).join(", ")
    }

    /// Bytes of one sample in the file.
    pub(crate) fn n_bytes(self) -> usize {
        match self {
            SampleType::U8 | SampleType::I8 => 1,
            SampleType::U16 | SampleType::I16 | SampleType::F16 => 2,
            SampleType::U32 | SampleType::I32 | SampleType::F32 => 4,
            SampleType::U64 | SampleType::I64 | SampleType::F64 => 8,
        }
    }
}

impl fmt::Display for SampleType {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = NAMES.iter().find(|(_, t)| t == self).map_or("unknown", |&(name, _)| name);
        f.write_str(name)
    }
}

/// Number of samples and bytes of `dims` samples of a type; `None` beyond the address space.
pub(crate) fn size_of_grid(dims: [usize; 3], sample_type: SampleType) -> Option<(usize, usize)> {
    let n = dims.iter().try_fold(1usize, |n, &d| n.checked_mul(d))?;
    // No vector may be larger than isize::MAX bytes.
    let bytes = n.checked_mul(sample_type.n_bytes()).filter(|&b| isize::try_from(b).is_ok())?;
    Some((n, bytes))
}

/// How bytes are compressed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Compression {
    None,
    Gzip,
    Zlib,
}

impl Compression {
    /// Gzip if the file name ends in `.gz`, in any case.
    pub(crate) fn of_name(path: &Path) -> Compression {
        let is_gzip = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("gz"));
        if is_gzip { Compression::Gzip } else { Compression::None }
    }
}

/// One of the `of` numbers of each sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Channel {
    pub(crate) index: usize,
    pub(crate) of: usize,
}

impl Channel {
    /// The channel of samples of one number.
    pub(crate) const ONLY: Channel = Channel { index: 0, of: 1 };
}

/// The layout of samples in a stream, x fastest.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SampleLayout {
    pub(crate) dims: [usize; 3],
    pub(crate) sample_type: SampleType,
    pub(crate) big_endian: bool,
    /// Which number of each sample is read; the numbers of a sample are adjacent.
    pub(crate) channel: Channel,
    /// Bytes before the samples, after decompression.
    pub(crate) skip: u64,
}

impl SampleLayout {
    /// The samples for messages: `3 x 64x64x10 uint8`.
    pub(crate) fn describe(&self) -> String {
        let [x, y, z] = self.dims;
        let times = if self.channel.of > 1 { format!("{} x ", self.channel.of) } else { "".into() };
        format!("{times}{x}x{y}x{z} {}", self.sample_type)
    }

    /// The number of samples, and the bytes up to the end of them.
    ///
    /// # Errors
    ///
    /// `InvalidData` if the samples exceed the address space.
    pub(crate) fn size(&self) -> io::Result<(usize, u64)> {
        let size = size_of_grid(self.dims, self.sample_type).and_then(|(n, bytes)| {
            let all = (bytes as u64).checked_mul(self.channel.of as u64)?;
            Some((n, all.checked_add(self.skip)?))
        });
        let too_many =
            || invalid(format!("{} samples, more than memory can hold", self.describe()));
        size.ok_or_else(too_many)
    }

    /// Skips `n` volumes of this layout after `offset` bytes.
    ///
    /// # Errors
    ///
    /// `InvalidData` if that is beyond the end of any file.
    pub(super) fn skip_volumes(&mut self, n: usize, offset: u64) -> io::Result<()> {
        let before = self.size()?.1.checked_mul(n as u64);
        self.skip = before.and_then(|bytes| bytes.checked_add(offset)).ok_or_else(|| {
            invalid(format!("volume {n} of {}, more than a file can hold", self.describe()))
        })?;
        Ok(())
    }

    /// The error for samples of `found` bytes.
    pub(super) fn wrong_length(&self, found: u64, expected: u64) -> io::Error {
        invalid(format!("{found} bytes of samples, expected {expected} for {}", self.describe()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_type_is_found_by_its_long_and_short_name() {
        for (name, sample_type) in NAMES {
            assert_eq!(SampleType::from_name(name), Some(sample_type));
            assert_eq!(sample_type.to_string(), name);
        }
        assert_eq!(SampleType::from_name("u8"), Some(SampleType::U8));
        assert_eq!(SampleType::from_name("F32"), Some(SampleType::F32));
        assert_eq!(SampleType::from_name("float"), None);
    }

    #[test]
    fn the_size_of_a_grid_does_not_overflow() {
        assert_eq!(size_of_grid([2, 3, 4], SampleType::F64), Some((24, 192)));
        assert_eq!(size_of_grid([1 << 21, 1 << 21, 1 << 21], SampleType::F64), None);
        assert_eq!(size_of_grid([usize::MAX, 2, 2], SampleType::U8), None);
    }
}
