//! Memory of every reader in proportion to the length of its file, counted by the allocator of this test binary.

#[path = "../common/mod.rs"]
mod common;

mod damaged_volumes;
mod files;

use std::sync::{Mutex, MutexGuard, PoisonError};

use peak_alloc::PeakAlloc;

#[global_allocator]
static BYTES: PeakAlloc = PeakAlloc;

/// The counter includes all threads, so one test measures at a time.
static ONE_AT_A_TIME: Mutex<()> = Mutex::new(());

/// Waits until no other test measures.
fn turn() -> MutexGuard<'static, ()> {
    // A failed test does not affect this one.
    ONE_AT_A_TIME.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Runs `f`. Returns its result and the peak of bytes in use beyond those before.
fn peak<T>(f: impl FnOnce() -> T) -> (T, usize) {
    let before = BYTES.current_usage();
    BYTES.reset_peak_usage();
    let result = f();
    (result, BYTES.peak_usage().saturating_sub(before))
}
