//! The triangles of exact cells, over all isovalues at which the cells are exact.
//!
//! # Theory
//!
//! While the isovalue passes no sample, face saddle or body saddle of a cell, the exact
//! extraction inside the cell has the same triangles, and its vertices move along their lattice edges linearly in
//! the isovalue. So one record per triangle and such interval, and two knots per lattice edge, represent it at every isovalue.
//!
//! # Invariants
//!
//! An interval ends at the least number at which the exact field decides otherwise ([`ExactField::vertex_value`],
//! [`ExactField::face_saddle_value`]), which may be a few units in the last place below a sample's value. So the extraction is the same at
//! all numbers of an interval, and cells with a common face change it at the same number.

use std::collections::HashMap;

use glam::Vec3;
use rayon::prelude::*;

use super::life::{Life, Track, merge_consecutive};
use super::record::Recorder;
use super::region::{LatticeEdge, PaddedGrid};
use super::shared::SharedPlanes;
use crate::extract::{Extraction, extract_cell};
use crate::topology::Topology;
use crate::topology::critical::GridElement;
use crate::topology::exact::ExactField;

/// Isovalues at which vertices inside cells are computed, as shares of an interval; first and last serve for its ends.
const INNER_SHARES: [f64; 5] = [0.02, 0.25, 0.5, 0.75, 0.98];

/// Cells per task.
const TASK_CELLS: usize = 1024;

/// Cells per round: the results of a round are in memory twice until they are joined.
const ROUND_CELLS: usize = 1 << 16;

/// A cell, and the isovalues between which it is exact.
#[derive(Clone, Copy, Debug)]
pub(super) struct ExactInterval {
    pub(super) cell: u32,
    pub(super) low: f64,
    pub(super) high: f64,
}

/// Sorts intervals by cell and isovalue, and joins consecutive ones of a cell.
pub(super) fn join_intervals(mut intervals: Vec<ExactInterval>) -> Vec<ExactInterval> {
    intervals.sort_by(|a, b| a.cell.cmp(&b.cell).then(a.low.total_cmp(&b.low)));
    let mut joined: Vec<ExactInterval> = Vec::with_capacity(intervals.len());
    for next in intervals {
        match joined.last_mut() {
            Some(last) if last.cell == next.cell && last.high == next.low => last.high = next.high,
            _ => joined.push(next),
        }
    }
    joined
}

/// The result of one task.
#[derive(Debug, Default)]
struct ExactTriangles {
    lives: Vec<Life>,
    /// Trajectories of vertices inside cells: isovalues and positions.
    inner: Vec<Vec<(f64, Vec3)>>,
}

/// Adds the triangles of cells in the intervals in which they are exact; returns the trajectories of vertices inside
/// cells. `intervals` is sorted.
pub(super) fn add_exact_triangles(
    record: &mut Recorder,
    field: &ExactField,
    topology: &Topology,
    intervals: &[ExactInterval],
) -> Vec<Vec<(f64, Vec3)>> {
    let shared = SharedPlanes::of(field);
    let events = &event_isovalues(field, topology, shared);
    let triangles = |intervals: &[ExactInterval]| {
        let mut triangles = ExactTriangles::default();
        for interval in intervals {
            triangles.add_cell(field, events.get(&interval.cell).map_or(&[], |e| e), interval);
        }
        triangles
    };
    let mut inner = Vec::new();
    for intervals in intervals.chunks(ROUND_CELLS) {
        let all: Vec<ExactTriangles> = intervals.par_chunks(TASK_CELLS).map(triangles).collect();
        for triangles in all {
            let base = inner.len() as u32;
            record.lives.extend(triangles.lives.into_iter().map(|mut l| {
                for t in &mut l.vertices {
                    if let Track::Inner(n) = t {
                        *n += base;
                    }
                }
                l
            }));
            inner.extend(triangles.inner);
        }
    }
    inner
}

