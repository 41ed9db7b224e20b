//! The order in which the triangles of translucent surfaces are drawn.
//!
//! # Theory
//!
//! Blending needs the farthest triangle first. The picture's depth is divided into slabs, drawn from the farthest to the nearest; within
//! a slab, inner surfaces come before outer ones. So a picture takes a draw for each surface in a slab instead of one for each triangle.
//! Figures: decision 0025. Twin: `page/depth_order.js`.

use glam::DVec3;
use rayon::prelude::*;

use crate::grouped::grouped;
use crate::spectrum::Mesh;

/// Number of slabs: with fewer, triangles of one slab are seen in the wrong order; more cost draws.
const N_SLABS: usize = 256;

/// The depths of some triangles of a mesh: how far their centroids are behind each other, `towards_eye` being the direction in the
/// voxel frame.
pub(super) fn depths(mesh: &Mesh, triangles: &[u32], towards_eye: DVec3) -> Vec<f32> {
    let depth = |&t: &u32| {
        let corners = mesh.triangles[t as usize].map(|v| mesh.positions[v as usize].map(f64::from));
        -corners.iter().map(|&p| towards_eye.dot(DVec3::from_array(p))).sum::<f64>() as f32
    };
    triangles.par_iter().map(depth).collect()
}

/// The least and the greatest of depths.
pub(super) fn range<'a>(depths: impl Iterator<Item = &'a f32>) -> (f32, f32) {
    depths.fold((f32::INFINITY, f32::NEG_INFINITY), |(low, high), &depth| {
        (low.min(depth), high.max(depth))
    })
}

/// Where the slabs of a surface begin, the farthest first, with the end, and the places of its triangles in their order. The range is
/// that of all surfaces.
pub(super) fn slabs(depths: &[f32], (near, far): (f32, f32)) -> (Vec<u32>, Vec<u32>) {
    let per_depth = N_SLABS as f32 / (far - near).max(f32::MIN_POSITIVE);
    let slab = |&depth: &f32| (((far - depth) * per_depth) as u32).min(N_SLABS as u32 - 1);
    grouped(N_SLABS, depths.iter().zip(0..).map(|(depth, i)| (slab(depth), i)))
}

/// A part of a surface's triangles, drawn at once.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Run {
    /// The surface's place in the list of [`runs`].
    pub(super) surface: usize,
    pub(super) first: usize,
    pub(super) end: usize,
}

/// The drawing order of surfaces with these slabs, inner surfaces first in the list.
pub(super) fn runs(surfaces: &[&[u32]]) -> Vec<Run> {
    let mut runs: Vec<Run> = Vec::new();
    for (slab, surface) in (0..N_SLABS).flat_map(|slab| (0..surfaces.len()).map(move |i| (slab, i)))
    {
        let [first, end] = [0, 1].map(|i| surfaces[surface][slab + i] as usize);
        match runs.last_mut() {
            _ if first == end => {}
            Some(last) if last.surface == surface => last.end = end,
            _ => runs.push(Run { surface, first, end }),
        }
    }
    runs
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_go_from_the_far_side_through_nested_shells_to_the_near_side() {
        // The near and the far side of an inner and an outer shell.
        let [inner, outer] = [[4.0, 6.0], [1.0, 9.0]];
        let near_and_far = range(inner.iter().chain(&outer));
        assert_eq!(near_and_far, (1.0, 9.0));
        let order = |range| {
            let ordered = [inner, outer].map(|shell| slabs(&shell, range));
            let starts: Vec<&[u32]> = ordered.iter().map(|(starts, _)| &starts[..]).collect();
            (runs(&starts), ordered.map(|(_, places)| places))
        };
        let run = |surface, first, end| Run { surface, first, end };
        let (found, places) = order(near_and_far);
        assert_eq!(found, [run(1, 0, 1), run(0, 0, 2), run(1, 1, 2)]);
        assert_eq!(places, [[1, 0], [1, 0]], "far first");
        // In one slab the inner one comes first.
        assert_eq!(order((-1e9, 1e9)).0, [run(0, 0, 2), run(1, 0, 2)]);
        assert_eq!(runs(&[]), []);
        assert_eq!(slabs(&[3.0], (3.0, 3.0)).1, [0], "without any depth");
    }
}
