//! The exact extraction of whole stretches of isovalues at once: where no mesh is tracked.
//!
//! While no sample of a cell is passed, no face of it changes its decision and no body saddle is
//! passed, the exact extraction inside the cell keeps its triangles, and its vertices slide along
//! their lattice edges, linearly in the isovalue. So one record per triangle and such interval,
//! and two knots per lattice edge, show the exact topology at every isovalue, whatever the number of
//! events: the size depends on the cells alone. The triangles are those of an exact marching cubes.

use std::collections::HashMap;

use glam::Vec3;
use rayon::prelude::*;

use super::{Piece, Sweep};
use crate::error::Result;
use crate::extract::{Extraction, extract_cell};
use crate::spectrum::{Knot, Patch, Triangle, normal};
use crate::topology::critical::Place;

/// Layers of cells that one task covers.
const LAYERS: usize = 4;

/// How near to a sample, as a share of the lattice edge, a vertex comes.
const EDGE_MARGIN: f64 = 1e-4;

/// How near to the border, as a share of an edge into the layer, a cap's vertex comes: what is
/// nearer could be taken for the isosurface proper.
const CAP_MARGIN: f64 = 0.01;

/// Where in an interval, as shares of it, vertices inside cells are placed: first and last stand for its
/// ends.
const INNER_SHARES: [f64; 5] = [0.02, 0.25, 0.5, 0.75, 0.98];

/// A vertex before it is numbered: a lattice edge (its lower end and its axis), or a vertex inside a
/// cell by its number within the task.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
enum Key {
    Edge(u32, u8),
    Inner(u32),
}

/// A triangle over the isovalues at which it shows.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Record {
    vertices: [Key; 3],
    low: f64,
    high: f64,
    cap: bool,
}

/// A vertex inside a cell: where it is from one end of an interval to the other, voxel frame.
#[derive(Clone, Copy, Debug)]
struct Inner {
    isovalues: [f64; INNER_SHARES.len()],
    positions: [[f32; 3]; INNER_SHARES.len()],
}

/// A knot before its isovalue has a rank: isovalue, position, normal.
type Unranked = (f64, Vec3, [i16; 2]);

/// The trajectories of a patch: the knots of one from one entry of `first` to the next.
struct Trajectories {
    knots: Vec<Unranked>,
    first: Vec<u32>,
}

impl Trajectories {
    fn len(&self) -> usize {
        self.first.len() - 1
    }

    fn push(&mut self, knots: &[Unranked]) {
        self.knots.extend(knots);
        self.first.push(self.knots.len() as u32);
    }
}

/// What one task finds.
#[derive(Debug, Default)]
struct Slab {
    records: Vec<Record>,
    inner: Vec<Inner>,
}

/// The intervals of isovalues to show.
struct Shown {
    by_arc: Vec<Vec<(f64, f64)>>,
    /// All of them merged, ascending.
    merged: Vec<(f64, f64)>,
    /// Per arc: up to where everything is to be shown that its component becomes, if it is to be shown
    /// at its upper end.
    beyond: Vec<f64>,
}

/// The exact extraction over all the given stretches, as one patch.
pub(super) fn patch(sweep: &Sweep, stretches: &[Piece]) -> Result<Patch> {
    let shown = &Shown::new(sweep, stretches);
    let body_saddles = body_saddles(sweep);
    log::debug!(
        "the exact extraction shows over {} stretches, {} intervals",
        stretches.len(),
        shown.merged.len()
    );
    let n_layers = sweep.exact.dims()[2] - 1;
    let slabs: Vec<Result<Slab>> = (0..n_layers.div_ceil(LAYERS))
        .into_par_iter()
        .map(|s| {
            sweep.cancelled()?;
            let layers = s * LAYERS..((s + 1) * LAYERS).min(n_layers);
            Ok(slab(sweep, shown, &body_saddles, layers))
        })
        .collect();
    let slabs = slabs.into_iter().collect::<Result<Vec<Slab>>>()?;
    log::debug!("{} triangles of it", slabs.iter().map(|s| s.records.len()).sum::<usize>());
    Ok(joined(sweep, shown, &slabs))
}

