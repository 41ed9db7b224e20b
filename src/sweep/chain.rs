//! The order of the sweep: from the start isovalue up and down through the arcs of the contour tree.
//!
//! An arc is tracked from where its mesh comes from to the node at its end. A node waits for all
//! arcs that lead to it; then surgery turns their meshes into those of the arcs beyond it. What is
//! done depends on the meshes and the field only, never on which task ends first.

use std::sync::Mutex;

use glam::Vec3;
use rayon::Scope;

use super::graph::{Graph, Node};
use super::recorder::{Direction, Log, Run};
use super::start::{extraction_of_arcs, start_front};
use super::surgery::{Front, Operation, end_all, operate};
use super::track::{Repair, Tracking, Way, track};
use super::{Counts, Piece, Sweep};
use crate::error::{Error, Result};
use crate::extract::Extraction;
use crate::kernels::Kernels;

/// Pieces shorter than this share of the range do not get a mesh of their own.
const SHORT_SHARE: f64 = 5e-4;

/// Nor do components with fewer faces at the middle of their arc.
const SMALL_FACES: usize = 300;

/// Share of an arc, at an event, over which surgery leads at most and at least.
const WINDOW_SHARE: (f64, f64) = (0.01, 0.2);

/// Distance from an event, voxels, at which the field tells how far sheets are apart.
const WINDOW_RADIUS: f32 = 0.35;

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
    waiting: Vec<Mutex<Arrivals>>,
    log: Mutex<Log>,
    leftovers: Mutex<Vec<Piece>>,
    counts: Mutex<Counts>,
    failed: Mutex<Option<Error>>,
}

/// The arcs that have arrived at a node, with their meshes.
#[derive(Default)]
struct Arrivals(Vec<(usize, Option<Front>)>);

/// A lock, also where another task has panicked.
fn lock<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
}

