//! Work of the library while Python goes on: in a thread of its own, watched by the one that called.
//!
//! The caller lets go of the interpreter's lock, and comes back to it a few times a second to learn of Ctrl-C and to tell how
//! far the work is. So a callable for progress is always called in the thread that asked for the work, which is where
//! notebooks want it.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use isospectrum::{Error, Progress, Result};
use pyo3::prelude::*;

use crate::errors::raised;

/// How often the caller looks up.
const LOOK: Duration = Duration::from_millis(50);

/// How long work that was asked to stop may take to. What has not stopped by then (the topology of a large volume looks at
/// nothing) goes on unseen until it does, and what it finds is dropped.
const GRACE: Duration = Duration::from_millis(500);

/// Stack of the thread: that of a program's first one.
const STACK: usize = 8 << 20;

/// How far the work is, and whether it should stop.
#[derive(Default)]
pub(crate) struct Watched {
    told: Mutex<(f64, String)>,
    is_cancelled: AtomicBool,
}

impl Progress for Watched {
    fn report(&self, done: f64, message: &str) {
        let mut told = self.told.lock().unwrap_or_else(PoisonError::into_inner);
        told.0 = done;
        if told.1 != message {
            message.clone_into(&mut told.1);
        }
    }

    fn cancelled(&self) -> bool {
        self.is_cancelled.load(Ordering::Relaxed)
    }
}

/// Does work in a thread and waits for it. `progress` is called with the share done and what is being done.
pub(crate) fn watched<T: Send + 'static>(
    py: Python<'_>,
    progress: Option<&Bound<'_, PyAny>>,
    work: impl FnOnce(&Watched) -> Result<T> + Send + 'static,
) -> PyResult<T> {
    let watched = Arc::new(Watched::default());
    let (send, receive) = channel();
    let work = {
        let watched = watched.clone();
        move || drop(send.send(work(&watched)))
    };
    std::thread::Builder::new()
        .name("isospectrum".to_owned())
        .stack_size(STACK)
        .spawn(work)
        .map_err(|error| raised(Error::internal(format!("no thread: {error}"))))?;
    let receive = Mutex::new(receive);
    let mut last = None;
    loop {
        let found = py.detach(|| wait(&receive, LOOK));
        if let Some(found) = found {
            return found.map_err(raised);
        }
        if let Err(exception) = looked_up(py, progress, &watched, &mut last) {
            watched.is_cancelled.store(true, Ordering::Relaxed);
            let _stopped_or_left_alone = py.detach(|| wait(&receive, GRACE));
            return Err(exception);
        }
    }
}

/// What the work found, once it has; a thread that ended without a word has panicked.
fn wait<T>(receive: &Mutex<Receiver<Result<T>>>, time: Duration) -> Option<Result<T>> {
    let receive = receive.lock().unwrap_or_else(PoisonError::into_inner);
    match receive.recv_timeout(time) {
        Ok(found) => Some(found),
        Err(RecvTimeoutError::Timeout) => None,
        Err(RecvTimeoutError::Disconnected) => Some(Err(Error::internal("a thread panicked"))),
    }
}

/// Looks for Ctrl-C, and tells how far the work is where that is news.
fn looked_up(
    py: Python<'_>,
    progress: Option<&Bound<'_, PyAny>>,
    watched: &Watched,
    last: &mut Option<(f64, String)>,
) -> PyResult<()> {
    py.check_signals()?;
    let Some(progress) = progress else { return Ok(()) };
    let told = watched.told.lock().unwrap_or_else(PoisonError::into_inner).clone();
    if last.as_ref() != Some(&told) {
        progress.call1((told.0, told.1.as_str()))?;
        *last = Some(told);
    }
    Ok(())
}
