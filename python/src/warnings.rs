//! The library's warnings as Python warnings, `isospectrum.Warning`.
//!
//! The library logs them in whichever thread works. They are collected here, and raised in the calling thread when its work is done.

use std::sync::{Mutex, Once, PoisonError};

use log::{Level, LevelFilter, Log, Metadata, Record};
use pyo3::prelude::*;

use crate::errors::in_words_of_python;

/// Most warnings that are kept: a computation has a few.
const MAX_KEPT: usize = 100;

static COLLECTED: Mutex<Vec<String>> = Mutex::new(Vec::new());

/// Collects warnings of the library.
struct Collector;

impl Log for Collector {
    fn enabled(&self, metadata: &Metadata<'_>) -> bool {
        metadata.level() <= Level::Warn && metadata.target().starts_with("isospectrum")
    }

    fn log(&self, record: &Record<'_>) {
        if self.enabled(record.metadata()) {
            let mut collected = COLLECTED.lock().unwrap_or_else(PoisonError::into_inner);
            if collected.len() < MAX_KEPT {
                collected.push(in_words_of_python(&record.args().to_string()));
            }
        }
    }

    fn flush(&self) {}
}

/// Begins to collect.
pub(crate) fn collect() {
    static BEGUN: Once = Once::new();
    BEGUN.call_once(|| {
        // Only this module sets a logger.
        if log::set_logger(&Collector).is_ok() {
            log::set_max_level(LevelFilter::Warn);
        }
    });
}

/// Raises the warnings that have been collected.
///
/// # Errors
///
/// The warning itself where the user has made it an exception.
pub(crate) fn raise(py: Python<'_>) -> PyResult<()> {
    let collected = {
        let mut collected = COLLECTED.lock().unwrap_or_else(PoisonError::into_inner);
        std::mem::take(&mut *collected)
    };
    if collected.is_empty() {
        return Ok(());
    }
    py.import("isospectrum._warnings")?.call_method1("warn_all", (collected,)).map(drop)
}
