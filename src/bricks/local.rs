//! All parts of a plan on one machine: as many at a time as there are threads, and as memory allows.
//!
//! # Invariants
//!
//! What is expected of the parts in work, by [`Forecast`], is never more than the limit. The parts do not depend on how many there
//! are at a time.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};

use super::part::PartHead;
use super::{Opened, Part, Parts, Plan};
use crate::error::{Error, Result};
use crate::forecast::Forecast;
use crate::kernels::Backend;
use crate::progress::Progress;
use crate::sweep::compute_block;
use crate::topology::blocks::BlockTopology;
use crate::topology::exact::ExactField;
use crate::volume::Volume;

/// What joining the borders takes of memory, bytes per critical point of all parts (measured: 305 of `bonsai`).
const JOIN_BYTES_PER_POINT: f64 = 350.0;

/// What merging to one file takes of memory, bytes per triangle of all parts (measured: 112 of `bonsai`).
const FILE_BYTES_PER_TRIANGLE: f64 = 130.0;

/// What may be used.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// Memory for all parts in work at a time, and for what is made of them then, bytes: where it is known that this becomes more,
    /// work ends early.
    pub memory: f64,
    /// Whether the parts become one file; else a folder.
    pub one_file: bool,
    /// Most triangles of all parts.
    pub triangles: Option<f64>,
}

/// The bytes of the file of a part.
///
/// # Errors
///
/// [`Error::Input`] where the volume is another one than the plan's; those of [`compute_block`].
pub fn part_of(
    plan: &Plan,
    volume: &Opened,
    number: usize,
    backend: &Backend,
    progress: &dyn Progress,
) -> Result<Vec<u8>> {
    let brick = Prepared::of(plan, volume, number)?;
    brick.swept(plan, number, backend, progress)
}

/// Computes all parts of a plan into their folder, which is there and which nobody else writes to; those that are there already are
/// made anew.
///
/// # Errors
///
/// As [`part_of`]; [`Error::Usage`] where a brick, or all together, are beyond a limit; [`Error::Io`].
pub fn compute_parts(
    parts: &Parts,
    volume: &Opened,
    backend: &Backend,
    limits: Limits,
    progress: &dyn Progress,
) -> Result<()> {
    let n = parts.n();
    // A device is shared as it is; it holds the samples of one brick at a time.
    let at_once = if backend.gpu().is_some() { 1 } else { rayon::current_num_threads() };
    let work = Work {
        parts,
        volume,
        backend,
        limits,
        progress,
        next: AtomicUsize::new(0),
        stopped: AtomicBool::new(false),
        state: Mutex::new(State {
            done: vec![0.0; n],
            n_made: 0,
            in_use: 0.0,
            triangles: 0,
            points: 0,
            failure: None,
        }),
        freed: Condvar::new(),
    };
    std::thread::scope(|scope| {
        // Not in the pool: one that waits for a share of its own work there would begin another brick meanwhile.
        for _ in 0..at_once.min(n) {
            scope.spawn(|| work.go_on());
        }
    });
    work.state.into_inner().unwrap_or_else(PoisonError::into_inner).failure.map_or(Ok(()), Err)
}

/// A brick that is ready to be swept.
struct Prepared {
    block: Arc<Volume>,
    topology: BlockTopology,
}

impl Prepared {
    fn of(plan: &Plan, volume: &Opened, number: usize) -> Result<Prepared> {
        let block = Arc::new(plan.block(volume, number)?);
        Ok(Prepared { block, topology: plan.topology(volume, number)? })
    }

    /// Bytes that its sweep is expected to take.
    fn memory(&self, plan: &Plan) -> Result<f64> {
        let parameters = &plan.recipe.parameters;
        let range = parameters.range.unwrap_or(plan.recipe.volume.range);
        let inside = |c: f64| (range.0..=range.1).contains(&c);
        let events = self.topology.points.iter().filter(|p| inside(p.isovalue)).count();
        let field = ExactField::new(&self.block)?;
        Ok(Forecast::with_events(&field, events, range, parameters.error).memory)
    }

    fn swept(
        &self,
        plan: &Plan,
        number: usize,
        backend: &Backend,
        progress: &dyn Progress,
    ) -> Result<Vec<u8>> {
        let swept = compute_block(&self.block, &plan.recipe.parameters, backend, progress)?;
        Part::to_bytes(plan, number, &backend.name(), (&swept, &self.topology))
    }
}

