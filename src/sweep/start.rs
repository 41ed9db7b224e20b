//! Where a tracked piece gets its mesh from, and what becomes of it: extraction at the start
//! isovalue, remeshing, tracking to both ends.
//!
//! This is the place of local surgery: a piece whose arc begins at an event may one day start from
//! the meshes of the arcs that ended there instead of from an extraction.

use super::criteria::Criteria;
use super::recorder::Recorder;
use super::remesh::remesh;
use super::track::track;
use super::{Counts, Piece, Sweep};
use crate::error::{Error, Result};
use crate::extract::{Extraction, extract};
use crate::kernels::Kernels;
use crate::mesh::{Mesh, intersecting};
use crate::spectrum::Patch;

/// Pieces shorter than this share of the range are shown by one unmoving mesh.
const UNMOVING_SHARE: f64 = 1e-6;

/// After so many extractions afresh inside one another the rest is shown by one unmoving mesh.
const MAX_DEPTH: u32 = 8;

/// The mesh a piece starts from: the exact extraction of its component.
pub(super) struct StartMesh {
    mesh: Mesh,
}

/// A tracked piece and how far it got.
pub(super) struct Tracked {
    pub(super) patch: Patch,
    pub(super) low: f64,
    pub(super) high: f64,
}

/// The exact meshes of the given pieces' components at one isovalue, in their order.
pub(super) fn start_meshes(sweep: &Sweep, isovalue: f64, pieces: &[Piece]) -> Result<Vec<StartMesh>> {
    sweep.cancelled()?;
    let extraction = extract(&sweep.exact, isovalue);
    let mut arc_of_component = vec![None; extraction.n_components as usize];
    for (f, t) in extraction.faces.iter().enumerate() {
        let c = extraction.components[f] as usize;
        if arc_of_component[c].is_none()
            && let Some((low, high)) = t.iter().find_map(|&v| extraction.crossings[v as usize])
        {
            arc_of_component[c] = sweep.topology.arc_of(low, high, isovalue);
        }
    }
    pieces
        .iter()
        .map(|piece| {
            let component = arc_of_component.iter().position(|&a| a == Some(piece.arc));
            let Some(component) = component else {
                return Err(Error::Input(format!(
                    "internal: no component of arc {} at isovalue {isovalue}",
                    piece.arc
                )));
            };
            Ok(StartMesh { mesh: component_mesh(&extraction, component as u32)? })
        })
        .collect()
}

/// One component of an extraction as a mesh.
fn component_mesh(extraction: &Extraction, component: u32) -> Result<Mesh> {
    let mut index = vec![u32::MAX; extraction.positions.len()];
    let (mut positions, mut borders) = (Vec::new(), Vec::new());
    let (mut triangles, mut caps) = (Vec::new(), Vec::new());
    for (f, t) in extraction.faces.iter().enumerate() {
        if extraction.components[f] != component {
            continue;
        }
        triangles.push(t.map(|v| {
            if index[v as usize] == u32::MAX {
                index[v as usize] = positions.len() as u32;
                positions.push(extraction.positions[v as usize]);
                borders.push(extraction.borders[v as usize]);
            }
            index[v as usize]
        }));
        caps.push(extraction.caps[f]);
    }
    Mesh::from_triangles(&positions, &borders, &triangles, &caps)
}

/// Remeshes a start mesh and tracks it to both ends of its piece.
pub(super) fn track_both_ways(
    sweep: &Sweep,
    piece: &Piece,
    isovalue: f64,
    start: StartMesh,
    counts: &mut Counts,
) -> Result<Tracked> {
    let mut kernels = sweep.backend.kernels(&sweep.field)?;
    let kernels = kernels.as_mut();
    let mesh = remeshed(sweep, isovalue, start.mesh, kernels)?;
    let compacted = mesh.compacted();
    kernels.load(&compacted.connectivity, &compacted.positions)?;
    let normals = kernels.normals()?;
    let mut recorder = Recorder::begin(&mesh, &normals, &compacted.vertices, isovalue);
    let unmoving = piece.depth >= MAX_DEPTH
        || piece.high - piece.low < UNMOVING_SHARE * (sweep.range.1 - sweep.range.0);
    let mut reached = [piece.low, piece.high];
    for (side, end) in [(0, piece.low), (1, piece.high)] {
        recorder.restart();
        if unmoving {
            if end != isovalue {
                recorder.knots(&compacted.vertices, &compacted.positions, &normals, end);
            }
            recorder.finish_direction(end);
            continue;
        }
        let mut moving = mesh.clone();
        let way = sweep.way(piece, side == 1);
        reached[side] = track(
            &mut moving,
            &sweep.field,
            kernels,
            sweep.parameters,
            &way,
            isovalue,
            &mut recorder,
            counts,
            &|| sweep.cancelled(),
        )?;
    }
    counts.unmoving += u64::from(unmoving);
    Ok(Tracked { patch: recorder.patch(), low: reached[0], high: reached[1] })
}

/// The start mesh with good triangles; the exact one where remeshing would make it pass through
/// itself.
fn remeshed(sweep: &Sweep, isovalue: f64, exact: Mesh, kernels: &mut dyn Kernels) -> Result<Mesh> {
    let criteria = Criteria::new(&sweep.field, isovalue, sweep.parameters);
    let mut best = (usize::MAX, exact.clone());
    for share in [1.0, 0.5] {
        let mut mesh = exact.clone();
        let finer = Criteria { error: share * criteria.error, ..criteria };
        remesh(&mut mesh, &finer, kernels, isovalue, sweep.parameters)?;
        let crossing = n_intersecting(&mesh);
        if crossing < best.0 {
            best = (crossing, mesh);
        }
        if best.0 == 0 {
            return Ok(best.1);
        }
    }
    if n_intersecting(&exact) < best.0 { Ok(exact) } else { Ok(best.1) }
}

fn n_intersecting(mesh: &Mesh) -> usize {
    let c = mesh.compacted();
    intersecting(&c.positions, &c.connectivity.faces).len()
}
