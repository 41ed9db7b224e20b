//! The spectrum: a patch with its metadata, which pass [`Spectrum::check`].

use super::elements::{Collapse, Knot, Patch, Triangle};
use super::metadata::{About, Metadata};
use crate::topology::Event;
use crate::volume::{Preparation, Statistics, VolumeInfo};

/// The isosurfaces of all isovalues of a range: trajectories of vertices, and triangles with lifetimes.
///
/// It is immutable, and valid as checked by [`Spectrum::new`].
///
/// ```
/// use isospectrum::spectrum::{About, Knot, Patch, Triangle};
/// use isospectrum::volume::phantom;
/// use isospectrum::{Isovalue, Spectrum};
///
/// // Three vertices that move from isovalue 0 to 1, and the triangle between them.
/// let trajectory = |x: u8| [0, 1].map(|rank: u8| Knot { rank: rank.into(), position: [x.into(), (x % 2).into(), rank.into()] });
/// let patch = Patch {
///     isovalues: vec![0.0, 1.0],
///     first_knot: vec![0, 2, 4, 6],
///     knots: [0, 1, 2].into_iter().flat_map(trajectory).collect(),
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

impl Spectrum {
    /// A spectrum of these parts, which must pass [`Spectrum::check`].
    ///
    /// # Errors
    ///
    /// [`Error::Input`](crate::Error::Input) naming the first invariant that does not hold.
    pub fn new(about: About, patch: Patch) -> crate::Result<Spectrum> {
        let spectrum = Spectrum::unchecked(about, patch);
        spectrum.check()?;
        Ok(spectrum)
    }

    /// A spectrum of parts that are known to be valid, or that the caller checks.
    pub(crate) fn unchecked(about: About, patch: Patch) -> Spectrum {
        Spectrum { about, patch }
    }

    /// Its parts.
    pub fn into_parts(self) -> (About, Patch) {
        (self.about, self.patch)
    }

    /// The patch, to be changed; the caller keeps it valid.
    pub(super) fn patch_mut(&mut self) -> &mut Patch {
        &mut self.patch
    }

    /// The spectrum after a change, checked again.
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

    /// All but the geometry.
    pub fn about(&self) -> &About {
        &self.about
    }

    /// The metadata, to be changed; the caller keeps it valid.
    pub(crate) fn about_mut(&mut self) -> &mut About {
        &mut self.about
    }

    /// Description of the volume.
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
    pub fn parameters(&self) -> &Metadata {
        &self.about.parameters
    }

    /// Every change of topology inside the range, by isovalue.
    pub fn events(&self) -> &[Event] {
        &self.about.events
    }

    /// Every isovalue of a knot or an end of a lifetime, strictly increasing.
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

    /// What was done to the volume before the sweep.
    ///
    /// # Errors
    ///
    /// [`Error::Input`](crate::Error::Input) if this version does not know the preparation in the parameters.
    pub fn preparation(&self) -> crate::Result<Preparation> {
        let preparation = self.about.parameters.get("preparation");
        preparation.map_or_else(|| Ok(Preparation::default()), Preparation::of_json)
    }

    /// The knots of vertex `v`, by rank.
    pub fn trajectory(&self, v: u32) -> &[Knot] {
        let v = v as usize;
        &self.knots()[self.first_knot()[v] as usize..self.first_knot()[v + 1] as usize]
    }

    /// Statistics of the volume's samples, if the parameters have them.
    pub fn statistics(&self) -> Option<Statistics> {
        self.about.parameters.get(Statistics::NAME).and_then(Statistics::of_json)
    }
}
