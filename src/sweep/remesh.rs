//! Remeshing of the tracked mesh at a sampling isovalue.
//!
//! # Theory
//!
//! Every edit ends lifetimes of triangles, and the size of a spectrum is proportional to the number of its triangles. So
//! remeshing has hysteresis: the result of a collapse must be well within the tolerance, and a flip must improve a poor
//! triangle clearly. The boundary's vertices are fixed.

pub(super) mod criteria;
mod flips;
pub(super) mod improve;
mod refine;
mod simplify;

use rayon::prelude::*;

use super::cause::{Cause, FirstCauses};
use crate::mesh::HalfEdgeMesh;
use criteria::{Criteria, extend_sizing, sizing};
use flips::{Flips, flip_edges};
use refine::{refine, split_long};
use simplify::{Bounds, simplify};

/// The target edge length aims at this share of the largest deviation.
const SIZING_GOAL: f32 = 0.8;

/// Thresholds with hysteresis, so that few edits are undone soon. With thresholds for a new mesh (gain 0.02, any triangle,
/// edges of 0.6 to 1.5 times the target length, the whole tolerance) 45 of 100 triangles of hydrogen live for one step only; with
/// these and 0.3 of the tolerance 8 of 100.
const FLIPS: Flips = Flips { gain: 0.1, poor: 0.6 };
const LONG_FACTOR: f32 = 1.8;
const COLLAPSES: Bounds = Bounds { short: 0.45, share: 0.6 };

/// Remeshes everything that is not fixed; `causes` has the causes of the changes.
pub(super) fn remesh(mesh: &mut HalfEdgeMesh, criteria: &Criteria, causes: &mut FirstCauses) {
    if mesh.n_faces() == 0 {
        return;
    }
    let edges = mesh.par_edges().collect();
    let mut edges = flip_edges(mesh, criteria, edges, 2, FLIPS);
    causes.attribute(mesh, Cause::Flip);
    let deviations = criteria.deviations(mesh);
    let mut length = sizing(mesh, criteria, &deviations, SIZING_GOAL * criteria.error);
    refine(mesh, criteria, &deviations);
    extend_sizing(mesh, &mut length);
    split_long(mesh, criteria, &length, LONG_FACTOR);
    causes.attribute(mesh, Cause::Split);
    extend_sizing(mesh, &mut length);
    simplify(mesh, criteria, &length, COLLAPSES);
    causes.attribute(mesh, Cause::Collapse);
    // All other edges have been found good, and are between the same triangles as then.
    let alive = causes.changed().filter(|&f| mesh.has_face(f));
    edges.extend(alive.flat_map(|f| mesh.face_halfedges(f)).map(|h| h.edge()));
    edges.retain(|&e| mesh.has_edge(e));
    edges.sort_unstable();
    edges.dedup();
    flip_edges(mesh, criteria, edges, 2, FLIPS);
    causes.attribute(mesh, Cause::Flip);
}
