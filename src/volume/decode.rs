//! Turns the bytes of a file into samples of their native type.
//!
//! Every reader ends here: it has found the type, the byte order and the number of samples, and
//! has checked that number against the length of the file. Samples are read straight into the
//! vector the volume keeps. Its memory is taken at once as far as the file vouches for it, so a volume of plain samples
//! needs its own size and a little more, never twice; beyond that, as with gzip, whose bytes may stand for a thousand
//! each or for none, it doubles as samples arrive. Types without a variant in [`Samples`] are widened on the way where that loses nothing:
//! float16 to float32, 64 bit integers to float64 (up to 2^53 in magnitude; beyond is an error).

use std::fmt;
use std::io::{self, Read};
use std::path::Path;

use bytemuck::Pod;
use half::f16;

use crate::error::Error;
use crate::volume::Samples;
use crate::volume::stream::Channel;

/// A number type a volume file may hold.
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

/// All types with the name that messages, flags and file names use.
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
    /// The type called `name` (`uint8`, `float32`, ..., in any case, or short: `u8`, `f32`).
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

/// The next `n` samples of `reader`; the file is known to hold the bytes of `n_earned` of them.
///
/// # Errors
///
/// `UnexpectedEof` if the data end early, `OutOfMemory`, `InvalidData` for a 64 bit integer that
/// float64 cannot hold, and what `reader` says.
pub(crate) fn read_samples(
    reader: &mut impl Read,
    sample_type: SampleType,
    big_endian: bool,
    n: usize,
    n_earned: usize,
) -> io::Result<Samples> {
    let n = Growth { n, n_earned };
    let swap = big_endian != cfg!(target_endian = "big");
    Ok(match sample_type {
        SampleType::U8 => Samples::U8(read_vec(reader, n, false, u8::swap_bytes)?),
        SampleType::I8 => Samples::I8(read_vec(reader, n, false, i8::swap_bytes)?),
        SampleType::U16 => Samples::U16(read_vec(reader, n, swap, u16::swap_bytes)?),
        SampleType::I16 => Samples::I16(read_vec(reader, n, swap, i16::swap_bytes)?),
        SampleType::U32 => Samples::U32(read_vec(reader, n, swap, u32::swap_bytes)?),
        SampleType::I32 => Samples::I32(read_vec(reader, n, swap, i32::swap_bytes)?),
        SampleType::F32 => Samples::F32(read_vec(reader, n, swap, |v: f32| {
            f32::from_bits(v.to_bits().swap_bytes())
        })?),
        SampleType::F64 => Samples::F64(read_vec(reader, n, swap, |v: f64| {
            f64::from_bits(v.to_bits().swap_bytes())
        })?),
        SampleType::F16 => Samples::F32(read_widened(reader, n, |bytes: [u8; 2]| {
            let bits =
                if big_endian { u16::from_be_bytes(bytes) } else { u16::from_le_bytes(bytes) };
            Ok(f16::from_bits(bits).to_f32())
        })?),
        SampleType::I64 => Samples::F64(read_widened(reader, n, |bytes| {
            let v = if big_endian { i64::from_be_bytes(bytes) } else { i64::from_le_bytes(bytes) };
            exact_f64(v.into())
        })?),
        SampleType::U64 => Samples::F64(read_widened(reader, n, |bytes| {
            let v = if big_endian { u64::from_be_bytes(bytes) } else { u64::from_le_bytes(bytes) };
            exact_f64(v.into())
        })?),
    })
}

/// What went wrong while reading samples of `path`: of the system, or of what the file holds.
pub(crate) fn read_error(path: &Path, e: io::Error) -> Error {
    match e.kind() {
        io::ErrorKind::InvalidData | io::ErrorKind::OutOfMemory => {
            Error::input(format!("{}: {e}", path.display()))
        }
        _ => Error::io(path, e),
    }
}

/// An error about what a file holds.
pub(crate) fn invalid(message: impl Into<String>) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, message.into())
}

