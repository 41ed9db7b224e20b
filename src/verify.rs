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
mod promise;
mod ray;
mod report;
mod triangle_grid;

use serde::Serialize;

use crate::error::{Error, Result};
use crate::extract::count::count;
use crate::numbers::exact;
use crate::progress::Progress;
use crate::random::Random;
use crate::spectrum::{Mesh, Query, Spectrum};
use crate::topology::exact::ExactField;
use crate::volume::{Placement, Volume, between};

pub use coherence::{Coherence, EventCoherence};
pub use distribution::Summary;
pub use findings::{Continuity, Row, Totals};
pub use isovalues::Sampling;
pub use jump::Jump;
pub use manifold::{MeshTopology, mesh_topology};
pub use promise::{Limits, Promise};
pub use report::{Remedy, Report};

use confidence::{Tallies, Tally};
use distribution::Distribution;
use isovalues::{Draw, event_isovalues, neighbours, random_isovalues, spread_isovalues};
use measure::Geometry;
use promise::Bounds;
use triangle_grid::TriangleGrid;

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
    Ok(measured_at(spectrum, volume, (sampling, Draw::Random), limits, progress)?.0)
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
    let limits = Limits::default();
    let sampling = (Sampling::affordable(volume), Draw::Random);
    let (report, mut tallies) = measured_at(spectrum, volume, sampling, limits, progress)?;
    let mut reports = vec![report];
    if let Some(sampling) = Sampling::second(volume, tallies.are_doubtful(&reports[0])) {
        let second = (sampling, Draw::Spread);
        let (report, more) = measured_at(spectrum, volume, second, limits, progress)?;
        tallies.append(more);
        reports.push(report);
    }
    let remedy = reports.iter().map(|report| report.remedy(volume)).min().unwrap_or(Remedy::None);
    let (broken, uncertain) = confidence::judge(&reports, &tallies);
    Ok(Check { broken, uncertain, remedy })
}

