//! One mesh that follows the isosurface over a range of isovalues without events.
//!
//! # Theory
//!
//! Between two events the isosurface keeps its topology, so one mesh can follow it. The triangles of the spectrum itself do not
//! persist there, because remeshing replaces them. So the mesh of the isovalue with most triangles is taken, and its vertices
//! are projected from isosurface to isosurface, each onto the nearest point with a similar normal. Intermediate isovalues make
//! this projection unambiguous. The remaining distance to the isosurface is measured: a feature that grows between the
//! vertices of the mesh is missing in it.

use std::io::Write;

use glam::DVec3;

use super::format::Format;
use super::glb;
use super::nearest::NearestPoint;
use super::world_mesh::{Border, WorldMesh};
use crate::error::{Error, Result};
use crate::spectrum::{Keep, Mesh, Query, Spectrum};
use crate::volume::Placement;

/// Largest number of morph targets: most programs do not play more.
const MAX_TARGETS: usize = 32;

/// Steps between two successive isovalues.
const STEPS: usize = 4;

/// A mesh and its morph targets.
#[derive(Clone, Debug)]
pub struct Morph {
    /// The mesh at the isovalue with most triangles, voxel frame.
    pub mesh: Mesh,
    /// Index of that isovalue.
    pub base: usize,
    /// Positions and normals of its vertices at each of the other isovalues.
    pub targets: Vec<MorphTarget>,
    /// Largest distance from a vertex of the isosurfaces to the morphed mesh, voxels.
    pub max_distance: f64,
}

/// Positions and unit normals, one each for every vertex.
#[derive(Clone, Debug)]
pub struct MorphTarget {
    /// Voxel frame.
    pub positions: Vec<[f32; 3]>,
    /// Towards the outer side.
    pub normals: Vec<[f32; 3]>,
}

impl Morph {
    /// Morphs the mesh of the isovalue with most triangles to each of the other isovalues, in their order.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`] for fewer than two or too many isovalues, for events between them, and for empty surfaces;
    /// [`Error::Range`].
    pub fn of(spectrum: &Spectrum, isovalues: &[f64], keep: &Keep, open: bool) -> Result<Self> {
        if !(2..=MAX_TARGETS + 1).contains(&isovalues.len()) {
            return Err(Error::Usage(format!(
                "{} isovalues to morph between, expected 2 to {}",
                isovalues.len(),
                MAX_TARGETS + 1
            )));
        }
        isovalues.iter().try_for_each(|&c| spectrum.check_isovalue(c))?;
        check_events(spectrum, isovalues)?;
        let mut query = Query::new(spectrum);
        let mut mesh_at = |c: f64| query.mesh_at(c).map(|mesh| mesh.kept(keep, open).0);
        let mut base = (0, Mesh::default());
        for (i, &c) in isovalues.iter().enumerate() {
            let mesh = mesh_at(c)?;
            if mesh.triangles.len() > base.1.triangles.len() {
                base = (i, mesh);
            }
        }
        let (base, mesh) = base;
        if mesh.triangles.is_empty() {
            return Err(Error::Usage("nothing to see, expected a surface to morph".to_owned()));
        }
        let mut targets = vec![None; isovalues.len()];
        let mut max_distance = 0.0f64;
        for indices in [(0..=base).rev().collect::<Vec<_>>(), (base..isovalues.len()).collect()] {
            let mut moving = mesh.clone();
            for pair in indices.windows(2) {
                let [from, to] = [isovalues[pair[0]], isovalues[pair[1]]];
                let mut isosurface = Mesh::default();
                for step in 1..=STEPS {
                    let t = step as f64 / STEPS as f64;
                    isosurface = mesh_at(from * (1.0 - t) + to * t)?;
                    project(&mut moving, &isosurface)?;
                }
                max_distance = max_distance.max(distance(&isosurface, &moving));
                let Mesh { positions, normals, .. } = moving.clone();
                targets[pair[1]] = Some(MorphTarget { positions, normals });
            }
        }
        let targets = targets.into_iter().flatten().collect();
        Ok(Morph { mesh, base, targets, max_distance })
    }
}

