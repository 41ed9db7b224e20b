//! Allocation for samples, whose number comes from a file: an error instead of an abort if memory does not suffice.

use std::io;

/// A vector of `n` times `fill`.
///
/// # Errors
///
/// `OutOfMemory`.
pub(crate) fn try_filled_vec<T: Copy>(n: usize, fill: T) -> io::Result<Vec<T>> {
    let mut values = Vec::new();
    try_reserve(&mut values, n)?;
    values.resize(n, fill);
    Ok(values)
}

/// Reserves room for `n` more values.
///
/// # Errors
///
/// `OutOfMemory`.
pub(super) fn try_reserve<T>(values: &mut Vec<T>, n: usize) -> io::Result<()> {
    values.try_reserve_exact(n).map_err(|_| {
        io::Error::new(
            io::ErrorKind::OutOfMemory,
            format!("{} bytes of memory are not available", n.saturating_mul(size_of::<T>())),
        )
    })
}
