//! The order of the sweep: from the start isovalue up and down through the arcs of the contour tree.
//!
//! An arc is tracked from where its mesh comes from to the node at its end. A node waits for all
//! arcs that lead to it; then surgery turns their meshes into those of the arcs beyond it. What is
//! done depends on the meshes and the field only, never on which task ends first.

mod node;

use std::collections::HashSet;
use std::sync::Mutex;

use rayon::Scope;

use super::again::Again;
use super::graph::{Graph, Node};
use super::idle::Idle;
use super::recorder::{Direction, Log, Run};
use super::start::{FRESH_MOTION, extraction_of_arcs, motion, of_arcs, start_front};
use super::surgery::{Front, end_all, repair};
use super::track::{End, Repair, Tracking, Way, track};
use super::window::{Slopes, window};
use super::{Counts, Piece, SMALL_FACES, SMALLEST_FACES, Sweep};
use crate::error::{Error, Result};
use crate::extract::Extraction;

/// Pieces shorter than this share of the range do not get a mesh of their own, nor those over which
/// the isosurface moves less than this, in voxels: making it would take longer than it lasts.
const SHORT_SHARE: f64 = 5e-5;
const SHORT_MOTION: f64 = 0.01;

/// A mesh that arrives is led through shorter pieces too, as far as its toil allows, but not through
/// those shorter than this share of the range: an operation needs isovalues on both sides of the event.
const TINY_SHARE: f64 = 1e-7;

/// Nor do small components, at the middle of their arc, if the arc is a smaller share of the range than
/// this and the isosurface moves less over it, in voxels; nor the smallest ones.
const LONG_SHARE: f64 = 0.05;
const LONG_MOTION: f64 = 1.0;

/// An arc that takes this share of the range gets a mesh even if the isosurface hardly moves: then a small range has been
/// asked for, for the mesh at about one isovalue.
const ASKED_SHARE: f64 = 0.25;

/// No step is shorter than this, in roundings of the range's isovalues: beside a large offset a step of a share of the
/// range would lead nowhere.
const RESOLUTION: f64 = 8.0;

/// No mesh is tracked over arcs shorter than so many of these steps: an operation takes a thousandth of an arc, in
/// stops that are closer and closer.
const RESOLVED: f64 = 1e6;

/// What a sweep leaves besides its counts.
pub(super) struct Swept {
    /// What was recorded of tracked meshes.
    pub(super) log: Log,
    /// The stretches no mesh was tracked over, by arc.
    pub(super) leftovers: Vec<Piece>,
}

/// What is shared between tasks.
struct Chain<'a> {
    sweep: &'a Sweep<'a>,
    graph: Graph,
    /// The isovalue the sweep starts from.
    start: f64,
    /// How fast the field rises.
    slopes: Slopes,
    /// Pieces shorter than this do not get a mesh of their own.
    short: f64,
    /// Pieces shorter than this get no mesh at all.
    tiny: f64,
    waiting: Vec<Mutex<Arrivals>>,
    log: Mutex<Log>,
    leftovers: Mutex<Vec<Piece>>,
    counts: Mutex<Counts>,
    failed: Mutex<Option<Error>>,
}

/// The arcs that have arrived at a node, each with its mesh, or with what is known of the stretch without
/// one.
type Arrivals = Vec<(usize, std::result::Result<Front, Idle>)>;

/// A lock, also where another task has panicked.
fn lock<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
}

/// Sweeps all arcs from an isovalue, given the exact extraction there.
pub(super) fn sweep_all(
    sweep: &Sweep,
    (start, whole): (f64, &Extraction),
    counts: &mut Counts,
) -> Result<Swept> {
    let graph = Graph::new(sweep);
    let length = sweep.range.1 - sweep.range.0;
    let slopes = Slopes::new(sweep);
    let chain = Chain {
        sweep,
        start,
        short: (SHORT_SHARE * length).max(SHORT_MOTION * slopes.typical),
        slopes,
        tiny: TINY_SHARE * length,
        waiting: graph.nodes.iter().map(|_| Mutex::default()).collect(),
        graph,
        log: Mutex::default(),
        leftovers: Mutex::default(),
        counts: Mutex::new(*counts),
        failed: Mutex::new(None),
    };
    log::debug!(
        "{} nodes, start at {}, short below {}",
        chain.graph.nodes.len(),
        chain.start,
        chain.short
    );
    rayon::scope(|scope| chain.begin(whole, scope));
    if let Some(error) = lock(&chain.failed).take() {
        return Err(error);
    }
    *counts = *lock(&chain.counts);
    let mut leftovers = std::mem::take(&mut *lock(&chain.leftovers));
    leftovers.sort_by(|a, b| a.arc.cmp(&b.arc).then(a.low.total_cmp(&b.low)));
    let log = std::mem::take(&mut *lock(&chain.log));
    Ok(Swept { log, leftovers })
}

