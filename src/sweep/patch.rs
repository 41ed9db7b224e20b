//! Builds the tables of a spectrum from the records of a sweep, and orients its triangles.
//!
//! # Theory
//!
//! Memory is limited by the number of triangles, so nothing is stored twice: triangles are changed in place, trajectories along lattice edges are
//! computed from the samples when needed, and duplicates are removed from tables while they grow.

use std::sync::atomic::{AtomicU32, Ordering};

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::isovalue_ranks::{IsovalueRanks, TASK_ITEMS, isovalues_of};
use super::ranked_set::RankedSet;
use super::record::OwnKnot;
use super::region::LatticeEdge;
use super::shared::{SharedPlanes, WholeEdge};
use super::thin::{Candidate, ErrorBound, thin};
use super::track::{Track, TrackCodes};
use super::tracked::EDGE_MARGIN;
use crate::error::Result;
use crate::spectrum::{Knot, Patch, Triangle, facing, quantum, rounded_along};
use crate::topology::exact::ExactField;
use crate::volume::Outside;

/// Least distance of a cap's vertex from the border, as a share of an edge into the layer.
const CAP_MARGIN: f64 = 0.01;

/// The trajectory of a vertex along its lattice edge: its knots are where the isosurface passes the samples.
pub(super) fn edge_trajectory(
    field: &ExactField,
    e: LatticeEdge,
    range: (f64, f64),
) -> [(f64, Vec3); 2] {
    trajectory_from(field, e, range, field.position(e.from).map(|x| x as f64))
}

/// The same for an edge that begins at `base`, in samples.
fn trajectory_from(
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
    // The isosurface may cross the edge slightly before the samples' values.
    let ends = [e.from, to].map(|v| field.vertex_value(v));
    let (low, high) = (ends[0].min(ends[1]).max(range.0), ends[0].max(ends[1]).min(range.1));
    [at(low), at(high)]
}

/// What a sweep has recorded.
pub(super) struct Recorded {
    /// All triangles, those of the tracked mesh first. Their vertices are codes of trajectories, their lifetimes ranks of `ends`.
    pub(super) triangles: Vec<Triangle>,
    /// How many are of the tracked mesh.
    pub(super) n_tracked: usize,
    pub(super) codes: TrackCodes,
    pub(super) ends: IsovalueRanks,
    /// The knots of tracked vertices.
    pub(super) knots: Vec<Vec<OwnKnot>>,
    /// The knots of vertices inside exact cells.
    pub(super) inner: Vec<Vec<(f64, Vec3)>>,
}

/// The result of a sweep.
#[derive(Debug)]
pub(super) struct Swept {
    /// All triangles, those of the tracked mesh first, in the frame of the whole.
    pub(super) patch: Patch,
    /// How many are of the tracked mesh.
    pub(super) n_tracked: usize,
    /// The vertices on planes that the volume shares with other blocks, ascending, with their lattice edges in the whole.
    pub(super) shared: Vec<(u32, WholeEdge)>,
}

/// Parameters of thinning.
#[derive(Clone, Copy, Debug)]
pub(super) struct Thinning {
    /// The tolerance of the mesh, voxels.
    pub(super) tolerance: f32,
    /// An isovalue at which all knots are kept.
    pub(super) kept: Option<f64>,
}

/// All trajectories.
struct Trajectories<'a> {
    field: &'a ExactField<'a>,
    range: (f64, f64),
    /// The trajectories in use, ascending.
    tracks: Vec<Track>,
    /// By trajectory, the isovalues between which there are triangles with it.
    spans: Vec<[f64; 2]>,
    /// Index in `tracks` of the first trajectory of a tracked vertex, and the knots of those, in the frame of the whole.
    first_own: usize,
    own: Vec<Vec<(f64, Vec3)>>,
    /// Knots of trajectories inside cells, in the frame of the whole.
    inner: Vec<Vec<(f64, Vec3)>>,
    /// Lowest and highest corner of the box of the whole volume, multiples of the unit of stored positions inside it.
    corners: [Vec3; 2],
}