/// The samples times `slope` plus `intercept`: what is stored becomes what was measured. Integers stay such where all
/// results are some of at most 32 bits; else float32 holds what came from at most 16 bits and from float32, float64 the rest.
pub(crate) fn rescaled(samples: Samples, slope: f64, intercept: f64) -> Samples {
    if (slope, intercept) == (1.0, 0.0) {
        return samples;
    }
    let of = |v: f64| v * slope + intercept;
    if samples.is_integer()
        && slope.fract() == 0.0
        && intercept.fract() == 0.0
        && let Some(integers) = whole(&samples, of)
    {
        return integers;
    }
    let values = (0..samples.len()).map(|i| of(samples.get(i)));
    if samples.is_wide() {
        Samples::F64(values.collect())
    } else {
        Samples::F32(values.map(|v| v as f32).collect())
    }
}

/// Integers after a change that leaves them such, if 16 or 32 bits hold all of them.
fn whole(samples: &Samples, of: impl Fn(f64) -> f64) -> Option<Samples> {
    let ends = |(low, high): (f64, f64), i| {
        let v = of(samples.get(i));
        (low.min(v), high.max(v))
    };
    let (low, high) = (0..samples.len()).fold((f64::INFINITY, f64::NEG_INFINITY), ends);
    let values = (0..samples.len()).map(|i| of(samples.get(i)));
    if f64::from(i16::MIN) <= low && high <= f64::from(i16::MAX) {
        return Some(Samples::I16(values.map(|v| v as i16).collect()));
    }
    let fits = f64::from(i32::MIN) <= low && high <= f64::from(i32::MAX);
    fits.then(|| Samples::I32(values.map(|v| v as i32).collect()))
}

/// One number of each sample, of those that lie beside each other.
pub(crate) fn picked(samples: Samples, channel: Channel) -> Samples {
    if channel == Channel::ONLY {
        return samples;
    }
    crate::volume::with_samples!(samples, s => {
        s.chunks_exact(channel.of).map(|sample| sample[channel.index]).collect::<Vec<_>>().into()
    })
}

/// The samples of a grid whose axis `order[a]` is axis a of the one they are in, and its dimensions.
pub(crate) fn permuted(
    samples: Samples,
    dims: [usize; 3],
    order: [usize; 3],
) -> io::Result<(Samples, [usize; 3])> {
    if order == [0, 1, 2] || samples.is_empty() {
        return Ok((samples, dims));
    }
    let mut new_dims = [0; 3];
    (0..3).for_each(|a| new_dims[order[a]] = dims[a]);
    let stride = [1, new_dims[0], new_dims[0] * new_dims[1]];
    let moved = crate::volume::with_samples!(samples, s => {
        let mut moved = reserve(s.len(), s[0])?;
        for (i, &v) in s.iter().enumerate() {
            let at = [i % dims[0], i / dims[0] % dims[1], i / (dims[0] * dims[1])];
            moved[(0..3).map(|a| at[a] * stride[order[a]]).sum::<usize>()] = v;
        }
        moved.into()
    });
    Ok((moved, new_dims))
}

/// A vector of `n` times `fill`, or an error where memory does not suffice.
pub(crate) fn reserve<T: Copy>(n: usize, fill: T) -> io::Result<Vec<T>> {
    let mut values = Vec::new();
    take_memory(&mut values, n)?;
    values.resize(n, fill);
    Ok(values)
}

/// How a vector grows to `n` values: at once to `n_earned`, then by doubling, each time only when all it holds has arrived.
#[derive(Clone, Copy, Debug)]
struct Growth {
    n: usize,
    n_earned: usize,
}

impl Growth {
    /// Values read at a time: so many are taken before any arrived.
    const CHUNK: usize = 1 << 14;

    /// Reads all values; `read` fills the next ones.
    fn fill<T: Copy>(
        self,
        zero: T,
        mut read: impl FnMut(&mut [T]) -> io::Result<()>,
    ) -> io::Result<Vec<T>> {
        let mut values = Vec::new();
        while values.len() < self.n {
            let so_far = values.len();
            if so_far == values.capacity() {
                let capacity = self.n.min((2 * so_far).max(self.n_earned).max(Self::CHUNK));
                take_memory(&mut values, capacity - so_far)?;
            }
            let n = values.capacity().min(self.n) - so_far;
            values.resize(so_far + n.min(Self::CHUNK), zero);
            read(&mut values[so_far..])?;
        }
        Ok(values)
    }
}

