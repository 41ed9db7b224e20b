//! The initial mesh: a mesh of another program in place of the extraction at the start isovalue, as in the thesis.
//!
//! The mesh is not trusted: it must be closed,
//! oriented and manifold, be inside the volume and on the isosurface, and have one component of
//! the right topology for each component of the isosurface. Then its vertices are moved onto the
//! isosurface, and the sweep starts from the mesh; only its parts in exact cells are cut out.
//!
//! The component of the isosurface that belongs to a component of the mesh is found in the exact
//! extraction at the same isovalue: each vertex votes for the component of the nearest extracted vertex.

mod nearest;
#[cfg(test)]
mod tests;

use std::collections::BTreeMap;
use std::path::PathBuf;

use glam::Vec3;

use super::context::Sweep;
use super::parameters::Parameters;
use super::transport::MAX_MOTION;
use crate::disjoint_sets::DisjointSets;
use crate::error::{Error, Result};
use crate::extract::{Extraction, extract};
use crate::field::Field;
use crate::kernels::{Advance, Advanced, Relaxation};
use crate::mesh::{Compacted, Edge, HalfEdgeMesh, Vertex, area, intersecting, normal};
use crate::numbers::exact;
use crate::ply_reader::{PlyMesh, read_ply};
use crate::volume::Placement;
use nearest::ExtractionVertices;

/// Largest distance of a vertex from the isosurface, to first order, voxels.
const MAX_DISTANCE: f32 = 0.5;

/// The mesh of the file, checked by itself and against the field, in the voxel frame.
pub(super) struct Given {
    path: PathBuf,
    isovalue: f64,
    /// Its faces face lower values. Vertices have their numbers in the file.
    mesh: HalfEdgeMesh,
    components: Vec<Component>,
}

/// The vertices of a connected component, ascending.
type Component = Vec<Vertex>;

/// A mesh of the file, or on the isosurface, in the voxel frame.
pub(super) struct InitialMesh {
    pub(super) positions: Vec<[f32; 3]>,
    pub(super) triangles: Vec<[u32; 3]>,
}

/// Reads the initial mesh and checks everything that does not need the topology of the volume.
/// `None` if the parameters name no mesh.
///
/// # Errors
///
/// [`Error::Usage`] without a start isovalue inside the range; [`Error::Io`]; [`Error::Input`] for
/// a mesh that is not closed, reaches the border of the volume or leaves the isosurface.
pub(super) fn read(
    parameters: &Parameters,
    range: (f64, f64),
    field: &Field,
) -> Result<Option<Given>> {
    let Some(path) = &parameters.initial_mesh else { return Ok(None) };
    let Some(isovalue) = parameters.start else {
        return Err(Error::Usage(
            "an initial mesh without the isovalue that it shows, expected --start".into(),
        ));
    };
    if !(range.0 <= isovalue && isovalue < range.1) {
        return Err(Error::Usage(format!(
            "initial mesh at isovalue {}, expected from {} to below {}",
            exact(isovalue),
            exact(range.0),
            exact(range.1)
        )));
    }
    let ply = in_voxel_frame(read_ply(path)?, field.volume().placement());
    let (mesh, components) = checked(&ply, isovalue, field).map_err(|e| e.of_file(path))?;
    Ok(Some(Given { path: path.clone(), isovalue, mesh, components }))
}

/// From the world to the voxel frame, the inverse of [`Placement::world_of_voxel`].
fn in_voxel_frame(ply: PlyMesh, placement: &Placement) -> InitialMesh {
    let in_voxels = |&p: &[f64; 3]| placement.voxel_of_world(p).map(|x| x as f32);
    let positions = ply.positions.iter().map(in_voxels).collect();
    let mut triangles = ply.triangles;
    if placement.span() < 0.0 {
        triangles.iter_mut().for_each(|t| t.swap(1, 2));
    }
    InitialMesh { positions, triangles }
}

