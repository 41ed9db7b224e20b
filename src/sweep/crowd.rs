//! How crowded with faces a mesh is, and what follows from it.
//!
//! A smooth isosurface takes 0.6 faces per square voxel at the usual tolerance, marching cubes 2.2. Where samples
//! of few bits make terraces, or noise makes dents in every cell, no mesh of good triangles keeps within the
//! tolerance: each step refines it, and it ends denser than the exact extraction and no nearer to the isosurface.
//! So the tolerance grows with what a mesh takes: a crowded one refines less, and goes on as a coarser one. Its steps
//! stay as short: terraces move with the isovalue, and a mesh that passes over some has nothing to do with the next.
//! Where even that takes too many faces it is given up, and the exact extraction shows.

use crate::mesh::Mesh;

/// Up to so many faces per square voxel a mesh keeps its tolerance.
const UNCROWDED: f32 = 1.3;

/// The tolerance grows by so many of its own for each face per square voxel beyond that.
const GROWTH: f32 = 2.15;

/// The most by which it grows.
const MOST: f32 = 4.0;

/// It does not grow beyond what this share of the faces keep: where the isosurface is smooth, but curved so much that
/// faces are many, they are near it.
const NEEDED_BY: f32 = 0.98;

/// A mesh of so many faces or more with more of them per square voxel is too dense: the exact extraction has 2.5 to 2.8.
/// The limit is higher the smaller a mesh is, down to [`SMALL_ENOUGH`].
const TOO_DENSE: (usize, f32) = (20_000, 2.0);

/// Meshes of up to so many faces are followed whatever they take; and the limit just above.
const SMALL_ENOUGH: (usize, f32) = (10_000, 3.5);

/// More faces per square voxel than this are too many for a fresh mesh. It keeps the tolerance, and has fewer
/// once it is under way.
const TOO_DENSE_AT_FIRST: f32 = 2.8;

/// Meshes of up to so many faces take as many as they need; up to the second number their crowding counts in
/// part.
const SMALL: (usize, usize) = (2_500, 5_000);

/// By how much the tolerance `error` of a mesh grows, 1 to [`MOST`]: no more than most of its faces need, which
/// deviate by `deviations` (by face slot) from the isosurface.
pub(super) fn coarseness(mesh: &Mesh, deviations: &[f32], error: f32) -> f32 {
    let size = (mesh.n_faces() as f32 - SMALL.0 as f32) / (SMALL.1 - SMALL.0) as f32;
    if size <= 0.0 {
        return 1.0;
    }
    let by_density = coarseness_of(mesh.n_faces() as f32 / mesh.area().max(1e-6), size);
    if by_density <= 1.0 {
        return 1.0;
    }
    let mut of_faces: Vec<f32> = mesh.faces().map(|f| deviations[f.0 as usize]).collect();
    let i = (of_faces.len() as f32 * NEEDED_BY) as usize;
    let needed = *of_faces.select_nth_unstable_by(i, f32::total_cmp).1 / error;
    needed.clamp(1.0, by_density)
}

/// The same of a mesh of so many faces per square voxel, whose crowding counts by a share of at most 1.
fn coarseness_of(density: f32, share: f32) -> f32 {
    1.0 + share.min(1.0) * (GROWTH * (density - UNCROWDED)).clamp(0.0, MOST - 1.0)
}

/// Whether a mesh on its way takes too many faces.
pub(super) fn is_too_dense(mesh: &Mesh) -> bool {
    has_more_faces(mesh, most_per_area(mesh.n_faces()))
}

/// How many faces per square voxel a mesh of so many may take on its way.
fn most_per_area(n_faces: usize) -> f32 {
    let ((few, high), (many, low)) = (SMALL_ENOUGH, TOO_DENSE);
    if n_faces <= few {
        return f32::INFINITY;
    }
    high + (low - high) * ((n_faces - few) as f32 / (many - few) as f32).min(1.0)
}

