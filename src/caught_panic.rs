//! Panics of other crates that become errors: decoders of pictures panic on some damaged files, and drivers of GPUs where memory is short.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicUsize, Ordering};

/// The number of calls of [`catch`] at work, in all threads: what they call may have threads of its own.
static N_RUNNING: AtomicUsize = AtomicUsize::new(0);

/// Whether code of another crate is at work whose panics are caught: a panic hook should not print them.
pub fn is_catching() -> bool {
    N_RUNNING.load(Ordering::Relaxed) > 0
}

/// Runs code of another crate. `None` if it panics.
pub(crate) fn catch<T>(work: impl FnOnce() -> T) -> Option<T> {
    N_RUNNING.fetch_add(1, Ordering::Relaxed);
    let result = catch_unwind(AssertUnwindSafe(work));
    N_RUNNING.fetch_sub(1, Ordering::Relaxed);
    result.ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_is_caught_and_announced_to_the_hook() {
        let result: Option<()> = catch(|| {
            assert!(is_catching());
            // As a panic without a message on the screen.
            std::panic::resume_unwind(Box::new("out of bounds"))
        });
        assert_eq!(result, None);
        assert_eq!(catch(|| 3), Some(3));
    }
}
