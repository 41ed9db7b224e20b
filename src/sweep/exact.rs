//! The exact extraction in the cells that are exact, over all isovalues at which they are; and the patch of everything.
//!
//! # Theory
//!
//! While no sample of a cell is passed, no face of it changes its decision and no body saddle is passed, the exact
//! extraction inside the cell keeps its triangles, and its vertices slide along their lattice edges, linearly in
//! the isovalue. So one record per triangle and such interval, and two knots per lattice edge, show it at every isovalue.

use std::collections::HashMap;

use glam::Vec3;
use rayon::prelude::*;

use super::record::{Life, OwnKnot, Recorder, Track};
use super::region::{Grid, LatticeEdge};
use super::shared::{Shared, WholeEdge};
use super::tracked::EDGE_MARGIN;
use crate::extract::{Extraction, extract_cell};
use crate::spectrum::{Knot, Patch, Triangle};
use crate::sweep::thin::{Bound, Place as ThinPlace, thin};
use crate::topology::Topology;
use crate::topology::critical::Place;
use crate::topology::exact::ExactField;

/// Where in an interval, as shares of it, vertices inside cells are placed: first and last stand for its ends.
const INNER_SHARES: [f64; 5] = [0.02, 0.25, 0.5, 0.75, 0.98];

/// How near to the border, as a share of an edge into the layer, a cap's vertex comes.
const CAP_MARGIN: f64 = 0.01;

/// Samples of a face whose numbers are farther apart than this share of their range are few numbers apart.
const FEW_NUMBERS: f64 = 1e-9;

/// Cells that one task covers.
const CELLS_AT_ONCE: usize = 4096;

/// A cell, and between which isovalues it is exact.
pub(super) type Shown = (u32, f64, f64);

/// What one task finds.
#[derive(Debug, Default)]
struct Part {
    lives: Vec<Life>,
    /// Vertices inside cells: where they are at their isovalues.
    inner: Vec<Vec<(f64, Vec3)>>,
}

/// The triangles of the cells while they are exact. `shown` is sorted.
pub(super) fn extend(
    record: &mut Recorder,
    field: &ExactField,
    topology: &Topology,
    shown: &[Shown],
) -> Vec<Vec<(f64, Vec3)>> {
    let shared = Shared::of(field);
    let events = &event_isovalues(field, topology, shared);
    let parts: Vec<Part> = shown
        .par_chunks(CELLS_AT_ONCE)
        .map(|shown| {
            let mut part = Part::default();
            for &(cell, low, high) in shown {
                part.add_cell(field, events.get(&cell).map_or(&[], |e| e), (cell, low, high));
            }
            part
        })
        .collect();
    let mut inner = Vec::new();
    for part in parts {
        let base = inner.len() as u32;
        record.lives.extend(part.lives.into_iter().map(|mut l| {
            for t in &mut l.vertices {
                if let Track::Inner(n) = t {
                    *n += base;
                }
            }
            l
        }));
        inner.extend(part.inner);
    }
    inner
}

/// Isovalues of the events by cell that they are in or beside: those of samples and of faces may be rounded otherwise than
/// the cells' own numbers.
fn event_isovalues(
    field: &ExactField,
    topology: &Topology,
    shared: Shared,
) -> HashMap<u32, Vec<f64>> {
    let grid = Grid::of(field);
    let mut events: HashMap<u32, Vec<f64>> = HashMap::new();
    for e in &topology.events {
        if matches!(e.place, Place::Vertex(v) if shared.holds_sample(v)) {
            continue;
        }
        for cell in grid.cells_at(e.place) {
            events.entry(cell).or_default().push(e.isovalue);
        }
    }
    events
}

/// The isovalues at which a cell's triangles may change inside an interval, ascending, its ends among them.
fn breaks(
    field: &ExactField,
    cell: u32,
    values: &[f64; 8],
    events: &[f64],
    (low, high): (f64, f64),
) -> Vec<f64> {
    let mut breaks: Vec<f64> = values.to_vec();
    breaks.extend(events);
    // Where the exact field has them, which may be a number before the samples' own arithmetic: both cells of a face change
    // at once, though the event of a third may fall between the two.
    for axis in 0..3 {
        for corner in [cell, cell + field.strides()[axis]] {
            let saddle = field.face_saddle(corner, axis);
            breaks.extend(saddle.map(|s| field.face_saddle_value(&s)));
        }
    }
    for axis in 0..3 {
        let (u, v) = (1 << ((axis + 1) % 3), 1 << ((axis + 2) % 3));
        for base in [0, 1 << axis] {
            let [a, b, c, d] = [base, base + u, base + v, base + u + v].map(|c: usize| values[c]);
            if a.max(d) < b.min(c) || b.max(c) < a.min(d) {
                // Not by products of samples, which leave the range of numbers sooner.
                let saddle = a + (b - a) / (b - a + c - d) * (c - a);
                breaks.push(saddle);
                // Where the samples are few numbers apart, rounding down shows what is not there yet: one number by
                // itself is extracted exactly. Both cells of the face find the same.
                let range = b.max(c).max(a.max(d)) - b.min(c).min(a.min(d));
                if saddle.next_up() - saddle > FEW_NUMBERS * range {
                    breaks.push(saddle.next_up());
                }
            }
        }
    }
    breaks.retain(|&c| low < c && c < high);
    breaks.extend([low, high]);
    breaks.sort_by(f64::total_cmp);
    breaks.dedup();
    breaks
}

