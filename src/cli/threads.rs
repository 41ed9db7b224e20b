//! Threads of the whole program, also where the system grants fewer than one for each processor (`ulimit -u`).

use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::available_parallelism;

use isospectrum::settings::{startable_threads, useful_threads};
use isospectrum::{Error, Result};

use super::machine;

/// Address space that a thread reserves, bytes: the heap that the C library gives each thread, and its stack.
const THREAD_BYTES: f64 = 66.0 * 1024.0 * 1024.0;

/// Most of the address space that threads may reserve.
const MAX_RESERVED_SHARE: f64 = 0.5;

/// True if the threads are started already, as many as the system grants.
static IS_STARTED: AtomicBool = AtomicBool::new(false);

/// Starts the threads if the system does not grant one for each processor: rayon, which starts them when they are first used, panics.
/// Where address space is limited (`ulimit -v`), they take their heaps at once, so that a forecast is compared with what is left.
///
/// # Errors
///
/// [`Error::Usage`] if threads end between the test and the start.
pub(super) fn start_granted() -> Result<()> {
    let processors = available_parallelism().map_or(1, usize::from);
    let Some(affordable) = affordable_threads() else {
        let granted = startable_threads(processors);
        if granted < processors {
            IS_STARTED.store(true, Ordering::Relaxed);
            start(processors, granted)?;
        }
        return Ok(());
    };
    IS_STARTED.store(true, Ordering::Relaxed);
    let wanted = affordable.min(processors);
    log::debug!("address space for {wanted} of {processors} threads");
    if wanted < 2 {
        return start(0, 0);
    }
    start(wanted, startable_threads(wanted))?;
    rayon::broadcast(|_| std::hint::black_box(Vec::<u8>::with_capacity(1)));
    Ok(())
}

/// Returns how many threads the limit of address space leaves room for; none without one.
fn affordable_threads() -> Option<usize> {
    machine::address_space().map(|left| (MAX_RESERVED_SHARE * left / THREAD_BYTES) as usize)
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