impl Shown {
    fn new(sweep: &Sweep, stretches: &[Piece]) -> Self {
        let mut by_arc = vec![Vec::new(); sweep.topology.arcs.len()];
        let mut all: Vec<(f64, f64)> = Vec::new();
        for s in stretches.iter().filter(|s| s.low < s.high) {
            by_arc[s.arc].push((s.low, s.high));
            all.push((s.low, s.high));
        }
        all.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut merged: Vec<(f64, f64)> = Vec::new();
        for (low, high) in all {
            match merged.last_mut() {
                Some(last) if low <= last.1 => last.1 = last.1.max(high),
                _ => merged.push((low, high)),
            }
        }
        by_arc.iter_mut().for_each(|s| s.sort_by(|a, b| a.0.total_cmp(&b.0)));
        let beyond = beyond(sweep, &by_arc);
        Shown { by_arc, merged, beyond }
    }

    /// The merged intervals that overlap an interval.
    fn overlapping(&self, low: f64, high: f64) -> &[(f64, f64)] {
        let first = self.merged.partition_point(|m| m.1 <= low);
        let last = self.merged.partition_point(|m| m.0 < high);
        &self.merged[first..last.max(first)]
    }
}

/// See [`Shown::beyond`]. Where noise makes a component meet thousands of others, it is followed at
/// once to where a mesh takes over.
fn beyond(sweep: &Sweep, by_arc: &[Vec<(f64, f64)>]) -> Vec<f64> {
    let arcs = &sweep.topology.arcs;
    let mut descending: Vec<usize> = (0..arcs.len()).collect();
    descending.sort_by_key(|&a| std::cmp::Reverse(arcs[a].death_event.map_or(u32::MAX, |e| e)));
    let mut from_event = vec![f64::INFINITY; sweep.topology.events.len()];
    let mut beyond = vec![f64::INFINITY; arcs.len()];
    for a in descending {
        if let Some(death) = arcs[a].death_event {
            beyond[a] = from_event[death as usize];
        }
        if let Some(birth) = arcs[a].birth_event {
            let (low, high) = sweep.shown(&arcs[a]);
            let until = if low >= high {
                beyond[a]
            } else {
                match by_arc[a].first() {
                    Some(first) if first.0 > low => low,
                    Some(first) if first.1 < high => first.1,
                    Some(_) => beyond[a],
                    None => low,
                }
            };
            let from = &mut from_event[birth as usize];
            *from = from.min(until);
        }
    }
    beyond
}

/// Isovalues of the body saddles by cell.
fn body_saddles(sweep: &Sweep) -> HashMap<u32, Vec<f64>> {
    let mut saddles: HashMap<u32, Vec<f64>> = HashMap::new();
    for e in &sweep.topology.events {
        if let Place::Cell(corner) = e.place {
            saddles.entry(corner).or_default().push(e.isovalue);
        }
    }
    saddles
}

/// The records of some layers of cells.
fn slab(
    sweep: &Sweep,
    shown: &Shown,
    body_saddles: &HashMap<u32, Vec<f64>>,
    layers: std::ops::Range<usize>,
) -> Slab {
    let mut slab = Slab::default();
    let [nx, ny, _] = sweep.exact.dims();
    for k in layers {
        for j in 0..ny - 1 {
            for i in 0..nx - 1 {
                let corner = (i + nx * (j + ny * k)) as u32;
                let values = corner_values(sweep, corner);
                let low = values.iter().copied().fold(f64::INFINITY, f64::min);
                let high = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
                let intervals = shown.overlapping(low, high);
                if low < high && !intervals.is_empty() {
                    let own = body_saddles.get(&corner).map_or(&[][..], Vec::as_slice);
                    let breaks = breaks(&values, own, intervals);
                    slab.add_cell(sweep, shown, corner, &breaks);
                }
            }
        }
    }
    slab
}

