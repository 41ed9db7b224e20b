//! Forecast of the size of a spectrum and of the memory of its computation.
//!
//! # Theory
//!
//! A spectrum consists of the triangles of the tracked surface and those of exact cells. The tracked ones are proportional to the
//! area of the isosurface, for which the lattice edges that it crosses are counted at a few isovalues; their number grows with a
//! power of the tolerance. The exact ones come with the events, including those of tied samples, and with the intervals between the
//! values of a cell's corners, in each of which the cell has other triangles.
//!
//! # Accuracy
//!
//! The constants are fitted to spectra of an earlier version of the sweep, so that the ratio of forecast to truth is near 1 on
//! average: 2.2 nucleon, 0.9 fuel, 0.9 hydrogen of 128^3, 0.6 and 0.9 lobster smoothed by 1 and 2 voxels, 0.7 lobster,
//! 1.0 tooth, 0.9 flair, 1.5 aneurism, 0.8 HeadMRVolume, 1.1 engine, 0.9 bonsai (0.8 with an error of 0.4), 3.1 gyroid:48, 1.1 noise:32, and
//! 0.3 marschner_lobb, whose whole surface changes with each grey level. That is a factor of about two either way.
//! `compute --json` prints the forecast with the actual numbers, for fitting the constants again when the sweep changes.
//!
//! The constants of memory are fitted to 36 peaks on two threads, so that the forecast is rather too high: it is 0.86 to 2.8 times the
//! peak, half of them below 1.3. Measured with this version, 24 to 710 MB: phantoms of 12 to 96 samples along a side (0.9 to 2.7),
//! `nucleon` 1.8, `fuel` 1.1, `hydrogen_orbital` 1.1, `lobster` 30:60 1.9, `tooth` 90:130 0.9, `HeadMRVolume` 1.3, EMD-3197 1.0. Figures of
//! decisions 0007 to 0017, of earlier versions, 0.5 to 4.6 GB: `hydrogen` 0.9, `lobster` 1.2, `aneurism` 1.2, `bonsai` 40:255 1.8 and 60:80
//! 2.8, `tooth` 2.6, `flair` 2.5, `engine` 2.6. `marschner_lobb` was left out: its forecast is 0.3 of the peak.

use rayon::prelude::*;
use serde::Serialize;

use crate::error::Result;
use crate::topology::Topology;
use crate::topology::exact::ExactField;
use crate::volume::Volume;

/// Isovalues at which the isosurface is counted.
const N_ISOVALUES: usize = 16;

/// Triangles of a spectrum per lattice edge that the isosurface crosses on average.
const TRIANGLES_PER_CROSSING: f64 = 45.0;

/// Triangles per event.
const TRIANGLES_PER_EVENT: f64 = 15.0;

/// Triangles per interval between two values of a cell's corners.
const TRIANGLES_PER_INTERVAL: f64 = 0.6;

/// Events per crossed edge above which noise dominates the size of a spectrum (scans 0.5 to 12, smooth fields 0.001 to 0.1).
const EVENTS_PER_CROSSING: f64 = 0.125;

/// Tolerance for which the constants are fitted, voxels.
const FITTED_ERROR: f64 = 0.1;

/// Power of the ratio of tolerances by which the number of tracked triangles grows.
const ERROR_POWER: f64 = 0.5;

/// Memory of the program before it computes, bytes.
pub(crate) const PROGRAM_BYTES: f64 = 24e6;

/// Memory for computing a spectrum, bytes per sample of the volume.
const BYTES_PER_SAMPLE: f64 = 40.0;

/// Memory per lattice edge that the isosurface crosses on average, bytes; it grows with the tolerance as triangles do.
const BYTES_PER_CROSSING: f64 = 2800.0;

/// Memory per geometric mean of crossings and events, bytes: near an event the mesh is exact, and is exchanged for it.
const BYTES_PER_BUSY_CROSSING: f64 = 34_000.0;

/// Events per crossing beyond which more of them make no more of the mesh exact.
const MAX_EVENTS_PER_CROSSING: f64 = 0.2;

/// Memory per event, bytes.
const BYTES_PER_EVENT: f64 = 4000.0;

/// Memory per interval between two values of a cell's corners, bytes.
const BYTES_PER_INTERVAL: f64 = 98.0;

/// Expected size of a spectrum.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Forecast {
    /// Events within the range of isovalues, including those of tied samples.
    pub events: usize,
    /// Lattice edges that the isosurface crosses, mean over the range.
    pub crossings: f64,
    /// Intervals between the values of a cell's corners within the range, sum over all cells.
    pub intervals: u64,
    /// Triangles of the spectrum.
    pub triangles: f64,
    /// Peak memory of the program during the computation, bytes.
    pub memory: f64,
}

