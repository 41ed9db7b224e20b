//! Good triangles for what came in: remeshing between vertices that stay as they are.
//!
//! A strip that joins two rims across a gap has its corners on the isosurface and nothing else. Remeshing would split its
//! edges where the isosurface cannot be reached, again and again, and leave a film of many faces; where many vertices have
//! strayed, the block must be larger. Where few have, they are left as they came in.

use glam::Vec3;

use super::block::Block;
use super::stitch::{Stitched, Trouble};
use super::{Operation, Patched, Sweep};
use crate::error::Result;
use crate::kernels::Kernels;
use crate::mesh::{Face, Mesh, Vertex, intersecting};
use crate::sweep::caps::{inner_slope, is_of_cap};
use crate::sweep::criteria::Criteria;
use crate::sweep::remesh::{Effort, remesh};
use crate::sweep::start::pin_around;

/// Remeshing is tried so many times, with more of the extraction pinned each time; then the
/// extraction is taken as it is.
const ATTEMPTS: u32 = 4;

/// So many faces as they were extracted are taken in a repair; more only if they are no more than a third of the mesh:
/// steps from a large patch of slivers fail, and each further repair brings in more of them.
const MOST_EXTRACTED: usize = 500;

/// Radius around faces that pass through others, and around vertices that have strayed, within which vertices are pinned,
/// times the number of the attempt, voxels.
const PIN_RADIUS: f32 = 1.0;

/// A vertex that is farther from the isosurface has strayed, voxels.
const STRAYED: f32 = 0.3;

/// Faces of a strip with a side longer than this, whose middle is farther from the isosurface than that, are part of a
/// film, voxels.
const LONG: f32 = 1.5;
const FAR: f32 = 0.5;

/// So many vertices that have strayed, or faces of a film, are taken.
const FEW: usize = 4;

/// Improves every component; else says where one passes through itself whatever is tried, or a strip is far from the
/// isosurface.
pub(super) fn improve_all(
    sweep: &Sweep,
    operation: &Operation,
    stitched: Vec<Stitched>,
    block: &Block,
    kernels: &mut dyn Kernels,
) -> Result<std::result::Result<Vec<Patched>, Trouble>> {
    let mut all = Vec::new();
    for s in stitched {
        match improve(sweep, operation, s, block, kernels)? {
            Ok(patched) => all.push(patched),
            Err(trouble) => return Ok(Err(trouble)),
        }
    }
    Ok(Ok(all))
}

fn improve(
    sweep: &Sweep,
    operation: &Operation,
    stitched: Stitched,
    block: &Block,
    kernels: &mut dyn Kernels,
) -> Result<std::result::Result<Patched, Trouble>> {
    let n_kept = stitched.kept_vertices.len();
    let mut start = stitched.mesh.clone();
    for v in (0..n_kept as u32).map(Vertex) {
        start.set_pinned(v, !stitched.on_rim[v.0 as usize]);
    }
    // What crosses before it is touched needs another block.
    let crossing = crossing_near(&start, block);
    if !crossing.is_empty() {
        return Ok(Err(passes_through_itself(crossing)));
    }
    let criteria =
        Criteria::new(&sweep.field, operation.after, sweep.parameters).for_size_of(&start);
    for attempt in 0..=ATTEMPTS {
        sweep.cancelled()?;
        let mut mesh = start.clone();
        let mut collapsed = Vec::new();
        if attempt < ATTEMPTS {
            let at = operation.after;
            let (effort, parameters) = (Effort::PATCH, sweep.parameters);
            let done =
                remesh(&mut mesh, &criteria, kernels, at, parameters, effort, &|_, _| false)?;
            collapsed = done.expect("any number of faces will do");
        }
        let mut points = strayed(&mesh, &criteria);
        if points.len() > FEW {
            let film = film(&start, &stitched.on_rim, &criteria);
            if film.len() > FEW {
                points.extend(film);
                let why = "a strip is far from the isosurface".into();
                return Ok(Err(Trouble { why, points }));
            }
        }
        if points.is_empty() || attempt == ATTEMPTS {
            points = crossing_near(&mesh, block);
            if points.is_empty() {
                if attempt == ATTEMPTS && operation.repaired && is_large(&stitched) {
                    return Ok(Err(Trouble { why: "stays as extracted".into(), points }));
                }
                let pinned: Vec<Vertex> = mesh.vertices().filter(|&v| mesh.is_pinned(v)).collect();
                pinned.into_iter().for_each(|v| mesh.set_pinned(v, false));
                return Ok(Ok(Patched { stitched, mesh, collapsed }));
            }
            if attempt == ATTEMPTS {
                return Ok(Err(passes_through_itself(points)));
            }
        }
        pin_around(&mut start, &points, PIN_RADIUS * (attempt + 1) as f32);
    }
    unreachable!("the last attempt returns")
}

/// Whether too many faces of a mesh are as they were extracted.
fn is_large(stitched: &Stitched) -> bool {
    let n = stitched.mesh.n_faces();
    n - stitched.kept_faces.len() > MOST_EXTRACTED.max(n / 3)
}

fn passes_through_itself(points: Vec<Vec3>) -> Trouble {
    Trouble { why: "passes through itself".into(), points }
}

