//! The curve in which the isosurface meets the border of the volume, as the isovalue moves.
//!
//! The curve runs over vertices on both sides of it. One that it is about to run over is collapsed
//! onto it where that keeps the faces; else the vertex passes the border, and the curve runs around
//! it: that is how a curve opens where the isosurface first touches the border, how two curves join
//! and how one vanishes.

use glam::Vec3;

use super::caps::{LIFT, beyond, follows_border, is_of_cap, looks_in, top};
use crate::kernels::field::Field;
use crate::mesh::{Compacted, HalfEdge, Mesh, Vertex, normal, radius_ratio};

/// How far outside the volume a vertex of the isosurface proper has left it, voxels.
const LEFT: f32 = 1e-4;

/// Largest angle, as its cosine, by which a collapse onto the border curve turns a face.
const MOST_TURN: f32 = 0.5;

/// A vertex passes the border from no farther away than this, voxels: so far it jumps.
const MOST_DEPTH: f32 = 0.3;

/// Where the curve runs, around a vertex that passes the border, as a share of its edges: where it is known, within
/// bounds, and else.
const CUT: f32 = 0.35;
const CUTS: (f32, f32) = (0.1, 0.9);

/// So many places of an edge are asked where it meets the curve, and so often the one found is halved.
const PLACES: u32 = 8;
const HALVINGS: u32 = 12;

/// A vertex in the way of the border curve, and the border planes (bits of [`Mesh::border`]) that it
/// would pass; none for a cap's vertex that is only in the way.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Leaving {
    pub(crate) vertex: Vertex,
    planes: u8,
}

impl Leaving {
    /// The first of the planes.
    fn plane(&self) -> u8 {
        1 << self.planes.trailing_zeros().min(2)
    }
}

/// What became of the vertices in the way of the border curve.
#[derive(Debug, Default, PartialEq)]
pub(crate) struct Cleared {
    /// The vertices that were collapsed onto the curve, and those in their place.
    pub(crate) collapsed: Vec<(Vertex, Vertex)>,
    /// The vertices that have passed the border.
    pub(crate) passed: Vec<Vertex>,
    /// Whether others may pass it when the isosurface is nearer to it.
    pub(crate) is_early: bool,
}

impl Cleared {
    /// Whether none has gone.
    pub(crate) fn is_nothing(&self) -> bool {
        self.collapsed.is_empty() && self.passed.is_empty()
    }
}

/// The border planes beyond which a vertex of the isosurface proper lies at `p`: there the isosurface,
/// or its border curve, wants a cap.
pub(crate) fn planes_left(mesh: &Mesh, field: &Field, v: Vertex, p: Vec3) -> u8 {
    let beyond = beyond(field, p);
    let border = mesh.border(v);
    let planes = (0..3).filter(|&a| border & 1 << a == 0 && beyond[a] > LEFT);
    let planes = planes.fold(0, |planes, a| planes | 1 << a);
    if planes != 0 && is_of_cap(mesh, v) { 0 } else { planes }
}

/// The vertices of the isosurface proper that leave the volume at `positions`, in the order of the
/// compacted mesh.
pub(crate) fn leaving(
    mesh: &Mesh,
    field: &Field,
    compacted: &Compacted,
    positions: &[[f32; 3]],
) -> Vec<Leaving> {
    let vertices = compacted.vertices.iter().zip(positions);
    let leaving = vertices.map(|(&v, &p)| {
        let planes = planes_left(mesh, field, v, p.into());
        Leaving { vertex: v, planes }
    });
    leaving.filter(|l| l.planes != 0).collect()
}

/// The vertices of caps only that the border curve runs over at `positions`: their faces turn over; or
/// of which only the curve around is left, and it is `lost` in part.
pub(crate) fn overrun(
    mesh: &Mesh,
    (field, isovalue): (&Field, f64),
    compacted: &Compacted,
    positions: &[[f32; 3]],
    lost: &[Vertex],
) -> Vec<Leaving> {
    let isovalue = field.isovalue(isovalue);
    let mut found = Vec::new();
    for (&f, t) in compacted.faces.iter().zip(&compacted.connectivity.faces) {
        if !mesh.is_cap(f) {
            continue;
        }
        let after = t.map(|v| positions[v as usize].into());
        if looks_in(field, isovalue, after) && !looks_in(field, isovalue, mesh.corners(f)) {
            let own = mesh.face_vertices(f).into_iter().filter(|&v| is_of_cap(mesh, v));
            found.extend(own.map(|vertex| Leaving { vertex, planes: plane_beside(mesh, vertex) }));
        }
    }
    for &v in lost.iter().filter(|&&v| mesh.border(v) != 0) {
        let last = mesh.one_ring(v).filter(|&w| is_of_cap(mesh, w));
        found.extend(last.map(|w| Leaving { vertex: w, planes: plane_beside(mesh, w) }));
    }
    found.sort_unstable_by_key(|l| (l.vertex, u8::MAX - l.planes));
    found.dedup_by_key(|l| l.vertex);
    found
}

/// The border plane of the curve beside a cap's vertex; none where there are two, or no curve.
fn plane_beside(mesh: &Mesh, v: Vertex) -> u8 {
    let planes = mesh.one_ring(v).fold(0, |planes, w| planes | mesh.border(w));
    if planes.count_ones() == 1 { planes } else { 0 }
}

