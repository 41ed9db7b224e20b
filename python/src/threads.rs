//! Threads of the library: as many as the system lets this process start, or the calling one. A process that was forked after they were
//! started has none of them, and work would wait for them forever: it is refused there.

use std::cell::RefCell;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};

use isospectrum::settings::{startable_threads, useful_threads};
use isospectrum::{Error, Result};
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};

thread_local! {
    /// The pool of this thread alone. It stays, because a thread cannot leave a pool.
    static ALONE: RefCell<Option<ThreadPool>> = const { RefCell::new(None) };
}

/// Whether the threads for all work have been started, if the system lets this process start any.
static ARE_GRANTED: OnceLock<bool> = OnceLock::new();

/// True in a process that was forked after the threads were started.
static IS_FORKED: AtomicBool = AtomicBool::new(false);

/// Called in the child of a fork.
#[pyfunction]
pub(crate) fn after_fork() {
    if ARE_GRANTED.get().is_some() {
        IS_FORKED.store(true, Ordering::Relaxed);
    }
}

/// Refuses work in a process without the threads for it.
///
/// # Errors
///
/// `isospectrum.ForkError`.
pub(crate) fn check_process(py: Python<'_>) -> PyResult<()> {
    if !IS_FORKED.load(Ordering::Relaxed) {
        return Ok(());
    }
    let text = "this process was forked after isospectrum had started its threads, which it does not have; start processes by \
                multiprocessing.get_context('spawn')";
    let class = py.import("isospectrum._errors")?.getattr("ForkError")?;
    Err(class.call1((text,)).map_or_else(|_| PyRuntimeError::new_err(text), PyErr::from_value))
}

/// True if the system lets this process start threads. The first call starts those for all work; rayon would panic if it could not
/// start them.
pub(crate) fn are_granted() -> bool {
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
