//! The isosurface spectrum: trajectories, lifetimes, collapses, and the mesh at any isovalue.
//!
//! Nothing here knows of samples, sweeps or GPUs, and of a volume no more than [`VolumeInfo`] holds: the sweep makes a [`Spectrum`] of a
//! [`Patch`], the file stores it, a [`Query`] and the renderer read it.
//!
//! # Invariants
//!
//! [`Spectrum::check`] lists them; every function here that takes a spectrum relies on them.
//! Lifetimes are half-open, so the mesh is continuous from the right in the isovalue. Triangles
//! that are still alive at the upper end of the range die at an isovalue above it (the next
//! floating point number will do), which is why the table of isovalues may end outside the range.

pub(crate) mod active_set;
mod assembly;
mod check;
mod components;
mod cuts;
pub(crate) mod interval_tree;
mod joiner;
mod lineage;
mod measures;
pub mod normal;
mod normals;
mod numbers;
mod patch;
mod picked;
mod quantise;
mod query;
mod shown_first;
mod size;
mod suggested;
mod told;
mod uncounted;

pub(crate) use assembly::Assembly;
pub use check::MAX_COORDINATE;
pub use components::{Component, Components, Keep};
pub(crate) use cuts::cuts;
pub(crate) use joiner::{Joiner, Seam, Unlike};
pub use lineage::{End, Lineage, lineages};
pub(crate) use measures::Measures;
pub use normals::Normals;
pub use patch::Patch;
pub use picked::Picked;
pub use quantise::{FINEST_QUANTUM, quantum};
pub use query::Query;
pub(crate) use shown_first::shown_first;
pub use size::Size;
pub use told::{About, Told};

pub use crate::topology::{Event, EventKind};
pub use crate::volume::VolumeInfo;

use crate::volume::{Preparation, Statistics};

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

/// The isosurfaces of all isovalues of a range: trajectories of vertices, and triangles with lifetimes.
///
/// It does not change, and holds what [`Spectrum::new`] has checked.
///
/// ```
/// use isospectrum::spectrum::{About, Knot, Patch, Triangle};
/// use isospectrum::volume::phantom;
/// use isospectrum::{Isovalue, Spectrum};
///
/// // Three vertices that move from isovalue 0 to 1, and the triangle between them.
/// let place = |x: u8| [0, 1].map(|rank: u8| Knot { rank: rank.into(), position: [x.into(), (x % 2).into(), rank.into()] });
/// let patch = Patch {
///     isovalues: vec![0.0, 1.0],
///     first_knot: vec![0, 2, 4, 6],
///     knots: [0, 1, 2].into_iter().flat_map(place).collect(),
///     triangles: vec![Triangle { vertices: [0, 1, 2], birth: 0, death: 1, cap: false }],
///     collapses: Vec::new(),
/// };
/// let about = About::new(phantom("sphere:8")?.info(), (0.0, 0.5), 0.1);
/// let spectrum = Spectrum::new(about.clone(), patch.clone())?;
/// let c = "50%".parse::<Isovalue>()?.resolve(spectrum.range(), spectrum.statistics().as_ref())?;
/// assert_eq!(spectrum.mesh_at(c)?.positions[0], [0.0, 0.0, 0.25]);
///
/// // The last vertex has no knots.
/// let bad = Patch { first_knot: vec![0, 2, 6, 6], ..patch };
/// assert!(Spectrum::new(about, bad).is_err());
/// # Ok::<(), isospectrum::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Spectrum {
    about: About,
    patch: Patch,
}

