//! A GPU device that is lost in the middle of a sweep.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use isospectrum::Error;
use isospectrum::volume::phantom;
use isospectrum::{Backend, Choice};
use isospectrum::{Parameters, Progress, Silent, compute};

/// The number of calls of `cancelled` before the device is lost: after remeshing, at the first steps.
const LOST_AT: usize = 6;

/// Loses the device at the n-th call of `cancelled`.
struct LosesDevice<'a> {
    backend: &'a Backend,
    calls: AtomicUsize,
    lost_at: usize,
}

impl Progress for LosesDevice<'_> {
    fn report(&self, _done: f64, _message: &str) {}

    fn cancelled(&self) -> bool {
        if self.calls.fetch_add(1, Ordering::Relaxed) == self.lost_at {
            self.backend.gpu().expect("a GPU").lose();
        }
        false
    }
}

#[test]
fn a_device_lost_in_the_middle_of_a_sweep_is_an_error_of_one_line() {
    let volume = Arc::new(phantom("sphere:32").expect("a phantom"));
    let backend = Backend::choose(Choice::Gpu, None).expect("an adapter");
    let loses_device =
        LosesDevice { backend: &backend, calls: AtomicUsize::new(0), lost_at: LOST_AT };
    let swept = compute(&volume, &Parameters::default(), &backend, &loses_device);
    let Err(error) = swept else { panic!("a spectrum without a device") };
    assert!(matches!(error, Error::Gpu(_)), "{error}");
    assert!(!error.to_string().contains('\n'), "{error}");
    assert!(loses_device.calls.into_inner() > LOST_AT);

    // Later sweeps with it neither hang nor panic.
    let swept = compute(&volume, &Parameters::default(), &backend, &Silent);
    let Err(error) = swept else { panic!("a spectrum without a device") };
    assert!(matches!(error, Error::Gpu(_)), "{error}");
}
