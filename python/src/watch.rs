//! Runs work of the library in a thread of its own while other Python threads run.
//!
//! The calling thread releases the interpreter's lock and takes it again several times a second, to check for Ctrl-C and to report
//! progress. So the progress callable is always called in the calling thread, as notebooks require.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use isospectrum::{Error, Progress, Result};
use pyo3::prelude::*;

use crate::errors::raised;
use crate::threads::{are_granted, check_process, in_this_thread};
use crate::warnings;

/// Interval at which the calling thread checks for Ctrl-C and reports progress.
const POLL_INTERVAL: Duration = Duration::from_millis(50);

/// Time for cancelled work to stop. After that the caller returns, the work continues in the background until it next checks for
/// cancellation (the topology of a large volume does not), and its result is dropped.
const CANCELLATION_TIMEOUT: Duration = Duration::from_millis(500);

/// Stack of the thread, bytes: as large as that of a main thread.
const STACK_BYTES: usize = 8 << 20;

/// Progress and cancellation of work in another thread.
#[derive(Default)]
pub(crate) struct Watched {
    latest: Mutex<(f64, String)>,
    is_cancelled: AtomicBool,
}

impl Progress for Watched {
    fn report(&self, done: f64, message: &str) {
        let mut latest = self.latest.lock().unwrap_or_else(PoisonError::into_inner);
        latest.0 = done;
        if latest.1 != message {
            message.clone_into(&mut latest.1);
        }
    }

    fn cancelled(&self) -> bool {
        self.is_cancelled.load(Ordering::Relaxed)
    }
}

/// Runs work in a thread and waits for it. `progress` is called with the finished share and the current stage. If the system grants no
/// thread, the calling one does the work, without progress, and Ctrl-C waits until it is done.
pub(crate) fn watched<T: Send + 'static>(
    py: Python<'_>,
    progress: Option<&Bound<'_, PyAny>>,
    work: impl FnOnce(&Watched) -> Result<T> + Send + 'static,
) -> PyResult<T> {
    check_process(py)?;
    warnings::collect();
    let watched = Arc::new(Watched::default());
    // Shared, so that it is still here if no thread starts.
    let work = Arc::new(Mutex::new(Some(work)));
    let (send, receive) = channel();
    let all = {
        let (watched, work) = (watched.clone(), work.clone());
        move || {
            let work = work.lock().unwrap_or_else(PoisonError::into_inner).take();
            drop(work.map(|work| send.send(work(&watched))));
        }
    };
    if !are_granted() || !is_started(all) {
        let work = work.lock().unwrap_or_else(PoisonError::into_inner).take();
        let work = work.ok_or_else(|| raised(Error::internal("work without a thread")))?;
        let done = detached(py, || work(&watched));
        return py.check_signals().and(done);
    }
    let receive = Mutex::new(receive);
    let mut last_report = None;
    loop {
        let result = py.detach(|| wait(&receive, POLL_INTERVAL));
        if let Some(result) = result {
            return result.map_err(raised).and_then(|done| warnings::raise(py).map(|()| done));
        }
        if let Err(exception) = poll(py, progress, &watched, &mut last_report) {
            watched.is_cancelled.store(true, Ordering::Relaxed);
            let _stopped_or_abandoned = py.detach(|| wait(&receive, CANCELLATION_TIMEOUT));
            return Err(exception);
        }
    }
}

/// Runs short work in the calling thread, without the interpreter's lock.
pub(crate) fn detached<T: Send>(
    py: Python<'_>,
    work: impl FnOnce() -> Result<T> + Send,
) -> PyResult<T> {
    check_process(py)?;
    warnings::collect();
    let done = py.detach(|| in_this_thread(work)).map_err(raised)?;
    warnings::raise(py).map(|()| done)
}

/// Starts a thread; false if the system grants none.
fn is_started(work: impl FnOnce() + Send + 'static) -> bool {
    let thread = std::thread::Builder::new().name("isospectrum".to_owned());
    thread.stack_size(STACK_BYTES).spawn(work).is_ok()
}

/// The result of the work, if it has finished. A thread that ended without sending one has panicked.
fn wait<T>(receive: &Mutex<Receiver<Result<T>>>, time: Duration) -> Option<Result<T>> {
    let receive = receive.lock().unwrap_or_else(PoisonError::into_inner);
    match receive.recv_timeout(time) {
        Ok(result) => Some(result),
        Err(RecvTimeoutError::Timeout) => None,
        Err(RecvTimeoutError::Disconnected) => Some(Err(Error::internal("a thread panicked"))),
    }
}

/// Checks for Ctrl-C, and reports progress if it has changed.
fn poll(
    py: Python<'_>,
    progress: Option<&Bound<'_, PyAny>>,
    watched: &Watched,
    last_report: &mut Option<(f64, String)>,
) -> PyResult<()> {
    py.check_signals()?;
    let Some(progress) = progress else { return Ok(()) };
    let latest = watched.latest.lock().unwrap_or_else(PoisonError::into_inner).clone();
    if last_report.as_ref() != Some(&latest) {
        progress.call1((latest.0, latest.1.as_str()))?;
        *last_report = Some(latest);
    }
    Ok(())
}