/// Middles of the long faces between rims that are far from the isosurface: a film across a gap.
fn film(mesh: &Mesh, on_rim: &[bool], criteria: &Criteria) -> Vec<Vec3> {
    let between =
        |f: &Face| !mesh.is_cap(*f) && mesh.face_vertices(*f).iter().all(|v| on_rim[v.0 as usize]);
    let is_long =
        |[p, q, r]: &[Vec3; 3]| p.distance(*q).max(q.distance(*r)).max(r.distance(*p)) > LONG;
    let corners = mesh.faces().filter(between).map(|f| mesh.corners(f)).filter(is_long);
    let middles = corners.map(|t| t.iter().sum::<Vec3>() / 3.0);
    middles.filter(|&p| is_off(criteria, p, FAR)).collect()
}

/// Whether a point is farther from the isosurface than so many voxels.
fn is_off(criteria: &Criteria, p: Vec3, distance: f32) -> bool {
    let off = (criteria.field.value(p) - criteria.isovalue).abs();
    off > distance * inner_slope(criteria.field, p) && off > criteria.field.value_noise()
}

/// Where vertices that may move, but for those of caps, are far from the isosurface.
fn strayed(mesh: &Mesh, criteria: &Criteria) -> Vec<Vec3> {
    let free = mesh.vertices().filter(|&v| !mesh.is_pinned(v) && !is_of_cap(mesh, v));
    free.map(|v| mesh.position(v)).filter(|&p| is_off(criteria, p, STRAYED)).collect()
}

/// Middles of the faces in or beside the block that pass through others.
fn crossing_near(mesh: &Mesh, block: &Block) -> Vec<Vec3> {
    let is_near = |f: &Face| {
        mesh.face_vertices(*f).iter().any(|&v| !mesh.is_pinned(v))
            || block.touches_triangle(mesh.corners(*f), 1.0)
    };
    let faces: Vec<Face> = mesh.faces().filter(is_near).collect();
    let (vertices, triangles) = renumbered(mesh, &faces);
    let positions: Vec<[f32; 3]> = vertices.iter().map(|&v| mesh.position(v).to_array()).collect();
    let crossing = intersecting(&positions, &triangles);
    crossing.iter().map(|&f| mesh.corners(faces[f as usize]).iter().sum::<Vec3>() / 3.0).collect()
}

/// The vertices of some faces, and the faces as triples of their numbers.
pub(super) fn renumbered(mesh: &Mesh, faces: &[Face]) -> (Vec<Vertex>, Vec<[u32; 3]>) {
    let mut number = vec![u32::MAX; mesh.vertex_slots()];
    let mut vertices = Vec::new();
    let triangles = faces
        .iter()
        .map(|&f| {
            mesh.face_vertices(f).map(|v| {
                let n = &mut number[v.0 as usize];
                if *n == u32::MAX {
                    *n = vertices.len() as u32;
                    vertices.push(v);
                }
                *n
            })
        })
        .collect();
    (vertices, triangles)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernels::Field;
    use crate::mesh::shapes;
    use crate::sweep::Parameters;
    use crate::volume::phantom;
    use std::sync::Arc;

    #[test]
    fn free_vertices_far_from_the_isosurface_have_strayed() {
        // The phantom is 1 - |p - centre|, p from -1 to 1 over 16 voxels: where it is a half is a sphere of 4 voxels.
        let centre = Vec3::new(8.166, 8.234, 8.126);
        let field = Field::new(Arc::new(phantom("sphere:17").expect("a phantom")));
        let criteria = Criteria::new(&field, 0.5, &Parameters::default());
        let mut mesh = shapes::sphere(4.0, 2);
        let vertices: Vec<Vertex> = mesh.vertices().collect();
        for &v in &vertices {
            mesh.set_position(v, mesh.position(v) + centre);
        }
        assert!(strayed(&mesh, &criteria).is_empty());
        for (&v, by) in vertices.iter().zip([0.9, 1.2]) {
            mesh.set_position(v, centre + by * (mesh.position(v) - centre));
        }
        assert_eq!(
            strayed(&mesh, &criteria),
            [mesh.position(vertices[0]), mesh.position(vertices[1])]
        );
        mesh.set_pinned(vertices[1], true);
        assert_eq!(strayed(&mesh, &criteria), [mesh.position(vertices[0])]);
    }

    #[test]
    fn faces_between_rims_far_from_the_isosurface_are_a_film() {
        let field = Field::new(Arc::new(phantom("sphere:17").expect("a phantom")));
        let criteria = Criteria::new(&field, 0.5, &Parameters::default());
        let mut mesh = shapes::sphere(4.0, 2);
        let vertices: Vec<Vertex> = mesh.vertices().collect();
        for &v in &vertices {
            mesh.set_position(v, mesh.position(v) + Vec3::splat(8.17));
        }
        let everywhere = vec![true; mesh.vertex_slots()];
        assert!(film(&mesh, &everywhere, &criteria).is_empty());
        // A dent two voxels deep pulls the middles of the faces around it in.
        let dent = vertices[0];
        mesh.set_position(dent, mesh.position(dent).lerp(Vec3::splat(8.17), 0.5));
        let around = mesh.spokes(dent).count();
        assert_eq!(film(&mesh, &everywhere, &criteria).len(), around);
        let mut beside = everywhere;
        beside[dent.0 as usize] = false;
        assert!(film(&mesh, &beside, &criteria).is_empty(), "they are not between rims");
    }
}
