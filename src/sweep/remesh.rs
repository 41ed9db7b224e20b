//! Remeshing at one isovalue: from any closed mesh of the isosurface to good triangles of the right
//! size, by the operators of the sweep.

use super::caps::{smooth_caps, split_chamfers};
use super::criteria::{Criteria, extend_sizing, sizing};
use super::flips::{Flips, flip_edges};
use super::refine::{refine, split_curve, split_long};
use super::simplify::{Bounds, simplify};
use crate::error::Result;
use crate::kernels::Kernels;
use crate::mesh::{Mesh, Vertex};
use crate::sweep::Parameters;

/// Share of the largest deviation at which the wanted edge length aims.
pub(crate) const SIZING_GOAL: f32 = 0.8;

/// Relaxes what is not pinned on the isosurface and takes the new positions.
pub(crate) fn relax(
    mesh: &mut Mesh,
    criteria: &Criteria,
    kernels: &mut dyn Kernels,
    isovalue: f64,
    parameters: &Parameters,
    iterations: u32,
) -> Result<()> {
    let compacted = mesh.compacted_free();
    kernels.load(&compacted.connectivity, &compacted.positions)?;
    kernels.relax(
        isovalue,
        parameters.relax_strength as f32,
        parameters.relax_force as f32,
        iterations,
    )?;
    let mut positions = kernels.positions()?;
    smooth_caps(mesh, criteria.field, isovalue, &compacted.vertices, &mut positions);
    for (&v, p) in compacted.vertices.iter().zip(positions) {
        mesh.set_position(v, p.into());
    }
    Ok(())
}

/// How thorough remeshing is.
#[derive(Clone, Copy)]
pub(crate) struct Effort {
    /// Rounds of split, collapse, flip and relaxation.
    rounds: usize,
    /// Rounds of refinement after them.
    refinements: usize,
}

impl Effort {
    /// For a mesh as it was extracted.
    pub(crate) const WHOLE: Effort = Effort { rounds: 6, refinements: 4 };
    /// For a patch between pinned vertices.
    pub(crate) const PATCH: Effort = Effort { rounds: 3, refinements: 2 };
}

/// Remeshes what is not pinned of the isosurface of one isovalue. Returns the collapses; `None` as soon as the
/// mesh takes too many faces, of which it is asked after each round, with the rounds that are done.
pub(crate) fn remesh(
    mesh: &mut Mesh,
    criteria: &Criteria,
    kernels: &mut dyn Kernels,
    isovalue: f64,
    parameters: &Parameters,
    effort: Effort,
    is_too_much: &dyn Fn(&Mesh, usize) -> bool,
) -> Result<Option<Vec<(Vertex, Vertex)>>> {
    let mut collapsed = Vec::new();
    for round in 1..=effort.rounds {
        split_chamfers(mesh, criteria.field);
        let deviations = criteria.deviations(mesh);
        let mut length = sizing(mesh, criteria, &deviations, SIZING_GOAL * criteria.error);
        split_long(mesh, criteria, &length, 1.4, &mut Vec::new());
        extend_sizing(mesh, &mut length);
        collapsed.extend(simplify(mesh, criteria, &length, Bounds { short: 0.75, share: 1.0 }));
        flip_edges(mesh, criteria, 3, Flips::ALL);
        if is_too_much(mesh, round) {
            log::debug!("{} faces are too many after {round} rounds", mesh.n_faces());
            return Ok(None);
        }
        relax(mesh, criteria, kernels, isovalue, parameters, 4)?;
    }
    for _ in 0..effort.refinements {
        let deviations = criteria.deviations(mesh);
        let n_refined = refine(mesh, criteria, &deviations, &mut Vec::new());
        if n_refined + split_curve(mesh, criteria, &mut Vec::new()) == 0 {
            break;
        }
        flip_edges(mesh, criteria, 3, Flips::ALL);
        relax(mesh, criteria, kernels, isovalue, parameters, 2)?;
    }
    let length = vec![0.0; mesh.vertex_slots()];
    collapsed.extend(simplify(mesh, criteria, &length, Bounds { short: 0.0, share: 1.0 }));
    flip_edges(mesh, criteria, 2, Flips::ALL);
    Ok((!is_too_much(mesh, effort.rounds)).then_some(collapsed))
}
