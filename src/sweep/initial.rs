//! The initial mesh: a mesh of another program in place of the extraction at the start isovalue, as in the thesis.
//!
//! The mesh is not trusted: it must be closed,
//! oriented and manifold, be inside the volume and on the isosurface, and have one component of
//! the right topology for each component of the isosurface. Then its vertices are moved onto the
//! isosurface, and the sweep starts from the mesh; only its parts in exact cells are cut out.
//!
//! The component of the isosurface that belongs to a component of the mesh is found in the exact
//! extraction at the same isovalue: some vertices of the mesh vote for the component of the nearest extracted vertex.

mod nearest;
#[cfg(test)]
mod tests;

use std::collections::BTreeMap;
use std::path::PathBuf;

use glam::Vec3;

use super::context::Sweep;
use super::parameters::Parameters;
use crate::error::{Error, Result};
use crate::extract::{Extraction, extract};
use crate::field::Field;
use crate::kernels::{Advance, Advanced, Relaxation};
use crate::mesh::{Compacted, HalfEdgeMesh, Vertex, area, intersecting, normal};
use crate::numbers::exact;
use crate::ply_reader::{PlyMesh, read_ply};
use crate::volume::Placement;
use nearest::ExtractionVertices;

/// Largest distance of a vertex from the isosurface, to first order, voxels.
const MAX_DISTANCE: f32 = 0.5;

/// Number of vertices of a component that vote for a component of the isosurface.
const N_VOTERS: usize = 64;

/// How far a vertex may move onto the isosurface, voxels; more than [`MAX_DISTANCE`], which is to first order
/// only.
const MAX_MOTION: f32 = 2.0;

/// The mesh of the file, checked by itself and against the field, in the voxel frame.
pub(super) struct Given {
    path: PathBuf,
    isovalue: f64,
    components: Vec<GivenComponent>,
}

/// One connected component of the given mesh.
struct GivenComponent {
    /// The index of each vertex in the file.
    numbers: Vec<u32>,
    mesh: HalfEdgeMesh,
}

/// The components of the given mesh as one mesh on the isosurface, voxel frame.
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
    let components = checked(&ply, isovalue, field).map_err(|e| e.of_file(path))?;
    Ok(Some(Given { path: path.clone(), isovalue, components }))
}

/// The mesh of the file in the voxel frame.
struct Triangles {
    positions: Vec<[f32; 3]>,
    triangles: Vec<[u32; 3]>,
}

/// From the world to the voxel frame, the inverse of [`Placement::world_of_voxel`].
fn in_voxel_frame(ply: PlyMesh, placement: &Placement) -> Triangles {
    let in_voxels = |&p: &[f64; 3]| placement.voxel_of_world(p).map(|x| x as f32);
    let positions = ply.positions.iter().map(in_voxels).collect();
    let mut triangles = ply.triangles;
    if placement.span() < 0.0 {
        triangles.iter_mut().for_each(|t| t.swap(1, 2));
    }
    Triangles { positions, triangles }
}

