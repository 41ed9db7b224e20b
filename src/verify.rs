//! Verification of a spectrum against its volume: is the mesh at an isovalue the isosurface?
//!
//! Isovalues are random, just before and just after events, and numbers next to the values of samples and events. At each, the topology and geometry of the mesh are
//! computed from its triangle list alone, and those of the isosurface from the samples alone
//! ([`crate::extract::count`](mod@crate::extract::count)), independently of the sweep.
//!
//! Measured: components and Euler characteristic on both sides; whether the mesh is a closed oriented
//! 2-manifold; triangles that cross; distances of vertices, of barycentres, and of the isosurface
//! from the mesh; radius ratios; jumps of the mesh across events and where most triangles are
//! born or die; and, from the spectrum alone, the shares of vertices that stay in the mesh from one isovalue to
//! the next and of triangles that survive events.

mod coherence;
mod confidence;
mod distribution;
mod findings;
mod geometry;
mod isovalues;
mod jump;
mod manifold;
mod measure;
mod meshes;
mod promise;
mod ray;
mod report;
mod run;
mod triangle_grid;
mod vertex_set;

use std::sync::Arc;

use serde::Serialize;

use crate::error::{Error, Result};
use crate::file::SpectrumFile;
use crate::numbers::exact;
use crate::progress::Progress;
use crate::spectrum::{Query, Spectrum};
use crate::volume::{Placement, Volume, between};

pub use coherence::{Coherence, EventCoherence};
pub use distribution::Summary;
pub use findings::{Continuity, Row, Totals};
pub use isovalues::Sampling;
pub use jump::Jump;
pub use manifold::{MeshTopology, mesh_topology};
pub use promise::{Limits, Promise};
pub use report::{Remedy, Report};

use isovalues::Draw;
use measure::Geometry;
use meshes::Meshes;
use run::measured;

/// The distance in voxels from a point of the voxel frame to the isosurface of an isovalue: along a unit normal,
/// along the gradient, or by descent, whichever is shortest. NaN if none of these meets it within 4
/// voxels and the volume.
pub fn distance(volume: &Volume, isovalue: f64, point: [f32; 3], normal: [f32; 3]) -> f64 {
    let [point, normal] = [point, normal].map(|v| v.map(f64::from));
    match ray::distance_near(volume, isovalue, point, Some(normal), measure::MAX_DISTANCE) {
        ray::Hit::At(distance) => distance,
        ray::Hit::Nothing | ray::Hit::Border => f64::NAN,
    }
}

/// Verifies a spectrum against the volume it was computed from.
///
/// ```
/// use isospectrum::verify::{Limits, Sampling, verify};
/// use isospectrum::{Backend, Choice};
/// use isospectrum::{Parameters, Silent, compute, volume::phantom};
///
/// let volume = std::sync::Arc::new(phantom("sphere:16")?);
/// let backend = Backend::choose(Choice::Cpu, None)?;
/// let spectrum = compute(&volume, &Parameters::default(), &backend, &Silent)?;
/// let sampling = Sampling { n_random: 8, ..Sampling::default() };
/// let report = verify(&spectrum, &volume, sampling, Limits::default(), &Silent)?;
/// assert!(report.passed, "{:?}", report.failures);
/// # Ok::<(), isospectrum::Error>(())
/// ```
///
/// # Errors
///
/// [`Error::Input`] if the volume is not the spectrum's, [`Error::Usage`] for too many isovalues,
/// [`Error::Interrupted`] if `progress` is cancelled. A spectrum that fails is not an error: see [`Report::passed`].
pub fn verify(
    spectrum: &Spectrum,
    volume: &Volume,
    sampling: Sampling,
    limits: Limits,
    progress: &dyn Progress,
) -> Result<Report> {
    sampling.check()?;
    check_same_volume(spectrum, volume)?;
    let meshes = Meshes::in_memory(spectrum);
    Ok(measured(meshes, volume, (sampling, Draw::Random), limits, progress)?.0)
}

/// Verifies the spectrum of a file, as [`verify`], but reads one chunk after the other: only those of one isovalue are in memory.
///
/// # Errors
///
/// As [`verify`]; [`Error::Input`] if a chunk is damaged.
pub fn verify_file(
    file: &Arc<SpectrumFile>,
    volume: &Volume,
    sampling: Sampling,
    limits: Limits,
    progress: &dyn Progress,
) -> Result<Report> {
    sampling.check()?;
    check_same_volume(file.description(), volume)?;
    let meshes = Meshes::of_file(file.clone());
    Ok(measured(meshes, volume, (sampling, Draw::Random), limits, progress)?.0)
}

/// The result of [`check`].
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Check {
    /// One sentence for each promise that does not hold: those that [`verify`] names for the same isovalues.
    pub broken: Vec<String>,
    /// One sentence for each promise that holds at these isovalues, but may not hold at those of another verification.
    pub uncertain: Vec<String>,
    /// What helps.
    pub remedy: Remedy,
}

impl Check {
    /// Names the promises that do not hold or may not hold; `None` if there are none.
    pub fn summary(&self) -> Option<String> {
        let list = |what, promises: &[String]| {
            (!promises.is_empty()).then(|| format!("{what}: {}", promises.join("; ")))
        };
        let broken = list("does not keep its promises", &self.broken);
        let uncertain = list("may not keep its promises at other isovalues", &self.uncertain);
        let all: Vec<String> = broken.into_iter().chain(uncertain).collect();
        (!all.is_empty()).then(|| all.join("; "))
    }
}

