//! Threads of the whole program, also where the system grants fewer than one for each processor (`ulimit -u`).

use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::available_parallelism;

use isospectrum::settings::{startable_threads, useful_threads};
use isospectrum::{Error, Result};

/// True if the threads are started already, as many as the system grants.
static IS_STARTED: AtomicBool = AtomicBool::new(false);

/// Starts the threads if the system does not grant one for each processor: rayon, which starts them when they are first used, panics.
///
/// # Errors
///
/// [`Error::Usage`] if threads end between the test and the start.
pub(super) fn start_granted() -> Result<()> {
    let processors = available_parallelism().map_or(1, usize::from);
    let granted = startable_threads(processors);
    if granted < processors {
        IS_STARTED.store(true, Ordering::Relaxed);
        start(processors, granted)?;
    }
    Ok(())
}

/// Starts as many threads as are requested, useful and granted.
///
/// # Errors
///
/// [`Error::Usage`] as [`start_granted`].
pub(super) fn start_requested(n: usize) -> Result<()> {
    if IS_STARTED.load(Ordering::Relaxed) {
        return Ok(());
    }
    let n = useful_threads(n);
    start(n, startable_threads(n))
}

fn start(wanted: usize, granted: usize) -> Result<()> {
    if granted < wanted {
        log::warn!("{granted} of {wanted} threads can be started, and {} used", granted.max(1));
    }
    let pool = rayon::ThreadPoolBuilder::new().num_threads(granted.max(1));
    let pool = if granted == 0 { pool.use_current_thread() } else { pool };
    pool.build_global().map_err(|error| Error::Usage(format!("{wanted} threads: {error}")))
}