/// The mesh, oriented such that its faces face lower values, and its components by their first vertices.
fn checked(
    ply: &InitialMesh,
    isovalue: f64,
    field: &Field,
) -> Result<(HalfEdgeMesh, Vec<Component>)> {
    if ply.triangles.is_empty() {
        return Err(Error::input("no triangles, expected a closed mesh of the isosurface"));
    }
    let mesh_of = |triangles: &[[u32; 3]]| {
        let (fixed, caps) = (vec![false; ply.positions.len()], vec![false; triangles.len()]);
        HalfEdgeMesh::from_triangles(&ply.positions, &fixed, triangles, &caps)
    };
    let mesh = mesh_of(&ply.triangles)?;
    let dims = field.dims().as_vec3();
    let end = (dims - 1.0) * field.cell_size();
    for v in mesh.vertices() {
        let p = mesh.position(v);
        if !(p.cmpgt(Vec3::ZERO).all() && p.cmplt(end).all()) {
            return Err(Error::input(format!(
                "vertex {} lies at {} voxels, expected inside the volume of {} voxels, not at its border: \
                 surfaces that reach the border must be extracted",
                v.0,
                format_position(p),
                format_position(end)
            )));
        }
        check_distance(v.0, p, isovalue, field, MAX_DISTANCE)?;
    }
    let components = components(&mesh);
    Ok((mesh_of(&oriented(&mesh, &components, field))?, components))
}

/// The triangles of a mesh, those of components whose faces face higher values turned over: other programs may have another sign
/// convention.
fn oriented(mesh: &HalfEdgeMesh, components: &[Component], field: &Field) -> Vec<[u32; 3]> {
    let mut component_of = vec![0; mesh.vertex_slots()];
    for (i, vertices) in components.iter().enumerate() {
        vertices.iter().for_each(|v| component_of[v.0 as usize] = i);
    }
    let mut uphill = vec![0.0; components.len()];
    for f in mesh.faces() {
        let corners = mesh.corners(f);
        let gradient = field.gradient(corners.iter().sum::<Vec3>() / 3.0).normalize_or_zero();
        let [first, ..] = mesh.face_vertices(f);
        uphill[component_of[first.0 as usize]] += area(corners) * normal(corners).dot(gradient);
    }
    let triangles = mesh.faces().map(|f| mesh.face_vertices(f).map(|v| v.0));
    let turned = |[a, b, c]: [u32; 3]| {
        if uphill[component_of[a as usize]] > 0.0 { [a, c, b] } else { [a, b, c] }
    };
    triangles.map(turned).collect()
}

/// Checks that a vertex lies on the isosurface, up to a distance in voxels.
fn check_distance(number: u32, p: Vec3, isovalue: f64, field: &Field, largest: f32) -> Result<()> {
    let missing = (field.value(p) - field.isovalue(isovalue)).abs();
    let slope = field.gradient(p).length();
    // Not as a quotient: on a plateau at the isovalue both are 0.
    if missing <= largest * slope + field.value_noise() {
        return Ok(());
    }
    let distance = missing / slope;
    let value = field.volume().value_at(p.as_dvec3().to_array());
    Err(Error::input(format!(
        "vertex {number} has the value {value}, {distance:.3} voxels from the isosurface of {isovalue}, expected at most {largest}"
    )))
}

/// The connected components of a mesh, by their first vertices.
fn components(mesh: &HalfEdgeMesh) -> Vec<Component> {
    let mut sets = DisjointSets::new(mesh.vertex_slots());
    for h in mesh.edges().map(Edge::halfedge) {
        sets.join(mesh.from(h).0, mesh.to(h).0);
    }
    let mut components: BTreeMap<u32, Component> = BTreeMap::new();
    for v in mesh.vertices() {
        components.entry(sets.find(v.0)).or_default().push(v);
    }
    components.into_values().collect()
}

/// The given mesh, its vertices moved onto the isosurface.
///
/// # Errors
///
/// [`Error::Input`] where the components of the mesh are not those of the isosurface, or the
/// vertices cannot be moved onto it without faces that pass through each other.
pub(super) fn placed(sweep: &Sweep, given: Given) -> Result<InitialMesh> {
    on_isosurface(sweep, &given).map_err(|e| e.of_file(&given.path))
}

fn on_isosurface(sweep: &Sweep, given: &Given) -> Result<InitialMesh> {
    let extraction = extract(&sweep.exact, given.isovalue);
    let crossings = extraction.component_crossings();
    for (vertices, on) in given.components.iter().zip(matched(&extraction, given, sweep)?) {
        let (low, high) = crossings[on as usize];
        let arc = sweep.topology.arc_of(low, high, given.isovalue).ok_or_else(|| {
            Error::internal(format!("no arc of component {on} at isovalue {}", given.isovalue))
        })?;
        check_euler(&given.mesh, vertices, sweep.topology.arcs[arc].euler)?;
    }
    projected(&given.mesh, given.isovalue, sweep)
}

