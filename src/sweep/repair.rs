//! Repairs faces that are turned over or off the isosurface by local edits, before their cells become exact.
//!
//! # Theory
//!
//! The seam stays on the lattice's squares, so where the isosurface is oblique to them it runs over nearby vertices of the mesh,
//! and their faces are turned over in exact cells. Such vertices are merged into the seam, or
//! edges near them flipped. Remeshing does not do that, as its edits must not turn a triangle far. The criterion
//! here is how many triangles fail, in every position that the mesh has during a step, then how thin they are.

use std::collections::BTreeSet;

use glam::Vec3;

use super::region::Region;
use super::tracked::{Tracked, share_exact_cell};
use super::transport::fault;
use crate::mesh::{Edge, Face, HalfEdge, Vertex, radius_ratio};
use crate::sweep::remesh::criteria::Criteria;

/// The positions of the vertices at an isovalue, and the criteria there.
pub(super) struct Shape<'a> {
    pub(super) criteria: Criteria<'a>,
    /// The largest deviation of a barycentre, voxels.
    pub(super) max_deviation: f32,
    pub(super) place: &'a dyn Fn(&Tracked, Vertex) -> Vec3,
}

/// How bad some triangles are: the number of failures over all shapes, and the negative of the smallest radius ratio.
type Badness = (usize, f32);

#[derive(Clone, Copy)]
enum Edit {
    Collapse(HalfEdge),
    Flip(Edge),
}

/// The changes of a repair.
#[derive(Debug, Default)]
pub(super) struct Repaired {
    /// The corners that the repaired faces had.
    pub(super) corners: Vec<[Vec3; 3]>,
    /// Faces that were removed or have other vertices.
    pub(super) faces: BTreeSet<Face>,
    /// Removed vertices.
    pub(super) gone: Vec<Vertex>,
}

/// Repairs faces in order, each by the edit that leaves the fewest failures, if that are fewer than before.
pub(super) fn repair(
    tracked: &mut Tracked,
    region: &Region,
    shapes: &[Shape],
    faces: &[Face],
) -> Repaired {
    let mut repaired = Repaired::default();
    for &f in faces {
        if !tracked.mesh.has_face(f) || tracked.mesh.is_cap(f) {
            continue;
        }
        if let Some(edit) = best_edit(tracked, region, shapes, f) {
            repaired.corners.push(tracked.mesh.corners(f));
            match edit {
                Edit::Collapse(h) => {
                    repaired.faces.extend(tracked.faces_around(tracked.mesh.from(h)));
                    repaired.gone.push(tracked.mesh.collapse(h).removed);
                }
                Edit::Flip(e) => repaired.faces.extend(tracked.mesh.flip(e).faces),
            }
        }
    }
    repaired
}

/// The edit that leaves the fewest failing triangles.
fn best_edit(tracked: &Tracked, region: &Region, shapes: &[Shape], f: Face) -> Option<Edit> {
    let mesh = &tracked.mesh;
    let mut best: Option<(Badness, Edit)> = None;
    let mut offer = |edit: Edit, before: Badness, after: Badness| {
        let better = best.as_ref().is_none_or(|b| after < b.0);
        if after.0 < before.0 && better {
            best = Some((after, edit));
        }
    };
    for v in mesh.face_vertices(f).into_iter().filter(|&v| !mesh.is_pinned(v)) {
        let around: Vec<[Vertex; 3]> =
            mesh.spokes(v).map(|s| [v, mesh.to(s), mesh.to(mesh.next(s))]).collect();
        let before = badness(tracked, shapes, &around);
        for h in mesh.spokes(v).filter(|&h| may_collapse(tracked, region, h)) {
            let w = mesh.to(h);
            let left = around.iter().filter(|t| !t.contains(&w));
            let after: Vec<[Vertex; 3]> = left.map(|t| [w, t[1], t[2]]).collect();
            offer(Edit::Collapse(h), before, badness(tracked, shapes, &after));
        }
    }
    for e in mesh.face_halfedges(f).map(|h| h.edge()).into_iter().filter(|&e| mesh.can_flip(e)) {
        let h = e.halfedge();
        let (a, b) = (mesh.from(h), mesh.to(h));
        let (c, d) = (mesh.to(mesh.next(h)), mesh.to(mesh.next(h.twin())));
        let before = badness(tracked, shapes, &[[a, b, c], [b, a, d]]);
        offer(Edit::Flip(e), before, badness(tracked, shapes, &[[a, d, c], [d, b, c]]));
    }
    best.map(|b| b.1)
}

/// Whether the start of a half-edge may merge into its end, which may be on the seam.
fn may_collapse(tracked: &Tracked, region: &Region, h: HalfEdge) -> bool {
    let mesh = &tracked.mesh;
    let (v, w) = (mesh.from(h), mesh.to(h));
    if !mesh.is_link_kept(h) {
        return false;
    }
    let Some(e) = tracked.key(w) else { return !mesh.is_fixed(w) };
    mesh.one_ring(v)
        .filter(|&a| a != w && mesh.find_halfedge(w, a).is_none())
        .all(|a| tracked.key(a).is_none_or(|other| !share_exact_cell(region, e, other)))
}

fn badness(tracked: &Tracked, shapes: &[Shape], triangles: &[[Vertex; 3]]) -> Badness {
    let (mut n, mut worst) = (0, 1.0f32);
    for shape in shapes {
        for t in triangles {
            let corners = t.map(|v| (shape.place)(tracked, v));
            n += usize::from(fault(&shape.criteria, corners, shape.max_deviation).is_some());
            worst = worst.min(radius_ratio(corners));
        }
    }
    (n, -worst)
}
