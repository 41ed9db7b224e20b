//! Where a tracked piece gets its mesh from, and what becomes of it: extraction at the start
//! isovalue, remeshing, tracking to both ends.
//!
//! This is the place of local surgery: a piece whose arc begins at an event may one day start from
//! the meshes of the arcs that ended there instead of from an extraction.

use super::criteria::Criteria;
use super::recorder::Recorder;
use super::remesh::remesh;
use super::track::{Tracking, track};
use super::{Counts, Piece, Sweep, slide};
use crate::error::{Error, Result};
use crate::extract::{Extraction, extract};
use crate::kernels::Kernels;
use crate::mesh::{Mesh, Vertex, intersecting};
use crate::spectrum::Patch;
use glam::Vec3;

/// Remeshing that needs so many times the faces of the extraction does not lead anywhere.
const MOST_GROWTH: usize = 4;

/// One in so many faces of a remeshed mesh may pass through another.
const INTERSECTING_SHARE: usize = 20_000;

/// Remeshing is tried so many times, with more of the extraction pinned each time.
const ATTEMPTS: usize = 4;

/// Radius, in voxels, around faces that pass through each other within which vertices are pinned;
/// times the number of the attempt.
const PIN_RADIUS: f32 = 1.0;

/// A tracked piece and how far it got.
pub(super) struct Tracked {
    pub(super) patch: Patch,
    pub(super) low: f64,
    pub(super) high: f64,
}

/// The exact extractions of the given pieces' components at one isovalue, in their order.
pub(super) fn components_at(
    sweep: &Sweep,
    isovalue: f64,
    pieces: &[Piece],
) -> Result<Vec<Extraction>> {
    sweep.cancelled()?;
    let extraction = extract(&sweep.exact, isovalue);
    let arcs: Vec<Option<usize>> = extraction
        .component_crossings()
        .iter()
        .map(|&(low, high)| sweep.topology.arc_of(low, high, isovalue))
        .collect();
    pieces
        .iter()
        .map(|piece| {
            let component = arcs.iter().position(|&a| a == Some(piece.arc)).ok_or_else(|| {
                Error::Input(format!(
                    "internal: no component of arc {} at isovalue {isovalue}",
                    piece.arc
                ))
            })?;
            Ok(extraction.with_components(|c| c as usize == component))
        })
        .collect()
}

/// The exact extraction of one piece's component.
pub(super) fn component_at(sweep: &Sweep, piece: &Piece, isovalue: f64) -> Result<Extraction> {
    Ok(components_at(sweep, isovalue, &[*piece])?.pop().expect("one component per piece"))
}

/// Remeshes the exact extraction of a piece, or takes the mesh given for it, and tracks it to both ends. `None` where remeshing
/// makes the mesh pass through itself.
pub(super) fn track_both_ways(
    sweep: &Sweep,
    piece: &Piece,
    isovalue: f64,
    exact: &Extraction,
    counts: &mut Counts,
) -> Result<Option<Tracked>> {
    let mut kernels = sweep.backend.kernels(&sweep.field)?;
    let kernels = kernels.as_mut();
    let given = sweep.initial.of(piece, isovalue);
    let mesh = match given {
        Some(given) => Some(given.clone()),
        None => remeshed(sweep, isovalue, slide::mesh(exact)?, kernels)?,
    };
    let Some(mesh) = mesh else {
        return Ok(None);
    };
    let compacted = mesh.compacted();
    kernels.load(&compacted.connectivity, &compacted.positions)?;
    let normals = kernels.normals()?;
    let mut recorder = Recorder::begin(&mesh, &normals, &compacted.vertices, isovalue);
    let mut reached = [piece.low, piece.high];
    for side in [0, 1] {
        recorder.restart();
        let mut moving = mesh.clone();
        let tracking = Tracking {
            field: &sweep.field,
            parameters: sweep.parameters,
            way: &sweep.way(piece, side == 1),
            cancelled: &|| sweep.cancelled(),
        };
        reached[side] = track(&mut moving, kernels, &tracking, isovalue, &mut recorder, counts)?;
    }
    if given.is_some() && reached[1] <= isovalue {
        log::warn!(
            "the initial mesh cannot be tracked to higher isovalues than {isovalue}, it is extracted there"
        );
    }
    Ok(Some(Tracked { patch: recorder.patch(), low: reached[0], high: reached[1] }))
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
    let most = MOST_GROWTH * exact.n_faces();
    for attempt in 0..ATTEMPTS {
        sweep.cancelled()?;
        let mut mesh = exact.clone();
        if !remesh(&mut mesh, &criteria, kernels, isovalue, sweep.parameters, most)? {
            return Ok(None);
        }
        let c = mesh.compacted();
        let crossing = intersecting(&c.positions, &c.connectivity.faces);
        log::debug!(
            "remeshed {} faces at {isovalue} to {}, {} intersecting",
            exact.n_faces(),
            mesh.n_faces(),
            crossing.len()
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
fn pin_around(mesh: &mut Mesh, points: &[Vec3], radius: f32) {
    let near: Vec<Vertex> = mesh
        .vertices()
        .filter(|&v| points.iter().any(|p| p.distance_squared(mesh.position(v)) < radius * radius))
        .collect();
    for v in near {
        mesh.set_pinned(v, true);
    }
}
