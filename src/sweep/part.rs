//! A part of the tracked mesh as a mesh of its own, for an exchange.
//!
//! # Theory
//!
//! An exchange changes only faces near the blocks that change, so it works on the mesh near them: a mesh of its own
//! whose boundary consists of parts of the seam, and of the *rim*, where the rest of the mesh continues. The rim does not
//! change.

use std::collections::BTreeSet;

use super::fans::split_fans;
use super::tracked::Tracked;
use crate::mesh::{Face, Vertex};

/// See the module.
#[derive(Debug, Default)]
pub(super) struct MeshPart {
    /// The faces of the whole mesh that it is made of; the part's first face slots, in this order.
    pub(super) faces: Vec<Face>,
    pub(super) positions: Vec<[f32; 3]>,
    pub(super) triangles: Vec<[u32; 3]>,
    /// By vertex of the part: the vertex of the whole that it is.
    pub(super) origin: Vec<Option<Vertex>>,
    /// By vertex of the part: whether it is on the rim.
    pub(super) is_rim: Vec<bool>,
    /// The edges of the rim, as the part's faces have them, by vertices of the whole.
    pub(super) rim: BTreeSet<(Vertex, Vertex)>,
}

impl MeshPart {
    /// The part that consists of some faces, ascending and without caps.
    pub(super) fn of(whole: &Tracked, faces: &[Face]) -> MeshPart {
        let mesh = &whole.mesh;
        let is_part = |f: Face| faces.binary_search(&f).is_ok();
        let mut part = MeshPart { faces: faces.to_vec(), ..MeshPart::default() };
        let mut vertices: Vec<Vertex> =
            part.faces.iter().flat_map(|&f| mesh.face_vertices(f)).collect();
        vertices.sort_unstable();
        vertices.dedup();
        let number = |v: Vertex| vertices.binary_search(&v).expect("a vertex of the part") as u32;
        part.is_rim = vec![false; vertices.len()];
        for &f in &part.faces {
            part.triangles.push(mesh.face_vertices(f).map(number));
            for h in mesh.face_halfedges(f) {
                let other = mesh.face(h.twin());
                if !mesh.is_cap(other) && !is_part(other) {
                    let ends = [mesh.from(h), mesh.to(h)];
                    part.rim.insert((ends[0], ends[1]));
                    ends.iter().for_each(|&v| part.is_rim[number(v) as usize] = true);
                }
            }
        }
        part.positions = vertices.iter().map(|&v| mesh.position(v).to_array()).collect();
        part.origin = vertices.into_iter().map(Some).collect();
        for v in split_fans(&mut part.triangles, part.positions.len()) {
            part.positions.push(part.positions[v as usize]);
            part.origin.push(part.origin[v as usize]);
            part.is_rim.push(part.is_rim[v as usize]);
        }
        part
    }
}
