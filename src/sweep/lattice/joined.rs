//! One patch of all that the tasks have found: vertices numbered, and where they go.

use glam::Vec3;

use super::shown::Shown;
use super::{INNER_SHARES, Inner, Key, Slab};
use crate::spectrum::{Knot, Patch, Triangle};
use crate::sweep::Sweep;

/// How near to a sample, as a share of the lattice edge, a vertex comes.
const EDGE_MARGIN: f64 = 1e-4;

/// How near to the border, as a share of an edge into the layer, a cap's vertex comes: what is
/// nearer could be taken for the isosurface proper.
const CAP_MARGIN: f64 = 0.01;

/// A knot before its isovalue has a rank: isovalue, position.
type Unranked = (f64, Vec3);

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

/// One patch of all slabs.
pub(super) fn joined(sweep: &Sweep, shown: &Shown, slabs: Vec<Slab>) -> Patch {
    let mut numbers = vec![u32::MAX; 3 * sweep.exact.n_vertices()];
    let mut trajectories = Trajectories { knots: Vec::new(), first: vec![0] };
    let range =
        (shown.merged.first().map_or(0.0, |m| m.0), shown.merged.last().map_or(0.0, |m| m.1));
    let n_records = slabs.iter().map(|s| s.records.len()).sum();
    let mut triangles: Vec<([u32; 3], f64, f64, bool)> = Vec::with_capacity(n_records);
    // Each slab is given back before the next one is looked at.
    for slab in slabs {
        let inner_base = trajectories.len() as u32;
        slab.inner.iter().for_each(|i| trajectories.push(&inner_trajectory(i)));
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
    let knot = |(c, p): Unranked| Knot { rank: rank(c), position: p.to_array() };
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
    let at = |c: f64| {
        let t = ((c - fa) / (fb - fa)).clamp(near_from, near_to) as f32;
        let mut p = base;
        p[axis as usize] += t;
        (c, p * voxel)
    };
    let (low, high) = (fa.min(fb).max(range.0), fa.max(fb).min(range.1));
    [at(low), at(high)]
}

/// The trajectory of a vertex inside a cell. Saddles of a cell that are equal but for rounding leave intervals
/// without room for all of the knots; the last one stays, as it is where the interval ends.
fn inner_trajectory(inner: &Inner) -> Vec<Unranked> {
    let all = inner.isovalues.iter().zip(inner.positions);
    let mut knots: Vec<Unranked> = Vec::with_capacity(INNER_SHARES.len());
    for (&c, position) in all.rev() {
        if knots.last().is_none_or(|next| c < next.0) {
            knots.push((c, Vec3::from(position)));
        }
    }
    knots.reverse();
    knots
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_knots_of_a_vertex_inside_a_cell_increase_where_an_interval_is_a_few_roundings_wide() {
        let low = 7.5f64;
        for roundings in [1, 2, 3, 5, 1000] {
            let high = f64::from_bits(low.to_bits() + roundings);
            let mut isovalues = INNER_SHARES.map(|share| low + share * (high - low));
            (isovalues[0], isovalues[INNER_SHARES.len() - 1]) = (low, high);
            let positions = std::array::from_fn(|i| [i as f32; 3]);
            let knots = inner_trajectory(&Inner { isovalues, positions });
            assert!(knots.windows(2).all(|w| w[0].0 < w[1].0), "{roundings}: {knots:?}");
            assert_eq!((knots[0].0, knots.last().map(|k| k.0)), (low, Some(high)));
        }
    }
}
