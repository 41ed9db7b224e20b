//! The number of threads.

use std::thread::available_parallelism;

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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_processor_has_four_threads_at_most() {
        let processors = available_parallelism().map_or(1, usize::from);
        assert_eq!([0, 1, 4 * processors].map(useful_threads), [0, 1, 4 * processors]);
        assert_eq!([10_000, usize::MAX].map(useful_threads), [4 * processors; 2]);
    }
}