/// Sweeps all arcs.
pub(super) fn sweep_all(sweep: &Sweep, counts: &mut Counts) -> Result<Swept> {
    let graph = Graph::new(sweep);
    let chain = Chain {
        sweep,
        start: sweep.start_isovalue(),
        waiting: graph.nodes.iter().map(|_| Mutex::default()).collect(),
        graph,
        log: Mutex::default(),
        leftovers: Mutex::default(),
        counts: Mutex::new(*counts),
        failed: Mutex::new(None),
    };
    log::debug!("{} nodes, start at {}", chain.graph.nodes.len(), chain.start);
    rayon::scope(|scope| chain.begin(scope));
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
    fn begin<'s>(&'s self, scope: &Scope<'s>) {
        let at_start: Vec<usize> = (0..self.sweep.topology.arcs.len())
            .filter(|&a| {
                let (low, high) = self.sweep.shown(&self.sweep.topology.arcs[a]);
                low <= self.start && self.start < high
            })
            .collect();
        self.attempt(|| self.start_arcs(&at_start, self.start, scope));
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

    /// Extracts arcs at an isovalue and tracks each both ways.
    fn start_arcs<'s>(&'s self, arcs: &[usize], isovalue: f64, scope: &Scope<'s>) -> Result<()> {
        let (extraction, order) = extraction_of_arcs(self.sweep, isovalue, arcs)?;
        for (component, &arc) in order.iter().enumerate() {
            let exact = extraction.with_components(|c| c as usize == component);
            scope.spawn(move |scope| {
                self.attempt(|| self.start_arc(&self.piece(arc), isovalue, &exact, scope));
            });
        }
        Ok(())
    }

    /// Starts the mesh of an arc and tracks it both ways.
    fn start_arc<'s>(
        &'s self,
        piece: &Piece,
        isovalue: f64,
        exact: &Extraction,
        scope: &Scope<'s>,
    ) -> Result<()> {
        let sweep = self.sweep;
        let given = sweep.initial.of(piece, isovalue).is_some();
        let short = piece.high - piece.low < SHORT_SHARE * (sweep.range.1 - sweep.range.0);
        let front = if (short || exact.faces.len() < SMALL_FACES) && !given {
            None
        } else {
            let mut kernels = sweep.backend.kernels(&sweep.field)?;
            lock(&self.counts).extracted_afresh += 1;
            start_front(sweep, piece, isovalue, exact, kernels.as_mut())?
        };
        let Some(front) = front else {
            lock(&self.leftovers).push(*piece);
            self.arrive(piece.arc, Direction::Up, None, scope);
            self.arrive(piece.arc, Direction::Down, None, scope);
            return Ok(());
        };
        let branch = |run: Run| Front {
            mesh: front.mesh.clone(),
            recorder: front.recorder.branch(run.of_arc(piece.arc)),
            at: isovalue,
        };
        let [up, down] = [branch(Run::Up), branch(Run::Down)];
        lock(&self.log).append(front.recorder.into_log());
        let arc = piece.arc;
        scope.spawn(move |scope| self.attempt(|| self.run(arc, Direction::Up, up, scope)));
        scope.spawn(move |scope| self.attempt(|| self.run(arc, Direction::Down, down, scope)));
        Ok(())
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
        let margin = match node {
            Some(n) if goes_on => self.window(&self.graph.nodes[n], &piece),
            _ => 1e-3 * (piece.high - piece.low).min(0.01 * self.range_length()),
        };
        let last = end - direction.sign() * margin;
        let arrived = self.track_to(&mut front, arc, direction, last, &mut counts)?;
        log::debug!(
            "arc {arc} [{}, {}) {direction:?}: {} of {last}, {} faces, {counts:?}",
            piece.low,
            piece.high,
            front.at,
            front.mesh.n_faces()
        );
        lock(&self.counts).add(&counts);
        self.sweep.advance_progress(0.5 * self.sweep.weight(&piece));
        if arrived && goes_on {
            self.arrive(arc, direction, Some(front), scope);
            return Ok(());
        }
        if arrived {
            lock(&self.log).append(end_all(front, end));
        } else {
            let at = front.at;
            lock(&self.log).append(front.recorder.finish(at));
            lock(&self.leftovers).push(Piece { arc, low: at.min(end), high: at.max(end) });
        }
        self.arrive(arc, direction, None, scope);
        Ok(())
    }

    fn range_length(&self) -> f64 {
        self.sweep.range.1 - self.sweep.range.0
    }

    /// Tracks a mesh to an isovalue; true if it gets there.
    fn track_to(
        &self,
        front: &mut Front,
        arc: usize,
        direction: Direction,
        last: f64,
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
            fixed: fixed.map(|step| (sweep.range.0, step)),
            min_step: 1e-5 * range.min(100.0 * (piece.high - piece.low)),
        };
        let repair: &Repair = &|front, to, kernels, counts| {
            repair(sweep, arc, direction, front, to, kernels, counts)
        };
        let tracking = Tracking {
            field: &sweep.field,
            parameters: sweep.parameters,
            way: &way,
            cancelled: &|| sweep.cancelled(),
            repair,
        };
        let mut kernels = sweep.backend.kernels(&sweep.field)?;
        track(front, kernels.as_mut(), &tracking, counts)
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
        front: Option<Front>,
        scope: &Scope<'s>,
    ) {
        let Some(node) = self.node_ahead(arc, direction) else { return };
        let mut waiting = lock(&self.waiting[node]);
        waiting.0.push((arc, front));
        if waiting.0.len() == inputs(&self.graph.nodes[node], direction).len() {
            let arrivals = std::mem::take(&mut waiting.0);
            scope.spawn(move |scope| self.attempt(|| self.pass(node, arrivals, scope)));
        }
    }

    /// Passes a node: surgery on the meshes that have arrived, or new meshes for the arcs beyond.
    fn pass<'s>(
        &'s self,
        node: usize,
        mut arrivals: Vec<(usize, Option<Front>)>,
        scope: &Scope<'s>,
    ) -> Result<()> {
        let direction = self.direction_of(node);
        let node = &self.graph.nodes[node];
        let arcs = outputs(node, direction);
        arrivals.sort_by_key(|a| a.0);
        let fronts: Vec<Front> = arrivals.into_iter().filter_map(|a| a.1).collect();
        if fronts.is_empty() || arcs.is_empty() {
            return self.start_beyond(arcs, scope);
        }
        let points: Vec<Vec3> = node
            .events
            .iter()
            .map(|&e| Vec3::from(self.sweep.topology.events[e as usize].position.map(|x| x as f32)))
            .collect();
        let window =
            arcs.iter().map(|&a| self.window(node, &self.piece(a))).fold(f64::INFINITY, f64::min);
        let operation = Operation {
            direction,
            event: node.isovalue,
            after: node.isovalue + direction.sign() * window,
            points: &points,
            arcs,
            repaired: false,
        };
        let mut counts = Counts::default();
        let mut kernels = self.sweep.backend.kernels(&self.sweep.field)?;
        match operate(self.sweep, &operation, fronts, kernels.as_mut(), &mut counts)? {
            Ok(outcome) => {
                counts.surgeries += 1;
                lock(&self.counts).add(&counts);
                lock(&self.log).append(outcome.log);
                for (arc, front) in outcome.fronts {
                    scope.spawn(move |scope| {
                        self.attempt(|| self.run(arc, direction, front, scope));
                    });
                }
                Ok(())
            }
            Err(fronts) => {
                counts.surgeries_failed += 1;
                lock(&self.counts).add(&counts);
                for front in fronts {
                    lock(&self.log).append(end_all(front, node.isovalue));
                }
                self.start_beyond(arcs, scope)
            }
        }
    }

    /// Starts arcs in their middle.
    fn start_beyond<'s>(&'s self, arcs: &[usize], scope: &Scope<'s>) -> Result<()> {
        for &arc in arcs {
            let piece = self.piece(arc);
            if piece.high - piece.low < SHORT_SHARE * self.range_length() {
                lock(&self.leftovers).push(piece);
                self.arrive(arc, Direction::Up, None, scope);
                self.arrive(arc, Direction::Down, None, scope);
            } else {
                self.start_arcs(&[arc], self.sweep.middle(&piece), scope)?;
            }
        }
        Ok(())
    }

    /// How far from a node, in isovalues, an arc's mesh is given up or begun: where the sheets that
    /// meet there are apart again.
    fn window(&self, node: &Node, piece: &Piece) -> f64 {
        let sweep = self.sweep;
        let unit = f64::from(sweep.field.isovalue(node.isovalue + 1.0) - sweep.field.isovalue(node.isovalue));
        let mut changes: Vec<f64> = node
            .events
            .iter()
            .map(|&e| {
                let p = Vec3::from(sweep.topology.events[e as usize].position.map(|x| x as f32));
                let here = sweep.field.isovalue(node.isovalue);
                let changes = Vec3::AXES.iter().flat_map(|&a| [a, -a]).map(|a| {
                    let change = sweep.field.value(p + WINDOW_RADIUS * a) - here;
                    f64::from(change.abs()) / unit.max(1e-300)
                });
                changes.fold(0.0, f64::max)
            })
            .collect();
        changes.sort_by(f64::total_cmp);
        let length = piece.high - piece.low;
        let typical = changes.get(changes.len() / 2).copied().unwrap_or(0.0);
        typical.clamp(WINDOW_SHARE.0 * length, WINDOW_SHARE.1 * length)
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

/// Brings the mesh of an arc to an isovalue by replacing what does not follow.
fn repair(
    sweep: &Sweep,
    arc: usize,
    direction: Direction,
    front: &mut Front,
    to: f64,
    kernels: &mut dyn Kernels,
    counts: &mut Counts,
) -> Result<bool> {
    let operation = Operation {
        direction,
        event: front.at,
        after: to,
        points: &[],
        arcs: &[arc],
        repaired: true,
    };
    match operate(sweep, &operation, vec![std::mem::take(front)], kernels, counts)? {
        Ok(mut outcome) => {
            counts.repairs += 1;
            let (_, mut repaired) = outcome.fronts.pop().expect("one front per arc");
            repaired.recorder.prepend(outcome.log);
            *front = repaired;
            Ok(true)
        }
        Err(mut fronts) => {
            *front = fronts.pop().expect("the front that was given");
            Ok(false)
        }
    }
}
