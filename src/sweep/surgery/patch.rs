//! Good triangles for what came in: remeshing between vertices that stay as they are.

use glam::Vec3;

use super::block::Block;
use super::stitch::Stitched;
use super::{Operation, Patched, Sweep};
use crate::error::Result;
use crate::kernels::Kernels;
use crate::mesh::{Face, Mesh, Vertex, intersecting};
use crate::sweep::criteria::Criteria;
use crate::sweep::remesh::{Effort, remesh};
use crate::sweep::start::pin_around;

/// Remeshing is tried so many times, with more of the extraction pinned each time; then the
/// extraction is taken as it is.
const ATTEMPTS: u32 = 2;

/// Radius around faces that pass through others within which vertices are pinned, times the number
/// of the attempt, voxels.
const PIN_RADIUS: f32 = 1.0;

/// Improves every component; else says where one passes through itself whatever is tried.
pub(super) fn improve_all(
    sweep: &Sweep,
    operation: &Operation,
    stitched: Vec<Stitched>,
    block: &Block,
    kernels: &mut dyn Kernels,
) -> Result<std::result::Result<Vec<Patched>, Vec<Vec3>>> {
    let mut all = Vec::new();
    for s in stitched {
        match improve(sweep, operation, s, block, kernels)? {
            Ok(patched) => all.push(patched),
            Err(points) => return Ok(Err(points)),
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
) -> Result<std::result::Result<Patched, Vec<Vec3>>> {
    let n_kept = stitched.kept_vertices.len();
    let mut start = stitched.mesh.clone();
    for v in (0..n_kept as u32).map(Vertex) {
        start.set_pinned(v, !stitched.on_rim[v.0 as usize]);
    }
    // What crosses before it is touched needs another block.
    let crossing = crossing_near(&start, block);
    if !crossing.is_empty() {
        return Ok(Err(crossing));
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
        let crossing = crossing_near(&mesh, block);
        if crossing.is_empty() {
            let pinned: Vec<Vertex> = mesh.vertices().filter(|&v| mesh.is_pinned(v)).collect();
            pinned.into_iter().for_each(|v| mesh.set_pinned(v, false));
            return Ok(Ok(Patched { stitched, mesh, collapsed }));
        }
        if attempt == ATTEMPTS {
            return Ok(Err(crossing));
        }
        let radius = PIN_RADIUS * (attempt + 1) as f32;
        pin_around(&mut start, &crossing, radius);
    }
    unreachable!("the last attempt returns")
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