fn corner_values(sweep: &Sweep, corner: u32) -> [f64; 8] {
    sweep.exact.cell_offsets().map(|o| sweep.exact.sample(corner + o))
}

/// The isovalues at which a cell's triangles may change, ascending, the ends of the intervals to
/// show among them.
fn breaks(values: &[f64; 8], body_saddles: &[f64], intervals: &[(f64, f64)]) -> Vec<f64> {
    let mut breaks: Vec<f64> = values.to_vec();
    breaks.extend(body_saddles);
    breaks.extend(intervals.iter().flat_map(|i| [i.0, i.1]));
    // The two faces normal to each axis; corners in the order of the lattice, so that both cells of
    // a face compute the same number.
    for axis in 0..3 {
        let (u, v) = (1 << ((axis + 1) % 3), 1 << ((axis + 2) % 3));
        for base in [0, 1 << axis] {
            let [a, b, c, d] = [base, base + u, base + v, base + u + v].map(|c: usize| values[c]);
            let alternates = a.max(d) < b.min(c) || b.max(c) < a.min(d);
            if alternates {
                breaks.push((a * d - b * c) / (a + d - b - c));
            }
        }
    }
    breaks.sort_by(f64::total_cmp);
    breaks.dedup();
    breaks
}

impl Slab {
    /// Adds the records of one cell.
    fn add_cell(&mut self, sweep: &Sweep, shown: &Shown, corner: u32, breaks: &[f64]) {
        let first = self.records.len();
        for ends in breaks.windows(2) {
            let (low, high) = (ends[0], ends[1]);
            if shown.overlapping(low, high).is_empty() {
                continue;
            }
            let middle = low + 0.5 * (high - low);
            let surface = extract_cell(&sweep.exact, corner, middle);
            if surface.faces.is_empty() {
                continue;
            }
            let keys = self.keys(sweep, corner, &surface, [low, high]);
            let crossings = surface.component_crossings();
            let components: Vec<Vec<(f64, f64)>> =
                crossings.iter().map(|&c| shown_intervals(sweep, shown, c, low, high)).collect();
            for (f, face) in surface.faces.iter().enumerate() {
                for &(low, high) in &components[surface.components[f] as usize] {
                    let vertices = face.map(|v| keys[v as usize]);
                    self.records.push(Record { vertices, low, high, cap: surface.caps[f] });
                }
            }
        }
        merge_consecutive(&mut self.records, first);
    }

    /// The keys of an extraction's vertices; those inside the cell are added.
    fn keys(
        &mut self,
        sweep: &Sweep,
        corner: u32,
        surface: &Extraction,
        ends: [f64; 2],
    ) -> Vec<Key> {
        let has_inner = surface.crossings.contains(&None);
        let placed = has_inner.then(|| {
            INNER_SHARES.map(|share| {
                let e = extract_cell(&sweep.exact, corner, ends[0] + share * (ends[1] - ends[0]));
                // The same vertices in the same order, however they are joined.
                let same = e.crossings == surface.crossings;
                if same { e.positions } else { surface.positions.clone() }
            })
        });
        let mut isovalues = INNER_SHARES.map(|share| ends[0] + share * (ends[1] - ends[0]));
        (isovalues[0], isovalues[INNER_SHARES.len() - 1]) = (ends[0], ends[1]);
        let strides = sweep.exact.strides();
        let crossings = surface.crossings.iter().enumerate();
        crossings
            .map(|(v, crossing)| match (crossing, &placed) {
                (Some((a, b)), _) => {
                    let (from, to) = (*a.min(b), *a.max(b));
                    let axis = strides.iter().position(|&s| s == to - from);
                    Key::Edge(from, axis.expect("a lattice edge") as u8)
                }
                (None, Some(placed)) => {
                    let positions = std::array::from_fn(|i| placed[i][v]);
                    self.inner.push(Inner { isovalues, positions });
                    Key::Inner(self.inner.len() as u32 - 1)
                }
                (None, None) => unreachable!("vertices inside the cell were placed"),
            })
            .collect()
    }
}

