//! Simplifies a volume by persistence before the sweep: no extremum of a persistence below P is left.
//!
//! # Theory
//!
//! Each minimum of the field is born with a component of {f <= c} and is paired with the saddle at
//! which that component meets an older one; the difference of the two values is the *persistence*
//! of the pair (Edelsbrunner, Letscher, Zomorodian 2002); the same holds for maxima in -f. Changing
//! samples by at most P changes the persistence of a pair by at most 2 P (stability, Cohen-Steiner,
//! Edelsbrunner, Harer 2007): pairs of a persistence above 2 P remain.
//!
//! First the field is smoothed close to the given one (`smooth`), which removes most critical points of noise, also those of
//! handles. Each remaining extremum of a persistence below P is filled (or carved) half-way to its saddle, and the path out is
//! cut to the same height (`drain`). Remaining rims are smoothed without new extrema (`relax`). Finally the exact topology of
//! the trilinear field is computed, and pairs below P are drained until there are none.
//!
//! Smoothing moves a sample by up to 1.5 P. A limit of P would leave spikes where noise is as large as that, with saddles
//! around each (twice as many critical points on tooth and bonsai). There is no proven bound on the total change: an extremum
//! of a persistence p or its saddle must move by p / 2, which may come on top; and saddles of the trilinear field are inside
//! faces and cells, below the samples around them, so draining one of a persistence below P may need more than P / 2. The
//! largest change is measured and reported: 2.3 P on the scans tried, 4.3 P on small volumes of noise. No pair above twice the largest change is lost.
//!
//! Figures (critical points before and after): see docs/decisions/0006-noise.md.
//!
//! # Invariants
//!
//! No extremum of a persistence below P is left; otherwise [`simplified`] fails. The result does not depend on the number
//! of threads. Everything downstream is exact with respect to the simplified volume, not to the original one. Memory:
//! 10 bytes per sample in addition to the volumes and the topology.

mod drain;
mod lattice;
mod relax;
mod smooth;

use serde::Serialize;

use super::compute::Topology;
use super::critical::GridElement;
use super::event::EventKind;
use super::exact::ExactField;
use crate::error::{Error, Result};
use crate::numbers::exact;
use crate::volume::{Samples, Volume, with_samples};
use drain::drain_minima;
use lattice::{Grain, Lattice};
use relax::{RelaxParameters, relax};
use smooth::smooth;

/// Iterations of `relax` after the first round of draining, and after the second. More gain little (15 and 5: 1 % of the
/// handles of bonsai).
const RELAX_ITERATIONS: [usize; 2] = [3, 2];

/// Most rounds of draining. Volumes tried need up to 20.
const MAX_ROUNDS: usize = 1000;

/// Least range of the samples, in grains: of fewer the rounding to the grain would leave no field.
const MIN_GRAINS: f64 = 16.0;

/// Version of the method, which a spectrum stores: another version gives another volume.
pub const METHOD: u32 = 3;

/// The report of [`simplify`].
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Simplification {
    /// [`METHOD`].
    pub method: u32,
    /// P, in units of the volume: no pair of extremum and saddle of a smaller persistence is left.
    pub persistence: f64,
    /// The largest change of a sample.
    pub largest_change: f64,
    /// The mean change of a sample.
    pub mean_change: f64,
    /// Critical points of the given volume.
    pub before: Census,
    /// Critical points of the simplified volume.
    pub after: Census,
}

/// Numbers of critical points of a field.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Census {
    /// All of them.
    pub critical_points: usize,
    /// Minima paired with a saddle less than P above.
    pub minima_below: usize,
    /// Maxima paired with a saddle less than P below.
    pub maxima_below: usize,
    /// All minima.
    pub minima: usize,
    /// All maxima.
    pub maxima: usize,
    /// Handles that open (the same number closes).
    pub handles: usize,
}

impl Census {
    /// Counts the critical points of a volume and its pairs of a persistence below `persistence`.
    ///
    /// # Errors
    ///
    /// As [`Topology::compute`].
    pub fn of(volume: &Volume, persistence: f64) -> Result<Self> {
        Ok(Census::count(&Topology::compute(&ExactField::new(volume)?)?, persistence))
    }

    fn count(topology: &Topology, persistence: f64) -> Self {
        let pairs = topology.extremum_pairs();
        let below = |kind| {
            let is_kind = |e: u32| topology.events[e as usize].kind == kind;
            pairs.iter().filter(|p| p.persistence < persistence && is_kind(p.extremum)).count()
        };
        let count = |kind| topology.events.iter().filter(|e| e.kind == kind).count();
        Census {
            critical_points: topology.events.len(),
            minima_below: below(EventKind::Emerge),
            maxima_below: below(EventKind::Vanish),
            minima: count(EventKind::Emerge),
            maxima: count(EventKind::Vanish),
            handles: count(EventKind::HandleOpen),
        }
    }
}

