//! Where a mesh comes from that no other leads to: extraction at an isovalue, and remeshing.

use std::collections::HashSet;

use super::caps::{beyond, inner_slope};
use super::criteria::Criteria;
use super::crowd::{begins_too_dense, is_small};
use super::recorder::Recorder;
use super::remesh::{Effort, remesh};
use super::surgery::Front;
use super::toil::Toil;

use super::{Piece, Sweep};
use crate::error::Result;
use crate::extract::{Extraction, extract, extract_component};
use crate::kernels::Kernels;
use crate::mesh::{Mesh, Vertex, intersecting};
use glam::Vec3;

/// Stretches over which the isosurface moves less than this, in voxels, do not begin with a fresh mesh:
/// making it takes longer than following it over a hundred such stretches.
pub(super) const FRESH_MOTION: f64 = 0.25;

/// So many vertices are asked how fast the isosurface moves.
const MOTION_VERTICES: usize = 500;

/// One in so many faces of a remeshed mesh may pass through another.
const INTERSECTING_SHARE: usize = 20_000;

/// Remeshing is tried so many times, with more of the extraction pinned each time.
const ATTEMPTS: usize = 4;

/// Radius, in voxels, around faces that pass through each other within which vertices are pinned;
/// times the number of the attempt.
const PIN_RADIUS: f32 = 1.0;

/// The exact extraction of the components of some arcs at one isovalue, and the arc of each of its
/// components; `None` if some arc has no component there.
pub(super) fn extraction_of_arcs(
    sweep: &Sweep,
    isovalue: f64,
    arcs: &[usize],
) -> Result<Option<(Extraction, Vec<usize>)>> {
    extraction_up_to(sweep, isovalue, arcs, usize::MAX)
}

/// As [`extraction_of_arcs`]; also `None` if a component passes more than `most_cells`.
pub(super) fn extraction_up_to(
    sweep: &Sweep,
    isovalue: f64,
    arcs: &[usize],
    most_cells: usize,
) -> Result<Option<(Extraction, Vec<usize>)>> {
    sweep.cancelled()?;
    let found = arcs.iter().map(|&a| sweep.topology.crossing_of(&sweep.exact, a, isovalue));
    match found.collect::<Option<Vec<_>>>() {
        Some(crossings) => {
            let component = |c| extract_component(&sweep.exact, isovalue, c, most_cells);
            let each = crossings.into_iter().map(component).collect::<Option<Vec<_>>>();
            Ok(each.map(|each| (Extraction::joined(each), arcs.to_vec())))
        }
        None => {
            let found = of_arcs(sweep, &extract(&sweep.exact, isovalue), isovalue, arcs);
            Ok(Some(found).filter(|(_, order)| order.len() == arcs.len()))
        }
    }
}

/// The components of those of some arcs that are found in the exact extraction of a whole isosurface, and the arc of
/// each: one component each.
pub(super) fn of_arcs(
    sweep: &Sweep,
    extraction: &Extraction,
    isovalue: f64,
    arcs: &[usize],
) -> (Extraction, Vec<usize>) {
    let mut wanted: HashSet<usize> = arcs.iter().copied().collect();
    let found: Vec<Option<usize>> = extraction
        .component_crossings()
        .iter()
        .map(|&(low, high)| sweep.topology.arc_of(low, high, isovalue))
        .map(|arc| arc.filter(|a| wanted.remove(a)))
        .collect();
    let kept = found.iter().flatten().copied().collect();
    (extraction.with_components(|c| found[c as usize].is_some()), kept)
}

/// How far, in voxels, half of an isosurface moves when the isovalue changes by `change`; infinitely far
/// where it has no vertex inside the volume.
pub(super) fn motion(sweep: &Sweep, isosurface: &Extraction, change: f64) -> f64 {
    let field = &sweep.field;
    let inside = isosurface.positions.iter().map(|&p| Vec3::from(p));
    let inside = inside.filter(|&p| beyond(field, p).max_element() <= 0.0);
    let stride = isosurface.positions.len() / MOTION_VERTICES + 1;
    let mut slopes: Vec<f32> = inside.step_by(stride).map(|p| inner_slope(field, p)).collect();
    if slopes.is_empty() {
        return f64::INFINITY;
    }
    let middle = slopes.len() / 2;
    let (_, slope, _) = slopes.select_nth_unstable_by(middle, f32::total_cmp);
    let start = sweep.range.0;
    let change = field.isovalue(start + change) - field.isovalue(start);
    f64::from(change) / f64::from(*slope).max(1e-300)
}

/// The mesh that a piece starts from: the one given for it, or its exact extraction remeshed.
/// `None` where [`fresh_mesh`] gives none.
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
    Ok(Some(Front { mesh, recorder, at: isovalue, toil: Toil::default() }))
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

/// An exact extraction, remeshed to good triangles. Where they would pass through each other, which happens at
/// sharp creases and between close sheets, the vertices of the extraction around are pinned, and the rest is
/// remeshed again. `None` if that does not help, or where the mesh takes so many faces that it would be given up
/// after a step.
pub(super) fn fresh_mesh(
    sweep: &Sweep,
    isovalue: f64,
    exact: &Extraction,
    kernels: &mut dyn Kernels,
) -> Result<Option<Mesh>> {
    let mut exact = match mesh_of(exact) {
        Ok(mesh) => mesh,
        Err(error) => {
            // The exact extraction shows whatever it is.
            log::debug!("the extraction at {isovalue} is no mesh: {error}");
            return Ok(None);
        }
    };
    let criteria = Criteria::new(&sweep.field, isovalue, sweep.parameters).for_size_of(&exact);
    // Remeshing that needs more faces than the extraction does not lead anywhere, but for small meshes.
    let most = exact.n_faces();
    // Where the isosurface is smooth, the first round leaves up to four times the faces that the last one does.
    let is_too_much = |mesh: &Mesh, rounds: usize| {
        let n = mesh.n_faces();
        n > most && !is_small(n) || rounds > 1 && begins_too_dense(mesh)
    };
    for attempt in 0..ATTEMPTS {
        sweep.cancelled()?;
        let mut mesh = exact.clone();
        let (effort, parameters) = (Effort::WHOLE, sweep.parameters);
        let limit = &is_too_much;
        if remesh(&mut mesh, &criteria, kernels, isovalue, parameters, effort, limit)?.is_none() {
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