/// The mesh at one isovalue; at the root of the crate it is called `Mesh`.
///
/// ```
/// use isospectrum::volume::phantom;
/// use isospectrum::{Backend, Choice, Parameters, Silent, compute, export};
///
/// let volume = std::sync::Arc::new(phantom("sphere:10")?);
/// let backend = Backend::choose(Choice::Cpu, None)?;
/// let spectrum = compute(&volume, &Parameters::default(), &backend, &Silent)?;
/// let mesh = spectrum.mesh_at(0.4)?;
/// assert_eq!((mesh.normals.len(), mesh.caps.len()), (mesh.positions.len(), mesh.triangles.len()));
/// // Positions in the world.
/// let placed = export::place_in_world(mesh.clone(), volume.placement());
/// assert_eq!(placed.triangles, mesh.triangles);
/// # Ok::<(), isospectrum::Error>(())
/// ```
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
    /// A spectrum of its parts, checked: see [`Spectrum::check`].
    ///
    /// # Errors
    ///
    /// [`Error::Input`](crate::Error::Input) naming the first invariant that does not hold.
    pub fn new(about: About, patch: Patch) -> crate::Result<Spectrum> {
        let spectrum = Spectrum::unchecked(about, patch);
        spectrum.check()?;
        Ok(spectrum)
    }

    /// A spectrum of parts that are known to fit, or are yet to be checked.
    pub(crate) fn unchecked(about: About, patch: Patch) -> Spectrum {
        Spectrum { about, patch }
    }

    /// What it is made of.
    pub fn into_parts(self) -> (About, Patch) {
        (self.about, self.patch)
    }

    /// The spectrum with something of it changed, checked anew.
    ///
    /// # Errors
    ///
    /// As [`Spectrum::new`].
    pub fn changed(
        mut self,
        change: impl FnOnce(&mut About, &mut Patch),
    ) -> crate::Result<Spectrum> {
        change(&mut self.about, &mut self.patch);
        Spectrum::new(self.about, self.patch)
    }

    /// All that it tells besides its triangles.
    pub fn about(&self) -> &About {
        &self.about
    }

    /// To tell more; whoever changes it keeps it valid.
    pub(crate) fn about_mut(&mut self) -> &mut About {
        &mut self.about
    }

    /// Where it comes from.
    pub fn volume(&self) -> &VolumeInfo {
        &self.about.volume
    }

    /// Lowest and highest isovalue.
    pub fn range(&self) -> (f64, f64) {
        self.about.range
    }

    /// Tolerance in voxels the mesh was computed for.
    pub fn tolerance(&self) -> f64 {
        self.about.tolerance
    }

    /// How it was computed: every flag, the backend, the adapter, counts of what was repaired.
    pub fn parameters(&self) -> &Told {
        &self.about.parameters
    }

    /// Every change of topology inside the range, by isovalue.
    pub fn events(&self) -> &[Event] {
        &self.about.events
    }

    /// Every isovalue at which a knot or the end of a lifetime lies, strictly increasing.
    pub fn isovalues(&self) -> &[f64] {
        &self.patch.isovalues
    }

    /// Start of each vertex's knots in [`Spectrum::knots`], and the end: one more than there are vertices.
    pub fn first_knot(&self) -> &[u32] {
        &self.patch.first_knot
    }

    /// Knots by vertex, rank strictly increasing within a vertex.
    pub fn knots(&self) -> &[Knot] {
        &self.patch.knots
    }

    /// Triangles. Each vertex has knots from birth to death (inclusive) of each of its triangles.
    pub fn triangles(&self) -> &[Triangle] {
        &self.patch.triangles
    }

    /// Collapses.
    pub fn collapses(&self) -> &[Collapse] {
        &self.patch.collapses
    }

    /// Number of vertices (trajectories).
    pub fn n_vertices(&self) -> usize {
        self.patch.first_knot.len().saturating_sub(1)
    }

    /// What was done to the volume before it was swept.
    ///
    /// # Errors
    ///
    /// [`Error::Input`](crate::Error::Input) if the parameters tell what this version does not know.
    pub fn preparation(&self) -> crate::Result<Preparation> {
        let told = self.about.parameters.get("preparation");
        told.map_or_else(|| Ok(Preparation::default()), Preparation::of_json)
    }

    /// The knots of vertex `v`, by rank.
    pub fn trajectory(&self, v: u32) -> &[Knot] {
        let v = v as usize;
        &self.knots()[self.first_knot()[v] as usize..self.first_knot()[v + 1] as usize]
    }

    /// What is known of the samples of the volume, where the parameters tell it.
    pub fn statistics(&self) -> Option<Statistics> {
        self.about.parameters.get(Statistics::NAME).and_then(Statistics::of_json)
    }

    /// The mesh at one isovalue, after a look at every triangle; a [`Query`] is faster for many.
    ///
    /// # Errors
    ///
    /// [`Error::Range`](crate::Error::Range) outside [`Spectrum::range`].
    pub fn mesh_at(&self, isovalue: f64) -> crate::Result<SurfaceMesh> {
        Query::for_some(self, 1).mesh_at(isovalue)
    }
}
