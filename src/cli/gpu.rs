//! Opens GPUs where the system leaves a driver enough address space.
//!
//! A driver of a software adapter crashes or aborts where its allocations fail (Mesa's llvmpipe, at `ulimit -v` 280000 to 800000): no
//! process can catch that.

use isospectrum::render::Gpu;
use isospectrum::{Error, Result};

use super::{driver_warning, machine, report};

/// Memory that a driver is left at least, bytes: llvmpipe crashes with 0.8 GB of address space, and works with 1.2 GB.
const DRIVER_BYTES: f64 = 1.5e9;

/// Opens the adapter whose name contains `adapter`, or the fastest.
///
/// # Errors
///
/// [`Error::Gpu`] as [`Gpu::new`], and as [`check_room`].
pub(super) fn open(adapter: Option<&str>) -> Result<Gpu> {
    check_room()?;
    driver_warning::hidden(|| Gpu::new(adapter))
}

/// # Errors
///
/// [`Error::Gpu`] if the limits of the process leave a driver too little memory.
pub(super) fn check_room() -> Result<()> {
    let Some(allowed) = machine::allowed_by_process() else { return Ok(()) };
    if allowed.bytes >= DRIVER_BYTES {
        return Ok(());
    }
    let [needed, left] = [DRIVER_BYTES, allowed.bytes].map(|bytes| report::bytes(bytes as u64));
    Err(Error::Gpu(format!(
        "up to {needed} of memory expected for a driver, {} leaves {left}",
        allowed.by
    )))
}
