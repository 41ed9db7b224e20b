//! No file takes memory that its length has not earned: every reader, with the bytes in use counted by the allocator of
//! this test binary.

#[path = "../common/mod.rs"]
mod common;

mod damaged_volumes;
mod files;

use std::sync::{Mutex, MutexGuard, PoisonError};

use peak_alloc::PeakAlloc;

#[global_allocator]
static BYTES: PeakAlloc = PeakAlloc;

/// The counter sees all threads, so one test measures at a time.
static ONE_AT_A_TIME: Mutex<()> = Mutex::new(());

/// Waits until no other test measures.
fn turn() -> MutexGuard<'static, ()> {
    // A test that failed before this one broke nothing.
    ONE_AT_A_TIME.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Runs `f`; the most bytes in use at one time beyond those before.
fn peak<T>(f: impl FnOnce() -> T) -> (T, usize) {
    let before = BYTES.current_usage();
    BYTES.reset_peak_usage();
    let result = f();
    (result, BYTES.peak_usage().saturating_sub(before))
}
