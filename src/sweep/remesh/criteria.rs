//! Quality criteria of triangles, shared by simplification, refinement and flips.

use glam::Vec3;
use rayon::prelude::*;

use crate::field::Field;
use crate::field::face_deviation;
use crate::field::project_point;
use crate::mesh::{Face, HalfEdgeMesh, Vertex, normal, radius_ratio};
use crate::sweep::parameters::Parameters;

/// Share of the tolerance that a triangle may use at a sampling isovalue. The rest is for isovalues
/// between two sampling isovalues, where trajectories are straight and surfaces are not.
const SAMPLE_SHARE: f32 = 0.72;

/// Shortest edge that refinement aims at, voxels.
const MIN_EDGE: f32 = 0.35;

/// Cosine of the largest angle by which an edit may turn a face.
const MIN_TURN_COSINE: f32 = 0.4;

/// The isosurface a mesh should follow, and how closely.
#[derive(Clone, Copy)]
pub(crate) struct Criteria<'a> {
    /// The field, voxel frame.
    pub(crate) field: &'a Field,
    /// The isovalue in the field's own values.
    pub(crate) isovalue: f32,
    /// Largest deviation of a barycentre, voxels.
    pub(crate) error: f32,
    /// Radius ratio below which a triangle is removed.
    pub(crate) min_quality: f32,
    /// Area below which a triangle is removed, square voxels.
    pub(crate) min_area: f32,
    /// Area above which a triangle may be refined, square voxels.
    pub(crate) refine_area: f32,
    /// Longest edge, voxels.
    pub(crate) max_edge: f32,
    /// Shortest edge that refinement aims at, voxels: a crease of the trilinear field deviates
    /// however fine the mesh is.
    pub(crate) min_edge: f32,
}

impl<'a> Criteria<'a> {
    /// The criteria of a sweep at an isovalue.
    pub(crate) fn new(field: &'a Field, isovalue: f64, parameters: &Parameters) -> Self {
        let d = field.volume().block_position().whole.into_iter().min().unwrap_or(1) as f32;
        Criteria {
            field,
            isovalue: field.isovalue(isovalue),
            error: SAMPLE_SHARE * parameters.error as f32,
            min_quality: parameters.min_quality as f32,
            min_area: parameters.min_area as f32 * d,
            refine_area: parameters.refine_area as f32 * d,
            max_edge: parameters.max_edge as f32,
            min_edge: MIN_EDGE,
        }
    }

    /// Distance of a triangle's barycentre from the isosurface along its normal.
    pub(crate) fn deviation(&self, t: [Vec3; 3]) -> f32 {
        face_deviation(self.field, t[0], t[1], t[2], self.isovalue, 1.0)
    }

    /// Whether a face that changes from `before` to `after` keeps its side and deviates by at most `most`.
    pub(crate) fn may_change(&self, before: [Vec3; 3], after: [Vec3; 3], most: f32) -> bool {
        let (n, m) = (normal(before), normal(after));
        let turn = n.dot(m);
        turn > MIN_TURN_COSINE * n.length() * m.length() && self.deviation(after) <= most
    }

    /// The middle of an edge, projected onto the isosurface; the middle itself if the isosurface
    /// is not within half the edge length.
    pub(crate) fn edge_point(
        &self,
        mesh: &HalfEdgeMesh,
        a: Vertex,
        b: Vertex,
        along: Vec3,
    ) -> Vec3 {
        let (p, q) = (mesh.position(a), mesh.position(b));
        let middle = 0.5 * (p + q);
        let reach = 0.5 * p.distance(q);
        project_point(self.field, middle, along, self.isovalue, reach).unwrap_or(middle)
    }

    /// Deviation of every face by slot; zero where the slot is empty, all of the face is pinned, or it
    /// is a cap, which nothing has to follow.
    pub(crate) fn deviations(&self, mesh: &HalfEdgeMesh) -> Vec<f32> {
        let faces = (0..mesh.face_slots() as u32).into_par_iter().map(Face);
        let moves = |f| mesh.face_vertices(f).iter().any(|&v| !mesh.is_pinned(v));
        faces
            .with_min_len(256)
            .map(|f| {
                let is_free = mesh.has_face(f) && !mesh.is_cap(f) && moves(f);
                if is_free { self.deviation(mesh.corners(f)) } else { 0.0 }
            })
            .collect()
    }

