//! Surgery: the one way in which a mesh changes its topology or is repaired (docs/decisions/0003-surgery.md).
//!
//! Around the events, and wherever the mesh does not follow the isosurface from just before to just
//! after them, a block of cells is chosen. The faces away from the block stay, with their vertices
//! moved to the isovalue after; the exact extraction at that isovalue fills the block; and the gap
//! between the two is closed by one strip of triangles per rim. The result must be what the contour
//! tree says: one component per arc, each with its Euler characteristic. As the inside comes from
//! the field alone, minima, maxima, saddles of any kind, several at once and plateaus are no
//! different cases; and with no event at all it is a repair.

mod back;
mod block;
mod cut;
mod excursion;
mod handle;
mod incoming;
mod near;
mod patch;
mod rim;
mod stitch;
mod zip;

use glam::Vec3;

use super::recorder::{Direction, Log, Recorder, Run};
use super::start::extraction_up_to;
use super::toil::Toil;
use super::{Counts, Sweep};
use crate::error::Result;
use crate::extract::Extraction;
use crate::kernels::Kernels;
use crate::mesh::{Face, Mesh, Vertex, normal};
use back::Passage;
use block::Block;
use cut::Moved;
use incoming::Adjacency;
use near::Near;
use stitch::{Stitched, stitch};

/// So many blocks are tried, and so many for a repair.
const ATTEMPTS: u32 = 12;
const REPAIR_ATTEMPTS: u32 = 9;

/// Radius of the block around an event, voxels.
const EVENT_RADIUS: f32 = 0.8;

/// Radius of the block around a vertex that does not follow, voxels.
const BAD_RADIUS: f32 = 0.3;

/// Smaller meshes are not repaired: the exact extraction shows them as well.
pub(super) const REPAIRED_FROM: usize = 400;

/// The extraction has the mesh beside it where that faces the same way and is so near, voxels.
const COVERED: f32 = 0.5;

/// By how much, times the number of the attempt, the block grows around trouble, voxels.
const GROWTH: f32 = 0.2;

/// A surgery that leaves less than this share of the extraction to the meshes is none.
const MOST_REPLACED: f32 = 0.6;

/// An isosurface passes at most so many times the cells that its area says, and small ones any number up to this.
const MOST_CELLS_PASSED: f32 = 3.0;
const LEAST_CELLS: usize = 1_000;

/// A component's mesh at an isovalue, and what was recorded of it.
#[derive(Debug, Default)]
pub(super) struct Front {
    pub(super) mesh: Mesh,
    pub(super) recorder: Recorder,
    pub(super) at: f64,
    pub(super) toil: Toil,
}

/// What a surgery is to do.
pub(super) struct Operation<'a> {
    /// Which way the isovalue goes.
    pub(super) direction: Direction,
    /// Where the change shows.
    pub(super) event: f64,
    /// The isovalue of the meshes afterwards.
    pub(super) after: f64,
    /// Where the events are, or what is to be repaired, voxel frame.
    pub(super) points: &'a [Vec3],
    /// The arcs whose components there are afterwards.
    pub(super) arcs: &'a [usize],
    /// Whether this repairs the mesh of one arc, away from its events.
    pub(super) repaired: bool,
}

/// What a surgery leaves: a mesh for each arc, and what the meshes before it have recorded.
pub(super) struct Outcome {
    pub(super) fronts: Vec<(usize, Front)>,
    pub(super) log: Log,
}

/// The meshes that no surgery succeeded on.
pub(super) struct Failed {
    pub(super) fronts: Vec<Front>,
    /// Whether they are a small part only of the components there are afterwards.
    pub(super) are_small: bool,
}

