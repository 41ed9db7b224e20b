//! Where a mesh comes from that no other leads to: extraction at an isovalue, and remeshing.

use super::criteria::Criteria;
use super::recorder::Recorder;
use super::remesh::{Effort, remesh};
use super::surgery::Front;
use super::{Piece, Sweep};
use crate::error::{Error, Result};
use crate::extract::{Extraction, extract};
use crate::kernels::Kernels;
use crate::mesh::{Mesh, Vertex, intersecting};
use glam::Vec3;

/// Remeshing that needs so many times the faces of the extraction does not lead anywhere.
const MOST_GROWTH: f32 = 1.4;

/// Small meshes may grow to so many faces.
const GROWS_TO: usize = 5_000;

/// One in so many faces of a remeshed mesh may pass through another.
const INTERSECTING_SHARE: usize = 20_000;

/// Remeshing is tried so many times, with more of the extraction pinned each time.
const ATTEMPTS: usize = 4;

/// Radius, in voxels, around faces that pass through each other within which vertices are pinned;
/// times the number of the attempt.
const PIN_RADIUS: f32 = 1.0;

/// The exact extraction of the components of some arcs at one isovalue, and the arc of each of its
/// components.
pub(super) fn extraction_of_arcs(
    sweep: &Sweep,
    isovalue: f64,
    arcs: &[usize],
) -> Result<(Extraction, Vec<usize>)> {
    sweep.cancelled()?;
    of_arcs(sweep, &extract(&sweep.exact, isovalue), isovalue, arcs)
}

/// The components of some arcs in the exact extraction of a whole isosurface, and the arc of each.
pub(super) fn of_arcs(
    sweep: &Sweep,
    extraction: &Extraction,
    isovalue: f64,
    arcs: &[usize],
) -> Result<(Extraction, Vec<usize>)> {
    let found: Vec<Option<usize>> = extraction
        .component_crossings()
        .iter()
        .map(|&(low, high)| sweep.topology.arc_of(low, high, isovalue))
        .map(|arc| arc.filter(|a| arcs.contains(a)))
        .collect();
    let kept: Vec<usize> = found.iter().flatten().copied().collect();
    if let Some(missing) = arcs.iter().find(|a| !kept.contains(a)) {
        return Err(Error::Input(format!(
            "internal: no component of arc {missing} at isovalue {isovalue}"
        )));
    }
    Ok((extraction.with_components(|c| found[c as usize].is_some()), kept))
}

/// The mesh that a piece starts from: the one given for it, or its exact extraction remeshed.
/// `None` where remeshing makes the mesh pass through itself.
pub(super) fn start_front(
    sweep: &Sweep,
    piece: &Piece,
    isovalue: f64,
    exact: &Extraction,
    kernels: &mut dyn Kernels,
) -> Result<Option<Front>> {
    let mesh = match sweep.initial.of(piece, isovalue) {
        Some(given) => Some(given.clone()),
        None => fresh_mesh(sweep, isovalue, exact, kernels)?,
    };
    let Some(mesh) = mesh else { return Ok(None) };
    let compacted = mesh.compacted();
    kernels.load(&compacted.connectivity, &compacted.positions)?;
    let normals = kernels.normals()?;
    let recorder = Recorder::begin(&mesh, &normals, &compacted.vertices, isovalue, piece.arc);
    Ok(Some(Front { mesh, recorder, at: isovalue }))
}

/// An exact extraction, remeshed. `None` where remeshing makes the mesh pass through itself.
pub(super) fn fresh_mesh(
    sweep: &Sweep,
    isovalue: f64,
    exact: &Extraction,
    kernels: &mut dyn Kernels,
) -> Result<Option<Mesh>> {
    remeshed(sweep, isovalue, mesh_of(exact)?, kernels)
}

/// The mesh of an extraction.
fn mesh_of(extraction: &Extraction) -> Result<Mesh> {
    Mesh::from_triangles(
        &extraction.positions,
        &extraction.borders,
        &extraction.faces,
        &extraction.caps,
    )
}

/// The mesh with good triangles. Where they would pass through each other, which happens at sharp
/// creases and between close sheets, the vertices of the extraction around are pinned, and the rest
/// is remeshed again. `None` if that does not help.
fn remeshed(
    sweep: &Sweep,
    isovalue: f64,
    mut exact: Mesh,
    kernels: &mut dyn Kernels,
) -> Result<Option<Mesh>> {
    let criteria = Criteria::new(&sweep.field, isovalue, sweep.parameters).for_size_of(&exact);
    let most = ((MOST_GROWTH * exact.n_faces() as f32) as usize).max(GROWS_TO);
    for attempt in 0..ATTEMPTS {
        sweep.cancelled()?;
        let mut mesh = exact.clone();
        let (effort, parameters) = (Effort::WHOLE, sweep.parameters);
        if remesh(&mut mesh, &criteria, kernels, isovalue, parameters, effort, most)?.is_none() {
            return Ok(None);
        }
        let c = mesh.compacted();
        let crossing = intersecting(&c.positions, &c.connectivity.faces);
        log::debug!(
            "remeshed {} faces at {isovalue} to {}, {} intersecting, {} of them caps",
            exact.n_faces(),
            mesh.n_faces(),
            crossing.len(),
            crossing.iter().filter(|&&f| mesh.is_cap(c.faces[f as usize])).count()
        );
        if crossing.len() <= mesh.n_faces() / INTERSECTING_SHARE {
            return Ok(Some(mesh));
        }
        let centres =
            crossing.iter().map(|&f| mesh.corners(c.faces[f as usize]).iter().sum::<Vec3>() / 3.0);
        pin_around(&mut exact, &centres.collect::<Vec<_>>(), PIN_RADIUS * (attempt + 1) as f32);
    }
    Ok(None)
}

/// Pins the vertices within `radius` of any of the points.
pub(super) fn pin_around(mesh: &mut Mesh, points: &[Vec3], radius: f32) {
    let near: Vec<Vertex> = mesh
        .vertices()
        .filter(|&v| points.iter().any(|p| p.distance_squared(mesh.position(v)) < radius * radius))
        .collect();
    for v in near {
        mesh.set_pinned(v, true);
    }
}