    /// Whether simplification should remove the face: too small or too thin (thesis section 3.6).
    pub(crate) fn is_bad(&self, mesh: &HalfEdgeMesh, f: Face) -> bool {
        let t = mesh.corners(f);
        0.5 * normal(t).length() < self.min_area || radius_ratio(t) < self.min_quality
    }
}

/// Longest target edge length at the seam, voxels: the side of a cell.
const MAX_SEAM_EDGE: f32 = 1.0;

/// Target edge length at every vertex slot, voxels.
///
/// A triangle with edges of length l on a surface of curvature k deviates by about k l^2 / 6, so
/// the length at which it would deviate by `goal` is l * sqrt(goal / deviation).
pub(crate) fn sizing(
    mesh: &HalfEdgeMesh,
    criteria: &Criteria,
    deviations: &[f32],
    goal: f32,
) -> Vec<f32> {
    // The requested longest edge may be shorter than the default shortest one.
    let max_edge = criteria.max_edge;
    let min_edge = criteria.min_edge.min(max_edge);
    let faces: Vec<Face> = mesh.par_faces().filter(|&f| !mesh.is_cap(f)).collect();
    let inverse_square = |&f: &Face| {
        let [a, b, c] = mesh.corners(f);
        let square = (a.distance_squared(b) + b.distance_squared(c) + c.distance_squared(a)) / 3.0;
        let wanted = square * (goal / deviations[f.0 as usize].max(1e-6)).clamp(0.2, 4.0);
        1.0 / wanted.max(1e-12)
    };
    let of_faces: Vec<f32> = faces.par_iter().with_min_len(256).map(inverse_square).collect();
    let mut around = vec![(0.0f32, 0u32); mesh.vertex_slots()];
    for (&f, inverse_square) in faces.iter().zip(of_faces) {
        for v in mesh.face_vertices(f) {
            let (sum, n) = &mut around[v.0 as usize];
            (*sum, *n) = (*sum + inverse_square, *n + 1);
        }
    }
    let vertices = (0..mesh.vertex_slots() as u32).into_par_iter().with_min_len(256).map(Vertex);
    let wanted = |v: Vertex| {
        let wanted = match around[v.0 as usize] {
            (_, 0) => max_edge,
            (sum, n) => (n as f32 / sum).sqrt().clamp(min_edge, max_edge),
        };
        // The hull of the exact cells has corners at every cell; longer triangles would extend across them.
        let is_at_seam = mesh.has_vertex(v) && mesh.is_fixed(v);
        if is_at_seam { wanted.min(MAX_SEAM_EDGE) } else { wanted }
    };
    let mut length: Vec<f32> = vertices.clone().map(wanted).collect();
    // Lengths grow by at most half a length per length, so that triangles stay well shaped.
    for _ in 0..2 {
        let grown = |v: Vertex| {
            let own = length[v.0 as usize];
            let ring = mesh.has_vertex(v).then(|| mesh.one_ring(v)).into_iter().flatten();
            let place = mesh.position(v);
            let limit = |w: Vertex| length[w.0 as usize] + 0.5 * place.distance(mesh.position(w));
            ring.map(limit).fold(own, f32::min)
        };
        length = vertices.clone().map(grown).collect();
    }
    length
}

/// Sets the target length of vertices added since `length` was computed to the mean of their neighbours.
pub(crate) fn extend_sizing(mesh: &HalfEdgeMesh, length: &mut Vec<f32>) {
    let known = length.len();
    for slot in known..mesh.vertex_slots() {
        let v = Vertex(slot as u32);
        let ring = if mesh.has_vertex(v) { mesh.one_ring(v).collect() } else { Vec::new() };
        let neighbours: Vec<f32> =
            ring.iter().filter_map(|w| length.get(w.0 as usize).copied()).collect();
        let sum: f32 = neighbours.iter().sum();
        length.push(if neighbours.is_empty() { 0.0 } else { sum / neighbours.len() as f32 });
    }
}