/// The components of the mesh, each oriented such that its faces face lower values.
fn checked(ply: &Triangles, isovalue: f64, field: &Field) -> Result<Vec<GivenComponent>> {
    if ply.triangles.is_empty() {
        return Err(Error::input("no triangles, expected a closed mesh of the isosurface"));
    }
    let n = ply.positions.len();
    let mesh = HalfEdgeMesh::from_triangles(
        &ply.positions,
        &vec![false; n],
        &ply.triangles,
        &vec![false; ply.triangles.len()],
    )?;
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
    components(&mesh).iter().map(|vertices| component(&mesh, vertices, field)).collect()
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

/// The vertices of each connected component, ascending; components by their first vertices.
fn components(mesh: &HalfEdgeMesh) -> Vec<Vec<Vertex>> {
    let mut seen = vec![false; mesh.vertex_slots()];
    let mut components = Vec::new();
    for first in mesh.vertices() {
        if std::mem::replace(&mut seen[first.0 as usize], true) {
            continue;
        }
        let mut found = vec![first];
        let mut next = 0;
        while next < found.len() {
            for v in mesh.one_ring(found[next]) {
                if !std::mem::replace(&mut seen[v.0 as usize], true) {
                    found.push(v);
                }
            }
            next += 1;
        }
        found.sort_unstable();
        components.push(found);
    }
    components
}

/// One component as a mesh of its own.
fn component(mesh: &HalfEdgeMesh, vertices: &[Vertex], field: &Field) -> Result<GivenComponent> {
    let index =
        |v: Vertex| vertices.binary_search(&v).expect("a face lies in one component") as u32;
    // Every face is visited at the lowest of its vertices.
    let spokes = vertices.iter().flat_map(|&v| mesh.spokes(v).map(move |h| (v, mesh.face(h))));
    let mut faces: Vec<_> = spokes
        .filter(|&(v, f)| mesh.face_vertices(f).iter().min() == Some(&v))
        .map(|(_, f)| f)
        .collect();
    faces.sort_unstable();
    // For volumes of another sign convention faces face higher values.
    let uphill: f32 = faces
        .iter()
        .map(|&f| {
            let corners = mesh.corners(f);
            let centre = corners.iter().sum::<Vec3>() / 3.0;
            area(corners) * normal(corners).dot(field.gradient(centre).normalize_or_zero())
        })
        .sum();
    let mut triangles: Vec<[u32; 3]> =
        faces.iter().map(|&f| mesh.face_vertices(f).map(index)).collect();
    if uphill > 0.0 {
        triangles.iter_mut().for_each(|t| t.swap(1, 2));
    }
    let positions: Vec<[f32; 3]> = vertices.iter().map(|&v| mesh.position(v).to_array()).collect();
    let caps = vec![false; triangles.len()];
    Ok(GivenComponent {
        numbers: vertices.iter().map(|v| v.0).collect(),
        mesh: HalfEdgeMesh::from_triangles(
            &positions,
            &vec![false; positions.len()],
            &triangles,
            &caps,
        )?,
    })
}

/// The given mesh, its vertices moved onto the isosurface.
///
/// # Errors
///
/// [`Error::Input`] where the components of the mesh are not those of the isosurface, or the
/// vertices cannot be moved onto it without faces that pass through each other.
pub(super) fn placed(sweep: &Sweep, given: Given) -> Result<InitialMesh> {
    let Given { path, isovalue, components } = given;
    let extraction = extract(&sweep.exact, isovalue);
    let matched = matched(&extraction, &components, sweep).map_err(|e| e.of_file(&path))?;
    let crossings = extraction.component_crossings();
    let mut initial = InitialMesh { positions: Vec::new(), triangles: Vec::new() };
    for (component, on) in components.into_iter().zip(matched) {
        let (low, high) = crossings[on as usize];
        let arc = sweep.topology.arc_of(low, high, isovalue).ok_or_else(|| {
            Error::internal(format!("no arc of component {on} at isovalue {isovalue}"))
        })?;
        check_euler(&component, sweep.topology.arcs[arc].euler).map_err(|e| e.of_file(&path))?;
        let InitialMesh { positions, triangles } =
            projected(&component, isovalue, sweep).map_err(|e| e.of_file(&path))?;
        let first = initial.positions.len() as u32;
        initial.positions.extend(positions);
        initial.triangles.extend(triangles.into_iter().map(|t| t.map(|v| v + first)));
    }
    Ok(initial)
}

fn check_euler(component: &GivenComponent, expected: i64) -> Result<()> {
    let euler = component.mesh.euler();
    if euler == expected {
        return Ok(());
    }
    Err(Error::input(format!(
        "the component of vertex {} has genus {}, expected {} as the isosurface there",
        component.numbers[0],
        1 - euler / 2,
        1 - expected / 2
    )))
}

/// For each component of the mesh, its component of the extraction; one to one.
fn matched(
    extraction: &Extraction,
    components: &[GivenComponent],
    sweep: &Sweep,
) -> Result<Vec<u32>> {
    let vertices = ExtractionVertices::new(extraction, sweep.field.inverse_cell_size());
    let mut owner: Vec<Option<usize>> = vec![None; extraction.n_components];
    let mut matched = Vec::with_capacity(components.len());
    for (i, component) in components.iter().enumerate() {
        let mut votes: BTreeMap<u32, usize> = BTreeMap::new();
        let slots = component.mesh.vertex_slots();
        for v in (0..slots).step_by(slots.div_ceil(N_VOTERS)) {
            if let Some(on) = vertices.component_near(component.mesh.position(Vertex(v as u32))) {
                *votes.entry(on).or_default() += 1;
            }
        }
        // Of equal votes the first component wins: `max_by_key` takes the last, so reversed.
        let Some((&on, _)) = votes.iter().rev().max_by_key(|vote| vote.1) else {
            return Err(Error::input(format!(
                "the component of vertex {} has no isosurface near, expected one",
                component.numbers[0]
            )));
        };
        if let Some(other) = owner[on as usize].replace(i) {
            return Err(Error::input(format!(
                "the components of vertices {} and {} lie on the same component of the isosurface, expected one",
                components[other].numbers[0], component.numbers[0]
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

/// A component, its vertices moved onto the isosurface.
fn projected(component: &GivenComponent, isovalue: f64, sweep: &Sweep) -> Result<InitialMesh> {
    let mut kernels = sweep.backend.kernels(&sweep.field)?;
    let Compacted { connectivity, positions, vertices, .. } = component.mesh.compacted();
    kernels.load(&connectivity, &positions)?;
    let only_projects = Relaxation { isovalue, strength: 0.0, threshold: 0.0, max_iterations: 0 };
    let advance =
        Advance { isovalues: &[isovalue], reach: MAX_MOTION, ends: &[], relaxation: only_projects };
    let Advanced { positions, .. } = kernels.advance(&advance)?;
    let tolerance = sweep.parameters.error as f32;
    let number = |i: usize| component.numbers[vertices[i].0 as usize];
    for (i, &p) in positions.iter().enumerate() {
        check_distance(number(i), p.into(), isovalue, &sweep.field, tolerance)?;
    }
    if let Some(&f) = intersecting(&positions, &connectivity.faces).first() {
        let corners = connectivity.faces[f as usize].map(|v| number(v as usize));
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