/// Where in an interval the component with a crossing is to be shown.
fn shown_intervals(
    sweep: &Sweep,
    shown: &Shown,
    crossing: (u32, u32),
    low: f64,
    high: f64,
) -> Vec<(f64, f64)> {
    let mut found: Vec<(f64, f64)> = Vec::new();
    for &(a, b) in shown.overlapping(low, high) {
        walk_arcs(sweep, shown, crossing, [low.max(a), high.min(b)], &mut found);
    }
    found
}

/// Follows the component with a crossing through the arcs of an interval and adds where it shows.
fn walk_arcs(
    sweep: &Sweep,
    shown: &Shown,
    crossing: (u32, u32),
    [low, high]: [f64; 2],
    found: &mut Vec<(f64, f64)>,
) {
    let tiny = 1e-10 * (sweep.range.1 - sweep.range.0);
    let mut at = low;
    while at < high {
        let probe = (at + tiny).min(at + 0.5 * (high - at));
        let arc = sweep.topology.arc_of(crossing.0, crossing.1, probe);
        let Some(arc) = arc else { break };
        let end = sweep.shown(&sweep.topology.arcs[arc]).1;
        let mut next = if end > at { end } else { probe };
        for &(a, b) in &shown.by_arc[arc] {
            let b = if b == end { shown.beyond[arc].max(end) } else { b };
            let (a, b) = (a.max(at), b.min(high));
            if a >= b {
                continue;
            }
            next = next.max(b);
            match found.last_mut() {
                Some(last) if last.1 == a => last.1 = b,
                _ => found.push((a, b)),
            }
        }
        let end = next.min(high);
        if end <= at {
            break;
        }
        at = end;
    }
}

/// Joins records of one triangle over intervals that follow each other.
fn merge_consecutive(records: &mut Vec<Record>, first: usize) {
    let mut cell: Vec<Record> = records.drain(first..).collect();
    cell.sort_by(|a, b| a.vertices.cmp(&b.vertices).then(a.low.total_cmp(&b.low)));
    for r in cell {
        match records[first..].last_mut() {
            Some(last) if last.vertices == r.vertices && last.high == r.low => last.high = r.high,
            _ => records.push(r),
        }
    }
}

/// One patch of all slabs.
fn joined(sweep: &Sweep, shown: &Shown, slabs: &[Slab]) -> Patch {
    let mut numbers = vec![u32::MAX; 3 * sweep.exact.n_vertices()];
    let mut trajectories = Trajectories { knots: Vec::new(), first: vec![0] };
    let range =
        (shown.merged.first().map_or(0.0, |m| m.0), shown.merged.last().map_or(0.0, |m| m.1));
    let mut triangles: Vec<([u32; 3], f64, f64, bool)> = Vec::new();
    for slab in slabs {
        let inner_base = trajectories.len() as u32;
        slab.inner.iter().for_each(|i| trajectories.push(&inner_trajectory(sweep, i)));
        for r in &slab.records {
            let vertices = r.vertices.map(|key| match key {
                Key::Inner(i) => inner_base + i,
                Key::Edge(from, axis) => {
                    let number = &mut numbers[3 * from as usize + axis as usize];
                    if *number == u32::MAX {
                        *number = trajectories.len() as u32;
                        trajectories.push(&edge_trajectory(sweep, from, axis, range));
                    }
                    *number
                }
            });
            triangles.push((vertices, r.low, r.high, r.cap));
        }
    }
    cover(&mut trajectories, &triangles);
    let mut isovalues: Vec<f64> = trajectories.knots.iter().map(|k| k.0).collect();
    isovalues.extend(triangles.iter().flat_map(|t| [t.1, t.2]));
    isovalues.sort_by(f64::total_cmp);
    isovalues.dedup();
    let rank = |c: f64| isovalues.partition_point(|&x| x < c) as u32;
    let mut patch = Patch { first_knot: trajectories.first, ..Patch::default() };
    let knot = |(c, p, normal): Unranked| Knot { rank: rank(c), position: p.to_array(), normal };
    patch.knots = trajectories.knots.into_iter().map(knot).collect();
    patch.triangles = triangles
        .into_iter()
        .map(|(vertices, low, high, cap)| Triangle {
            vertices,
            birth: rank(low),
            death: rank(high),
            cap,
        })
        .collect();
    patch.isovalues = isovalues;
    patch
}

