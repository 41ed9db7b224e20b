//! Threads of the library: as many as the system lets this process start, or the calling one.

use std::cell::RefCell;
use std::sync::OnceLock;

use isospectrum::settings::{startable_threads, useful_threads};
use isospectrum::{Error, Result};
use rayon::{ThreadPool, ThreadPoolBuilder};

thread_local! {
    /// The pool of this thread alone. It stays, because a thread cannot leave a pool.
    static ALONE: RefCell<Option<ThreadPool>> = const { RefCell::new(None) };
}

/// True if the system lets this process start threads. The first call starts those for all work; rayon would panic if it could not
/// start them.
pub(crate) fn are_granted() -> bool {
    static ARE_GRANTED: OnceLock<bool> = OnceLock::new();
    *ARE_GRANTED.get_or_init(|| {
        let granted = startable_threads(0);
        granted > 0 && ThreadPoolBuilder::new().num_threads(granted).build_global().is_ok()
    })
}

/// Runs `work` in this thread, which does all of it if the system grants no other.
///
/// # Errors
///
/// Those of `work`; [`Error::Internal`] if this thread can do no work of the library.
pub(crate) fn in_this_thread<T>(work: impl FnOnce() -> Result<T>) -> Result<T> {
    if !are_granted() {
        ALONE.with_borrow_mut(|alone| -> Result<()> {
            if alone.is_none() {
                let pool = ThreadPoolBuilder::new().num_threads(1).use_current_thread().build();
                *alone = Some(pool.map_err(|e| Error::internal(format!("no thread: {e}")))?);
            }
            Ok(())
        })?;
    }
    work()
}

/// Runs `work` on this many threads, or on all.
pub(crate) fn with_threads<T: Send>(
    threads: Option<usize>,
    work: impl FnOnce() -> Result<T> + Send,
) -> Result<T> {
    let Some(n) = threads.filter(|_| are_granted()) else { return work() };
    let wanted = useful_threads(n);
    let granted = startable_threads(wanted);
    if granted == 0 {
        return work();
    }
    let pool = ThreadPoolBuilder::new().num_threads(granted).build();
    pool.map_err(|error| Error::Usage(format!("threads {n}: {error}")))?.install(work)
}
