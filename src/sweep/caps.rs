//! Caps stay outside the volume, and beside each other.
//!
//! A cap closes the mesh in the layer around the volume, at a distance from the border that falls
//! to zero where the field falls to the isovalue. Rounded to the border itself, a cap could not be
//! told from the isosurface proper; so its vertices keep a small distance. And the curve in which
//! the isosurface meets the border moves along the border, while the field in the layer rises only
//! across it: without more, the curve would run over the cap's vertices. They are smoothed along the
//! border, which nobody sees, and put back onto the isosurface across it.

use glam::Vec3;

use crate::kernels::field::Field;
use crate::mesh::{Face, HalfEdge, Mesh, Vertex, normal, radius_ratio};

/// Least distance of a cap's own vertices from the border, voxels.
const LIFT: f32 = 0.002;

/// How far outside the volume a vertex of the isosurface proper has left it, voxels.
const LEFT: f32 = 1e-4;

/// Largest angle, as its cosine, by which a collapse onto the border curve turns a face.
const MOST_TURN: f32 = 0.5;

/// How often a cap's vertices move to the middle of their neighbours.
const ROUNDS: usize = 16;

/// Whether a vertex belongs to caps only.
pub(crate) fn is_of_cap(mesh: &Mesh, v: Vertex) -> bool {
    mesh.border(v) == 0 && mesh.is_cap(mesh.face(mesh.outgoing(v)))
}

/// Whether a vertex of the isosurface proper has left the volume at `p`: the isosurface, or its border
/// curve, has reached another border plane there, and wants a cap.
pub(crate) fn has_left(mesh: &Mesh, field: &Field, v: Vertex, p: Vec3) -> bool {
    let dims = field.volume().dims().map(|d| (d - 1) as f32);
    let top = Vec3::from(dims) * field.cell_size();
    let beyond = (-p).max(p - top);
    let border = mesh.border(v);
    let leaves = |a: usize| border & 1 << a == 0 && beyond[a] > LEFT;
    (0..3).any(leaves) && !is_of_cap(mesh, v)
}

/// The vertices of caps only whose faces turn over at `positions`, by the numbers of `faces`' corners among
/// `vertices`: the border curve has run over them.
pub(crate) fn overrun(
    mesh: &Mesh,
    (faces, triangles): (&[Face], &[[u32; 3]]),
    vertices: &[Vertex],
    positions: &[[f32; 3]],
) -> Vec<Vertex> {
    let mut found = Vec::new();
    for (&f, t) in faces.iter().zip(triangles).filter(|(f, _)| mesh.is_cap(**f)) {
        let after = normal(t.map(|v| positions[v as usize].into()));
        if after.dot(normal(mesh.corners(f))) < 0.0 {
            found.extend(t.map(|v| vertices[v as usize]).iter().filter(|v| is_of_cap(mesh, **v)));
        }
    }
    found.sort_unstable();
    found.dedup();
    found
}

/// Takes vertices that the border curve is about to run over out of its way: each is collapsed onto a
/// vertex of the curve, the outer ones after those beside the curve; and vertices of the curve that
/// would leave a border plane onto one that lies in the next plane too.
/// Returns the vertices removed and those in their place.
pub(crate) fn retreat(mesh: &mut Mesh, leaving: &[Vertex]) -> Vec<(Vertex, Vertex)> {
    let mut collapsed = Vec::new();
    loop {
        let before = collapsed.len();
        for &v in leaving {
            if !mesh.has_vertex(v) {
                continue;
            }
            let border = mesh.border(v);
            let is_onto_curve = |b: u8| b & border == border && b != border;
            let onto_curve = mesh.spokes(v).filter(|&h| is_onto_curve(mesh.border(mesh.to(h))));
            let best = onto_curve
                .map(|h| (retreat_quality(mesh, h), h))
                .max_by(|a, b| a.0.total_cmp(&b.0).then(b.1.cmp(&a.1)));
            if let Some((quality, h)) = best
                && quality > 0.0
            {
                let c = mesh.collapse(h);
                collapsed.push((c.removed, c.target));
            }
        }
        if collapsed.len() == before {
            return collapsed;
        }
    }
}