impl Trajectories<'_> {
    /// Calls `f` with the knots of a trajectory, ascending, in the frame of the whole. Positions in the layer around the volume move to
    /// its border.
    fn each(&self, i: usize, f: &mut dyn FnMut(f64, Vec3)) {
        let edge;
        let knots: &[(f64, Vec3)] = match self.tracks[i] {
            // Computed from the position in the whole, so that all blocks round it equally.
            Track::Edge(e) => {
                edge =
                    trajectory_from(self.field, e, self.range, self.field.whole_position(e.from));
                &edge
            }
            Track::Own(_) => &self.own[i - self.first_own],
            Track::Inner(n) => &self.inner[n as usize],
        };
        // Events may be slightly before or after the other knots.
        let [low, high] = self.spans[i];
        let last = knots.len() - 1;
        for (k, &(c, p)) in knots.iter().enumerate() {
            let c = if k == 0 { c.min(low) } else { c };
            let p = p.clamp(self.corners[0], self.corners[1]);
            f(if k == last { c.max(high) } else { c }, p);
        }
    }
}

/// One patch of all triangles.
///
/// # Errors
///
/// As [`TrackCodes::n_codes`].
pub(super) fn patch(
    record: Recorded,
    field: &ExactField,
    range: (f64, f64),
    thinning: Thinning,
) -> Result<Swept> {
    let Recorded { mut triangles, n_tracked, codes, ends, knots, inner } = record;
    let used = triangles.par_iter().flat_map_iter(|t| t.vertices);
    let used = RankedSet::new(codes.n_codes(inner.len())?, used);
    // The sweep orients faces by the field, a spectrum by what is enclosed.
    let is_reversed = field.volume().outside() == Outside::High;
    let oriented = |[a, b, c]: [u32; 3]| if is_reversed { [a, c, b] } else { [a, b, c] };
    triangles
        .par_iter_mut()
        .for_each(|t| t.vertices = oriented(t.vertices.map(|code| used.rank(code))));
    let spans = spans(&triangles, used.len());
    let tracks: Vec<Track> = used.iter().map(|code| codes.track(code)).collect();
    drop(used);
    let first_own = tracks.partition_point(|t| matches!(t, Track::Edge(_)));
    let base = base(field);
    let own = tracks[first_own..].par_iter().filter_map(|t| match t {
        Track::Own(n) => Some(own_trajectory(&knots[*n as usize], base, thinning)),
        _ => None,
    });
    let own: Vec<Vec<(f64, Vec3)>> = own.collect();
    drop(knots);
    let inner = inner.into_par_iter();
    let inner = inner.map(|knots| inner_trajectory(&knots, base, thinning.tolerance)).collect();
    let corners = [Vec3::ZERO, highest_corner(field, thinning.tolerance)];
    let ends = ends.into_isovalues();
    let spans = spans.into_iter().map(|span| span.map(|rank| ends[rank as usize])).collect();
    let trajectories = Trajectories { field, range, tracks, spans, first_own, own, inner, corners };
    log_sizes(&trajectories);
    let (mut patch, isovalues) = with_knots(&trajectories, &ends);
    let ranks: Vec<u32> = ends.par_iter().map(|&c| isovalues.rank(c)).collect();
    triangles.par_iter_mut().for_each(|t| {
        (t.birth, t.death) = (ranks[t.birth as usize], ranks[t.death as usize]);
    });
    (patch.triangles, patch.isovalues) = (triangles, isovalues.into_isovalues());
    let shared = SharedPlanes::of(field);
    let edges = trajectories.tracks.iter().zip(0..).filter_map(|(t, v)| match t {
        Track::Edge(e) => Some((v, shared.whole_edge(*e)?)),
        _ => None,
    });
    Ok(Swept { n_tracked, shared: edges.collect(), patch })
}

/// By vertex, the first birth and the last death of its triangles.
fn spans(triangles: &[Triangle], n_vertices: usize) -> Vec<[u32; 2]> {
    let new = || [AtomicU32::new(u32::MAX), AtomicU32::new(0)];
    let spans: Vec<[AtomicU32; 2]> = (0..n_vertices).map(|_| new()).collect();
    triangles.par_iter().for_each(|t| {
        for [first, last] in t.vertices.map(|v| &spans[v as usize]) {
            // Most triangles change nothing, and reading is cheaper.
            if t.birth < first.load(Ordering::Relaxed) {
                first.fetch_min(t.birth, Ordering::Relaxed);
            }
            if t.death > last.load(Ordering::Relaxed) {
                last.fetch_max(t.death, Ordering::Relaxed);
            }
        }
    });
    spans.into_iter().map(|span| span.map(AtomicU32::into_inner)).collect()
}

/// The highest corner of the box of the whole volume, rounded down to the unit of stored positions.
fn highest_corner(field: &ExactField, tolerance: f32) -> Vec3 {
    let volume = field.volume();
    let (whole, size) = (volume.block_position().whole, volume.voxel_size());
    let unit = quantum(tolerance.into());
    let length = |a: usize| (whole[a] - 1) as f64 * size[a];
    Vec3::from([0, 1, 2].map(|a| ((length(a) / unit).floor() * unit) as f32))
}

