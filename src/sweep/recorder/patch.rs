//! From what recorders have written down to a patch of the spectrum.

use glam::Vec3;
use rayon::prelude::*;

use super::joints::join;
use super::{Ended, Log, Trajectory, Unranked};
use crate::spectrum::{Collapse, Knot, Patch, Triangle, normal};
use crate::sweep::thin::{Bound, Place, thin};

impl Log {
    /// The triangles that show, those that live on both sides of a start as one; ordered by their
    /// vertices.
    fn triangles(&mut self) -> Vec<Ended> {
        let mut ended = std::mem::take(&mut self.ended);
        ended.sort_by(|a, b| {
            (a.vertices, b.start).cmp(&(b.vertices, a.start)).then(a.low.total_cmp(&b.low))
        });
        let mut triangles: Vec<Ended> = Vec::with_capacity(ended.len());
        for t in ended {
            match triangles.last_mut() {
                Some(last)
                    if t.start
                        && last.start
                        && last.vertices == t.vertices
                        && last.high == t.low =>
                {
                    last.high = t.high;
                }
                _ => triangles.push(t),
            }
        }
        triangles.retain(|t| t.low < t.high);
        triangles
    }

    /// The patch: what was recorded, sorted and without what never shows, nor the knots that
    /// interpolation within `error` voxels does not need.
    pub(crate) fn patch(mut self, error: f32) -> Patch {
        let triangles = self.triangles();
        let mut used: Vec<Trajectory> = triangles.iter().flat_map(|t| t.vertices).collect();
        used.sort_unstable();
        used.dedup();
        let index = |t: Trajectory| used.binary_search(&t).ok().map(|i| i as u32);
        let mut knots: Vec<(u32, Unranked)> =
            self.knots.into_iter().filter_map(|k| index(k.trajectory).map(|i| (i, k))).collect();
        // Independent of the order in which logs were appended.
        let place = |k: &Unranked| k.position.map(f32::to_bits);
        knots.sort_unstable_by(|a, b| {
            let by_isovalue = a.0.cmp(&b.0).then(a.1.isovalue.total_cmp(&b.1.isovalue));
            by_isovalue.then_with(|| (place(&a.1), a.1.normal).cmp(&(place(&b.1), b.1.normal)))
        });
        knots.dedup_by(|b, a| a.0 == b.0 && a.1.isovalue == b.1.isovalue);
        let edges = shortest_edges(&knots, &triangles, &used);
        let mut knots = thinned(&knots, &edges, error);
        join(&mut knots, &self.joints, index);
        let mut isovalues: Vec<f64> = knots.iter().map(|k| k.1.isovalue).collect();
        isovalues.extend(triangles.iter().flat_map(|t| [t.low, t.high]));
        isovalues.extend(self.collapses.iter().map(|c| c.2));
        isovalues.sort_by(f64::total_cmp);
        isovalues.dedup();
        let rank = |c: f64| isovalues.partition_point(|&x| x < c) as u32;
        let mut patch = Patch::default();
        for (i, k) in &knots {
            while patch.first_knot.len() <= *i as usize {
                patch.first_knot.push(patch.knots.len() as u32);
            }
            patch.knots.push(Knot { rank: rank(k.isovalue), position: k.position });
        }
        patch.first_knot.push(patch.knots.len() as u32);
        let vertex = |t: Trajectory| index(t).expect("a vertex of a triangle");
        patch.triangles = triangles
            .iter()
            .map(|t| Triangle {
                vertices: t.vertices.map(vertex),
                birth: rank(t.low),
                death: rank(t.high),
                cap: t.cap,
            })
            .collect();
        self.collapses.sort_by(|a, b| (a.0, a.1).cmp(&(b.0, b.1)).then(a.2.total_cmp(&b.2)));
        let collapses = self.collapses.iter();
        patch.collapses = collapses
            .filter_map(|&(a, b, c, upward)| {
                let (vertex, target) = (index(a)?, index(b)?);
                Some(Collapse { vertex, target, rank: rank(c), upward })
            })
            .collect();
        patch.isovalues = isovalues;
        patch
    }
}

/// The shortest edge beside every trajectory, voxels, where its triangles begin and end.
fn shortest_edges(knots: &[(u32, Unranked)], triangles: &[Ended], used: &[Trajectory]) -> Vec<f32> {
    let mut first = vec![0u32; used.len() + 1];
    for (i, _) in knots {
        first[*i as usize + 1] += 1;
    }
    for i in 0..used.len() {
        first[i + 1] += first[i];
    }
    // At a knot, or the last one before: near enough for a length.
    let at = |i: usize, c: f64| {
        let knots = &knots[first[i] as usize..first[i + 1] as usize];
        let after = knots.partition_point(|k| k.1.isovalue <= c);
        Vec3::from(knots[after.saturating_sub(1)].1.position)
    };
    let mut shortest = vec![f32::INFINITY; used.len()];
    for t in triangles {
        let corners = t.vertices.map(|v| used.binary_search(&v).expect("a used trajectory"));
        for c in [t.low, t.high] {
            let p = corners.map(|i| at(i, c));
            let sides = [p[0].distance(p[1]), p[1].distance(p[2]), p[2].distance(p[0])];
            // A vertex that has glided onto another ends there.
            let sides = sides.map(|s| if s > 0.0 { s } else { f32::INFINITY });
            for (i, &v) in corners.iter().enumerate() {
                shortest[v] = shortest[v].min(sides[i]).min(sides[(i + 2) % 3]);
            }
        }
    }
    shortest
}

/// The knots, sorted by trajectory and isovalue, that stay of every trajectory.
fn thinned(knots: &[(u32, Unranked)], edges: &[f32], error: f32) -> Vec<(u32, Unranked)> {
    let trajectories: Vec<&[(u32, Unranked)]> = knots.chunk_by(|a, b| a.0 == b.0).collect();
    let thinned: Vec<Vec<(u32, Unranked)>> = trajectories
        .par_iter()
        .map(|knots| {
            let place = |k: &(u32, Unranked)| Place {
                isovalue: k.1.isovalue,
                position: k.1.position.into(),
                normal: normal::decode(k.1.normal).into(),
                stays: k.1.stays,
            };
            let places: Vec<Place> = knots.iter().map(place).collect();
            let bound = Bound::new(error, edges[knots[0].0 as usize]);
            thin(&places, bound).into_iter().map(|i| knots[i]).collect()
        })
        .collect();
    thinned.into_iter().flatten().collect()
}
