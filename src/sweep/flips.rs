//! Edge flips towards better triangles.

use glam::Vec3;

use super::caps::follows_border;
use super::criteria::Criteria;
use crate::mesh::{Edge, Mesh, normal, radius_ratio};

/// A flip must raise the worse radius ratio of the two triangles by this much.
const GAIN: f32 = 0.02;

/// Flips every edge whose flip makes the worse of its two triangles better, while the mesh stays as
/// close to the isosurface, and the edges before and after are at most `most_apart` voxels apart: so far
/// the surface jumps. At most `passes` times over all edges. Returns the number of flips.
pub(crate) fn flip_edges(
    mesh: &mut Mesh,
    criteria: &Criteria,
    passes: usize,
    most_apart: f32,
) -> usize {
    let mut total = 0;
    let mut edges: Vec<Edge> = mesh.edges().collect();
    for _ in 0..passes {
        let mut touched: Vec<Edge> = Vec::new();
        let mut flips = 0;
        for &e in &edges {
            if flip_is_better(mesh, criteria, e, most_apart) && mesh.can_flip(e) {
                let faces = mesh.flip(e).faces;
                touched
                    .extend(faces.iter().flat_map(|&f| mesh.face_halfedges(f)).map(|h| h.edge()));
                flips += 1;
            }
        }
        total += flips;
        if flips == 0 {
            break;
        }
        touched.sort_unstable();
        touched.dedup();
        edges = touched;
    }
    total
}

/// Whether the triangles after the flip are better and follow the isosurface as well.
fn flip_is_better(mesh: &Mesh, criteria: &Criteria, e: Edge, most_apart: f32) -> bool {
    let h = e.halfedge();
    if mesh.is_pinned(mesh.from(h)) && mesh.is_pinned(mesh.to(h)) {
        return false;
    }
    let at = |v| mesh.position(v);
    let (a, b) = (at(mesh.from(h)), at(mesh.to(h)));
    let (c, d) = (at(mesh.to(mesh.next(h))), at(mesh.to(mesh.next(h.twin()))));
    let before: [[Vec3; 3]; 2] = [[a, b, c], [b, a, d]];
    let after: [[Vec3; 3]; 2] = [[a, d, c], [d, b, c]];
    if (c - a).dot((b - a).cross(d - c).normalize_or_zero()).abs() > most_apart {
        return false;
    }
    let is_cap = mesh.is_cap(mesh.face(h)) || mesh.is_cap(mesh.face(h.twin()));
    if is_cap && after.iter().any(|&t| !follows_border(criteria.field, t)) {
        return false;
    }
    let worst = |t: [[Vec3; 3]; 2]| radius_ratio(t[0]).min(radius_ratio(t[1]));
    if worst(after) < worst(before) + GAIN {
        return false;
    }
    // Both new triangles face the side that both old ones face.
    let n = (normal(before[0]).normalize_or_zero() + normal(before[1]).normalize_or_zero())
        .normalize_or_zero();
    if after.iter().any(|&t| normal(t).normalize_or_zero().dot(n) < 0.7) {
        return false;
    }
    let deviation = |t: [[Vec3; 3]; 2]| criteria.deviation(t[0]).max(criteria.deviation(t[1]));
    let after_deviation = deviation(after);
    after_deviation <= 0.7 * criteria.error || after_deviation <= deviation(before)
}