/// Room for `n` more values, or an error where memory does not suffice.
fn take_memory<T>(values: &mut Vec<T>, n: usize) -> io::Result<()> {
    values.try_reserve_exact(n).map_err(|_| {
        io::Error::new(
            io::ErrorKind::OutOfMemory,
            format!("{} bytes of memory are not available", n.saturating_mul(size_of::<T>())),
        )
    })
}

/// Values read in place, each swapped where the file has the other byte order.
fn read_vec<T: Pod>(
    reader: &mut impl Read,
    n: Growth,
    swap: bool,
    swapped: impl Fn(T) -> T,
) -> io::Result<Vec<T>> {
    n.fill(T::zeroed(), |part| {
        reader.read_exact(bytemuck::cast_slice_mut(part))?;
        if swap {
            part.iter_mut().for_each(|v| *v = swapped(*v));
        }
        Ok(())
    })
}

/// Values of `N` bytes each, converted one by one.
fn read_widened<T: Copy + Default, const N: usize>(
    reader: &mut impl Read,
    n: Growth,
    convert: impl Fn([u8; N]) -> io::Result<T>,
) -> io::Result<Vec<T>> {
    let mut bytes = vec![[0u8; N]; Growth::CHUNK.min(n.n)];
    n.fill(T::default(), |part| {
        let bytes = &mut bytes[..part.len()];
        reader.read_exact(bytes.as_flattened_mut())?;
        for (v, &b) in part.iter_mut().zip(bytes.iter()) {
            *v = convert(b)?;
        }
        Ok(())
    })
}

/// A 64 bit integer as f64, if f64 holds it exactly.
pub(crate) fn exact_f64(v: i128) -> io::Result<f64> {
    if v.unsigned_abs() <= 1 << 53 {
        Ok(v as f64)
    } else {
        Err(io::Error::new(
            io::ErrorKind::InvalidData,
            format!("sample {v}, expected integers of at most 2^53, which float64 holds exactly"),
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn halves_widen_to_the_floats_they_are() {
        let known = [
            (0x0000, 0.0),
            (0x3c00, 1.0),
            (0xc000, -2.0),
            (0x7bff, 65504.0),
            (0x0400, 2f32.powi(-14)),
            (0x0001, 2f32.powi(-24)),
            (0x8001, -(2f32.powi(-24))),
            (0x3555, 0.333_251_95),
            (0x7c00, f32::INFINITY),
        ];
        for big_endian in [false, true] {
            let file: Vec<u8> = known
                .iter()
                .flat_map(
                    |&(bits, _): &(u16, f32)| {
                        if big_endian { bits.to_be_bytes() } else { bits.to_le_bytes() }
                    },
                )
                .collect();
            let n = known.len();
            let read = read_samples(&mut &file[..], SampleType::F16, big_endian, n, n);
            let values = known.map(|(_, value)| value);
            assert_eq!(read.expect("all are there"), Samples::F32(values.to_vec()));
        }
    }

    #[test]
    fn memory_is_taken_for_what_arrives_and_at_once_for_what_is_earned() {
        let capacity = |n_there: usize, n: usize, n_earned: usize| {
            let mut there = vec![7u8; n_there];
            there.extend([8; 3]);
            let mut largest = 0;
            let mut rest = &there[..n_there];
            let growth = Growth { n, n_earned };
            let read = growth.fill(0u8, |part| {
                largest += part.len();
                rest.read_exact(part)
            });
            (read.ok().map(|values| (values.len(), values.capacity())), largest)
        };
        assert_eq!(capacity(100_000, 100_000, 100_000), (Some((100_000, 100_000)), 100_000));
        assert_eq!(capacity(100_000, 100_000, 0), (Some((100_000, 100_000)), 100_000));
        assert_eq!(capacity(5, 5, 0), (Some((5, 5)), 5));
        // It ends early: no more than a chunk beyond what was there was asked for.
        let (none, asked) = capacity(100_000, 1 << 40, 10);
        assert_eq!((none, asked <= 100_000 + Growth::CHUNK), (None, true));
    }

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
