//! Faces that are turned over or off are mended by local edits, before their cells become exact for them.
//!
//! # Theory
//!
//! The seam keeps to the lattice's squares, so it runs over vertices of the mesh beside it where the isosurface is oblique to
//! them, and what it has overrun lies turned over in exact cells. Such vertices are merged into the seam, or
//! edges beside them flipped. Edits that make triangles better do not do so, as they turn no triangle far. What
//! counts here is how many triangles fail, in every shape that the mesh has on a step, then how thin they are.

use std::collections::BTreeSet;

use glam::Vec3;

use super::region::Region;
use super::tracked::{Tracked, share_exact_cell};
use super::transport::{MOST_OFF, fault, faults};
use crate::mesh::{Edge, Face, HalfEdge, Vertex, radius_ratio};
use crate::sweep::parameters::Parameters;
use crate::sweep::remesh::criteria::Criteria;

/// How a mesh lies at an isovalue.
pub(super) struct Shape<'a> {
    pub(super) criteria: Criteria<'a>,
    /// The largest deviation of a barycentre, voxels.
    pub(super) most: f32,
    pub(super) place: &'a dyn Fn(&Tracked, Vertex) -> Vec3,
}

/// How bad some triangles are: how many fail, over all shapes, and the smallest radius ratio with its sign changed.
type Badness = (usize, f32);

#[derive(Clone, Copy)]
enum Edit {
    Collapse(HalfEdge),
    Flip(Edge),
}

/// What mending has changed.
#[derive(Debug, Default)]
pub(super) struct Mended {
    /// Where the corners of the faces were that are mended.
    pub(super) corners: Vec<[Vec3; 3]>,
    /// Faces that are gone, or have other vertices.
    pub(super) faces: BTreeSet<Face>,
    /// Vertices that are gone.
    pub(super) gone: Vec<Vertex>,
}

/// Mends faces, in their order, where an edit leaves fewer that fail.
pub(super) fn mend(
    tracked: &mut Tracked,
    region: &Region,
    shapes: &[Shape],
    faces: &[Face],
) -> Mended {
    let mut mended = Mended::default();
    for &f in faces {
        if !tracked.mesh.has_face(f) || tracked.mesh.is_cap(f) {
            continue;
        }
        if let Some(edit) = best_edit(tracked, region, shapes, f) {
            mended.corners.push(tracked.mesh.corners(f));
            match edit {
                Edit::Collapse(h) => {
                    mended.faces.extend(tracked.faces_around(tracked.mesh.from(h)));
                    mended.gone.push(tracked.mesh.collapse(h).removed);
                }
                Edit::Flip(e) => mended.faces.extend(tracked.mesh.flip(e).faces),
            }
        }
    }
    mended
}

/// Mends the faces that cannot stay as they are, where the mesh is.
pub(super) fn mend_faults(
    tracked: &mut Tracked,
    region: &Region,
    criteria: &Criteria,
    parameters: &Parameters,
) {
    let bad = faults(tracked, criteria, parameters);
    let place = |tracked: &Tracked, v: Vertex| tracked.mesh.position(v);
    let most = MOST_OFF * parameters.error as f32;
    mend(tracked, region, &[Shape { criteria: *criteria, most, place: &place }], &bad);
}

/// The edit that leaves the fewest triangles that fail.
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
            n += usize::from(fault(&shape.criteria, corners, shape.most).is_some());
            worst = worst.min(radius_ratio(corners));
        }
    }
    (n, -worst)
}
