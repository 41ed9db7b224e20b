//! How work that takes long tells how far it is, and learns that it should stop: the one protocol of the library.

/// How work tells how far it is and learns that it should stop.
///
/// ```
/// use std::sync::atomic::{AtomicBool, Ordering};
/// use isospectrum::volume::phantom;
/// use isospectrum::{Backend, Choice, Error, Parameters, Progress, compute};
///
/// /// Stops when the flag is set, as a signal may do it.
/// struct Flag(AtomicBool);
///
/// impl Progress for Flag {
///     fn report(&self, done: f64, message: &str) {
///         println!("{message}: {:.0} %", 100.0 * done);
///     }
///     fn cancelled(&self) -> bool {
///         self.0.load(Ordering::Relaxed)
///     }
/// }
///
/// let volume = std::sync::Arc::new(phantom("sphere:8")?);
/// let backend = Backend::choose(Choice::Cpu, None)?;
/// let stopped = compute(&volume, &Parameters::default(), &backend, &Flag(AtomicBool::new(true)));
/// assert!(matches!(stopped, Err(Error::Interrupted)));
/// # Ok::<(), isospectrum::Error>(())
/// ```
pub trait Progress: Sync {
    /// `done` runs from 0 to 1.
    fn report(&self, done: f64, message: &str);
    /// Whether the caller wants the work to stop; it does so soon, with [`Error::Interrupted`](crate::Error::Interrupted).
    fn cancelled(&self) -> bool;
}

/// No reports, never cancelled.
#[derive(Clone, Copy, Debug, Default)]
pub struct Silent;

impl Progress for Silent {
    fn report(&self, _done: f64, _message: &str) {}
    fn cancelled(&self) -> bool {
        false
    }
}
