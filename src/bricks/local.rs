//! Computes all parts of a plan on one machine, as many at a time as threads and memory allow.
//!
//! # Invariants
//!
//! The memory expected for the parts in progress, by [`Forecast`], never exceeds the limit. The parts do not depend on how many are
//! computed at a time.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};

use super::head::PartHead;
use super::part::Part;
use super::parts::Parts;
use super::plan::Plan;
use super::source::OpenVolume;
use crate::error::{Error, Result};
use crate::forecast::{Forecast, PROGRAM_BYTES};
use crate::kernels::Backend;
use crate::progress::Progress;
use crate::sweep::compute_block;
use crate::topology::blocks::BlockTopology;
use crate::topology::exact::ExactField;
use crate::volume::Volume;

/// Memory for joining the borders, bytes per critical point of all parts (measured: 305 for `bonsai`).
const JOIN_BYTES_PER_POINT: f64 = 350.0;

/// Memory for merging in memory, bytes per triangle of all parts (measured: 112 for `bonsai`).
const MERGE_BYTES_PER_TRIANGLE: f64 = 130.0;

/// Interval at which a thread that waits for memory checks for cancellation.
const CANCELLATION_POLL: std::time::Duration = std::time::Duration::from_millis(100);

/// Limits of a computation in bricks on one machine.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BrickLimits {
    /// Memory for the parts in progress, and later for merging them, bytes. The computation fails as soon as the merge is known
    /// to exceed it.
    pub memory: f64,
    /// True if the parts are merged in memory; false if to a file, part by part.
    pub in_memory: bool,
    /// Most triangles of all parts together.
    pub triangles: Option<f64>,
}

/// Computes a part; returns the bytes of its file.
///
/// # Errors
///
/// [`Error::Input`] if the volume is not that of the plan; those of the sweep.
pub fn compute_part(
    plan: &Plan,
    volume: &OpenVolume,
    number: usize,
    backend: &Backend,
    progress: &dyn Progress,
) -> Result<Vec<u8>> {
    let brick = ReadyBrick::read(plan, volume, number)?;
    brick.sweep(plan, number, backend, progress)
}

/// Computes all parts of a plan into their folder, which must exist and to which nobody else writes. Existing part files are
/// overwritten.
///
/// # Errors
///
/// As [`compute_part`]; [`Error::Usage`] if one brick, or all of them together, exceed a limit; [`Error::Io`].
pub fn compute_parts(
    parts: &Parts,
    volume: &OpenVolume,
    backend: &Backend,
    limits: BrickLimits,
    progress: &dyn Progress,
) -> Result<()> {
    let n = parts.n();
    // A GPU is kept busy by one brick, and holds the samples of one.
    let at_once = if backend.gpu().is_some() { 1 } else { rayon::current_num_threads() };
    let queue = Queue {
        parts,
        volume,
        backend,
        limits,
        progress,
        next: AtomicUsize::new(0),
        stopped: AtomicBool::new(false),
        state: Mutex::new(State {
            shares: vec![0.0; n],
            n_done: 0,
            memory: 0.0,
            triangles: 0,
            points: 0,
            failure: None,
        }),
        freed: Condvar::new(),
    };
    let at_once = at_once.min(n);
    let started = std::thread::scope(|scope| {
        // Not in rayon's pool, where a thread that waits for its own tasks would start another brick meanwhile.
        let start = |_| std::thread::Builder::new().spawn_scoped(scope, || queue.run());
        let n_threads = if at_once > 1 { at_once } else { 0 };
        (0..n_threads).map(start).take_while(Result::is_ok).count()
    });
    // One thread is this one, which is rayon's if the system grants no other.
    if started == 0 {
        queue.run();
    }
    let state = queue.state.into_inner().unwrap_or_else(PoisonError::into_inner);
    match state.failure {
        Some(error) => Err(error),
        // Threads end without an error if they find the cancellation between two bricks.
        None if state.n_done < n => Err(Error::Interrupted),
        None => Ok(()),
    }
}

/// A brick whose samples and topology are in memory.
struct ReadyBrick {
    block: Arc<Volume>,
    topology: BlockTopology,
}

impl ReadyBrick {
    fn read(plan: &Plan, volume: &OpenVolume, number: usize) -> Result<ReadyBrick> {
        let block = Arc::new(plan.block(volume, number)?);
        Ok(ReadyBrick { block, topology: plan.topology(volume, number)? })
    }

    /// Expected memory of its sweep, bytes.
    fn expected_memory(&self, plan: &Plan) -> Result<f64> {
        let parameters = &plan.recipe.parameters;
        let range = parameters.range.unwrap_or(plan.recipe.volume.range);
        let inside = |c: f64| (range.0..=range.1).contains(&c);
        let events = self.topology.points.iter().filter(|p| inside(p.isovalue)).count();
        let field = ExactField::new(&self.block)?;
        let forecast = Forecast::with_events(&field, events, range, parameters.error);
        Ok(forecast.memory - PROGRAM_BYTES)
    }

    fn sweep(
        &self,
        plan: &Plan,
        number: usize,
        backend: &Backend,
        progress: &dyn Progress,
    ) -> Result<Vec<u8>> {
        let swept = compute_block(&self.block, &plan.recipe.parameters, backend, progress)?;
        Part::to_bytes(plan, number, &backend.name(), &swept, &self.topology)
    }
}

