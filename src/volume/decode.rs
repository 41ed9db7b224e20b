//! Converts the bytes of a file to samples of their native type.
//!
//! Every reader ends here: it has found the type, the byte order and the number of samples, and
//! has checked that number against the length of the file. Samples are read straight into the
//! vector that the volume keeps. As much memory is allocated at once as the file has bytes for, so a volume of uncompressed
//! samples needs little more than its own size. Beyond that, as for gzip, the vector doubles while samples are read.
//! Types without a variant in [`Samples`] are widened without loss:
//! float16 to float32, 64 bit integers to float64 (up to 2^53 in magnitude; beyond is an error).

use std::io::{self, Read};

use bytemuck::Pod;
use half::f16;

use super::data_error::invalid;
use super::layout::{Channel, SampleType};
use super::memory::{try_filled_vec, try_reserve};
use super::samples::{Samples, with_samples};

/// Reads the next `n` samples; the file has the bytes of at least `n_backed` of them.
///
/// # Errors
///
/// `UnexpectedEof` if the data end early, `OutOfMemory`, `InvalidData` for a 64 bit integer that
/// float64 cannot hold, and errors of `reader`.
pub(crate) fn read_samples(
    reader: &mut dyn Read,
    sample_type: SampleType,
    big_endian: bool,
    n: usize,
    n_backed: usize,
) -> io::Result<Samples> {
    let n = Growth { n, n_backed };
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

/// The samples times `slope` plus `intercept`: from stored to measured values. Integers stay integers if all results are
/// integers of at most 32 bits. Otherwise samples of at most 16 bits and float32 become float32, all others float64.
pub(crate) fn rescaled(samples: Samples, slope: f64, intercept: f64) -> Samples {
    if (slope, intercept) == (1.0, 0.0) {
        return samples;
    }
    let rescale = |v: f64| v * slope + intercept;
    if samples.is_integer()
        && slope.fract() == 0.0
        && intercept.fract() == 0.0
        && let Some(integers) = integers(&samples, rescale)
    {
        return integers;
    }
    let values = (0..samples.len()).map(|i| rescale(samples.get(i)));
    if samples.is_wide() {
        Samples::F64(values.collect())
    } else {
        Samples::F32(values.map(|v| v as f32).collect())
    }
}

/// The mapped samples as integers, if 16 or 32 bits hold all of them; `of` maps integers to integers.
fn integers(samples: &Samples, of: impl Fn(f64) -> f64) -> Option<Samples> {
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

/// One number of each sample; the numbers of a sample are adjacent.
pub(crate) fn select_channel(samples: Samples, channel: Channel) -> Samples {
    if channel == Channel::ONLY {
        return samples;
    }
    with_samples!(samples, s => {
        s.chunks_exact(channel.of).map(|sample| sample[channel.index]).collect::<Vec<_>>().into()
    })
}

/// Reorders the axes: axis a of the given samples becomes axis `order[a]`. Returns the new dimensions too.
pub(crate) fn permute_axes(
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
    let moved = with_samples!(samples, s => {
        let mut moved = try_filled_vec(s.len(), s[0])?;
        for (i, &v) in s.iter().enumerate() {
            let at = [i % dims[0], i / dims[0] % dims[1], i / (dims[0] * dims[1])];
            moved[(0..3).map(|a| at[a] * stride[order[a]]).sum::<usize>()] = v;
        }
        moved.into()
    });
    Ok((moved, new_dims))
}

/// How a vector grows to `n` values: at once to `n_backed`, then by doubling, each time only when it is full.
#[derive(Clone, Copy, Debug)]
struct Growth {
    n: usize,
    n_backed: usize,
}

impl Growth {
    /// Values per read: the least allocation.
    const CHUNK: usize = 1 << 14;

    /// Reads all values; `read` fills a slice with the next ones.
    fn fill<T: Copy>(
        self,
        zero: T,
        mut read: impl FnMut(&mut [T]) -> io::Result<()>,
    ) -> io::Result<Vec<T>> {
        let mut values = Vec::new();
        while values.len() < self.n {
            let so_far = values.len();
            if so_far == values.capacity() {
                let capacity = self.n.min((2 * so_far).max(self.n_backed).max(Self::CHUNK));
                try_reserve(&mut values, capacity - so_far)?;
            }
            let n = values.capacity().min(self.n) - so_far;
            values.resize(so_far + n.min(Self::CHUNK), zero);
            read(&mut values[so_far..])?;
        }
        Ok(values)
    }
}

/// Reads values in place, and swaps their bytes if the file has the other byte order.
fn read_vec<T: Pod>(
    reader: &mut dyn Read,
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

/// Reads values of `N` bytes each and converts them one by one.
fn read_widened<T: Copy + Default, const N: usize>(
    reader: &mut dyn Read,
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

/// A 64 bit integer as f64, if f64 represents it exactly.
pub(crate) fn exact_f64(v: i128) -> io::Result<f64> {
    if v.unsigned_abs() <= 1 << 53 {
        Ok(v as f64)
    } else {
        Err(invalid(format!(
            "sample {v}, expected integers of at most 2^53, which float64 holds exactly"
        )))
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
    fn memory_grows_with_the_data_beyond_what_the_file_length_backs() {
        let capacity = |n_there: usize, n: usize, n_backed: usize| {
            let mut there = vec![7u8; n_there];
            there.extend([8; 3]);
            let mut largest = 0;
            let mut rest = &there[..n_there];
            let growth = Growth { n, n_backed };
            let read = growth.fill(0u8, |part| {
                largest += part.len();
                rest.read_exact(part)
            });
            (read.ok().map(|values| (values.len(), values.capacity())), largest)
        };
        assert_eq!(capacity(100_000, 100_000, 100_000), (Some((100_000, 100_000)), 100_000));
        assert_eq!(capacity(100_000, 100_000, 0), (Some((100_000, 100_000)), 100_000));
        assert_eq!(capacity(5, 5, 0), (Some((5, 5)), 5));
        // The data end early: at most a chunk beyond them was requested.
        let (none, largest) = capacity(100_000, 1 << 40, 10);
        assert_eq!((none, largest <= 100_000 + Growth::CHUNK), (None, true));
    }
}