/// Operates on the meshes of some components. Gives them back if no attempt succeeds.
pub(super) fn operate(
    sweep: &Sweep,
    operation: &Operation,
    fronts: Vec<Front>,
    kernels: &mut dyn Kernels,
) -> Result<std::result::Result<Outcome, Failed>> {
    let most_cells = most_cells(sweep, &fronts);
    let extraction = extraction_up_to(sweep, operation.after, operation.arcs, most_cells)?;
    let Some(extraction) = extraction else {
        return Ok(Err(Failed { fronts, are_small: true }));
    };
    let moved = fronts
        .iter()
        .map(|f| Moved::new(&f.mesh, &sweep.field, kernels, f.at, operation.after))
        .collect::<Result<Vec<Moved>>>()?;
    let adjacency = Adjacency::new(&extraction.0);
    let mut block = first_block(sweep, operation, &fronts, &moved, (&extraction.0, &adjacency));
    let attempts = if operation.repaired { REPAIR_ATTEMPTS } else { ATTEMPTS };
    for attempt in 1..=attempts {
        sweep.cancelled()?;
        let n_faces = extraction.0.faces.len();
        let replaced = extraction.0.cells.iter().filter(|&&c| block.has(c)).count();
        if replaced as f32 > MOST_REPLACED * n_faces as f32 {
            log::debug!(
                "surgery at {}: {replaced} of {n_faces} faces in the block",
                operation.event
            );
            return Ok(Err(Failed { fronts, are_small: attempt == 1 }));
        }
        let trouble = match stitch(
            sweep,
            &fronts,
            &moved,
            (&extraction.0, &extraction.1, &adjacency),
            &block,
        ) {
            Ok(stitched) => {
                match patch::improve_all(sweep, operation, stitched, &block, kernels)? {
                    Ok(patched) => {
                        let stays = staying(&fronts, &patched);
                        let before = (0..fronts.len())
                            .map(|r| {
                                let (front, moved) = (&fronts[r], &moved[r]);
                                back::before_event(
                                    operation, front, moved, &stays[r], &block, kernels,
                                )
                            })
                            .collect::<Result<Vec<_>>>()?;
                        let places = patched
                            .iter()
                            .map(|p| back::at_event(sweep, operation, &before, p, &block, kernels))
                            .collect::<Result<Vec<_>>>()?;
                        return Ok(Ok(record(
                            operation,
                            fronts,
                            &stays,
                            patched,
                            (&before, &places),
                        )));
                    }
                    Err(trouble) => trouble,
                }
            }
            Err(trouble) => trouble,
        };
        log::debug!("surgery at {}, attempt {attempt}: {}", operation.event, trouble.why);
        let radius = GROWTH * attempt as f32;
        let seeds = if trouble.points.is_empty() { operation.points } else { &trouble.points };
        seeds.iter().for_each(|&p| block.add_around(p, radius));
    }
    Ok(Err(Failed { fronts, are_small: false }))
}

/// So many cells a component passes at most if some meshes are more than a small part of it: noise that joins what
/// has no mesh is told from its size, not from a look at all that it joins.
fn most_cells(sweep: &Sweep, fronts: &[Front]) -> usize {
    let cell = sweep.field.cell_size();
    // An isosurface passes no more cells than its area projected along the three axes, where it is smooth.
    let faces = fronts.iter().flat_map(|f| f.mesh.faces().map(|face| normal(f.mesh.corners(face))));
    let passed: Vec3 = faces.map(|n| 0.5 * n.abs() * cell / cell.element_product()).sum();
    let kept = MOST_CELLS_PASSED * passed.element_sum();
    LEAST_CELLS + (kept / (1.0 - MOST_REPLACED)) as usize
}

/// Brings the mesh of an arc to an isovalue by replacing what does not follow, and what lies at some
/// points (voxel frame).
pub(super) fn repair(
    sweep: &Sweep,
    arc: usize,
    direction: Direction,
    front: &mut Front,
    (to, points): (f64, &[Vec3]),
    kernels: &mut dyn Kernels,
    counts: &mut Counts,
) -> Result<bool> {
    if front.mesh.n_faces() < REPAIRED_FROM {
        return Ok(false);
    }
    let n_faces = front.mesh.n_faces();
    let operation =
        Operation { direction, event: front.at, after: to, points, arcs: &[arc], repaired: true };
    match operate(sweep, &operation, vec![std::mem::take(front)], kernels)? {
        Ok(mut outcome) => {
            counts.repairs += 1;
            let (_, mut repaired) = outcome.fronts.pop().expect("one front per arc");
            repaired.recorder.prepend(outcome.log);
            log::debug!(
                "repaired arc {arc} from {} to {to}: {n_faces} faces, then {}",
                operation.event,
                repaired.mesh.n_faces()
            );
            *front = repaired;
            Ok(true)
        }
        Err(mut failed) => {
            *front = failed.fronts.pop().expect("the front that was given");
            Ok(false)
        }
    }
}

/// The smallest block: around the events, around what does not follow, and where the extraction has
/// no mesh beside it.
fn first_block(
    sweep: &Sweep,
    operation: &Operation,
    fronts: &[Front],
    moved: &[Moved],
    (extraction, adjacency): (&Extraction, &Adjacency),
) -> Block {
    let mut block = Block::new(&sweep.exact);
    let radius = if operation.repaired { BAD_RADIUS } else { EVENT_RADIUS };
    operation.points.iter().for_each(|&p| block.add_around(p, radius));
    let mut followed = Vec::new();
    for (front, moved) in fronts.iter().zip(moved) {
        moved.add_bad(&front.mesh, BAD_RADIUS, &mut block);
        followed.extend(moved.followed(&front.mesh));
    }
    let covered = Near::of(followed, COVERED);
    for (&p, &n) in extraction.positions.iter().zip(&adjacency.normals) {
        let p = Vec3::from(p);
        if !covered.is_near(p, n) {
            block.add_around(p, BAD_RADIUS);
        }
    }
    block
}