/// Worst radius ratio of the faces that a collapse onto the border curve would leave; zero if it is
/// not legal or turns a face.
fn retreat_quality(mesh: &Mesh, h: HalfEdge) -> f32 {
    if !mesh.can_collapse(h) {
        return 0.0;
    }
    let (v, w) = (mesh.from(h), mesh.to(h));
    let mut worst = 1.0f32;
    for s in mesh.spokes(v) {
        let (a, b) = (mesh.to(s), mesh.to(mesh.next(s)));
        if a == w || b == w {
            continue;
        }
        let [p, q] = [a, b].map(|x| mesh.position(x));
        let after = [mesh.position(w), p, q];
        let (n, m) = (normal([mesh.position(v), p, q]), normal(after));
        if n.dot(m) < MOST_TURN * n.length() * m.length() {
            return 0.0;
        }
        worst = worst.min(radius_ratio(after));
    }
    worst
}

/// The vertices that belong to caps only, smoothed along the border and lifted off it. `positions`
/// are those of `vertices`, voxel frame; a neighbour that is not among them counts where `mesh` has
/// it.
pub(crate) fn smooth_caps(
    mesh: &Mesh,
    field: &Field,
    isovalue: f64,
    vertices: &[Vertex],
    positions: &mut [[f32; 3]],
) {
    let dims = field.volume().dims();
    let top = Vec3::new((dims[0] - 1) as f32, (dims[1] - 1) as f32, (dims[2] - 1) as f32)
        * field.cell_size();
    let moves = |v: Vertex| is_of_cap(mesh, v) && !mesh.is_pinned(v);
    let caps: Vec<usize> = (0..vertices.len()).filter(|&i| moves(vertices[i])).collect();
    if caps.is_empty() {
        return;
    }
    // Projected, those that the curve has run over lie inside the volume: they start from before.
    for &i in &caps {
        positions[i] = mesh.position(vertices[i]).to_array();
    }
    let at = |v: Vertex, positions: &[[f32; 3]]| {
        vertices.binary_search(&v).map_or(mesh.position(v), |i| positions[i].into())
    };
    let rings: Vec<Vec<Vertex>> =
        caps.iter().map(|&i| mesh.one_ring(vertices[i]).collect()).collect();
    for _ in 0..ROUNDS {
        let moved: Vec<Vec3> = rings
            .iter()
            .map(|r| r.iter().map(|&w| at(w, positions)).sum::<Vec3>() / r.len() as f32)
            .collect();
        for (&i, &middle) in caps.iter().zip(&moved) {
            let p = Vec3::from(positions[i]);
            let outside = p.cmplt(Vec3::ZERO) | p.cmpgt(top);
            // Beyond an edge of the volume there is no one direction along the border.
            if outside.bitmask().count_ones() == 1 {
                positions[i] = Vec3::select(outside, p, middle.clamp(Vec3::ZERO, top)).to_array();
            }
        }
    }
    let isovalue = field.isovalue(isovalue);
    for &i in &caps {
        positions[i] = lifted(field, isovalue, top, positions[i].into()).to_array();
    }
}

/// A cap's vertex, put onto the isosurface across the border, at least [`LIFT`] off it.
fn lifted(field: &Field, isovalue: f32, top: Vec3, mut p: Vec3) -> Vec3 {
    let outside = p.cmplt(Vec3::ZERO) | p.cmpgt(top);
    let value = field.value(p.clamp(Vec3::ZERO, top));
    let share = (value - isovalue) / (value - field.outside());
    let is_beside_face = outside.bitmask().count_ones() == 1;
    for a in 0..3 {
        let [below, above] = [-p[a], p[a] - top[a]];
        // Where it lies outside along one axis the field rises along that axis only.
        let height = |h: f32| {
            let onto = is_beside_face && h > 0.0;
            if onto { (share * field.cell_size()[a]).max(LIFT) } else { h.max(LIFT) }
        };
        if below > -LIFT && (below > 0.0 || !is_beside_face) {
            p[a] = -height(below);
        } else if above > -LIFT && (above > 0.0 || !is_beside_face) {
            p[a] = top[a] + height(above);
        }
    }
    p
}
