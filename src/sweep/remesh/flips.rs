//! Edge flips that improve the shape of triangles or reduce their deviation from the isosurface.

use glam::Vec3;
use rayon::prelude::*;

use super::criteria::Criteria;
use crate::mesh::{Edge, HalfEdgeMesh, normal, radius_ratio};

/// Which flips are made.
#[derive(Clone, Copy)]
pub(crate) struct Flips {
    /// A flip must raise the worse radius ratio of the two triangles by this much,
    pub(crate) gain: f32,
    /// where that is below this one.
    pub(crate) poor: f32,
}

impl Flips {
    /// Every flip that improves triangles.
    pub(crate) const ALL: Flips = Flips { gain: 0.02, poor: 1.0 };
}

/// Triangles that deviate by more than this share of the tolerance are off the isosurface: no flip may create one.
const MAX_FLIP_SHARE: f32 = 0.7;

/// A flip for the deviation of triangles that are off must reduce it to this share, and leave no
/// radius ratio below the second value.
const NEARER_FACTOR: f32 = 0.75;
const MIN_NEARER_QUALITY: f32 = 0.5;

/// Flips every edge whose flip improves the worse of its two triangles without increasing the deviation,
/// and every edge whose flip reduces the deviation of triangles that are off while their shape stays good.
/// The first pass is over the given edges, at most `passes - 1` more over those near flips. Returns edges that must not be flipped
/// though that would be better.
pub(crate) fn flip_edges(
    mesh: &mut HalfEdgeMesh,
    criteria: &Criteria,
    mut edges: Vec<Edge>,
    passes: usize,
    flips: Flips,
) -> Vec<Edge> {
    let mut left = Vec::new();
    for _ in 0..passes {
        let mut touched: Vec<Edge> = Vec::new();
        // Candidates are few; they are tested again, as earlier flips change their surroundings.
        let is_better = |e: &Edge| flip_is_better(mesh, criteria, *e, flips);
        edges = edges.into_par_iter().with_min_len(256).filter(is_better).collect();
        for &e in &edges {
            if !flip_is_better(mesh, criteria, e, flips) {
                continue;
            }
            if mesh.can_flip(e) {
                let faces = mesh.flip(e).faces;
                touched
                    .extend(faces.iter().flat_map(|&f| mesh.face_halfedges(f)).map(|h| h.edge()));
            } else {
                left.push(e);
            }
        }
        touched.sort_unstable();
        touched.dedup();
        edges = touched;
    }
    left
}

/// Whether the triangles after the flip have a better shape and no larger deviation, or a smaller deviation and a good
/// shape.
fn flip_is_better(mesh: &HalfEdgeMesh, criteria: &Criteria, e: Edge, flips: Flips) -> bool {
    let h = e.halfedge();
    if mesh.is_pinned(mesh.from(h)) && mesh.is_pinned(mesh.to(h)) {
        return false;
    }
    let at = |v| mesh.position(v);
    let (a, b) = (at(mesh.from(h)), at(mesh.to(h)));
    let (c, d) = (at(mesh.to(mesh.next(h))), at(mesh.to(mesh.next(h.twin()))));
    let before: [[Vec3; 3]; 2] = [[a, b, c], [b, a, d]];
    let after: [[Vec3; 3]; 2] = [[a, d, c], [d, b, c]];
    // Both new triangles must face the same side as both old ones.
    let n = (normal(before[0]).normalize_or_zero() + normal(before[1]).normalize_or_zero())
        .normalize_or_zero();
    if after.iter().any(|&t| normal(t).normalize_or_zero().dot(n) < 0.7) {
        return false;
    }
    let worst = |t: [[Vec3; 3]; 2]| radius_ratio(t[0]).min(radius_ratio(t[1]));
    let deviation = |t: [[Vec3; 3]; 2]| criteria.deviation(t[0]).max(criteria.deviation(t[1]));
    let (worst_before, worst_after) = (worst(before), worst(after));
    if worst_before < flips.poor && worst_after >= worst_before + flips.gain {
        let after = deviation(after);
        return after <= MAX_FLIP_SHARE * criteria.error || after <= deviation(before);
    }
    if worst_after < MIN_NEARER_QUALITY {
        return false;
    }
    let far = deviation(before);
    far > MAX_FLIP_SHARE * criteria.error && deviation(after) < NEARER_FACTOR * far
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::field::Field;
    use crate::mesh::Vertex;
    use crate::sweep::parameters::Parameters;
    use crate::volume::{Placement, Samples, Volume};

    /// Samples along an axis, and the isovalue that the roof is looked at.
    const N: usize = 21;
    const ISOVALUE: f64 = 8.0;

    /// Where the ridge of the roof is, as y and z, voxels.
    const RIDGE: [f32; 2] = [10.0, 12.0];

    /// A field that falls upwards and, with a slope, away from a plane: its isosurface is a roof.
    fn roof(slope: f32) -> Field {
        let value = |i: usize| {
            let [y, z] = [i / N % N, i / N / N].map(|x| x as f32);
            ISOVALUE as f32 + RIDGE[1] - z - slope * (y - RIDGE[0]).abs()
        };
        let samples = Samples::F32((0..N.pow(3)).map(value).collect());
        let volume = Volume::new("roof", [N; 3], samples, Placement::default());
        Field::new(Arc::new(volume.expect("a valid volume")))
    }

    /// Two triangles over the square of two vertices of the ridge, 0 and 1, and one of either side, 2 and 3,
    /// whose common edge goes across the ridge; closed from below.
    fn across(slope: f32) -> HalfEdgeMesh {
        let [y, z] = RIDGE;
        let low = z - 4.0 * slope;
        let positions =
            [[6.0, y, z], [14.0, y, z], [10.0, y - 4.0, low], [10.0, y + 4.0, low], [10.0, y, 2.0]];
        let triangles = [[0, 2, 3], [1, 3, 2], [2, 0, 4], [0, 3, 4], [3, 1, 4], [1, 2, 4]];
        HalfEdgeMesh::from_triangles(&positions, &[false; 5], &triangles, &[false; 6])
            .expect("closed")
    }

    /// Whether the edge over the square goes along the ridge after all flips are made.
    fn goes_along_ridge(slope: f32) -> bool {
        let (field, mut mesh) = (roof(slope), across(slope));
        let criteria = Criteria::new(&field, ISOVALUE, &Parameters::default());
        let edges = mesh.edges().collect();
        flip_edges(&mut mesh, &criteria, edges, 2, Flips::ALL);
        mesh.check().expect("flips keep the invariants");
        mesh.find_halfedge(Vertex(0), Vertex(1)).is_some()
    }

    #[test]
    fn an_edge_across_a_ridge_is_flipped_though_the_triangles_get_no_better() {
        assert!(goes_along_ridge(0.3));
    }

    #[test]
    fn triangles_that_follow_the_isosurface_stay() {
        assert!(!goes_along_ridge(0.01));
    }
}
