//! Cutting: which faces of the meshes stay, where a block is replaced.

use glam::Vec3;

use super::block::Block;
use super::rim::{RimVertex, Side, is_one_sided};
use crate::error::Result;
use crate::kernels::field::Field;
use crate::kernels::{Kernels, Status};
use crate::mesh::{Face, Mesh, Vertex, intersecting, normal};
use crate::sweep::border::planes_left;
use crate::sweep::caps::{is_of_cap, looks_in, smooth_caps};

/// A vertex that moves farther than this, in voxels, is not sure to have followed its surface.
const MOST_MOTION: f32 = 1.0;

/// Distance from the block, voxels, that faces that stay keep.
const MARGIN: f32 = 0.2;

/// The vertices of one mesh, moved to the isovalue after the surgery.
pub(super) struct Moved {
    /// By vertex slot, voxel frame.
    pub(super) positions: Vec<Vec3>,
    /// By vertex slot.
    pub(super) normals: Vec<Vec3>,
    /// By vertex slot: whether it could not follow the isosurface.
    pub(super) is_bad: Vec<bool>,
}

impl Moved {
    /// Moves a mesh from an isovalue to another and marks what does not follow: vertices that do
    /// not reach the isosurface or go far, folded faces, and faces that pass through others.
    pub(super) fn new(
        mesh: &Mesh,
        field: &Field,
        kernels: &mut dyn Kernels,
        from: f64,
        to: f64,
    ) -> Result<Moved> {
        let n = mesh.vertex_slots();
        let (mut positions, mut normals) = (vec![Vec3::ZERO; n], vec![Vec3::ZERO; n]);
        let mut is_bad = vec![false; n];
        let c = mesh.compacted();
        kernels.load(&c.connectivity, &c.positions)?;
        for at in [0.5 * (from + to), to] {
            kernels.project(at, 2.0)?;
            for (&v, status) in c.vertices.iter().zip(kernels.status()?) {
                is_bad[v.0 as usize] |= status == Status::Failed && !is_of_cap(mesh, v);
            }
        }
        let (mut moved, unit) = (kernels.positions()?, kernels.normals()?);
        smooth_caps(mesh, field, to, &c.vertices, &mut moved);
        for (i, &v) in c.vertices.iter().enumerate() {
            let slot = v.0 as usize;
            (positions[slot], normals[slot]) = (moved[i].into(), unit[i].into());
            is_bad[slot] |= positions[slot].distance(mesh.position(v)) > MOST_MOTION
                || planes_left(mesh, field, v, positions[slot]) != 0;
        }
        let mut folded: Vec<Face> = Vec::new();
        for &f in &c.faces {
            let t = mesh.face_vertices(f);
            // At the border the normals are also those of the caps.
            let inner = t.iter().filter(|&&v| mesh.border(v) == 0);
            let mean: Vec3 = inner.map(|v| normals[v.0 as usize]).sum();
            let after = t.map(|v| positions[v.0 as usize]);
            let is_folded = if mesh.is_cap(f) {
                looks_in(field, field.isovalue(to), after)
            } else {
                normal(after).dot(mean) < 0.0
            };
            if is_folded {
                folded.push(f);
            }
        }
        let crossing = intersecting(&moved, &c.connectivity.faces);
        let crossing = crossing.iter().map(|&f| c.faces[f as usize]);
        for f in folded.into_iter().chain(crossing) {
            mesh.face_vertices(f).iter().for_each(|v| is_bad[v.0 as usize] = true);
        }
        Ok(Moved { positions, normals, is_bad })
    }

    /// The corners of a face after the motion.
    pub(super) fn corners(&self, mesh: &Mesh, f: Face) -> [Vec3; 3] {
        mesh.face_vertices(f).map(|v| self.positions[v.0 as usize])
    }

    fn is_good(&self, mesh: &Mesh, f: Face) -> bool {
        mesh.face_vertices(f).iter().all(|v| !self.is_bad[v.0 as usize])
    }

    /// Adds to a block the cells around the vertices that did not follow.
    pub(super) fn add_bad(&self, mesh: &Mesh, radius: f32, block: &mut Block) {
        for v in mesh.vertices().filter(|v| self.is_bad[v.0 as usize]) {
            block.add_around(self.positions[v.0 as usize], radius);
            block.add_around(mesh.position(v), radius);
        }
    }

    /// The corners of the faces that followed.
    pub(super) fn followed(&self, mesh: &Mesh) -> impl Iterator<Item = [Vec3; 3]> {
        let good = mesh.faces().filter(|&f| self.is_good(mesh, f));
        good.map(|f| self.corners(mesh, f))
    }

    /// Which faces stay, by slot: those that followed and lie beside the block, such that what is
    /// taken away has no rim along the border of the volume, none ends in it on one side only, and no rim meets
    /// another.
    pub(super) fn staying(&self, mesh: &Mesh, block: &Block) -> Vec<bool> {
        let mut stays = vec![false; mesh.face_slots()];
        let mut removed: Vec<Face> = Vec::new();
        for f in mesh.faces() {
            let stay =
                self.is_good(mesh, f) && !block.touches_triangle(self.corners(mesh, f), MARGIN);
            stays[f.0 as usize] = stay;
            if !stay {
                removed.push(f);
            }
        }
        while let Some(f) = removed.pop() {
            for h in mesh.face_halfedges(f) {
                let g = mesh.face(h.twin());
                if mesh.is_crease(h.edge()) && stays[g.0 as usize] {
                    stays[g.0 as usize] = false;
                    removed.push(g);
                }
                let v = mesh.from(h);
                if n_fans(mesh, v, &stays) > 1 || is_beside_curve(mesh, v, &stays) {
                    for g in mesh.spokes(v).map(|s| mesh.face(s)) {
                        if std::mem::replace(&mut stays[g.0 as usize], false) {
                            removed.push(g);
                        }
                    }
                }
            }
        }
        stays
    }

    /// The vertex as a rim has it.
    pub(super) fn rim_vertex(&self, mesh: &Mesh, v: Vertex, number: u32, cap: bool) -> RimVertex {
        RimVertex {
            vertex: number,
            position: self.positions[v.0 as usize],
            normal: self.normals[v.0 as usize],
            border: mesh.border(v),
            cap,
        }
    }
}

/// Whether a vertex in the border of the volume would not lie on the curve in which the isosurface meets the border
/// any more.
fn is_beside_curve(mesh: &Mesh, v: Vertex, stays: &[bool]) -> bool {
    let faces = mesh.spokes(v).map(|h| mesh.face(h)).filter(|f| stays[f.0 as usize]);
    mesh.border(v) != 0 && is_one_sided(faces.map(|f| mesh.is_cap(f)))
}

/// Into how many fans the faces that stay around a vertex fall.
fn n_fans(mesh: &Mesh, v: Vertex, stays: &[bool]) -> usize {
    let stay = |h| stays[mesh.face(h).0 as usize];
    mesh.spokes(v).filter(|&h| stay(h) && !stay(h.twin())).count()
}

/// The sides of the faces that stay beside those that do not, as (vertex slot, vertex slot, cap).
pub(super) fn sides(mesh: &Mesh, stays: &[bool]) -> Vec<Side> {
    let mut sides = Vec::new();
    for f in mesh.faces().filter(|f| !stays[f.0 as usize]) {
        for h in mesh.face_halfedges(f).map(|h| h.twin()) {
            let g = mesh.face(h);
            if stays[g.0 as usize] {
                sides.push((mesh.from(h).0, mesh.to(h).0, mesh.is_cap(g)));
            }
        }
    }
    sides
}