/// Takes vertices out of the way of the border curve, as far as it goes, on the way to the isovalue `next`.
pub(crate) fn clear(mesh: &mut Mesh, field: &Field, leaving: &[Leaving], next: f64) -> Cleared {
    let vertices: Vec<Vertex> = leaving.iter().map(|l| l.vertex).collect();
    let collapsed = retreat(mesh, field, &vertices);
    let mut passed = Vec::new();
    let mut touched = Vec::new();
    let mut is_early = false;
    let far = |l: &Leaving| depth(field, mesh, l.vertex, l.plane());
    let may_pass = |l: &&Leaving| mesh.has_vertex(l.vertex) && l.planes != 0;
    let mut nearest: Vec<(f32, Leaving)> =
        leaving.iter().filter(may_pass).map(|l| (far(l), *l)).collect();
    nearest.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.vertex.cmp(&b.1.vertex)));
    for (depth, l) in nearest {
        let v = l.vertex;
        if touched.contains(&v) || !mesh.can_cross(v, l.plane()) {
            continue;
        }
        if depth > MOST_DEPTH {
            is_early = true;
            continue;
        }
        // Around it the others wait: the curve may run over them.
        let ring: Vec<Vertex> = mesh.one_ring(v).collect();
        touched.extend(ring.iter().flat_map(|&w| mesh.one_ring(w)));
        pass(mesh, (field, field.isovalue(next)), v, l.plane());
        passed.push(v);
    }
    Cleared { collapsed, passed, is_early }
}

/// How far a vertex has to go to pass a border plane, voxels: to the plane, or for a cap's vertex to the
/// curve.
fn depth(field: &Field, mesh: &Mesh, v: Vertex, plane: u8) -> f32 {
    let (p, a) = (mesh.position(v), plane.trailing_zeros() as usize);
    if !is_of_cap(mesh, v) {
        return p[a].abs().min((top(field)[a] - p[a]).abs());
    }
    let curve = mesh.one_ring(v).filter(|&w| mesh.border(w) & plane != 0);
    curve.map(|w| p.distance(mesh.position(w))).fold(f32::INFINITY, f32::min)
}

/// A vertex passes a border plane. The curve runs around it where it will be at the next isovalue: as the
/// isosurface touches the border, a curve is there at once.
fn pass(mesh: &mut Mesh, (field, next): (&Field, f32), v: Vertex, plane: u8) {
    let a = plane.trailing_zeros() as usize;
    let p = mesh.position(v);
    let is_low = p[a] < 0.5 * top(field)[a];
    let side = if is_low { 0.0 } else { top(field)[a] };
    let in_plane = |mut p: Vec3| {
        p[a] = side;
        p
    };
    mesh.cross(v, plane, |p, q| {
        let (p, q) = (in_plane(p), in_plane(q));
        p.lerp(q, curve_between(field, next, p, q).unwrap_or(CUT))
    });
    let mut p = in_plane(p);
    if is_of_cap(mesh, v) {
        p[a] += if is_low { -LIFT } else { LIFT };
    }
    mesh.set_position(v, p);
}

/// Where the isosurface first meets the way between two points, as a share of it.
fn curve_between(field: &Field, isovalue: f32, p: Vec3, q: Vec3) -> Option<f32> {
    let is_inside = |t: f32| field.value(p.lerp(q, t)) > isovalue;
    let first = is_inside(0.0);
    let places = (1..=PLACES).map(|i| i as f32 / PLACES as f32);
    let mut high = places.into_iter().find(|&t| is_inside(t) != first)?;
    let mut low = high - 1.0 / PLACES as f32;
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if is_inside(middle) == first { low = middle } else { high = middle }
    }
    Some(high.clamp(CUTS.0, CUTS.1))
}

/// Takes vertices that the border curve is about to run over out of its way: each is collapsed onto a
/// vertex of the curve, the outer ones after those beside the curve; and vertices of the curve that
/// would leave a border plane onto one that lies in the next plane too.
/// Returns the vertices removed and those in their place.
fn retreat(mesh: &mut Mesh, field: &Field, leaving: &[Vertex]) -> Vec<(Vertex, Vertex)> {
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
                .map(|h| (retreat_quality(mesh, field, h), h))
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
fn retreat_quality(mesh: &Mesh, field: &Field, h: HalfEdge) -> f32 {
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
        if mesh.is_cap(mesh.face(s)) && !follows_border(field, after) {
            return 0.0;
        }
        worst = worst.min(radius_ratio(after));
    }
    worst
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::volume::phantom;
    use std::sync::Arc;

    /// The phantom is 1 - |p|, p from -1 to 1 along 17 samples, but for a centre that is a little off.
    const HALF: f32 = 8.0;

    #[test]
    fn the_curve_is_found_between_two_points_of_the_border() {
        let field = Field::new(Arc::new(phantom("sphere:17").expect("a phantom")));
        let radius = 3.0f32;
        let isovalue = 1.0 - (1.0 + (radius / HALF).powi(2)).sqrt();
        let isovalue = field.isovalue(f64::from(isovalue));
        let centre = Vec3::new(HALF, HALF, 0.0);
        let outer = centre + Vec3::new(6.0, 0.0, 0.0);
        let share = curve_between(&field, isovalue, centre, outer).expect("a curve");
        let missing = field.value(centre.lerp(outer, share)) - isovalue;
        assert!(missing.abs() < 1e-4 * field.range(), "{share}: {missing}");
        assert!((6.0 * share - radius).abs() < 0.5, "{share}");
        let back = curve_between(&field, isovalue, outer, centre).expect("a curve");
        assert!((share + back - 1.0).abs() < 1e-3, "{share} {back}");
        assert_eq!(curve_between(&field, isovalue, centre, centre + 0.2 * Vec3::X), None);
    }
}