impl Forecast {
    /// Forecast for a volume, a range of isovalues and the tolerance `error` in voxels. Takes about as long as the first steps of
    /// the sweep.
    ///
    /// ```
    /// use isospectrum::{Forecast, volume::phantom};
    ///
    /// let volume = phantom("sphere:16")?;
    /// let [coarse, fine] = [0.2, 0.05].map(|error| Forecast::of_volume(&volume, volume.range(), error));
    /// assert!(coarse?.triangles < fine?.triangles);
    /// # Ok::<(), isospectrum::Error>(())
    /// ```
    ///
    /// # Errors
    ///
    /// Those of computing its topology: [`Error::Input`](crate::Error::Input), [`Error::Internal`](crate::Error::Internal).
    pub fn of_volume(volume: &Volume, range: (f64, f64), error: f64) -> Result<Self> {
        let field = ExactField::new(volume)?;
        Ok(Forecast::of(&field, &Topology::compute(&field)?, range, error))
    }

    /// As [`Forecast::of_volume`], for a field whose topology is known.
    pub(crate) fn of(
        field: &ExactField<'_>,
        topology: &Topology,
        (low, high): (f64, f64),
        error: f64,
    ) -> Self {
        let is_inside = |isovalue: f64| (low..=high).contains(&isovalue);
        let events = topology.events.iter().filter(|e| is_inside(e.isovalue)).count();
        Self::with_events(field, events, (low, high), error)
    }

    /// As [`Forecast::of`], for a known number of events within the range.
    pub(crate) fn with_events(
        field: &ExactField<'_>,
        events: usize,
        (low, high): (f64, f64),
        error: f64,
    ) -> Self {
        let step = (high - low) / N_ISOVALUES as f64;
        let isovalue = |i: usize| low + (i as f64 + 0.5) * step;
        let isovalues: Vec<f64> = (0..N_ISOVALUES).map(isovalue).collect();
        let crossings = crossings(field, &isovalues, true).iter().sum::<u64>();
        let crossings = crossings as f64 / N_ISOVALUES as f64;
        let intervals = intervals(field, (low, high));
        let finer = (FITTED_ERROR / error).powf(ERROR_POWER);
        let exact = TRIANGLES_PER_EVENT * events as f64 + TRIANGLES_PER_INTERVAL * intervals as f64;
        let triangles = finer * TRIANGLES_PER_CROSSING * crossings + exact;
        let samples = field.n_vertices() as f64;
        Forecast {
            events,
            crossings,
            intervals,
            triangles,
            memory: PROGRAM_BYTES
                + BYTES_PER_SAMPLE * samples
                + mesh_memory(finer * crossings, events as f64, intervals as f64),
        }
    }

    /// Lower bound of the memory for computing the spectrum of a volume of `dims` samples, bytes.
    pub fn least_memory(dims: [usize; 3]) -> f64 {
        BYTES_PER_SAMPLE * dims.map(|n| n as f64).iter().product::<f64>()
    }

    /// True if events dominate the size, so that removing noise reduces it most.
    pub fn is_mostly_events(&self) -> bool {
        EVENTS_PER_CROSSING * self.crossings < self.events as f64
    }
}

/// Memory of the triangles, bytes.
fn mesh_memory(crossings: f64, events: f64, intervals: f64) -> f64 {
    let busy = (crossings * events.min(MAX_EVENTS_PER_CROSSING * crossings)).sqrt();
    BYTES_PER_CROSSING * crossings
        + BYTES_PER_BUSY_CROSSING * busy
        + BYTES_PER_EVENT * events
        + BYTES_PER_INTERVAL * intervals
}

