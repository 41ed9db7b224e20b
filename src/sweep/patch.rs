//! What was swept as one patch of a spectrum.
//!
//! # Theory
//!
//! Triangles are many, so what is told of each is held once: trajectories along lattice edges follow from the samples and
//! are never stored, and tables are made unique while they grow.

use std::cmp::Ordering;

use glam::Vec3;
use rayon::prelude::*;

use super::life::{Life, Track, by_triangle, is_tracked, merge_sorted};
use super::record::{OwnKnot, Recorder};
use super::region::LatticeEdge;
use super::shared::{Shared, WholeEdge};
use super::thin::{Bound, Place, thin};
use super::tracked::EDGE_MARGIN;
use crate::spectrum::{Knot, Patch, Triangle};
use crate::topology::exact::ExactField;

/// Triangles or trajectories per task.
const TASK_ITEMS: usize = 1 << 16;

/// How near to the border, as a share of an edge into the layer, a cap's vertex comes.
const CAP_MARGIN: f64 = 0.01;

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
pub(super) struct Swept {
    /// All triangles, those of the tracked mesh first, in the frame of the whole.
    pub(super) patch: Patch,
    /// How many are of the tracked mesh.
    pub(super) n_tracked: usize,
    /// The vertices on planes that the volume shares with other blocks, ascending, with their lattice edges in the whole.
    pub(super) shared: Vec<(u32, WholeEdge)>,
}

/// Which knots are left out.
#[derive(Clone, Copy, Debug)]
pub(super) struct Thinning {
    /// The tolerance of the mesh, voxels.
    pub(super) tolerance: f32,
    /// An isovalue at which none is.
    pub(super) kept: Option<f64>,
}

/// Where trajectories are.
struct Ways<'a> {
    field: &'a ExactField<'a>,
    range: (f64, f64),
    /// Those in use, ascending.
    tracks: Vec<Track>,
    /// By trajectory, the isovalues between which there are triangles with it.
    spans: Vec<(f64, f64)>,
    /// The first of the tracked mesh's own in `tracks`, and the knots of those.
    first_own: usize,
    own: Vec<Vec<(f64, Vec3)>>,
    /// Those inside cells.
    inner: Vec<Vec<(f64, Vec3)>>,
}

impl Ways<'_> {
    /// Tells the knots of a trajectory, ascending, in the frame of the whole.
    fn each(&self, i: usize, f: &mut dyn FnMut(f64, Vec3)) {
        let size = self.field.volume().voxel_size();
        let first = self.field.first();
        let base = Vec3::from([0, 1, 2].map(|a| (first[a] as f64 * size[a]) as f32));
        let edge;
        let (knots, by): (&[(f64, Vec3)], Vec3) = match self.tracks[i] {
            // By its place in the whole, so that no block rounds it otherwise.
            Track::Edge(e) => {
                edge = way_from(self.field, e, self.range, self.field.whole_position(e.from));
                (&edge, Vec3::ZERO)
            }
            Track::Own(_) => (&self.own[i - self.first_own], base),
            Track::Inner(n) => (&self.inner[n as usize], base),
        };
        // The exact field rounds samples that are no integers, so an edge may be crossed a trace before or after its
        // samples' values are reached.
        let (low, high) = self.spans[i];
        let last = knots.len() - 1;
        for (k, &(c, p)) in knots.iter().enumerate() {
            let c = if k == 0 { c.min(low) } else { c };
            f(if k == last { c.max(high) } else { c }, p + by);
        }
    }
}

/// One patch of all triangles, those of the tracked mesh first. `inner` are the trajectories inside exact cells.
pub(super) fn patch(
    record: Recorder,
    inner: Vec<Vec<(f64, Vec3)>>,
    field: &ExactField,
    range: (f64, f64),
    thinning: Thinning,
) -> Swept {
    let Recorder { mut lives, knots, .. } = record;
    lives.par_sort_unstable_by(by_triangle);
    merge_sorted(&mut lives, 0);
    lives.shrink_to_fit();
    let n_tracked = lives.partition_point(is_tracked);
    let tracks = unique(&lives, |l, tracks| tracks.extend(l.vertices), Track::cmp);
    let number = |t: Track| tracks.binary_search(&t).expect("a trajectory in use") as u32;
    let ends = unique(&lives, |l, ends| ends.extend([l.low, l.high]), f64::total_cmp);
    let end = |c: f64| ends.partition_point(|&x| x < c) as u32;
    // Lifetimes among these ends at first.
    let mut triangles = replaced(lives, |l: &Life| Triangle {
        vertices: l.vertices.map(number),
        birth: end(l.low),
        death: end(l.high),
        cap: l.cap,
    });
    let first_own = tracks.partition_point(|t| matches!(t, Track::Edge(_)));
    let own = tracks[first_own..].par_iter().filter_map(|t| match t {
        Track::Own(n) => Some(thinned(&knots[*n as usize], thinning)),
        _ => None,
    });
    let own: Vec<Vec<(f64, Vec3)>> = own.collect();
    drop(knots);
    let inner: Vec<Vec<(f64, Vec3)>> =
        inner.into_par_iter().map(|way| thinned_inside(&way, thinning.tolerance)).collect();
    let mut spans = vec![(f64::INFINITY, f64::NEG_INFINITY); tracks.len()];
    for t in &triangles {
        let (low, high) = (ends[t.birth as usize], ends[t.death as usize]);
        for v in t.vertices.map(|v| v as usize) {
            spans[v] = (spans[v].0.min(low), spans[v].1.max(high));
        }
    }
    let ways = Ways { field, range, tracks, spans, first_own, own, inner };
    tell(&ways);
    let mut patch = with_knots(&ways, &ends);
    let rank = |c: &f64| patch.isovalues.partition_point(|x| x < c) as u32;
    let ranks: Vec<u32> = ends.par_iter().map(rank).collect();
    triangles.par_iter_mut().for_each(|t| {
        (t.birth, t.death) = (ranks[t.birth as usize], ranks[t.death as usize]);
    });
    patch.triangles = triangles;
    let shared = Shared::of(field);
    let edges = ways.tracks.iter().zip(0..).filter_map(|(t, v)| match t {
        Track::Edge(e) => Some((v, shared.whole_edge(*e)?)),
        _ => None,
    });
    Swept { n_tracked, shared: edges.collect(), patch }
}