/// Removes all pairs of a persistence below `persistence` (units of the volume), and reports the changes.
/// Samples of the new volume are float64.
///
/// # Errors
///
/// [`Error::Usage`] if `persistence` is not above 0 and below half of the volume's range, the
/// errors of [`Topology::compute`], and [`Error::Internal`] if extrema below `persistence` are left.
pub fn simplify(volume: &Volume, persistence: f64) -> Result<(Volume, Simplification)> {
    let (simplified, after) = simplify_counted(volume, persistence)?;
    let n = volume.samples().len();
    let change = |i| (simplified.samples().get(i) - volume.samples().get(i)).abs();
    let changes = || (0..n).map(change);
    let report = Simplification {
        method: METHOD,
        persistence,
        largest_change: changes().fold(0.0, f64::max),
        mean_change: changes().sum::<f64>() / n as f64,
        before: Census::of(volume, persistence)?,
        after,
    };
    Ok((simplified, report))
}

/// The volume of [`simplify`], without the report.
///
/// # Errors
///
/// As [`simplify`].
pub fn simplified(volume: &Volume, persistence: f64) -> Result<Volume> {
    Ok(simplify_counted(volume, persistence)?.0)
}

/// The simplified volume and its critical points.
fn simplify_counted(volume: &Volume, persistence: f64) -> Result<(Volume, Census)> {
    let (low, high) = volume.range();
    let half = 0.5 * (high - low);
    if !(persistence > 0.0 && persistence < half) {
        return Err(Error::Usage(format!(
            "persistence {persistence}, expected above 0 and below half of the volume's range, {half}"
        )));
    }
    let grain = Grain::of_range((low, high));
    if high - low < MIN_GRAINS * grain.size {
        return Err(Error::input(format!(
            "{}: samples from {} to {}, expected a range of at least {:e} for the removal of noise",
            volume.name(),
            exact(low),
            exact(high),
            MIN_GRAINS * grain.size
        )));
    }
    let mut lattice = Lattice::of(volume, grain);
    let mut iterations = RELAX_ITERATIONS.into_iter();
    with_samples!(volume.samples(), given => smooth(&mut lattice, given, persistence));
    let mut marked: [Vec<usize>; 2] = Default::default();
    for _ in 0..MAX_ROUNDS {
        let n_removed = drain(&mut lattice, persistence, &marked);
        if n_removed > 0 {
            if let Some(iterations) = iterations.next() {
                let relaxation = RelaxParameters { radius: persistence, iterations };
                with_samples!(volume.samples(), given => relax(&mut lattice, given, relaxation));
            }
            continue;
        }
        let samples = Samples::from(lattice.into_samples());
        let simplified = volume.with_samples(samples)?;
        let census;
        (census, marked) = remaining_extrema(&simplified, persistence)?;
        if marked.iter().all(Vec::is_empty) {
            return Ok((simplified, census));
        }
        lattice = Lattice::of(&simplified, grain);
    }
    Err(Error::internal(format!("extrema of a persistence below {persistence} are left")))
}

/// Removes minima, then maxima, that are shallower than `depth` or marked. Returns their number.
fn drain(lattice: &mut Lattice, depth: f64, marked: &[Vec<usize>; 2]) -> usize {
    let n_minima = drain_minima(lattice, depth, &marked[0]);
    lattice.negate();
    let n_maxima = drain_minima(lattice, depth, &marked[1]);
    lattice.negate();
    n_minima + n_maxima
}

/// The critical points of a volume, and the samples of its minima and of its maxima of a persistence below
/// `persistence`, ascending.
fn remaining_extrema(volume: &Volume, persistence: f64) -> Result<(Census, [Vec<usize>; 2])> {
    let field = ExactField::new(volume)?;
    let topology = Topology::compute(&field)?;
    let [nx, ny, _] = volume.dims();
    let mut found: [Vec<usize>; 2] = Default::default();
    for pair in topology.extremum_pairs().iter().filter(|pair| pair.persistence < persistence) {
        let event = &topology.events[pair.extremum as usize];
        if let GridElement::Vertex(vertex) = event.element {
            let [x, y, z] = field.position(vertex).map(|p| p as usize);
            found[usize::from(event.kind == EventKind::Vanish)].push(x + nx * (y + ny * z));
        }
    }
    found.iter_mut().for_each(|samples| samples.sort_unstable());
    Ok((Census::count(&topology, persistence), found))
}
