//! What was swept as one patch of a spectrum.
//!
//! # Theory
//!
//! Triangles are many, so what is told of each is held once: trajectories along lattice edges follow from the samples and
//! are never stored, and tables are made unique while they grow.

use glam::Vec3;
use rayon::prelude::*;

use super::exact::{by_triangle, is_tracked, merge_sorted};
use super::record::{Life, OwnKnot, Recorder, Track};
use super::region::LatticeEdge;
use super::shared::{Shared, WholeEdge};
use super::thin::{Bound, Place, thin};
use super::tracked::EDGE_MARGIN;
use crate::spectrum::{Knot, Patch, Triangle};
use crate::topology::exact::ExactField;

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
    let mut tracks = Unique::new(Track::cmp);
    lives.iter().flat_map(|l| l.vertices).for_each(|t| tracks.push(t));
    let tracks = tracks.finish();
    let number = |t: Track| tracks.binary_search(&t).expect("a trajectory in use") as u32;
    let triangles: Vec<[u32; 3]> = lives.par_iter().map(|l| l.vertices.map(number)).collect();
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
    for (t, l) in triangles.iter().zip(&lives) {
        for v in t.map(|v| v as usize) {
            spans[v] = (spans[v].0.min(l.low), spans[v].1.max(l.high));
        }
    }
    let ways = Ways { field, range, tracks, spans, first_own, own, inner };
    tell(&ways);
    let mut patch = with_knots(&ways, &lives);
    let isovalues = &patch.isovalues;
    let rank = |c: f64| isovalues.partition_point(|&x| x < c) as u32;
    let triangle = |(l, t): (&Life, &[u32; 3])| Triangle {
        vertices: *t,
        birth: rank(l.low),
        death: rank(l.high),
        cap: l.cap,
    };
    patch.triangles = lives.par_iter().zip(&triangles).map(triangle).collect();
    let shared = Shared::of(field);
    let edges = ways.tracks.iter().zip(0..).filter_map(|(t, v)| match t {
        Track::Edge(e) => Some((v, shared.whole_edge(*e)?)),
        _ => None,
    });
    Swept { n_tracked, shared: edges.collect(), patch }
}

/// The table of isovalues, and the knots of all trajectories.
fn with_knots(ways: &Ways, lives: &[Life]) -> Patch {
    let mut isovalues = Unique::new(f64::total_cmp);
    for i in 0..ways.tracks.len() {
        ways.each(i, &mut |c, _| isovalues.push(c));
    }
    lives.iter().flat_map(|l| [l.low, l.high]).for_each(|c| isovalues.push(c));
    let isovalues = isovalues.finish();
    let rank = |c: f64| isovalues.partition_point(|&x| x < c) as u32;
    let mut patch = Patch::default();
    patch.first_knot.push(0);
    for i in 0..ways.tracks.len() {
        ways.each(i, &mut |c, p| {
            patch.knots.push(Knot { rank: rank(c), position: p.to_array() });
        });
        patch.first_knot.push(patch.knots.len() as u32);
    }
    patch.knots.shrink_to_fit();
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

/// Collects values, ascending and once; repeated ones take no memory for long.
struct Unique<T, F> {
    found: Vec<T>,
    order: F,
    /// So many are collected before those that are repeated go.
    most: usize,
}

impl<T: Send, F: Fn(&T, &T) -> std::cmp::Ordering + Copy + Sync> Unique<T, F> {
    fn new(order: F) -> Self {
        Unique { found: Vec::new(), order, most: 1 << 20 }
    }

    fn push(&mut self, x: T) {
        self.found.push(x);
        if self.found.len() == self.most {
            self.shorten();
            self.most = self.most.max(2 * self.found.len());
        }
    }

    fn shorten(&mut self) {
        let order = self.order;
        self.found.par_sort_unstable_by(order);
        self.found.dedup_by(|a, b| order(a, b).is_eq());
    }

    fn finish(mut self) -> Vec<T> {
        self.shorten();
        self.found.shrink_to_fit();
        self.found
    }
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
