//! Arrays of bits in VTK files: eight numbers in a byte, the first in its highest bit.

use std::io;

use super::data_error::invalid;
use super::layout::{Channel, SampleLayout};
use super::memory::try_filled_vec;
use super::samples::Samples;

/// The layout of the bytes that hold the bits of samples of the given layout.
///
/// # Errors
///
/// `InvalidData` if the samples exceed the address space.
pub(super) fn layout(of: &SampleLayout) -> io::Result<SampleLayout> {
    let n_bits = n_bits(of)?;
    Ok(SampleLayout { dims: [n_bits.div_ceil(8), 1, 1], channel: Channel::ONLY, ..*of })
}

/// The samples, 0 or 1, of bytes that were read with [`layout`].
///
/// # Errors
///
/// `OutOfMemory`.
pub(super) fn unpack(bytes: &Samples, of: &SampleLayout) -> io::Result<Samples> {
    let Samples::U8(bytes) = bytes else { return Err(invalid("bits that are not in bytes")) };
    let Channel { index, of: n_channels } = of.channel;
    let mut samples = try_filled_vec(n_bits(of)? / n_channels, 0u8)?;
    for (i, sample) in samples.iter_mut().enumerate() {
        let bit = i * n_channels + index;
        *sample = bytes[bit / 8] >> (7 - bit % 8) & 1;
    }
    Ok(Samples::U8(samples))
}

fn n_bits(of: &SampleLayout) -> io::Result<usize> {
    let all = of.size()?.0.checked_mul(of.channel.of);
    all.ok_or_else(|| invalid(format!("{} bits, more than memory can hold", of.describe())))
}