impl Part {
    fn add_cell(&mut self, field: &ExactField, events: &[f64], (cell, low, high): Shown) {
        let values = field.cell_offsets().map(|o| field.sample(cell + o));
        let least = values.iter().copied().fold(f64::INFINITY, f64::min);
        let most = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let (low, high) = (low.max(least), high.min(most));
        if low >= high {
            return;
        }
        let first = self.lives.len();
        for ends in breaks(field, cell, &values, events, (low, high)).windows(2) {
            let (low, high) = (ends[0], ends[1]);
            // Between neighbouring numbers the middle rounds to one of them; at the lower one the interval begins.
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
                // The same vertices in the same order, however they are joined.
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

/// The order of lives: those of the tracked mesh first, then triangle by triangle, ascending in time.
fn by_triangle(a: &Life, b: &Life) -> std::cmp::Ordering {
    let is_exact = |l: &Life| !is_tracked(l);
    let key = |l: &Life| (is_exact(l), l.vertices);
    key(a).cmp(&key(b)).then(a.low.total_cmp(&b.low)).then(a.high.total_cmp(&b.high))
}

/// Whether a life is one of the tracked mesh. Between vertices of the seam alone there is next to nothing of that.
fn is_tracked(l: &Life) -> bool {
    l.vertices.iter().any(|t| matches!(t, Track::Own(_)))
}

/// Joins the lives of one triangle over intervals that follow each other, in place: there are many.
pub(super) fn merge_consecutive(lives: &mut Vec<Life>, first: usize) {
    lives[first..].sort_unstable_by(by_triangle);
    merge_sorted(lives, first);
}

/// The same, once they are in order.
fn merge_sorted(lives: &mut Vec<Life>, first: usize) {
    let mut end = first;
    for i in first..lives.len() {
        let (vertices, low, high) = (lives[i].vertices, lives[i].low, lives[i].high);
        match lives[first..end].last_mut() {
            Some(last) if last.vertices == vertices && last.high == low => last.high = high,
            _ => {
                lives.swap(end, i);
                end += 1;
            }
        }
    }
    lives.truncate(end);
}

/// The way of a vertex along its lattice edge: at the samples' values.
pub(super) fn edge_trajectory(
    field: &ExactField,
    e: LatticeEdge,
    range: (f64, f64),
) -> [(f64, Vec3); 2] {
    way_from(field, e, range, field.position(e.from).map(|x| x as f64))
}

/// The same where the edge begins at another place, in samples.
fn way_from(
    field: &ExactField,
    e: LatticeEdge,
    range: (f64, f64),
    base: [f64; 3],
) -> [(f64, Vec3); 2] {
    let to = e.from + field.strides()[e.axis as usize];
    let (fa, fb) = (field.sample(e.from), field.sample(to));
    let margin = |v: u32| if field.is_in_layer(v) { CAP_MARGIN } else { EDGE_MARGIN };
    // An edge into the layer keeps away from the sample at the border.
    let (near_from, near_to) = (margin(to), 1.0 - margin(e.from));
    let size = field.volume().voxel_size();
    let at = |c: f64| {
        let t = ((c - fa) / (fb - fa)).clamp(near_from, near_to);
        let t = if t.is_finite() { t } else { 0.5 };
        let mut p = base;
        p[e.axis as usize] += t;
        (c, Vec3::from(std::array::from_fn(|a| (p[a] * size[a]) as f32)))
    };
    let (low, high) = (fa.min(fb).max(range.0), fa.max(fb).min(range.1));
    [at(low), at(high)]
}

/// What was swept.
#[derive(Debug)]
pub(in crate::sweep) struct Swept {
    /// All triangles, those of the tracked mesh first, in the frame of the whole.
    pub(in crate::sweep) patch: Patch,
    /// How many are of the tracked mesh.
    pub(in crate::sweep) n_tracked: usize,
    /// The vertices on planes that the volume shares with other blocks, ascending, with their lattice edges in the whole.
    pub(in crate::sweep) shared: Vec<(u32, WholeEdge)>,
}

/// Which knots are left out.
#[derive(Clone, Copy, Debug)]
pub(super) struct Thinning {
    /// By how much they may be off, voxels.
    pub(super) error: f32,
    /// An isovalue at which none is.
    pub(super) kept: Option<f64>,
}

/// One patch of all triangles, those of the tracked mesh first.
pub(super) fn patch(
    record: Recorder,
    inner: &[Vec<(f64, Vec3)>],
    field: &ExactField,
    range: (f64, f64),
    thinning: Thinning,
) -> Swept {
    let mut lives = record.lives;
    lives.par_sort_unstable_by(by_triangle);
    merge_sorted(&mut lives, 0);
    lives.shrink_to_fit();
    let n_tracked = lives.partition_point(is_tracked);
    let mut tracks: Vec<Track> = lives.iter().flat_map(|l| l.vertices).collect();
    tracks.par_sort_unstable();
    tracks.dedup();
    let number = |t: Track| tracks.binary_search(&t).expect("a trajectory in use") as u32;
    let thinned: HashMap<u32, Vec<(f64, Vec3)>> = tracks
        .par_iter()
        .filter_map(|t| match t {
            Track::Own(n) => Some((*n, thinned(&record.knots[*n as usize], thinning))),
            _ => None,
        })
        .collect();
    let size = field.volume().voxel_size();
    let first = Vec3::from([0, 1, 2].map(|a| (field.first()[a] as f64 * size[a]) as f32));
    let moved = |knots: &[(f64, Vec3)]| knots.iter().map(|&(c, p)| (c, p + first)).collect();
    let mut knots: Vec<Vec<(f64, Vec3)>> = tracks
        .iter()
        .map(|t| match t {
            // By its place in the whole, so that no block rounds it otherwise.
            Track::Edge(e) => way_from(field, *e, range, field.whole_position(e.from)).to_vec(),
            Track::Own(n) => moved(&thinned[n]),
            Track::Inner(n) => moved(&inner[*n as usize]),
        })
        .collect();
    let n = |is: fn(&Track) -> bool| {
        let own = tracks.iter().zip(&knots).filter(|t| is(t.0));
        own.fold((0, 0), |(n, k), t| (n + 1, k + t.1.len()))
    };
    log::debug!(
        "vertices and knots: {:?} on lattice edges, {:?} tracked, {:?} inside cells",
        n(|t| matches!(t, Track::Edge(_))),
        n(|t| matches!(t, Track::Own(_))),
        n(|t| matches!(t, Track::Inner(_)))
    );
    // The exact field rounds samples that are no integers, so an edge may be crossed a trace before or after its
    // samples' values are reached.
    let triangles: Vec<[u32; 3]> = lives.par_iter().map(|l| l.vertices.map(number)).collect();
    for (t, l) in triangles.iter().zip(&lives) {
        for v in t.map(|v| v as usize) {
            let knots = &mut knots[v];
            let last = knots.len() - 1;
            knots[0].0 = knots[0].0.min(l.low);
            knots[last].0 = knots[last].0.max(l.high);
        }
    }
    let mut isovalues: Vec<f64> = knots.iter().flatten().map(|k| k.0).collect();
    isovalues.extend(lives.iter().flat_map(|l| [l.low, l.high]));
    isovalues.par_sort_unstable_by(f64::total_cmp);
    isovalues.dedup();
    let rank = |c: f64| isovalues.partition_point(|&x| x < c) as u32;
    let mut patch = Patch::default();
    patch.first_knot.push(0);
    for knots in &knots {
        patch
            .knots
            .extend(knots.iter().map(|&(c, p)| Knot { rank: rank(c), position: p.to_array() }));
        patch.first_knot.push(patch.knots.len() as u32);
    }
    let ends = lives.iter().zip(&triangles);
    patch.triangles = ends
        .map(|(l, t)| Triangle {
            vertices: *t,
            birth: rank(l.low),
            death: rank(l.high),
            cap: l.cap,
        })
        .collect();
    patch.isovalues = isovalues;
    let shared = Shared::of(field);
    let edges = tracks.iter().zip(0..).filter_map(|(t, v)| match t {
        Track::Edge(e) => Some((v, shared.whole_edge(*e)?)),
        _ => None,
    });
    Swept { patch, n_tracked, shared: edges.collect() }
}

/// The knots of one trajectory that stay, by isovalue.
fn thinned(knots: &[OwnKnot], Thinning { error, kept }: Thinning) -> Vec<(f64, Vec3)> {
    let mut knots = knots.to_vec();
    knots.sort_by(|a, b| a.isovalue.total_cmp(&b.isovalue));
    knots.dedup_by(|b, a| a.isovalue == b.isovalue);
    let places: Vec<ThinPlace> = knots
        .iter()
        .map(|k| ThinPlace {
            isovalue: k.isovalue,
            position: k.position,
            normal: k.normal,
            stays: kept == Some(k.isovalue),
        })
        .collect();
    let stay = thin(&places, Bound::new(error, 1.0));
    stay.into_iter().map(|i| (knots[i].isovalue, knots[i].position)).collect()
}
