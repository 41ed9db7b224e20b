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
use crate::mesh::{Edge, Mesh, Vertex, normal};

/// Least distance of a cap's own vertices from the border, voxels.
pub(crate) const LIFT: f32 = 0.002;

/// Within this distance a point lies in a border plane, voxels.
const ON_PLANE: f32 = 1e-5;

/// How often a cap's vertices move to the middle of their neighbours, by shares of the way there; and how far,
/// in voxels, away from a side of the ring around them that is in their way.
const ROUNDS: usize = 16;
const MIDDLE_SHARES: [f32; 3] = [1.0, 0.5, 0.25];
const APART: [f32; 2] = [0.5, 0.1];

/// A vertex of a cap that moved by no more than this, in voxels, waits until one of the ring around it moves farther:
/// most lie far from the curve that moves.
const AT_REST: f32 = 0.003;

/// Whether a vertex belongs to caps only.
pub(crate) fn is_of_cap(mesh: &Mesh, v: Vertex) -> bool {
    mesh.border(v) == 0 && mesh.is_cap(mesh.face(mesh.outgoing(v)))
}

/// The highest corner of the volume, voxel frame.
pub(crate) fn top(field: &Field) -> Vec3 {
    Vec3::from(field.volume().dims().map(|d| (d - 1) as f32)) * field.cell_size()
}

/// How far beyond the volume a point lies along each axis, voxel frame; negative inside.
pub(crate) fn beyond(field: &Field, p: Vec3) -> Vec3 {
    (-p).max(p - top(field))
}

/// The gradient at a point of the isosurface proper, seen from inside the volume where it lies on the border: the
/// layer is much steeper.
pub(crate) fn inner_gradient(field: &Field, p: Vec3) -> Vec3 {
    field.gradient(p.clamp(Vec3::splat(ON_PLANE), top(field) - ON_PLANE))
}

/// How steep the field is at a point of the isosurface proper: see [`inner_gradient`].
pub(crate) fn inner_slope(field: &Field, p: Vec3) -> f32 {
    inner_gradient(field, p).length()
}

/// How steep the field is at the vertices of a mesh that are not of caps, in their order; at evenly chosen ones
/// where there are more than `most`.
pub(crate) fn inner_slopes(mesh: &Mesh, field: &Field, most: usize) -> Vec<f32> {
    let moving: Vec<Vertex> = mesh.vertices().filter(|&v| !is_of_cap(mesh, v)).collect();
    let chosen = moving.iter().step_by(moving.len() / most + 1);
    chosen.map(|&v| inner_slope(field, mesh.position(v))).collect()
}

/// The border planes, as bits of [`Mesh::border`], that a point of a cap lies in or beyond.
pub(super) fn planes(field: &Field, p: Vec3) -> u8 {
    let beyond = beyond(field, p);
    (0..3).filter(|&a| beyond[a] > -ON_PLANE).fold(0, |planes, a| planes | 1 << a)
}

/// Whether a cap's triangle follows the border: no side of it cuts off an edge of the volume.
pub(crate) fn follows_border(field: &Field, t: [Vec3; 3]) -> bool {
    let [a, b, c] = t.map(|p| planes(field, p));
    a & b != 0 && b & c != 0 && c & a != 0
}

/// Whether a cap's triangle looks into the volume: then it lies over others.
pub(crate) fn looks_in(field: &Field, isovalue: f32, t: [Vec3; 3]) -> bool {
    let shared = t.into_iter().fold(u8::MAX, |shared, p| shared & planes(field, p));
    if shared == 0 {
        return false;
    }
    let a = shared.trailing_zeros() as usize;
    let is_low = t[0][a] < 0.5 * top(field)[a];
    let falls_outwards = field.outside() < isovalue;
    (normal(t)[a] < 0.0) != (is_low == falls_outwards)
}

/// Splits the edges of caps that cut off an edge of the volume, beyond it.
pub(crate) fn split_chamfers(mesh: &mut Mesh, field: &Field) {
    let is_chamfer = |mesh: &Mesh, e: Edge| {
        let h = e.halfedge();
        let ends = [mesh.from(h), mesh.to(h)];
        let is_in_cap = mesh.is_cap(mesh.face(h)) && mesh.is_cap(mesh.face(h.twin()));
        let [p, q] = ends.map(|v| planes(field, mesh.position(v)));
        is_in_cap && p & q == 0 && !ends.iter().all(|&v| mesh.is_pinned(v))
    };
    let chamfers: Vec<Edge> = mesh.edges().filter(|&e| is_chamfer(mesh, e)).collect();
    let top = top(field);
    for e in chamfers {
        let [p, q] = [mesh.from(e.halfedge()), mesh.to(e.halfedge())].map(|v| mesh.position(v));
        let mut middle = 0.5 * (p + q);
        for (end, planes) in [p, q].map(|p| (p, planes(field, p))) {
            for a in (0..3).filter(|a| planes & 1 << a != 0) {
                let is_low = end[a] < 0.5 * top[a];
                middle[a] = if is_low { end[a].min(-LIFT) } else { end[a].max(top[a] + LIFT) };
            }
        }
        mesh.split_edge(e, middle);
    }
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
    let top = top(field);
    let moves = |v: Vertex| is_of_cap(mesh, v) && !mesh.is_pinned(v);
    let caps: Vec<usize> = (0..vertices.len()).filter(|&i| moves(vertices[i])).collect();
    if caps.is_empty() {
        return;
    }
    // Projected, those that the curve has run over lie inside the volume: they start from before.
    for &i in &caps {
        positions[i] = mesh.position(vertices[i]).to_array();
    }
    let isovalue = field.isovalue(isovalue);
    // Caps look to the lower values.
    let out = if field.outside() < isovalue { 1.0 } else { -1.0 };
    let rings: Vec<Ring> = caps.iter().map(|&i| Ring::of(mesh, vertices[i], vertices)).collect();
    let mut moved = vec![false; positions.len()];
    for round in 0..ROUNDS {
        for (&i, ring) in caps.iter().zip(&rings) {
            if round > 0 && !moved[i] && !ring.any(&moved) {
                continue;
            }
            let p = Vec3::from(positions[i]);
            let q = smoothed(p, &ring.places(positions), out, top);
            moved[i] = q.distance_squared(p) > AT_REST * AT_REST;
            positions[i] = q.to_array();
        }
    }
    for &i in &caps {
        positions[i] = lifted(field, isovalue, top, positions[i].into()).to_array();
    }
}