/// The table of isovalues, the ends of lifetimes among them, and the knots of all trajectories.
fn with_knots(ways: &Ways, ends: &[f64]) -> Patch {
    let all: Vec<u32> = (0..ways.tracks.len() as u32).collect();
    let mut isovalues = unique(
        &all,
        |&i, isovalues: &mut Vec<f64>| ways.each(i as usize, &mut |c, _| isovalues.push(c)),
        f64::total_cmp,
    );
    isovalues.extend(ends);
    let isovalues = once(isovalues, f64::total_cmp);
    let rank = |c: f64| isovalues.partition_point(|&x| x < c) as u32;
    let told = all.par_chunks(TASK_ITEMS).map(|some| {
        let mut told = (Vec::new(), Vec::with_capacity(some.len()));
        for &i in some {
            ways.each(i as usize, &mut |c, p| {
                told.0.push(Knot { rank: rank(c), position: p.to_array() });
            });
            told.1.push(told.0.len() as u32);
        }
        told
    });
    let told: Vec<(Vec<Knot>, Vec<u32>)> = told.collect();
    let mut patch = Patch::default();
    patch.first_knot.push(0);
    patch.knots.reserve_exact(told.iter().map(|t| t.0.len()).sum());
    for (knots, ends) in told {
        let first = patch.knots.len() as u32;
        patch.first_knot.extend(ends.into_iter().map(|end| first + end));
        patch.knots.extend(knots);
    }
    patch.isovalues = isovalues;
    patch
}

/// How many vertices there are of each kind, for those who look on.
fn tell(ways: &Ways) {
    let n_own = ways.own.len();
    let n_inner = ways.tracks.len() - ways.first_own - n_own;
    let n_knots: usize = ways.own.iter().map(Vec::len).sum();
    log::debug!(
        "{} vertices on lattice edges, {n_own} tracked with {n_knots} knots, {n_inner} inside cells",
        ways.first_own
    );
}

/// Something in place of each of many, whose memory goes while this takes its own.
fn replaced<X: Sync, Y: Send>(mut all: Vec<X>, by: impl Fn(&X) -> Y + Sync) -> Vec<Y> {
    let mut made = Vec::with_capacity(all.len());
    // Only behind its end a vector can be cut; in few parts, as an allocator may have to copy what is left.
    let part = all.len().div_ceil(16);
    while !all.is_empty() {
        let at = all.len().saturating_sub(part);
        made.par_extend(all[at..].par_iter().rev().map(&by));
        all.truncate(at);
        all.shrink_to_fit();
    }
    made.reverse();
    made
}

/// What some things tell, ascending and once: repeated values take no memory for long.
fn unique<X: Sync, T: Clone + Send + Sync>(
    of: &[X],
    tell: impl Fn(&X, &mut Vec<T>) + Sync,
    order: impl Fn(&T, &T) -> Ordering + Copy + Sync,
) -> Vec<T> {
    let told = of.par_chunks(TASK_ITEMS).map(|some| {
        let mut told = Vec::new();
        some.iter().for_each(|x| tell(x, &mut told));
        once(told, order)
    });
    once(told.collect::<Vec<Vec<T>>>().concat(), order)
}

/// Values ascending and once.
fn once<T: Send>(mut all: Vec<T>, order: impl Fn(&T, &T) -> Ordering + Copy + Sync) -> Vec<T> {
    all.par_sort_unstable_by(order);
    all.dedup_by(|a, b| order(a, b).is_eq());
    all.shrink_to_fit();
    all
}

/// The knots of one trajectory that stay, by isovalue.
fn thinned(knots: &[OwnKnot], Thinning { tolerance, kept }: Thinning) -> Vec<(f64, Vec3)> {
    let mut knots = knots.to_vec();
    knots.sort_by(|a, b| a.isovalue.total_cmp(&b.isovalue));
    knots.dedup_by(|b, a| a.isovalue == b.isovalue);
    let place = |k: &OwnKnot| Place {
        isovalue: k.isovalue,
        position: k.position,
        normal: k.normal,
        stays: kept == Some(k.isovalue),
    };
    let places: Vec<Place> = knots.iter().map(place).collect();
    let stay = thin(&places, Bound::new(tolerance));
    stay.into_iter().map(|i| (knots[i].isovalue, knots[i].position)).collect()
}

/// The knots that stay of a way inside a cell.
fn thinned_inside(way: &[(f64, Vec3)], tolerance: f32) -> Vec<(f64, Vec3)> {
    // Any normal will do: the bound is the same in all directions.
    let place = |&(isovalue, position): &(f64, Vec3)| Place {
        isovalue,
        position,
        normal: Vec3::Z,
        stays: false,
    };
    let places: Vec<Place> = way.iter().map(place).collect();
    let stay = thin(&places, Bound::inside(tolerance));
    stay.into_iter().map(|i| way[i]).collect()
}
