//! Simplification: edge collapses (thesis section 3.6) that keep the mesh within its tolerance.

use glam::Vec3;
use rayon::prelude::*;

use super::criteria::Criteria;
use crate::mesh::{Edge, HalfEdge, HalfEdgeMesh, radius_ratio};

/// Which collapses are made.
#[derive(Clone, Copy)]
pub(crate) struct Bounds {
    /// Edges shorter than this multiple of the target length at both ends collapse.
    pub(crate) short: f32,
    /// Largest deviation of the faces around after a collapse, as a share of the tolerance.
    pub(crate) share: f32,
}

/// Collapses short edges, and the shortest edges of triangles that are too small or too thin, as far
/// as the criteria allow.
pub(crate) fn simplify(
    mesh: &mut HalfEdgeMesh,
    criteria: &Criteria,
    length: &[f32],
    bounds: Bounds,
) {
    let candidate = |e: Edge| {
        let h = e.halfedge();
        if mesh.is_pinned(mesh.from(h)) && mesh.is_pinned(mesh.to(h)) {
            return None;
        }
        let l = mesh.length(e);
        let wanted = length[mesh.from(h).0 as usize].min(length[mesh.to(h).0 as usize]);
        let is_candidate = l < bounds.short * wanted
            || is_shortest_of_bad_face(mesh, criteria, h)
            || is_shortest_of_bad_face(mesh, criteria, h.twin());
        is_candidate.then_some((l, h))
    };
    let mut candidates: Vec<(f32, HalfEdge)> = mesh.par_edges().filter_map(candidate).collect();
    candidates.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    for (_, h) in candidates {
        if !mesh.has_edge(h.edge()) {
            continue;
        }
        let directions =
            [h, h.twin()].map(|h| (h, collapse_quality(mesh, criteria, length, h, bounds)));
        let best = directions.iter().max_by(|a, b| a.1.total_cmp(&b.1)).expect("two directions");
        if best.1 > 0.0 {
            mesh.collapse(best.0);
        }
    }
}

/// Whether `h` is the shortest side of a face that should be removed.
fn is_shortest_of_bad_face(mesh: &HalfEdgeMesh, criteria: &Criteria, h: HalfEdge) -> bool {
    let l = mesh.length(h.edge());
    let sides = [mesh.next(h), mesh.prev(h)];
    sides.iter().all(|s| mesh.length(s.edge()) >= l) && criteria.is_bad(mesh, mesh.face(h))
}

/// Worst radius ratio of the faces that the collapse would leave around its target; zero if the
/// collapse is not legal, or leaves a face that turns over, is thinner than before, too long, or
/// off the isosurface.
fn collapse_quality(
    mesh: &HalfEdgeMesh,
    criteria: &Criteria,
    length: &[f32],
    h: HalfEdge,
    bounds: Bounds,
) -> f32 {
    if !mesh.can_collapse(h) {
        return 0.0;
    }
    let (v, w) = (mesh.from(h), mesh.to(h));
    let target = mesh.position(w);
    let (mut worst_before, mut worst_after) = (1.0f32, 1.0f32);
    let mut faces: Vec<([Vec3; 3], [Vec3; 3])> = Vec::new();
    for s in mesh.spokes(v) {
        let (a, b) = (mesh.to(s), mesh.to(mesh.next(s)));
        let before = [mesh.position(v), mesh.position(a), mesh.position(b)];
        worst_before = worst_before.min(radius_ratio(before));
        if a == w || b == w {
            continue;
        }
        let after = [target, before[1], before[2]];
        worst_after = worst_after.min(radius_ratio(after));
        let longest = 1.5 * length[w.0 as usize].min(length[a.0 as usize]);
        if target.distance(before[1]) > longest.max(before[0].distance(before[1])) {
            return 0.0;
        }
        faces.push((before, after));
    }
    if worst_after < 1.5 * criteria.min_quality && worst_after <= worst_before {
        return 0.0;
    }
    let wanted = bounds.share * criteria.error;
    let most = if worst_before < criteria.min_quality {
        faces.iter().map(|f| criteria.deviation(f.0)).fold(wanted, f32::max)
    } else {
        wanted
    };
    let good = faces.iter().all(|&(before, after)| criteria.may_change(before, after, most));
    if good { worst_after } else { 0.0 }
}