/// The ring around a cap's vertex: of each vertex either its index among those that have a position, or where it is.
struct Ring(Vec<Result<usize, Vec3>>);

impl Ring {
    fn of(mesh: &Mesh, v: Vertex, vertices: &[Vertex]) -> Ring {
        let found = |w: Vertex| vertices.binary_search(&w).map_err(|_| mesh.position(w));
        Ring(mesh.one_ring(v).map(found).collect())
    }

    /// Whether any of those among the positions is marked.
    fn any(&self, marked: &[bool]) -> bool {
        self.0.iter().flatten().any(|&i| marked[i])
    }

    /// Where the ring's vertices are, in their order.
    fn places(&self, positions: &[[f32; 3]]) -> Vec<Vec3> {
        self.0.iter().map(|w| w.map_or_else(|p| p, |i| positions[i].into())).collect()
    }
}

/// Where a cap's vertex goes along the border: to the middle of the ring around it, or part of the way; but
/// where that turns a face over, or one is turned over, away from the side of the ring that is in its way.
/// `out` is 1 if the cap looks out of the volume, else -1.
fn smoothed(p: Vec3, ring: &[Vec3], out: f32, top: Vec3) -> Vec3 {
    let outside = p.cmplt(Vec3::ZERO) | p.cmpgt(top);
    // Beyond an edge of the volume there is no one direction along the border.
    if outside.bitmask().count_ones() != 1 {
        return p;
    }
    let along = |q: Vec3| Vec3::select(outside, p, q.clamp(Vec3::ZERO, top));
    let up = Vec3::select(outside, out * (p - p.clamp(Vec3::ZERO, top)), Vec3::ZERO).normalize();
    let middle = ring.iter().sum::<Vec3>() / ring.len() as f32;
    let sides = sides(ring, up);
    let (room, off) = least_room(p, &sides);
    let to_middle = MIDDLE_SHARES.map(|share| along(p.lerp(middle, share)));
    let apart = APART.map(|distance| along(p + distance * off));
    let mut places = to_middle.into_iter().chain(apart);
    places.find(|&q| least_room(q, &sides).0 > room.min(0.0)).unwrap_or(p)
}

/// The sides of a ring: where each begins, and the unit direction into the ring. `up` is the unit normal of the cap.
fn sides(ring: &[Vec3], up: Vec3) -> Vec<(Vec3, Vec3)> {
    let next = ring.iter().cycle().skip(1);
    ring.iter().zip(next).map(|(&a, &b)| (a, up.cross(b - a).normalize_or_zero())).collect()
}

/// How far a point of a cap is from the nearest line through a side of the ring around it, and the direction away
/// from it: negative where the face beside it would lie face down.
fn least_room(p: Vec3, sides: &[(Vec3, Vec3)]) -> (f32, Vec3) {
    let rooms = sides.iter().map(|&(a, inwards)| ((p - a).dot(inwards), inwards));
    rooms.min_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or((0.0, Vec3::ZERO))
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

#[cfg(test)]
mod tests {
    use super::*;

    const TOP: Vec3 = Vec3::splat(9.0);

    /// A ring that is not convex in the plane z = 9, counter-clockwise seen from outside: its middle lies
    /// outside it.
    fn sickle() -> Vec<Vec3> {
        [[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [3.0, 4.0], [3.0, 1.0], [0.0, 1.0]]
            .map(|[x, y]| Vec3::new(1.0 + x, 1.0 + y, 9.0))
            .to_vec()
    }

    fn room(p: Vec3) -> f32 {
        least_room(p, &sides(&sickle(), Vec3::Z)).0
    }

    #[test]
    fn a_caps_vertex_turns_no_face_over() {
        let p = Vec3::new(4.5, 1.5, 9.002);
        assert!(room(p) > 0.0);
        let middle = sickle().iter().sum::<Vec3>() / 6.0;
        assert!(room(middle) < 0.0);
        let q = smoothed(p, &sickle(), 1.0, TOP);
        assert!(room(q) > 0.0 && q.z == p.z, "{q}");
    }

    #[test]
    fn a_caps_vertex_that_was_run_over_comes_back() {
        let mut p = Vec3::new(4.5, 0.8, 9.002);
        assert!(room(p) < 0.0);
        for _ in 0..ROUNDS {
            p = smoothed(p, &sickle(), 1.0, TOP);
        }
        assert!(room(p) > 0.0, "{p}");
        // Beyond z = 0, where lower values are inside, the same ring looks in.
        let lowered: Vec<Vec3> = sickle().iter().map(|v| v.with_z(0.0)).collect();
        let q = smoothed(Vec3::new(4.5, 1.5, -0.002), &lowered, -1.0, TOP);
        assert!(least_room(q, &sides(&lowered, Vec3::Z)).0 > 0.0, "{q}");
    }
}