/// Checks the Euler characteristic of a component.
fn check_euler(mesh: &HalfEdgeMesh, vertices: &[Vertex], expected: i64) -> Result<()> {
    // Each face is at three vertices, and a closed mesh has three edges for two faces.
    let n_faces = vertices.iter().map(|&v| mesh.spokes(v).count() as i64).sum::<i64>() / 3;
    let euler = vertices.len() as i64 - n_faces / 2;
    if euler == expected {
        return Ok(());
    }
    Err(Error::input(format!(
        "the component of vertex {} has genus {}, expected {} as the isosurface there",
        vertices[0].0,
        1 - euler / 2,
        1 - expected / 2
    )))
}

/// For each component of the mesh, its component of the extraction; one to one.
fn matched(
    extraction: &Extraction,
    Given { mesh, components, .. }: &Given,
    sweep: &Sweep,
) -> Result<Vec<u32>> {
    let extracted = ExtractionVertices::new(extraction, sweep.field.inverse_cell_size());
    let mut owner: Vec<Option<u32>> = vec![None; extraction.n_components];
    let mut matched = Vec::with_capacity(components.len());
    for vertices in components {
        let first = vertices[0].0;
        let mut votes: BTreeMap<u32, usize> = BTreeMap::new();
        for &v in vertices {
            if let Some(on) = extracted.component_near(mesh.position(v)) {
                *votes.entry(on).or_default() += 1;
            }
        }
        // Of equal votes the first component wins: `max_by_key` takes the last, so reversed.
        let Some((&on, _)) = votes.iter().rev().max_by_key(|vote| vote.1) else {
            return Err(Error::input(format!(
                "the component of vertex {first} has no isosurface near, expected one"
            )));
        };
        if let Some(other) = owner[on as usize].replace(first) {
            return Err(Error::input(format!(
                "the components of vertices {other} and {first} lie on the same component of the isosurface, expected one"
            )));
        }
        matched.push(on);
    }
    if let Some(left) = owner.iter().position(Option::is_none) {
        return Err(missing(extraction, left as u32, components.len()));
    }
    Ok(matched)
}

/// The error for a component of the isosurface that the mesh lacks.
fn missing(extraction: &Extraction, component: u32, n_found: usize) -> Error {
    let faces = extraction.components.iter().zip(&extraction.faces).zip(&extraction.caps);
    let mut at_border = false;
    let mut place = None;
    for ((_, face), &cap) in faces.filter(|&((&c, _), _)| c == component) {
        at_border |= cap;
        place = place.or(Some(extraction.positions[face[0] as usize]));
    }
    let place = format_position(place.expect("a component has faces").into());
    let why = if at_border {
        "; it reaches the border of the volume, so these surfaces must be extracted"
    } else {
        ""
    };
    Error::input(format!(
        "no component for the one of the isosurface at {place} voxels, {n_found} found, expected {}{why}",
        extraction.n_components
    ))
}

/// The vertices of a mesh moved onto the isosurface.
fn projected(mesh: &HalfEdgeMesh, isovalue: f64, sweep: &Sweep) -> Result<InitialMesh> {
    let mut kernels = sweep.backend.kernels(&sweep.field)?;
    let Compacted { connectivity, positions, vertices, .. } = mesh.compacted();
    kernels.load(&connectivity, &positions)?;
    let only_projects = Relaxation { isovalue, strength: 0.0, threshold: 0.0, max_iterations: 0 };
    let advance =
        Advance { isovalues: &[isovalue], reach: MAX_MOTION, ends: &[], relaxation: only_projects };
    let Advanced { positions, .. } = kernels.advance(&advance)?;
    let tolerance = sweep.parameters.error as f32;
    for (v, &p) in vertices.iter().zip(&positions) {
        check_distance(v.0, p.into(), isovalue, &sweep.field, tolerance)?;
    }
    if let Some(&f) = intersecting(&positions, &connectivity.faces).first() {
        let corners = connectivity.faces[f as usize].map(|v| vertices[v as usize].0);
        return Err(Error::input(format!(
            "on the isosurface the triangle of vertices {corners:?} passes through another, expected none"
        )));
    }
    Ok(InitialMesh { positions, triangles: connectivity.faces })
}

/// A position for messages.
fn format_position(p: Vec3) -> String {
    format!("({:.3}, {:.3}, {:.3})", p.x, p.y, p.z)
}
