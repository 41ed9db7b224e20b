//! The isosurface spectrum: trajectories, lifetimes, collapses, and the mesh at any isovalue.
//!
//! Nothing here knows of samples, sweeps or GPUs, and of a volume no more than [`VolumeInfo`] holds: the sweep fills a [`Spectrum`] through a
//! [`SpectrumBuilder`], the file stores it, a [`Query`] and the renderer read it.
//!
//! # Invariants
//!
//! [`Spectrum::check`] lists them; every function here that takes a spectrum relies on them.
//! Lifetimes are half-open, so the mesh is continuous from the right in the isovalue. Triangles
//! that are still alive at the upper end of the range die at an isovalue above it (the next
//! floating point number will do), which is why the table of isovalues may end outside the range.

mod active_set;
mod assembly;
mod builder;
mod check;
mod components;
pub mod interval_tree;
mod joiner;
mod lineage;
mod measures;
pub mod normal;
mod normals;
mod numbers;
mod quantise;
mod query;
mod shown_first;
mod uncounted;

pub use active_set::ActiveSet;
pub(crate) use assembly::Assembly;
pub use builder::{Patch, SpectrumBuilder};
pub use check::MAX_COORDINATE;
pub use components::{Component, Components, Keep};
pub use joiner::{Joiner, Seam, Unlike};
pub use lineage::{End, Lineage, lineages};
pub(crate) use measures::Measures;
pub use normals::Normals;
pub use quantise::QUANTUM;
pub(crate) use quantise::{from_fixed, to_fixed};
pub use query::Query;

pub use crate::topology::{Event, EventKind};
pub use crate::volume::VolumeInfo;

use crate::volume::Statistics;

/// One knot of a trajectory.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Knot {
    /// Rank of the isovalue in [`Spectrum::isovalues`].
    pub rank: u32,
    /// Position, voxel frame.
    pub position: [f32; 3],
}

/// One triangle: counter-clockwise seen from lower values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Triangle {
    /// Indices into the trajectories.
    pub vertices: [u32; 3],
    /// Rank of the isovalue from which the triangle is part of the mesh.
    pub birth: u32,
    /// Rank of the isovalue from which it no longer is; `birth < death`.
    pub death: u32,
    /// Whether the triangle only closes the mesh at the border of the volume, or lies beyond its mask.
    pub cap: bool,
}

/// One edge collapse: which vertex stands in for one that has ended (thesis section 4.2).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Collapse {
    /// The vertex that ended.
    pub vertex: u32,
    /// The vertex in its place.
    pub target: u32,
    /// Rank of the isovalue of the collapse.
    pub rank: u32,
    /// Whether the target stands in towards higher isovalues (else towards lower ones).
    pub upward: bool,
}

/// The isosurfaces of all isovalues of a range.
#[derive(Clone, Debug, PartialEq)]
pub struct Spectrum {
    /// Where it comes from.
    pub volume: VolumeInfo,
    /// Lowest and highest isovalue.
    pub range: (f64, f64),
    /// Tolerance in voxels the mesh was computed for.
    pub tolerance: f64,
    /// How it was computed: every flag, the backend, the adapter, counts of what was repaired.
    pub parameters: serde_json::Value,
    /// Every change of topology inside the range, by isovalue.
    pub events: Vec<Event>,
    /// Every isovalue at which a knot or the end of a lifetime lies, strictly increasing.
    pub isovalues: Vec<f64>,
    /// Start of each vertex's knots in `knots`, and the end: one more than there are vertices.
    pub first_knot: Vec<u32>,
    /// Knots by vertex, rank strictly increasing within a vertex.
    pub knots: Vec<Knot>,
    /// Triangles. Each vertex has knots from birth to death (inclusive) of each of its triangles.
    pub triangles: Vec<Triangle>,
    /// Collapses.
    pub collapses: Vec<Collapse>,
}

/// The mesh at one isovalue.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SurfaceMesh {
    /// Positions, voxel frame (exports place them in the world).
    pub positions: Vec<[f32; 3]>,
    /// Unit normals towards lower values: area-weighted means over the triangles around each vertex, over caps only
    /// where it has no others.
    pub normals: Vec<[f32; 3]>,
    /// Vertex indices, counter-clockwise seen from lower values.
    pub triangles: Vec<[u32; 3]>,
    /// Whether a triangle is a cap; as long as `triangles`.
    pub caps: Vec<bool>,
}

impl SurfaceMesh {
    /// Least and largest corner of the box around the vertices, voxel frame; none of an empty mesh.
    pub fn bounds(&self) -> Option<[[f64; 3]; 2]> {
        let (first, others) = self.positions.split_first()?;
        let start = [*first, *first];
        let [low, high] = others.iter().fold(start, |[low, high], p| {
            let along = |axis: usize| (low[axis].min(p[axis]), high[axis].max(p[axis]));
            let sides: [_; 3] = std::array::from_fn(along);
            [sides.map(|s| s.0), sides.map(|s| s.1)]
        });
        Some([low, high].map(|corner| corner.map(f64::from)))
    }
}

impl Spectrum {
    /// Number of vertices (trajectories).
    pub fn n_vertices(&self) -> usize {
        self.first_knot.len().saturating_sub(1)
    }

    /// The knots of vertex `v`, by rank.
    pub fn trajectory(&self, v: u32) -> &[Knot] {
        let v = v as usize;
        &self.knots[self.first_knot[v] as usize..self.first_knot[v + 1] as usize]
    }

    /// What is known of the samples of the volume, where the parameters tell it.
    pub fn statistics(&self) -> Option<Statistics> {
        self.parameters.get(Statistics::NAME).and_then(Statistics::of_json)
    }

    /// The mesh at one isovalue; builds the search structures anew, so use a [`Query`] for more
    /// than one.
    ///
    /// # Errors
    ///
    /// [`Error::Range`](crate::Error::Range) outside [`Spectrum::range`].
    pub fn mesh_at(&self, isovalue: f64) -> crate::Result<SurfaceMesh> {
        Query::new(self).mesh_at(isovalue)
    }
}
