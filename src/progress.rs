//! Progress reporting and cancellation.

/// Receives progress reports of long computations, and cancels them.
///
/// ```
/// use std::sync::atomic::{AtomicBool, Ordering};
/// use isospectrum::volume::phantom;
/// use isospectrum::{Backend, Choice, Error, Parameters, Progress, compute};
///
/// /// Cancels when a flag is set, for example by a signal handler.
/// struct CancelFlag(AtomicBool);
///
/// impl Progress for CancelFlag {
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
/// let stopped = compute(&volume, &Parameters::default(), &backend, &CancelFlag(AtomicBool::new(true)));
/// assert!(matches!(stopped, Err(Error::Interrupted)));
/// # Ok::<(), isospectrum::Error>(())
/// ```
pub trait Progress: Sync {
    /// Reports that the share `done` of the work, from 0 to 1, is finished; `message` names the current stage.
    fn report(&self, done: f64, message: &str);
    /// True if the work shall stop. It then ends soon with [`Error::Interrupted`](crate::Error::Interrupted).
    fn cancelled(&self) -> bool;
}

/// Ignores reports and never cancels.
#[derive(Clone, Copy, Debug, Default)]
pub struct Silent;

impl Progress for Silent {
    fn report(&self, _done: f64, _message: &str) {}
    fn cancelled(&self) -> bool {
        false
    }
}
