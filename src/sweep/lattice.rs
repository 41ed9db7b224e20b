//! The exact extraction of whole stretches of isovalues at once: where no mesh is tracked.
//!
//! While no sample of a cell is passed, no face of it changes its decision and no body saddle is
//! passed, the exact extraction inside the cell keeps its triangles, and its vertices slide along
//! their lattice edges, linearly in the isovalue. So one record per triangle and such interval,
//! and two knots per lattice edge, show the exact topology at every isovalue, whatever the number of
//! events: the size depends on the cells alone. The triangles are those of an exact marching cubes.

mod joined;
mod shown;

use std::collections::HashMap;

use rayon::prelude::*;

use super::{Piece, Sweep};
use crate::error::Result;
use crate::extract::{Extraction, extract_cell};
use crate::spectrum::Patch;
use crate::topology::critical::Place;
use joined::joined;
use shown::{Shown, shown_intervals};

/// Layers of cells that one task covers.
const LAYERS: usize = 4;

/// Where in an interval, as shares of it, vertices inside cells are placed: first and last stand for its
/// ends.
const INNER_SHARES: [f64; 5] = [0.02, 0.25, 0.5, 0.75, 0.98];

/// Numbers this share of a face's range apart, or more, are few.
const FEW_NUMBERS: f64 = 1e-9;

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

/// What one task finds.
#[derive(Debug, Default)]
struct Slab {
    records: Vec<Record>,
    inner: Vec<Inner>,
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
    Ok(joined(sweep, shown, slabs))
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
    // Most of the memory of noisy volumes: none of it stays unused.
    slab.records.shrink_to_fit();
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
                // Not by products of samples, which leave the range of numbers sooner.
                let saddle = a + (b - a) / (b - a + c - d) * (c - a);
                breaks.push(saddle);
                // Where the samples are few numbers apart, rounding down shows what is not there yet: one number by
                // itself is extracted exactly. Both cells of the face must find the same.
                let range = b.max(c).max(a.max(d)) - b.min(c).min(a.min(d));
                if saddle.next_up() - saddle > FEW_NUMBERS * range {
                    breaks.push(saddle.next_up());
                }
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
            // Between neighbouring numbers the middle rounds to one of them; at the lower one the interval begins.
            let middle = Some(low + 0.5 * (high - low)).filter(|&m| m < high).unwrap_or(low);
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
        let mut isovalues = INNER_SHARES.map(|share| ends[0] + share * (ends[1] - ends[0]));
        let placed = has_inner.then(|| {
            isovalues.map(|c| {
                let e = extract_cell(&sweep.exact, corner, c);
                // The same vertices in the same order, however they are joined.
                let same = e.crossings == surface.crossings;
                if same { e.positions } else { surface.positions.clone() }
            })
        });
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