/// The table of isovalues, the ends of lifetimes among them, and a patch of the knots of all trajectories.
fn with_knots(trajectories: &Trajectories, ends: &[f64]) -> (Patch, IsovalueRanks) {
    let all: Vec<u32> = (0..trajectories.tracks.len() as u32).collect();
    let of_knots = isovalues_of(&all, |&i, isovalues| {
        trajectories.each(i as usize, &mut |c, _| isovalues.push(c));
    });
    let isovalues = IsovalueRanks::new([&of_knots, ends].concat());
    let chunks = all.par_chunks(TASK_ITEMS).map(|chunk| {
        let (mut knots, mut ends) = (Vec::new(), Vec::with_capacity(chunk.len()));
        for &i in chunk {
            trajectories.each(i as usize, &mut |c, p| {
                knots.push(Knot { rank: isovalues.rank(c), position: p.to_array() });
            });
            ends.push(knots.len() as u32);
        }
        (knots, ends)
    });
    let chunks: Vec<(Vec<Knot>, Vec<u32>)> = chunks.collect();
    let mut patch = Patch::default();
    patch.first_knot.push(0);
    patch.knots.reserve_exact(chunks.iter().map(|c| c.0.len()).sum());
    for (knots, ends) in chunks {
        let first = patch.knots.len() as u32;
        patch.first_knot.extend(ends.into_iter().map(|end| first + end));
        patch.knots.extend(knots);
    }
    (patch, isovalues)
}

/// Logs the number of vertices of each kind.
fn log_sizes(trajectories: &Trajectories) {
    let n_own = trajectories.own.len();
    let n_inner = trajectories.tracks.len() - trajectories.first_own - n_own;
    let n_knots: usize = trajectories.own.iter().map(Vec::len).sum();
    log::debug!(
        "{} vertices on lattice edges, {n_own} tracked with {n_knots} knots, {n_inner} inside cells",
        trajectories.first_own
    );
}

/// The position of the block's first sample in the whole, voxel frame.
fn base(field: &ExactField) -> Vec3 {
    let (size, first) = (field.volume().voxel_size(), field.first());
    Vec3::from([0, 1, 2].map(|a| (first[a] as f64 * size[a]) as f32))
}

/// The trajectory of a tracked vertex: the knots that thinning keeps, rounded to units of stored positions in the frame of the whole.
fn own_trajectory(
    knots: &[OwnKnot],
    base: Vec3,
    Thinning { tolerance, kept }: Thinning,
) -> Vec<(f64, Vec3)> {
    let of_knot = |k: &OwnKnot| {
        let OwnKnot { isovalue, position, normal } = *k;
        Candidate { isovalue, position, normal, is_required: kept == Some(isovalue) }
    };
    let kept = thinned(knots.iter().map(of_knot).collect(), ErrorBound::new(tolerance));
    let unit = quantum(tolerance.into());
    let axis = facing(kept.iter().map(|k| k.normal.as_dvec3()));
    let round = |k: &Candidate| {
        let exact = (k.position + base).as_dvec3() / unit;
        let position: DVec3 = rounded_along(exact, k.normal.as_dvec3(), axis) * unit;
        (k.isovalue, position.as_vec3())
    };
    kept.iter().map(round).collect()
}

/// The trajectory of a vertex inside a cell: the knots that thinning keeps, in the frame of the whole.
fn inner_trajectory(knots: &[(f64, Vec3)], base: Vec3, tolerance: f32) -> Vec<(f64, Vec3)> {
    // The normal does not matter: the bound is the same in all directions.
    let normal = Vec3::Z;
    let of_knot =
        |&(isovalue, position)| Candidate { isovalue, position, normal, is_required: false };
    let kept = thinned(knots.iter().map(of_knot).collect(), ErrorBound::inside(tolerance));
    kept.iter().map(|k| (k.isovalue, k.position + base)).collect()
}

/// The knots of one trajectory that thinning keeps, by isovalue.
fn thinned(mut places: Vec<Candidate>, bound: ErrorBound) -> Vec<Candidate> {
    places.sort_by(|a, b| a.isovalue.total_cmp(&b.isovalue));
    places.dedup_by(|b, a| a.isovalue == b.isovalue);
    thin(&places, bound).into_iter().map(|i| places[i]).collect()
}