/// Makes trajectories last as long as their triangles. The exact field rounds samples that are no
/// integers, so an edge may be crossed a trace before or after its samples' values are reached.
fn cover(trajectories: &mut Trajectories, triangles: &[([u32; 3], f64, f64, bool)]) {
    for (vertices, low, high, _) in triangles {
        for v in vertices.map(|v| v as usize) {
            let [first, end] = [0, 1].map(|n| trajectories.first[v + n] as usize);
            let knots = &mut trajectories.knots[first..end];
            let last = knots.len() - 1;
            knots[0].0 = knots[0].0.min(*low);
            knots[last].0 = knots[last].0.max(*high);
        }
    }
}

/// The way of a vertex along its lattice edge, clipped to a range of isovalues.
fn edge_trajectory(sweep: &Sweep, from: u32, axis: u8, range: (f64, f64)) -> [Unranked; 2] {
    let to = from + sweep.exact.strides()[axis as usize];
    let (fa, fb) = (sweep.exact.sample(from), sweep.exact.sample(to));
    let margin = |v: u32| if sweep.exact.is_in_layer(v) { CAP_MARGIN } else { EDGE_MARGIN };
    // An edge into the layer keeps away from the sample at the border.
    let (near_from, near_to) = (margin(to), 1.0 - margin(from));
    let base = Vec3::from(sweep.exact.position(from).map(|x| x as f32));
    let voxel = Vec3::from(sweep.exact.volume().voxel_size().map(|x| x as f32));
    let (na, nb) = (sample_normal(sweep, from), sample_normal(sweep, to));
    let at = |c: f64| {
        let t = ((c - fa) / (fb - fa)).clamp(near_from, near_to) as f32;
        let mut p = base;
        p[axis as usize] += t;
        (c, p * voxel, normal::encode(na.lerp(nb, t).normalize_or(Vec3::Z).to_array()))
    };
    let (low, high) = (fa.min(fb).max(range.0), fa.max(fb).min(range.1));
    [at(low), at(high)]
}

/// The trajectory of a vertex inside a cell.
fn inner_trajectory(sweep: &Sweep, inner: &Inner) -> [Unranked; INNER_SHARES.len()] {
    std::array::from_fn(|i| {
        let p = Vec3::from(inner.positions[i]);
        let n = -sweep.field.gradient(p).normalize_or(Vec3::NEG_Z);
        (inner.isovalues[i], p, normal::encode(n.to_array()))
    })
}

/// Unit normal at a sample, towards lower values, from central differences.
fn sample_normal(sweep: &Sweep, vertex: u32) -> Vec3 {
    let dims = sweep.exact.volume().dims().map(|d| d as i64);
    let voxel = sweep.exact.volume().voxel_size();
    let p = sweep.exact.position(vertex);
    let inside = std::array::from_fn::<i64, 3, _>(|a| p[a].clamp(0, dims[a] - 1));
    let value = |q: [i64; 3]| sweep.exact.volume().padded(q[0], q[1], q[2]);
    let slope = |a: usize| {
        let (mut before, mut after) = (inside, inside);
        before[a] = (inside[a] - 1).max(0);
        after[a] = (inside[a] + 1).min(dims[a] - 1);
        ((value(after) - value(before)) / ((after[a] - before[a]).max(1) as f64 * voxel[a])) as f32
    };
    -Vec3::new(slope(0), slope(1), slope(2)).normalize_or(Vec3::NEG_Z)
}