/// One component after the surgery, its triangles improved.
struct Patched {
    stitched: Stitched,
    mesh: Mesh,
    collapsed: Vec<(Vertex, Vertex)>,
}

/// Which faces of each mesh stay, by slot.
fn staying(fronts: &[Front], patched: &[Patched]) -> Vec<Vec<bool>> {
    let mut stays: Vec<Vec<bool>> =
        fronts.iter().map(|f| vec![false; f.mesh.face_slots()]).collect();
    for p in patched {
        for &(r, f) in &p.stitched.kept_faces {
            stays[r][f.0 as usize] = true;
        }
    }
    stays
}

/// Records what the surgery changed. `stays` tells which faces of each mesh stay, by slot; the passages are those of each mesh that arrives, and of
/// each that goes on.
fn record(
    operation: &Operation,
    mut fronts: Vec<Front>,
    stays: &[Vec<bool>],
    patched: Vec<Patched>,
    (before, passages): (&[Passage], &[Passage]),
) -> Outcome {
    let toil = Toil::of_operation(fronts.iter().map(|f| f.toil));
    let mut others: Vec<Recorder> =
        fronts.iter_mut().map(|f| std::mem::take(&mut f.recorder)).collect();
    for p in &patched {
        pass_event(&fronts, before, &mut others, p, operation);
    }
    let mut after = Vec::new();
    for (p, passage) in patched.into_iter().zip(passages) {
        let mut recorder = Recorder::resume(
            &others,
            &p.stitched.kept_vertices,
            &p.stitched.kept_faces,
            operation.repaired.then_some(0),
            Run::Surgery.of_arc(p.stitched.arc),
        );
        let mesh = p.mesh;
        recorder.begin_at(&mesh, |v| passage.at_event[v.0 as usize], operation.event);
        for v in mesh.vertices() {
            for (isovalue, place) in passage.stops_of(v) {
                recorder.knot_at(&mesh, v, place, isovalue);
            }
        }
        recorder.edits(&mesh, &p.collapsed, operation.event, operation.direction);
        let vertices: Vec<Vertex> = mesh.vertices().collect();
        recorder.knots_of(&mesh, &vertices, operation.after);
        after.push((p.stitched.arc, Front { mesh, recorder, at: operation.after, toil }));
    }
    let mut log = Log::default();
    for (r, (front, mut recorder)) in fronts.into_iter().zip(others).enumerate() {
        end_removed(&front.mesh, &mut recorder, &stays[r], &before[r], operation.event);
        log.append(recorder.into_log());
    }
    Outcome { fronts: after, log }
}

/// Records the way to the event of the vertices that stay; for those that the improvement has collapsed it
/// is the end.
fn pass_event(
    fronts: &[Front],
    before: &[Passage],
    others: &mut [Recorder],
    p: &Patched,
    operation: &Operation,
) {
    for (slot, &(r, v)) in p.stitched.kept_vertices.iter().enumerate() {
        let ends = !p.mesh.has_vertex(Vertex(slot as u32));
        if ends || !operation.repaired {
            let mesh = &fronts[r].mesh;
            for (isovalue, place) in before[r].stops_of(v) {
                others[r].knot_at(mesh, v, place, isovalue);
            }
            others[r].knot_at(mesh, v, before[r].at_event[v.0 as usize], operation.event);
        }
    }
}

/// Ends all faces of a mesh at an isovalue, up to which it stays as it is.
pub(super) fn end_all(mut front: Front, event: f64) -> Log {
    let vertices: Vec<Vertex> = front.mesh.vertices().collect();
    front.recorder.knots_of(&front.mesh, &vertices, event);
    front.recorder.finish(event)
}

/// Ends the faces that were taken away, and their vertices, but for those that other faces go on with, at
/// their places at the event.
fn end_removed(
    mesh: &Mesh,
    recorder: &mut Recorder,
    stays: &[bool],
    passage: &Passage,
    event: f64,
) {
    let kept = back::kept(mesh, stays);
    for v in mesh.vertices().filter(|v| !kept[v.0 as usize]) {
        for (isovalue, place) in passage.stops_of(v) {
            recorder.knot_at(mesh, v, place, isovalue);
        }
        recorder.knot_at(mesh, v, passage.at_event[v.0 as usize], event);
    }
    let faces: Vec<Face> = mesh.faces().filter(|f| !stays[f.0 as usize]).collect();
    faces.into_iter().for_each(|f| recorder.end_face(f, event));
}