/// What those who sweep bricks have in common.
struct Work<'a> {
    parts: &'a Parts<'a>,
    volume: &'a Opened,
    backend: &'a Backend,
    limits: Limits,
    progress: &'a dyn Progress,
    next: AtomicUsize,
    stopped: AtomicBool,
    state: Mutex<State>,
    /// Told when memory is free again, or work stops.
    freed: Condvar,
}

struct State {
    /// Share of each brick that is done.
    done: Vec<f64>,
    n_made: usize,
    /// Bytes expected of the bricks in work.
    in_use: f64,
    triangles: u64,
    /// Critical points.
    points: u64,
    /// The first one.
    failure: Option<Error>,
}

impl Work<'_> {
    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Takes brick after brick until none is left.
    fn go_on(&self) {
        loop {
            let number = self.next.fetch_add(1, Ordering::Relaxed);
            if number >= self.parts.n() || self.is_stopped() {
                return;
            }
            if let Err(error) = self.make(number) {
                self.state().failure.get_or_insert(error);
                self.stopped.store(true, Ordering::Relaxed);
                self.freed.notify_all();
            }
        }
    }

    fn is_stopped(&self) -> bool {
        self.stopped.load(Ordering::Relaxed) || self.progress.cancelled()
    }

    fn make(&self, number: usize) -> Result<()> {
        let plan = self.parts.plan();
        let brick = Prepared::of(plan, self.volume, number)?;
        let memory = brick.memory(plan)?;
        self.take(number, memory)?;
        let of_brick = OfBrick { work: self, number };
        let bytes = brick.swept(plan, number, self.backend, &of_brick);
        self.state().in_use -= memory;
        self.freed.notify_all();
        let bytes = bytes?;
        let file = self.parts.file(number);
        std::fs::write(&file, &bytes).map_err(|e| Error::io(&file, e))?;
        self.made(number, &Part::head(&bytes, plan, number)?)
    }

    /// Waits until a brick fits beside those in work.
    fn take(&self, number: usize, memory: f64) -> Result<()> {
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
        while state.in_use + memory > limit && state.in_use > 0.0 && !self.is_stopped() {
            let looks = std::time::Duration::from_millis(100);
            let waited = self.freed.wait_timeout(state, looks);
            state = waited.unwrap_or_else(PoisonError::into_inner).0;
        }
        if self.is_stopped() {
            return Err(Error::Interrupted);
        }
        state.in_use += memory;
        Ok(())
    }

    /// Takes down that a part is there.
    fn made(&self, number: usize, head: &PartHead) -> Result<()> {
        let mut state = self.state();
        state.done[number] = 1.0;
        state.n_made += 1;
        state.triangles += head.size()[2];
        state.points += u64::from(head.critical);
        let (n, of) = (state.n_made, self.parts.n());
        let (triangles, points) = (state.triangles as f64, state.points as f64);
        drop(state);
        if let Some(most) = self.limits.triangles.filter(|&most| triangles > most) {
            return Err(Error::Usage(format!(
                "{triangles} triangles in {n} of {of} bricks, expected {most} at most in all"
            )));
        }
        let beyond = |what: String, bytes: f64, advice: &str| {
            let left = self.limits.memory;
            let [bytes, left_for_it] = [bytes, left].map(megabytes);
            let said = format!(
                "{what} in {n} of {of} bricks: about {bytes} MB of memory to merge them, {left_for_it} MB are left for it, expected {advice}"
            );
            Error::Usage(said)
        };
        let join = JOIN_BYTES_PER_POINT * points;
        if join > self.limits.memory {
            let what = format!("{points} critical points");
            return Err(beyond(what, join, "noise taken out (--persistence), or more memory"));
        }
        let file = FILE_BYTES_PER_TRIANGLE * triangles;
        if self.limits.one_file && file > self.limits.memory {
            let what = format!("{triangles} triangles");
            return Err(beyond(what, file, "-o NAME.ispt, a folder, or more memory"));
        }
        Ok(())
    }
}

/// Whole megabytes.
fn megabytes(bytes: f64) -> u64 {
    (bytes / 1e6).ceil() as u64
}

/// The progress of one brick.
struct OfBrick<'a> {
    work: &'a Work<'a>,
    number: usize,
}

impl Progress for OfBrick<'_> {
    fn report(&self, done: f64, _message: &str) {
        let mut state = self.work.state();
        state.done[self.number] = done.clamp(0.0, 1.0);
        let n = state.done.len();
        let (share, made) = (state.done.iter().sum::<f64>() / n as f64, state.n_made);
        drop(state);
        self.work.progress.report(share, &format!("{made} of {n} bricks"));
    }

    fn cancelled(&self) -> bool {
        self.work.is_stopped()
    }
}