/// The bricks to compute, shared by all threads.
struct Queue<'a> {
    parts: &'a Parts<'a>,
    volume: &'a OpenVolume,
    backend: &'a Backend,
    limits: BrickLimits,
    progress: &'a dyn Progress,
    next: AtomicUsize,
    stopped: AtomicBool,
    state: Mutex<State>,
    /// Signalled when memory is released or the computation stops.
    freed: Condvar,
}

struct State {
    /// Finished share of each brick, 0 to 1.
    shares: Vec<f64>,
    n_done: usize,
    /// Memory expected for the bricks in progress, bytes.
    memory: f64,
    /// Triangles of the finished parts.
    triangles: u64,
    /// Critical points of the finished parts.
    points: u64,
    /// The first error.
    failure: Option<Error>,
}

impl Queue<'_> {
    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Computes one brick after the other until none is left.
    fn run(&self) {
        loop {
            let number = self.next.fetch_add(1, Ordering::Relaxed);
            if number >= self.parts.n() || self.is_stopped() {
                return;
            }
            if let Err(error) = self.compute(number) {
                self.state().failure.get_or_insert(error);
                self.stopped.store(true, Ordering::Relaxed);
                self.freed.notify_all();
            }
        }
    }

    fn is_stopped(&self) -> bool {
        self.stopped.load(Ordering::Relaxed) || self.progress.cancelled()
    }

    fn compute(&self, number: usize) -> Result<()> {
        let plan = self.parts.plan();
        let brick = ReadyBrick::read(plan, self.volume, number)?;
        let memory = brick.expected_memory(plan)?;
        self.reserve(number, memory)?;
        let progress = BrickProgress { queue: self, number };
        let bytes = brick.sweep(plan, number, self.backend, &progress);
        self.state().memory -= memory;
        self.freed.notify_all();
        let bytes = bytes?;
        let file = self.parts.file(number);
        std::fs::write(&file, &bytes).map_err(|e| Error::io(&file, e))?;
        self.finish(number, &Part::head(&bytes, plan, number)?)
    }

    /// Waits until the memory of a brick is free, and reserves it.
    fn reserve(&self, number: usize, memory: f64) -> Result<()> {
        let limit = self.limits.memory;
        if memory > limit {
            let [x, y, z] = self.parts.plan().recipe.bricks[number].dims();
            return Err(Error::Usage(format!(
                "brick {number} of {x}x{y}x{z} samples: about {} MB of memory expected, {} MB are left for it, expected more, or a smaller --brick",
                megabytes(memory),
                megabytes(limit)
            )));
        }
        let mut state = self.state();
        while state.memory + memory > limit && state.memory > 0.0 && !self.is_stopped() {
            let waited = self.freed.wait_timeout(state, CANCELLATION_POLL);
            state = waited.unwrap_or_else(PoisonError::into_inner).0;
        }
        if self.is_stopped() {
            return Err(Error::Interrupted);
        }
        state.memory += memory;
        Ok(())
    }

    /// Records a finished part and checks that all parts so far can be merged within the limits.
    fn finish(&self, number: usize, head: &PartHead) -> Result<()> {
        let mut state = self.state();
        state.shares[number] = 1.0;
        state.n_done += 1;
        state.triangles += head.size()[2];
        state.points += u64::from(head.critical);
        let (n, of) = (state.n_done, self.parts.n());
        let (triangles, points) = (state.triangles as f64, state.points as f64);
        drop(state);
        if let Some(limit) = self.limits.triangles.filter(|&limit| triangles > limit) {
            return Err(Error::Usage(format!(
                "{triangles} triangles in {n} of {of} bricks, expected {limit} at most in all"
            )));
        }
        let too_much = |what: String, bytes: f64, advice: &str| {
            let left = self.limits.memory;
            let [bytes, left_for_it] = [bytes, left].map(megabytes);
            Error::Usage(format!(
                "{what} in {n} of {of} bricks: about {bytes} MB of memory to merge them, {left_for_it} MB are left for it, expected {advice}"
            ))
        };
        let join = JOIN_BYTES_PER_POINT * points;
        if join > self.limits.memory {
            let what = format!("{points} critical points");
            return Err(too_much(what, join, "noise removal (--persistence), or more memory"));
        }
        let merged = MERGE_BYTES_PER_TRIANGLE * triangles;
        if self.limits.in_memory && merged > self.limits.memory {
            let what = format!("{triangles} triangles");
            return Err(too_much(what, merged, "a file to write to, or more memory"));
        }
        Ok(())
    }
}

/// Whole megabytes.
fn megabytes(bytes: f64) -> u64 {
    (bytes / 1e6).ceil() as u64
}

/// Reports the progress of one brick as a share of all.
struct BrickProgress<'a> {
    queue: &'a Queue<'a>,
    number: usize,
}

impl Progress for BrickProgress<'_> {
    fn report(&self, done: f64, _message: &str) {
        let mut state = self.queue.state();
        state.shares[self.number] = done.clamp(0.0, 1.0);
        let n = state.shares.len();
        let (share, n_done) = (state.shares.iter().sum::<f64>() / n as f64, state.n_done);
        drop(state);
        self.queue.progress.report(share, &format!("{n_done} of {n} bricks"));
    }

    fn cancelled(&self) -> bool {
        self.queue.is_stopped()
    }
}