/// Measures a spectrum at the isovalues of one verification. Returns also what of each promise is beyond its limit where.
fn measured_at(
    spectrum: &Spectrum,
    volume: &Volume,
    (sampling, draw): (Sampling, Draw),
    limits: Limits,
    progress: &dyn Progress,
) -> Result<(Report, Tallies)> {
    check_same_volume(spectrum, volume)?;
    let field = ExactField::new(volume)?;
    let mut random = Random::new(sampling.seed);
    let single = match draw {
        Draw::Random => random_isovalues,
        Draw::Spread => spread_isovalues,
    }(volume, spectrum.range(), sampling.n_random, &mut random);
    let pairs =
        event_isovalues(spectrum.events(), spectrum.range(), sampling.n_events, &mut random);
    let elsewhere = coherence::busiest_elsewhere(spectrum, sampling.n_events);
    let neighbours = neighbours(volume, spectrum, sampling.n_events, &mut random);
    let n_all =
        (single.len() + 2 * (pairs.len() + elsewhere.len()) + neighbours.len()).max(1) as f64;

    let mut pooled = Geometry::new();
    let mut rows = Vec::new();
    let bounds = Bounds::new(&limits, spectrum.tolerance());
    let mut tallies = Tallies::new(bounds);
    let mut query = Query::new(spectrum);
    let mut mesh_at = |isovalue: f64, n_done: usize| -> Result<Mesh> {
        progress.report(n_done as f64 / n_all, "verifying");
        if progress.cancelled() {
            return Err(Error::Interrupted);
        }
        query.mesh_at(isovalue)
    };
    let mut measure_at = |isovalue: f64, at_event: bool| -> Result<Mesh> {
        let mesh = mesh_at(isovalue, rows.len())?;
        // Topology is found on one thread, geometry on all.
        let (mut row, measured) = rayon::join(
            || topology_row(&field, isovalue, at_event, &mesh),
            || measured(field.volume(), isovalue, &mesh, sampling.max_measured),
        );
        if let Some((self_intersecting, geometry)) = measured {
            row.self_intersecting = self_intersecting;
            row.barycentre_deviation = geometry.barycentre_deviation.summary();
            row.radius_ratio = geometry.radius_ratio.summary();
            tallies.add_crossing(self_intersecting, mesh.triangles.len());
            if !at_event {
                tallies.add(&geometry);
                pooled.merge(&geometry);
            }
        }
        rows.push(row);
        Ok(mesh)
    };
    for &isovalue in &single {
        measure_at(isovalue, false)?;
    }
    let mut jumps_at = |pairs: &[(f64, f64)]| -> Result<(Vec<Jump>, Summary, Vec<Tally>)> {
        let mut beyond = Distribution::new(measure::MAX_DISTANCE);
        let mut jumps = Vec::with_capacity(pairs.len());
        let mut counts = Vec::with_capacity(pairs.len());
        for &(before, after) in pairs {
            let (a, b) = (measure_at(before, true)?, measure_at(after, true)?);
            let mut distances = Distribution::new(measure::MAX_DISTANCE);
            jumps.push(jump::jump(&field, (before, &a), (after, &b), &mut distances));
            counts.push(Tally::of(&distances, bounds.jump));
            beyond.merge(&distances);
        }
        Ok((jumps, beyond.summary(), counts))
    };
    let (at_events, beyond_at_events, _) = jumps_at(&pairs)?;
    let (elsewhere, beyond_elsewhere, counts) = jumps_at(&elsewhere)?;
    tallies.add_jumps(counts);
    for isovalue in neighbours {
        let mesh = mesh_at(isovalue, rows.len())?;
        let row = topology_row(&field, isovalue, true, &mesh);
        rows.push(Row { is_neighbour: true, ..row });
    }
    let continuity = Continuity {
        at_events,
        beyond_at_events,
        elsewhere,
        beyond_elsewhere,
        coherence: coherence::coherence(spectrum),
        tracked_share: tracked_share(spectrum, &single),
    };
    Ok((Report::new(spectrum, sampling, limits, rows, &pooled, continuity), tallies))
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

/// The topology at one isovalue.
fn topology_row(field: &ExactField<'_>, isovalue: f64, at_event: bool, mesh: &Mesh) -> Row {
    let (expected, topology) = rayon::join(
        || count(field, isovalue),
        || mesh_topology(mesh.positions.len(), &mesh.triangles),
    );
    Row {
        isovalue,
        at_event,
        is_neighbour: false,
        n_triangles: mesh.triangles.len(),
        expected_components: expected.len(),
        expected_euler: expected.iter().map(|component| component.euler).sum(),
        topology,
        finite: measure::is_placed(field.volume(), mesh),
        self_intersecting: 0,
        barycentre_deviation: Summary::default(),
        radius_ratio: Summary::default(),
    }
}

/// How many triangles cross others, and the geometry; nothing if the mesh is not inside the volume.
fn measured(volume: &Volume, isovalue: f64, mesh: &Mesh, most: usize) -> Option<(usize, Geometry)> {
    if !measure::is_placed(volume, mesh) {
        return None;
    }
    let grid = TriangleGrid::new(mesh);
    let geometry = measure::measure(volume, isovalue, mesh, &grid, most);
    Some((grid.self_intersecting().len(), geometry))
}

/// The share of the vertices in the meshes at some isovalues that are also in the mesh a 256th of
/// the range higher; `None` without vertices.
fn tracked_share(spectrum: &Spectrum, isovalues: &[f64]) -> Option<f64> {
    let step = (spectrum.range().1 - spectrum.range().0) / 256.0;
    let (mut alive, mut survived) = (0u64, 0u64);
    for &isovalue in isovalues.iter().filter(|&&c| c + step < spectrum.range().1) {
        let here = active_vertices(spectrum, isovalue);
        let there = active_vertices(spectrum, isovalue + step);
        alive += here.iter().filter(|&&active| active).count() as u64;
        survived += here.iter().zip(&there).filter(|&(&a, &b)| a && b).count() as u64;
    }
    (alive > 0).then(|| survived as f64 / alive as f64)
}

fn active_vertices(spectrum: &Spectrum, isovalue: f64) -> Vec<bool> {
    let after = spectrum.isovalues().partition_point(|&c| c <= isovalue);
    let mut active = vec![false; spectrum.n_vertices()];
    // Below the first isovalue of the table there is no mesh.
    if let Some(rank) = after.checked_sub(1) {
        let rank = rank as u32;
        for triangle in spectrum.triangles().iter().filter(|t| t.birth <= rank && rank < t.death) {
            triangle.vertices.iter().for_each(|&v| active[v as usize] = true);
        }
    }
    active
}
