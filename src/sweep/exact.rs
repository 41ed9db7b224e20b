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

use glam::Vec3;
use rayon::prelude::*;

use super::isovalue_ranks::{IsovalueRanks, TASK_ITEMS, isovalues_of};
use super::life::merge_sorted;
use super::region::{LatticeEdge, PaddedGrid};
use super::shared::SharedPlanes;
use super::track::{Track, TrackCodes};
use crate::extract::{CellExtractor, Extraction, extract_cell};
use crate::spectrum::Triangle;
use crate::topology::critical::GridElement;
use crate::topology::exact::ExactField;
use crate::topology::{Topology, TopologyEvent};

/// Isovalues at which vertices inside cells are computed, as shares of an interval; first and last serve for its ends.
const INNER_SHARES: [f64; 5] = [0.02, 0.25, 0.5, 0.75, 0.98];

/// A cell, and the isovalues between which it is exact.
#[derive(Clone, Copy, Debug)]
pub(super) struct ExactInterval {
    pub(super) cell: u32,
    pub(super) low: f64,
    pub(super) high: f64,
}

/// Sorts intervals by cell and isovalue, and joins consecutive ones of a cell.
fn join_intervals(mut intervals: Vec<ExactInterval>) -> Vec<ExactInterval> {
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

/// The exact cells, and the isovalues of events in them.
pub(super) struct ExactCells<'a> {
    field: &'a ExactField<'a>,
    /// Sorted by cell and isovalue.
    intervals: Vec<ExactInterval>,
    /// Cells that contain or touch events, with the isovalue of each, ascending.
    events: Vec<(u32, f64)>,
}

/// The triangles of some cells.
#[derive(Debug, Default)]
struct ExactTriangles {
    triangles: Vec<Triangle>,
    /// The trajectories of vertices inside the cells: isovalues and positions.
    inner: Vec<Vec<(f64, Vec3)>>,
}

impl<'a> ExactCells<'a> {
    /// The cells of some intervals in which they are exact.
    pub(super) fn new(
        field: &'a ExactField<'a>,
        topology: &Topology,
        intervals: Vec<ExactInterval>,
    ) -> Self {
        let (grid, shared) = (PaddedGrid::of(field), SharedPlanes::of(field));
        let is_own = |e: &&TopologyEvent| match e.element {
            GridElement::Vertex(v) => !shared.holds_sample(v),
            _ => true,
        };
        let own = topology.events.iter().filter(is_own);
        let cells =
            own.flat_map(|e| grid.cells_at(e.element).into_iter().map(|cell| (cell, e.isovalue)));
        let mut events: Vec<(u32, f64)> = cells.collect();
        events.par_sort_unstable_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
        ExactCells { field, intervals: join_intervals(intervals), events }
    }

    /// All isovalues at which triangles may begin or end.
    pub(super) fn ends(&self) -> Vec<f64> {
        isovalues_of(&self.intervals, |interval, ends| ends.extend(self.breaks(interval)))
    }

    /// Appends the triangles of all cells in the intervals in which they are exact, by cell, with codes of trajectories and ranks of `ends`,
    /// which has all isovalues of [`ExactCells::ends`]; and the trajectories of vertices inside cells.
    pub(super) fn add_triangles(
        &self,
        (codes, ends): (TrackCodes, &IsovalueRanks),
        triangles: &mut Vec<Triangle>,
        inner: &mut Vec<Vec<(f64, Vec3)>>,
    ) {
        let new = || (ExactTriangles::default(), CellExtractor::new(self.field));
        // By rounds, as the results of a round are in memory twice until they are joined.
        for intervals in self.intervals.chunks(TASK_ITEMS) {
            let intervals = intervals.par_iter().with_min_len(256);
            let made = intervals.fold(new, |(mut made, mut extractor), interval| {
                made.add_cell((self, &mut extractor), (codes, ends), interval);
                (made, extractor)
            });
            for (made, _) in made.collect::<Vec<(ExactTriangles, CellExtractor)>>() {
                let n = inner.len() as u32;
                let number = |code| codes.after_inner(code, n);
                let own = made.triangles.into_iter();
                triangles.extend(own.map(|t| Triangle { vertices: t.vertices.map(number), ..t }));
                inner.extend(made.inner);
            }
        }
    }

    /// The isovalues at which a cell's triangles may change inside an interval, ascending, including its ends; none if the cell has no triangles there.
    fn breaks(&self, &ExactInterval { cell, low, high }: &ExactInterval) -> Vec<f64> {
        let field = self.field;
        let values = field.cell_offsets().map(|o| field.vertex_value(cell + o));
        let least = values.iter().copied().fold(f64::INFINITY, f64::min);
        let most = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let (low, high) = (low.max(least), high.min(most));
        if low >= high {
            return Vec::new();
        }
        let mut breaks: Vec<f64> = values.to_vec();
        let first = self.events.partition_point(|e| e.0 < cell);
        breaks.extend(self.events[first..].iter().take_while(|e| e.0 == cell).map(|e| e.1));
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
}

impl ExactTriangles {
    fn add_cell(
        &mut self,
        (cells, extractor): (&ExactCells, &mut CellExtractor),
        (codes, ends): (TrackCodes, &IsovalueRanks),
        interval: &ExactInterval,
    ) {
        let (field, cell) = (cells.field, interval.cell);
        let breaks = cells.breaks(interval);
        let ranks: Vec<u32> = breaks.iter().map(|&c| ends.rank(c)).collect();
        let first = self.triangles.len();
        for (ends, ranks) in breaks.windows(2).zip(ranks.windows(2)) {
            let (low, high) = (ends[0], ends[1]);
            // Between neighbouring floating point numbers the middle rounds to one of them; the interval contains the lower one.
            let middle = Some(low + 0.5 * (high - low)).filter(|&m| m < high).unwrap_or(low);
            let surface = extractor.extract(cell, middle);
            let tracks = self.vertices(field, cell, surface, [low, high]);
            let (birth, death) = (ranks[0], ranks[1]);
            for (face, &cap) in surface.faces.iter().zip(&surface.caps) {
                let vertices = face.map(|v| codes.code(tracks[v as usize]));
                self.triangles.push(Triangle { vertices, birth, death, cap });
            }
        }
        self.triangles[first..].sort_unstable_by_key(|t| (t.vertices, t.birth));
        merge_sorted(&mut self.triangles, first);
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