/// Verifies a spectrum that has just been computed, in a time that a computation can afford: as [`verify`] with default parameters up to 20^3
/// samples, and at fewer isovalues above. Promises that another choice of isovalues may break are found, too: in a small volume, by
/// more isovalues.
///
/// # Errors
///
/// [`Error::Input`] if the volume is not the spectrum's, [`Error::Interrupted`] if `progress` is cancelled.
pub fn check(spectrum: &Spectrum, volume: &Volume, progress: &dyn Progress) -> Result<Check> {
    check_same_volume(spectrum, volume)?;
    let limits = Limits::default();
    let sampling = (Sampling::affordable(volume), Draw::Random);
    let meshes = Meshes::in_memory(spectrum);
    let (report, mut tallies) = measured(meshes, volume, sampling, limits, progress)?;
    let mut reports = vec![report];
    if let Some(sampling) = Sampling::second(volume, tallies.are_doubtful(&reports[0])) {
        let second = (sampling, Draw::Spread);
        let meshes = Meshes::in_memory(spectrum);
        let (report, more) = measured(meshes, volume, second, limits, progress)?;
        tallies.append(more);
        reports.push(report);
    }
    let remedy = reports.iter().map(|report| report.remedy(volume)).min().unwrap_or(Remedy::None);
    let (broken, uncertain) = confidence::judge(&reports, &tallies);
    Ok(Check { broken, uncertain, remedy })
}

/// The result of [`spot_check`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
#[non_exhaustive]
pub struct SpotCheck {
    /// Number of isovalues, in the middle of equal parts of the range.
    pub n_isovalues: usize,
    /// Share of the triangles' barycentres within the tolerance of the isosurface, of at most 20,000 at each isovalue; `None` without
    /// triangles.
    pub within_tolerance_share: Option<f64>,
    /// Mean radius ratio of these triangles.
    pub radius_ratio: Option<f64>,
}

/// Measures a spectrum against its volume at a few isovalues in equal distances, much faster than [`verify`]. Half of the isovalues of
/// `verify` are near those of samples instead, where the mesh may be worse.
///
/// # Errors
///
/// [`Error::Input`] if the volume is not the spectrum's.
pub fn spot_check(spectrum: &Spectrum, volume: &Volume, n_isovalues: usize) -> Result<SpotCheck> {
    check_same_volume(spectrum, volume)?;
    let mut query = Query::for_some(spectrum, n_isovalues);
    let mut pooled = Geometry::new();
    for i in 0..n_isovalues {
        let share = (i as f64 + 0.5) / n_isovalues as f64;
        let isovalue = between(spectrum.range(), share);
        let mesh = query.mesh_at(isovalue)?;
        if measure::is_placed(volume, &mesh) {
            pooled.merge(&measure::spot_check(volume, isovalue, &mesh));
        }
    }
    Ok(SpotCheck {
        n_isovalues,
        within_tolerance_share: pooled.barycentre_deviation.share_within(spectrum.tolerance()),
        radius_ratio: pooled.radius_ratio.summary().mean,
    })
}

fn check_same_volume(spectrum: &Spectrum, volume: &Volume) -> Result<()> {
    let text = |dims: [usize; 3]| format!("{}x{}x{}", dims[0], dims[1], dims[2]);
    let of = spectrum.volume();
    if of.dims != volume.dims() {
        return Err(Error::input(format!(
            "{}: {} samples, expected {} as the spectrum of {} has",
            volume.name(),
            text(volume.dims()),
            text(of.dims),
            of.name
        )));
    }
    if of.range != volume.range() {
        return Err(Error::input(format!(
            "{}: samples from {} to {}, expected {} to {} as the spectrum of {} has",
            volume.name(),
            exact(volume.range().0),
            exact(volume.range().1),
            exact(of.range.0),
            exact(of.range.1),
            of.name
        )));
    }
    // Positions are in the voxel frame, whose cells follow from the spacing.
    let [expected, found] = [&of.placement, volume.placement()].map(Placement::cell_size);
    if expected != found {
        return Err(Error::input(format!(
            "{}: cells of {found:?} voxels, expected {expected:?} as the spectrum of {} has",
            volume.name(),
            of.name
        )));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::file::{from_bytes, to_bytes_in_chunks_of};
    use crate::kernels::{Backend, Choice};
    use crate::progress::Silent;
    use crate::sweep::{Parameters, compute};
    use crate::volume::phantom;

    #[test]
    fn the_report_of_a_file_in_many_chunks_is_that_of_the_spectrum_in_memory() {
        let volume = Arc::new(phantom("blobs:12").expect("a phantom"));
        let backend = Backend::choose(Choice::Cpu, None).expect("the CPU");
        let spectrum = compute(&volume, &Parameters::default(), &backend, &Silent).expect("one");
        let bytes = to_bytes_in_chunks_of(500, spectrum.quantised());
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("s.isp");
        std::fs::write(&path, &bytes).expect("writable");
        let file = Arc::new(SpectrumFile::open(&path).expect("just written"));
        let (most, all) = (file.most_at_once(), file.size().triangles);
        assert!(most < all, "{most} of {all} triangles at once");
        let whole = from_bytes(&bytes).expect("just written");
        for (n_random, n_events) in [(8, 4), (0, 3), (5, 0), (0, 0)] {
            let sampling = Sampling { n_random, n_events, ..Sampling::default() };
            let limits = Limits::default();
            let found = verify_file(&file, &volume, sampling, limits, &Silent).expect("the volume");
            let expected = verify(&whole, &volume, sampling, limits, &Silent).expect("the volume");
            assert_eq!(found, expected, "{n_random} isovalues, {n_events} events");
        }
    }
}