/// Whether a mesh has so many faces from the beginning that it will not come far.
pub(super) fn begins_too_dense(mesh: &Mesh) -> bool {
    !is_small(mesh.n_faces()) && has_more_faces(mesh, TOO_DENSE_AT_FIRST)
}

/// Whether a fresh mesh of so many faces may have as many as it needs.
pub(super) fn is_small(n_faces: usize) -> bool {
    n_faces <= SMALL.1
}

/// Whether a mesh has more faces per square voxel; its area is summed up only where there is a limit.
fn has_more_faces(mesh: &Mesh, per_area: f32) -> bool {
    per_area.is_finite() && mesh.n_faces() as f32 > per_area * mesh.area()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::shapes::sphere;

    /// A sphere with this many faces per square voxel, and the deviation of every face.
    fn crowded(density: f32, deviation: f32) -> (Mesh, Vec<f32>) {
        crowded_sphere(5, density, deviation)
    }

    fn crowded_sphere(levels: u32, density: f32, deviation: f32) -> (Mesh, Vec<f32>) {
        let one = sphere(1.0, levels);
        let mesh = sphere((one.n_faces() as f32 / (density * one.area())).sqrt(), levels);
        let deviations = vec![deviation; mesh.face_slots()];
        (mesh, deviations)
    }

    fn assert_near(a: f32, b: f32) {
        assert!((a - b).abs() < 1e-3, "{a}, expected {b}");
    }

    #[test]
    fn the_tolerance_grows_with_the_faces_but_not_beyond_what_most_need() {
        let coarseness_at = |density: f32, deviation: f32| {
            let (mesh, deviations) = crowded(density, deviation);
            coarseness(&mesh, &deviations, 0.1)
        };
        assert_eq!(coarseness_at(0.95 * UNCROWDED, 1.0), 1.0);
        assert_near(coarseness_at(UNCROWDED + 0.5, 1.0), 1.0 + 0.5 * GROWTH);
        assert_eq!(coarseness_at(5.0, 1.0), MOST);
        assert_eq!(coarseness_at(5.0, 0.05), 1.0);
        assert_near(coarseness_at(5.0, 0.25), 2.5);
    }

    #[test]
    fn few_faces_that_are_off_do_not_count() {
        let (mesh, mut deviations) = crowded(UNCROWDED + 1.0, 0.05);
        deviations[..100].fill(1.0);
        assert_eq!(coarseness(&mesh, &deviations, 0.1), 1.0);
        deviations[..200].fill(1.0);
        assert_near(coarseness(&mesh, &deviations, 0.1), 1.0 + GROWTH);
    }

    #[test]
    fn small_meshes_may_have_as_many_faces_as_they_need() {
        let small = sphere(1.0, 4);
        assert!(small.n_faces() < SMALL.0);
        assert_eq!(coarseness(&small, &vec![1.0; small.face_slots()], 0.1), 1.0);
        assert!(!is_too_dense(&small) && !begins_too_dense(&small));
    }

    #[test]
    fn a_fresh_mesh_may_be_denser_than_a_large_one_on_its_way() {
        for (density, on_its_way, at_first) in
            [(1.9, false, false), (2.1, true, false), (2.7, true, false), (2.9, true, true)]
        {
            let (mesh, _) = crowded_sphere(6, density, 0.0);
            assert!(mesh.n_faces() > TOO_DENSE.0);
            assert_eq!(is_too_dense(&mesh), on_its_way, "{density}");
            assert_eq!(begins_too_dense(&mesh), at_first, "{density}");
        }
    }

    #[test]
    fn the_smaller_a_mesh_on_its_way_the_denser_it_may_be() {
        assert_eq!(most_per_area(SMALL_ENOUGH.0), f32::INFINITY);
        for (n_faces, most) in [(12_000, 3.2), (15_000, 2.75), (20_000, 2.0), (1_000_000, 2.0)] {
            assert_near(most_per_area(n_faces), most);
        }
        let (mesh, _) = crowded(9.0, 0.0);
        assert!(mesh.n_faces() <= SMALL_ENOUGH.0 && !is_too_dense(&mesh));
    }
}