/// The number of lattice edges that the isosurface crosses at each of some ascending isovalues, with or without those between the
/// volume and the layer around it.
pub(crate) fn crossings(field: &ExactField<'_>, isovalues: &[f64], with_layer: bool) -> Vec<u64> {
    if isovalues.is_empty() {
        return Vec::new();
    }
    let margin = usize::from(!with_layer);
    let [nx, ny, nz] = field.dims();
    let levels: Vec<i64> = isovalues.iter().map(|&c| field.isovalue_level(c)).collect();
    // The number of isovalues below each sample of a plane.
    let plane = |z: usize| -> Vec<u32> {
        let row = |y: usize| {
            let first = nx * (y + ny * z);
            first + margin..first + nx - margin
        };
        let samples = (margin..ny - margin).flat_map(row).map(|v| field.level(v as u32));
        samples.map(|level| levels.partition_point(|&l| l < level) as u32).collect()
    };
    // By number of isovalues: how many more edges are crossed from there on.
    let of_plane = |mut changes: Vec<i64>, z: usize| {
        let mut add = |a: u32, b: u32| {
            changes[a.min(b) as usize] += 1;
            changes[a.max(b) as usize] -= 1;
        };
        let (own, width) = (plane(z), nx - 2 * margin);
        own.chunks_exact(width).for_each(|row| row.windows(2).for_each(|w| add(w[0], w[1])));
        own.iter().zip(&own[width..]).for_each(|(&a, &b)| add(a, b));
        if z + 1 < nz - margin {
            own.iter().zip(plane(z + 1)).for_each(|(&a, b)| add(a, b));
        }
        changes
    };
    let none = || vec![0i64; isovalues.len() + 1];
    let sum = |mut a: Vec<i64>, b: Vec<i64>| {
        a.iter_mut().zip(b).for_each(|(a, b)| *a += b);
        a
    };
    let changes = (margin..nz - margin).into_par_iter().fold(none, of_plane).reduce(none, sum);
    let counts = changes.iter().scan(0i64, |n, change| {
        *n += change;
        Some(*n as u64)
    });
    counts.take(isovalues.len()).collect()
}

/// Number of intervals into which the values of a cell's corners cut the range, sum over all cells: within one, the triangles of an
/// exact cell do not change.
fn intervals(field: &ExactField<'_>, (low, high): (f64, f64)) -> u64 {
    let [nx, ny, nz] = field.dims();
    let (low, high) = (field.isovalue_level(low), field.isovalue_level(high));
    let offsets = field.cell_offsets();
    let of_cell = |corner: usize| {
        let mut levels = field.levels_at(corner as u32, offsets).map(|l| l.clamp(low, high));
        levels.sort_unstable();
        levels.windows(2).filter(|pair| pair[0] < pair[1]).count() as u64
    };
    let of_row = |y: usize, z: usize| {
        let first = nx * (y + ny * z);
        (first..first + nx - 1).map(of_cell).sum::<u64>()
    };
    let planes = (0..nz - 1).into_par_iter();
    planes.map(|z| (0..ny - 1).map(|y| of_row(y, z)).sum::<u64>()).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::volume::{Placement, Samples, phantom};

    fn forecast(volume: &Volume, range: (f64, f64), error: f64) -> Forecast {
        let field = ExactField::new(volume).expect("a field");
        let topology = Topology::compute(&field).expect("a topology");
        Forecast::of(&field, &topology, range, error)
    }

    #[test]
    fn a_cell_has_one_interval_between_each_two_values_of_its_corners() {
        let samples = Samples::U8(vec![0, 1, 2, 3, 4, 5, 6, 7]);
        let volume =
            Volume::new("cell", [2; 3], samples, Placement::default()).expect("a valid volume");
        let field = ExactField::new(&volume).expect("a field");
        // The layer lies below the range, so it counts as 0. Cells with one sample at their corners
        // have one interval, all but that of sample 0; with two samples two, but for the three that
        // sample 0 is one of; with four samples four, or three; the cell itself seven.
        let expected = 7 + (9 * 2 + 3) + (3 * 4 + 3 * 3) + 7;
        assert_eq!(intervals(&field, (0.0, 7.0)), expected);
        assert_eq!(intervals(&field, (7.0, 7.0)), 0);
    }

    #[test]
    fn noise_and_smaller_tolerances_make_more_triangles() {
        let sphere = phantom("sphere:12").expect("a phantom");
        // The upper bits of a hash.
        let bits = |i: u32| i.wrapping_mul(2_654_435_761).wrapping_mul(i | 1) >> 16;
        let samples = Samples::U16((0..1728).map(|i| bits(i) as u16).collect());
        let noise = Volume::new("noise", [12; 3], samples, Placement::default()).expect("noise");
        let of_noise = forecast(&noise, noise.range(), 0.1);
        let of_sphere = forecast(&sphere, sphere.range(), 0.1);
        assert!(of_noise.triangles > of_sphere.triangles);
        assert!(of_noise.is_mostly_events() && !of_sphere.is_mostly_events());
        assert!(forecast(&sphere, sphere.range(), 0.05).triangles > of_sphere.triangles);
        let (low, high) = noise.range();
        let half = forecast(&noise, (low, 0.5 * (low + high)), 0.1);
        assert!(half.events < of_noise.events && half.intervals < of_noise.intervals);
    }
}