/// Largest distance from a vertex of one mesh to another mesh.
fn distance(from: &Mesh, to: &Mesh) -> f64 {
    let Some(nearest) = NearestPoint::new(to) else { return 0.0 };
    let points = from.positions.iter().map(|p| DVec3::from(p.map(f64::from)));
    let distances = points.map(|p| nearest.to(p, None).map_or(0.0, |q| q.distance(p)));
    distances.fold(0.0, f64::max)
}

/// Writes a morphing mesh as GLB, in the world frame, with an animation that goes through its morph targets in `seconds`.
///
/// # Errors
///
/// As [`super::write_to`].
pub fn write_morph_to(
    morph: &Morph,
    seconds: f64,
    placement: &Placement,
    writer: &mut dyn Write,
) -> Result<()> {
    let world_mesh = |mesh: &Mesh| WorldMesh::new(mesh, placement, Border::Closed, Format::Glb);
    let mesh = world_mesh(&morph.mesh)?;
    let target = |MorphTarget { positions, normals }: &MorphTarget| {
        world_mesh(&Mesh {
            positions: positions.clone(),
            normals: normals.clone(),
            ..morph.mesh.clone()
        })
    };
    let targets = morph.targets.iter().map(target).collect::<Result<Vec<_>>>()?;
    glb::write_morph(&mesh, &targets, morph.base, seconds, writer)
        .and_then(|()| writer.flush())
        .map_err(|e| Error::io("-", e))
}

/// Returns an error with the widest range without events if there are events between the isovalues.
fn check_events(spectrum: &Spectrum, isovalues: &[f64]) -> Result<()> {
    let low = isovalues.iter().copied().fold(f64::INFINITY, f64::min);
    let high = isovalues.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let mut events: Vec<f64> = (spectrum.events().iter().map(|event| event.isovalue))
        .filter(|&c| low < c && c <= high)
        .collect();
    if events.is_empty() {
        return Ok(());
    }
    let n = events.len();
    events.sort_by(f64::total_cmp);
    let ends = [&[low][..], &events, &[high]].concat();
    let widest = ends.windows(2).max_by(|a, b| (a[1] - a[0]).total_cmp(&(b[1] - b[0])));
    let [from, to] = widest.map_or([low, high], |pair| [pair[0], pair[1]]);
    Err(Error::Usage(format!(
        "{n} events between {low} and {high}, expected a range without any to morph over; the widest here is from {from} to below {to}"
    )))
}

/// Projects the vertices of a mesh onto the nearest points of another with similar normals, and computes new normals.
fn project(moving: &mut Mesh, isosurface: &Mesh) -> Result<()> {
    let nearest = NearestPoint::new(isosurface)
        .ok_or_else(|| Error::internal("a surface without events has vanished"))?;
    for (position, normal) in moving.positions.iter_mut().zip(&moving.normals) {
        let p = DVec3::from(position.map(f64::from));
        let normal = DVec3::from(normal.map(f64::from));
        let found = nearest.to(p, Some(normal)).or_else(|| nearest.to(p, None));
        *position = found.unwrap_or(p).to_array().map(|x| x as f32);
    }
    let mut sums = vec![DVec3::ZERO; moving.positions.len()];
    for triangle in &moving.triangles {
        let [a, b, c] = triangle.map(|v| DVec3::from(moving.positions[v as usize].map(f64::from)));
        triangle.iter().for_each(|&v| sums[v as usize] += (b - a).cross(c - a));
    }
    for (normal, sum) in moving.normals.iter_mut().zip(sums) {
        // A vertex whose triangles have no area keeps its normal.
        if let Some(unit) = sum.try_normalize() {
            *normal = unit.to_array().map(|x| x as f32);
        }
    }
    Ok(())
}
