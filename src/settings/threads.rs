//! The number of threads.

use std::sync::Mutex;
use std::sync::mpsc::channel;
use std::thread::{Builder, available_parallelism};

/// Most threads for each processor. More wait for each other, and rayon's threads spin while they wait.
const MAX_PER_PROCESSOR: usize = 4;

/// The number of threads to start where `n` are requested, with a warning where that is fewer; 0 stands for one for each processor.
pub fn useful_threads(n: usize) -> usize {
    let processors = available_parallelism().map_or(1, usize::from);
    let most = MAX_PER_PROCESSOR * processors;
    if n > most {
        log::warn!("{n} threads on {processors} processors: {most} are used");
    }
    n.min(most)
}

/// How many of `n` threads the system lets this process start; 0 stands for one for each processor. They are started and end again.
pub fn startable_threads(n: usize) -> usize {
    let n = if n == 0 { available_parallelism().map_or(1, usize::from) } else { n };
    let (end, wait) = channel::<()>();
    let wait = Mutex::new(wait);
    std::thread::scope(|scope| {
        let start = |_| {
            let until_end = || drop(wait.lock().map(|wait| wait.recv()));
            Builder::new().spawn_scoped(scope, until_end)
        };
        let started = (0..n).map(start).take_while(Result::is_ok).count();
        drop(end);
        started
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_processor_has_four_threads_at_most() {
        let processors = available_parallelism().map_or(1, usize::from);
        assert_eq!([0, 1, 4 * processors].map(useful_threads), [0, 1, 4 * processors]);
        assert_eq!([1, 3].map(startable_threads), [1, 3]);
        assert_eq!([10_000, usize::MAX].map(useful_threads), [4 * processors; 2]);
    }
}
