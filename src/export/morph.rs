//! One mesh that follows the isosurface over a range of isovalues without events.
//!
//! # Theory
//!
//! Between two events the isosurface keeps its topology, so one mesh can follow it. A spectrum's own triangles come and go there, as
//! remeshing keeps them good; so those of one isovalue are taken, where there are most, and their vertices moved from isosurface to
//! isosurface, each to the nearest point that faces as it does. Steps are shorter than those between the isovalues that are wanted, which keeps the way
//! from one to the next unambiguous. How far the surfaces end up apart is measured: what grows out between the vertices of the
//! mesh is not in it.

use std::io::Write;

use glam::DVec3;

use super::nearest::Nearest;
use super::{Border, Format, glb, prepared};
use crate::error::{Error, Result};
use crate::spectrum::{Keep, Query, Spectrum, SurfaceMesh};
use crate::volume::Placement;

/// Most shapes beside the first one: more are more than most programs play.
pub const MOST_TARGETS: usize = 32;

/// Steps from one wanted isovalue to the next.
const STEPS: usize = 4;

/// A mesh and what becomes of it.
#[derive(Clone, Debug)]
pub struct Morph {
    /// At the isovalue at which it has most triangles, voxel frame.
    pub mesh: SurfaceMesh,
    /// Which of the isovalues that is.
    pub base: usize,
    /// Positions and normals of its vertices at each of the others.
    pub targets: Vec<Shape>,
    /// How far any vertex of the isosurfaces is from it at most, voxels.
    pub farthest: f64,
}

/// Positions and unit normals, one each for every vertex.
#[derive(Clone, Debug)]
pub struct Shape {
    /// Voxel frame.
    pub positions: Vec<[f32; 3]>,
    /// Towards lower values.
    pub normals: Vec<[f32; 3]>,
}

impl Morph {
    /// The mesh of the isovalue with most triangles as it follows the isosurface to each of the others, in their order.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`] for fewer than two or too many isovalues, where there are events between them, and where nothing is to be
    /// seen; [`Error::Range`].
    pub fn of(spectrum: &Spectrum, isovalues: &[f64], keep: &Keep, open: bool) -> Result<Self> {
        if !(2..=MOST_TARGETS + 1).contains(&isovalues.len()) {
            return Err(Error::Usage(format!(
                "{} isovalues to morph between, expected 2 to {}",
                isovalues.len(),
                MOST_TARGETS + 1
            )));
        }
        isovalues.iter().try_for_each(|&c| spectrum.check_isovalue(c))?;
        check_events(spectrum, isovalues)?;
        let mut query = Query::new(spectrum);
        let mut mesh_at = |c: f64| query.mesh_at(c).map(|mesh| mesh.kept(keep, open).0);
        let mut base = (0, SurfaceMesh::default());
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
        let mut shapes = vec![None; isovalues.len()];
        let mut farthest = 0.0f64;
        for way in [(0..=base).rev().collect::<Vec<_>>(), (base..isovalues.len()).collect()] {
            let mut moving = mesh.clone();
            for pair in way.windows(2) {
                let [from, to] = [isovalues[pair[0]], isovalues[pair[1]]];
                let mut wanted = SurfaceMesh::default();
                for step in 1..=STEPS {
                    let t = step as f64 / STEPS as f64;
                    wanted = mesh_at(from * (1.0 - t) + to * t)?;
                    follow(&mut moving, &wanted)?;
                }
                farthest = farthest.max(distance(&wanted, &moving));
                let SurfaceMesh { positions, normals, .. } = moving.clone();
                shapes[pair[1]] = Some(Shape { positions, normals });
            }
        }
        Ok(Morph { mesh, base, targets: shapes.into_iter().flatten().collect(), farthest })
    }
}

/// How far a vertex of a mesh is from another mesh at most.
fn distance(from: &SurfaceMesh, to: &SurfaceMesh) -> f64 {
    let Some(nearest) = Nearest::of(to) else { return 0.0 };
    let points = from.positions.iter().map(|p| DVec3::from(p.map(f64::from)));
    let distances = points.map(|p| nearest.to(p, None).map_or(0.0, |q| q.distance(p)));
    distances.fold(0.0, f64::max)
}

/// Writes a mesh that follows the isosurface as GLB, in the world frame: its shapes are morph targets, which an animation goes
/// through in so many seconds.
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
    let placed = prepared(&morph.mesh, placement, Border::Closed, Format::Glb)?;
    let shape = |Shape { positions, normals }: &Shape| {
        let mesh = SurfaceMesh {
            positions: positions.clone(),
            normals: normals.clone(),
            ..morph.mesh.clone()
        };
        prepared(&mesh, placement, Border::Closed, Format::Glb)
    };
    let shapes = morph.targets.iter().map(shape).collect::<Result<Vec<_>>>()?;
    glb::write_morph(&placed, &shapes, morph.base, seconds, writer)
        .and_then(|()| writer.flush())
        .map_err(|e| Error::io("-", e))
}

/// Refuses events between the isovalues, and tells the widest range without any.
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

/// Moves the vertices of a mesh to the nearest points of another that face as they do.
fn follow(moving: &mut SurfaceMesh, wanted: &SurfaceMesh) -> Result<()> {
    let nearest = Nearest::of(wanted)
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
        // What has no area keeps what it had.
        if let Some(unit) = sum.try_normalize() {
            *normal = unit.to_array().map(|x| x as f32);
        }
    }
    Ok(())
}