/// Isovalues of events by cell that contains or touches them.
fn event_isovalues(
    field: &ExactField,
    topology: &Topology,
    shared: SharedPlanes,
) -> HashMap<u32, Vec<f64>> {
    let grid = PaddedGrid::of(field);
    let mut events: HashMap<u32, Vec<f64>> = HashMap::new();
    for e in &topology.events {
        if matches!(e.element, GridElement::Vertex(v) if shared.holds_sample(v)) {
            continue;
        }
        for cell in grid.cells_at(e.element) {
            events.entry(cell).or_default().push(e.isovalue);
        }
    }
    events
}

/// The isovalues at which a cell's triangles may change inside an interval, ascending, including its ends.
fn breaks(
    field: &ExactField,
    cell: u32,
    values: &[f64; 8],
    events: &[f64],
    (low, high): (f64, f64),
) -> Vec<f64> {
    let mut breaks: Vec<f64> = values.to_vec();
    breaks.extend(events);
    for axis in 0..3 {
        for corner in [cell, cell + field.strides()[axis]] {
            let saddle = field.face_saddle(corner, axis);
            breaks.extend(saddle.map(|s| field.face_saddle_value(&s)));
        }
    }
    breaks.retain(|&c| low < c && c < high);
    breaks.extend([low, high]);
    breaks.sort_by(f64::total_cmp);
    breaks.dedup();
    breaks
}

impl ExactTriangles {
    fn add_cell(&mut self, field: &ExactField, events: &[f64], interval: &ExactInterval) {
        let &ExactInterval { cell, low, high } = interval;
        let values = field.cell_offsets().map(|o| field.vertex_value(cell + o));
        let least = values.iter().copied().fold(f64::INFINITY, f64::min);
        let most = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let (low, high) = (low.max(least), high.min(most));
        if low >= high {
            return;
        }
        let first = self.lives.len();
        for ends in breaks(field, cell, &values, events, (low, high)).windows(2) {
            let (low, high) = (ends[0], ends[1]);
            // Between neighbouring floating point numbers the middle rounds to one of them; the interval contains the lower one.
            let middle = Some(low + 0.5 * (high - low)).filter(|&m| m < high).unwrap_or(low);
            let surface = extract_cell(field, cell, middle);
            let vertices = self.vertices(field, cell, &surface, [low, high]);
            for (face, &cap) in surface.faces.iter().zip(&surface.caps) {
                let vertices = face.map(|v| vertices[v as usize]);
                self.lives.push(Life { vertices, low, high, cap });
            }
        }
        merge_consecutive(&mut self.lives, first);
    }

    fn vertices(
        &mut self,
        field: &ExactField,
        cell: u32,
        surface: &Extraction,
        ends: [f64; 2],
    ) -> Vec<Track> {
        let mut isovalues = INNER_SHARES.map(|share| ends[0] + share * (ends[1] - ends[0]));
        let placed = surface.crossings.contains(&None).then(|| {
            isovalues.map(|c| {
                let e = extract_cell(field, cell, c);
                // The same vertices in the same order, even if the triangles differ.
                let same = e.crossings == surface.crossings;
                if same { e.positions } else { surface.positions.clone() }
            })
        });
        (isovalues[0], isovalues[INNER_SHARES.len() - 1]) = (ends[0], ends[1]);
        let strides = field.strides();
        let vertex = |(v, crossing): (usize, &Option<(u32, u32)>)| match (crossing, &placed) {
            (Some((a, b)), _) => {
                let (from, to) = (*a.min(b), *a.max(b));
                let axis = strides.iter().position(|&s| s == to - from).expect("a lattice edge");
                Track::Edge(LatticeEdge { from, axis: axis as u8 })
            }
            (None, Some(placed)) => {
                let mut knots: Vec<(f64, Vec3)> = Vec::with_capacity(isovalues.len());
                for (i, &c) in isovalues.iter().enumerate().rev() {
                    if knots.last().is_none_or(|next| c < next.0) {
                        knots.push((c, Vec3::from(placed[i][v])));
                    }
                }
                knots.reverse();
                self.inner.push(knots);
                Track::Inner(self.inner.len() as u32 - 1)
            }
            (None, None) => unreachable!("vertices inside the cell were placed"),
        };
        surface.crossings.iter().enumerate().map(vertex).collect()
    }
}