impl<'a> Chain<'a> {
    /// Runs a task unless another has failed; keeps its error.
    fn attempt(&self, task: impl FnOnce() -> Result<()>) {
        if lock(&self.failed).is_some() {
            return;
        }
        if let Err(error) = task() {
            lock(&self.failed).get_or_insert(error);
        }
    }

    /// Starts the arcs that show at the start isovalue, and the nodes that nothing leads to.
    fn begin<'s>(&'s self, whole: &Extraction, scope: &Scope<'s>) {
        let at_start: Vec<usize> = (0..self.sweep.topology.arcs.len())
            .filter(|&a| {
                let (low, high) = self.sweep.shown(&self.sweep.topology.arcs[a]);
                low <= self.start && self.start < high
            })
            .collect();
        let found = of_arcs(self.sweep, whole, self.start, &at_start);
        // A component that is there elsewhere in its piece only: see `Sweep::alive`.
        let there: HashSet<usize> = found.1.iter().copied().collect();
        let missing: Vec<usize> = at_start.into_iter().filter(|a| !there.contains(a)).collect();
        self.start_found(found, self.start, Idle::NONE, scope);
        self.attempt(|| self.start_beyond(&missing, Idle::NONE, scope));
        for node in 0..self.graph.nodes.len() {
            let direction = self.direction_of(node);
            if inputs(&self.graph.nodes[node], direction).is_empty() {
                scope.spawn(move |scope| self.attempt(|| self.pass(node, Vec::new(), scope)));
            }
        }
    }

    /// Which way the sweep passes a node.
    fn direction_of(&self, node: usize) -> Direction {
        if self.graph.nodes[node].isovalue > self.start { Direction::Up } else { Direction::Down }
    }

    fn piece(&self, arc: usize) -> Piece {
        let (low, high) = self.sweep.shown(&self.sweep.topology.arcs[arc]);
        Piece { arc, low, high }
    }

    /// Extracts an arc in the middle of where its component is and tracks it both ways.
    fn start_in_middle<'s>(&'s self, arc: usize, idle: Idle, scope: &Scope<'s>) -> Result<()> {
        let isovalue = self.sweep.middle(&self.piece(arc));
        match extraction_of_arcs(self.sweep, isovalue, &[arc])? {
            Some(found) => self.start_found(found, isovalue, idle, scope),
            None => {
                log::debug!("no component of arc {arc} at isovalue {isovalue}");
                lock(&self.counts).lost += 1;
                self.leave(arc, idle, scope);
            }
        }
        Ok(())
    }

    /// Tracks arcs both ways from their exact extraction.
    fn start_found<'s>(
        &'s self,
        (extraction, order): (Extraction, Vec<usize>),
        isovalue: f64,
        idle: Idle,
        scope: &Scope<'s>,
    ) {
        for (exact, arc) in extraction.into_components().into_iter().zip(order) {
            scope.spawn(move |scope| {
                self.attempt(|| self.start_arc(&self.piece(arc), isovalue, &exact, idle, scope));
            });
        }
    }

    /// Starts the mesh of an arc and tracks it both ways.
    fn start_arc<'s>(
        &'s self,
        piece: &Piece,
        isovalue: f64,
        exact: &Extraction,
        idle: Idle,
        scope: &Scope<'s>,
    ) -> Result<()> {
        let sweep = self.sweep;
        let given = sweep.initial.of(piece, isovalue).is_some();
        let length = piece.high - piece.low;
        if self.is_unresolved(piece.arc) {
            self.leave(piece.arc, idle, scope);
            return Ok(());
        }
        let motion = motion(sweep, exact, length);
        let is_still = motion < FRESH_MOTION && length < ASKED_SHARE * self.range_length();
        let is_long = motion >= LONG_MOTION || length >= LONG_SHARE * self.range_length();
        let smallest = if is_long { SMALLEST_FACES } else { SMALL_FACES };
        let is_over = idle.is_over();
        if (is_still && !is_over || exact.faces.len() < smallest) && !given {
            let idle = if is_over { Idle::after(idle.toil()) } else { idle };
            self.leave(piece.arc, idle, scope);
            return Ok(());
        }
        let mut kernels = sweep.backend.kernels(&sweep.field)?;
        let again = u64::from(idle.had_mesh());
        let counts = Counts { begun: 1 - again, extracted_afresh: again, ..Counts::default() };
        lock(&self.counts).add(&counts);
        let Some(mut front) = start_front(sweep, piece, isovalue, exact, kernels.as_mut())? else {
            let idle = Idle::after(idle.toil());
            log::debug!("no mesh of arc {} at {isovalue}: {idle:?}", piece.arc);
            self.leave(piece.arc, idle, scope);
            return Ok(());
        };
        front.toil = idle.toil();
        let branch = |run: Run| Front {
            mesh: front.mesh.clone(),
            recorder: front.recorder.branch(run.of_arc(piece.arc)),
            at: isovalue,
            toil: front.toil,
        };
        let [up, down] = [branch(Run::Up), branch(Run::Down)];
        lock(&self.log).append(front.recorder.into_log());
        let arc = piece.arc;
        scope.spawn(move |scope| self.attempt(|| self.run(arc, Direction::Up, up, scope)));
        scope.spawn(move |scope| self.attempt(|| self.run(arc, Direction::Down, down, scope)));
        Ok(())
    }

    /// Leaves all of an arc to the exact extraction.
    fn leave<'s>(&'s self, arc: usize, idle: Idle, scope: &Scope<'s>) {
        let piece = self.piece(arc);
        let idle = self.beyond(idle, arc);
        self.sweep.advance_progress(self.sweep.weight(&piece));
        lock(&self.leftovers).push(piece);
        self.arrive(arc, Direction::Up, Err(idle), scope);
        self.arrive(arc, Direction::Down, Err(idle), scope);
    }

    /// After all of an arc without a mesh.
    fn beyond(&self, idle: Idle, arc: usize) -> Idle {
        let Piece { low, high, .. } = self.piece(arc);
        idle.go_on(self.slopes.motion(low, high))
    }

    /// Tracks the mesh of an arc to its end in one direction.
    fn run<'s>(
        &'s self,
        arc: usize,
        direction: Direction,
        mut front: Front,
        scope: &Scope<'s>,
    ) -> Result<()> {
        let mut counts = Counts::default();
        let piece = self.piece(arc);
        let end = if direction == Direction::Up { piece.high } else { piece.low };
        let node = self.node_ahead(arc, direction);
        let goes_on = node.is_some_and(|n| !outputs(&self.graph.nodes[n], direction).is_empty());
        let window = match node {
            Some(n) if goes_on => window(self.sweep, &self.graph.nodes[n], &piece, &front.mesh),
            _ => 0.0,
        };
        let last = end - direction.sign() * self.margin(&piece);
        let arrived = self.track_to(&mut front, arc, direction, [last, window], &mut counts)?;
        log::debug!(
            "arc {arc} [{}, {}) {direction:?}: {} of {last}, {} faces, {:?}, {counts:?}",
            piece.low,
            piece.high,
            front.at,
            front.mesh.n_faces(),
            front.toil
        );
        lock(&self.counts).add(&counts);
        self.sweep.advance_progress(0.5 * self.sweep.weight(&piece));
        let front = if arrived && goes_on {
            Ok(front)
        } else {
            let idle = Idle::after(front.toil);
            self.end(front, arc, direction, arrived);
            Err(idle)
        };
        self.arrive(arc, direction, front, scope);
        Ok(())
    }

    /// Ends a mesh that goes no farther: at the end of its arc if it has `arrived` just before it,
    /// else where it is, and the rest of the arc is left over.
    fn end(&self, front: Front, arc: usize, direction: Direction, arrived: bool) {
        let piece = self.piece(arc);
        let end = if direction == Direction::Up { piece.high } else { piece.low };
        if arrived {
            lock(&self.log).append(end_all(front, end));
        } else {
            let at = front.at;
            lock(&self.log).append(front.recorder.finish(at));
            lock(&self.leftovers).push(Piece { arc, low: at.min(end), high: at.max(end) });
        }
    }

    /// How near to the end of a piece a mesh is tracked where nothing follows.
    fn margin(&self, piece: &Piece) -> f64 {
        let share = 1e-3 * (piece.high - piece.low).min(0.01 * self.range_length());
        share.max(self.resolution())
    }

    /// Isovalues nearer to each other than this are hardly told apart: some places of the last digit.
    fn resolution(&self) -> f64 {
        let (low, high) = self.sweep.range;
        RESOLUTION * f64::EPSILON * low.abs().max(high.abs())
    }

    fn range_length(&self) -> f64 {
        self.sweep.range.1 - self.sweep.range.0
    }

    /// Tracks a mesh to an isovalue; true if it gets there, or as near as the window says.
    fn track_to(
        &self,
        front: &mut Front,
        arc: usize,
        direction: Direction,
        [last, window]: [f64; 2],
        counts: &mut Counts,
    ) -> Result<bool> {
        let sweep = self.sweep;
        let range = sweep.range.1 - sweep.range.0;
        let fixed = sweep
            .parameters
            .step
            .or_else(|| sweep.parameters.samples.map(|n| range / n.max(1) as f64));
        let piece = self.piece(arc);
        let way = Way {
            direction,
            last,
            window,
            fixed: fixed.map(|step| (sweep.range.0, step)),
            min_step: (1e-5 * range.min(100.0 * (piece.high - piece.low))).max(self.resolution()),
            resolution: self.resolution(),
        };
        let repair: &Repair =
            &|front, at, kernels, counts| repair(sweep, arc, direction, front, at, kernels, counts);
        let tracking = Tracking {
            field: &sweep.field,
            parameters: sweep.parameters,
            way: &way,
            cancelled: &|| sweep.cancelled(),
            repair,
        };
        let mut kernels = sweep.backend.kernels(&sweep.field)?;
        let mut again = Again::new(sweep, arc, direction, last);
        loop {
            let end = track(front, kernels.as_mut(), &tracking, counts)?;
            if end == End::Arrived {
                return Ok(true);
            }
            match again.begin(front, end, kernels.as_mut(), counts)? {
                Some(before) => {
                    lock(&self.log).append(before.log);
                    lock(&self.leftovers).extend(before.untracked);
                }
                None => return Ok(false),
            }
        }
    }

    /// The node that the sweep passes at the end of an arc.
    fn node_ahead(&self, arc: usize, direction: Direction) -> Option<usize> {
        let side = usize::from(direction == Direction::Up);
        self.graph.ends[arc][side].filter(|&n| self.direction_of(n) == direction)
    }

    /// An arc is done: once all that lead to the node are, the node is passed.
    fn arrive<'s>(
        &'s self,
        arc: usize,
        direction: Direction,
        front: std::result::Result<Front, Idle>,
        scope: &Scope<'s>,
    ) {
        let Some(node) = self.node_ahead(arc, direction) else { return };
        let mut waiting = lock(&self.waiting[node]);
        waiting.push((arc, front));
        if waiting.len() == inputs(&self.graph.nodes[node], direction).len() {
            let arrivals = std::mem::take(&mut *waiting);
            scope.spawn(move |scope| self.attempt(|| self.pass(node, arrivals, scope)));
        }
    }

    /// Whether an arc has too few isovalues for a mesh that moves in steps: beside a large offset.
    fn is_unresolved(&self, arc: usize) -> bool {
        self.length(arc) < RESOLVED * self.resolution()
    }

    /// Whether an arc is too short for a mesh of its own.
    fn is_short(&self, arc: usize) -> bool {
        self.length(arc) < self.short
    }

    fn length(&self, arc: usize) -> f64 {
        let piece = self.piece(arc);
        piece.high - piece.low
    }
}

/// The arcs that lead to a node.
fn inputs(node: &Node, direction: Direction) -> &[usize] {
    if direction == Direction::Up { &node.below } else { &node.above }
}

/// The arcs beyond a node.
fn outputs(node: &Node, direction: Direction) -> &[usize] {
    if direction == Direction::Up { &node.above } else { &node.below }
}
