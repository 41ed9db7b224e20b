//! Noise taken out of a volume before the sweep: no extremum of a persistence below a given one is left.
//!
//! # Theory
//!
//! Each minimum of the field is born with a component of {f <= c} and is paired with the saddle at
//! which that component meets an older one; the difference of the two values is the *persistence*
//! of the pair (Edelsbrunner, Letscher, Zomorodian 2002); maxima likewise in -f. Moving every
//! sample by at most P moves no pair by more than P (Cohen-Steiner, Edelsbrunner, Harer 2007): so
//! whatever is done within P, pairs of a persistence above 2 P stay, and only smaller ones can go.
//!
//! First the field becomes as smooth as it can near the given one (`smooth`): that takes away most of what noise
//! makes, handles included. Each extremum of a persistence below P that is left is
//! filled, or carved, half-way to its saddle, and the way out cut to the same height (`drain`), and what that leaves
//! of rims is smoothed in a way that makes no extremum (`relax`). In the end the exact topology of the trilinear field is
//! counted, and what it still pairs below P is drained, until there is none.
//!
//! Smoothing moves a sample by up to 1.5 P: within P it leaves spikes where noise is as large as that, with saddles around
//! each (twice as many critical points on tooth and bonsai). No bound on the change is certain: an extremum of a persistence p
//! must move by p / 2 or its saddle must, which may come on top; and saddles of the trilinear field lie inside faces and cells,
//! where extrema meet below the height that the samples around would have to reach, so draining one of a persistence below P may
//! take more than P / 2. The largest change is measured and reported: 2.3 P on the volumes tried. Of pairs
//! above twice the largest change none is lost.
//!
//! Figures (critical points before and after): see docs/decisions/0006-noise.md.
//!
//! # Invariants
//!
//! No extremum of a persistence below P is left: it is counted, or [`simplified`] fails. The same input gives the same
//! bytes with any number of threads. The result is a volume like any other: everything downstream is exact with regard to
//! it, and only to it. Memory: 10 bytes per sample beside the volumes and the topology.

mod drain;
mod lattice;
mod relax;
mod smooth;

use serde::Serialize;

use crate::error::{Error, Result};
use crate::topology::EventKind;
use crate::topology::Topology;
use crate::topology::critical::Place;
use crate::topology::exact::ExactField;
use crate::volume::with_samples;
use crate::volume::{Samples, Volume};
use drain::drain_minima;
use lattice::{Grain, Lattice};
use relax::{Relaxation, relax};
use smooth::smooth;

/// Iterations of smoothing after what was left has been drained for the first time; after the second. More of them take longer and
/// leave little less (15 and 5: 1 % of bonsai's handles).
const PASSES: [usize; 2] = [3, 2];

/// Most rounds of draining. Volumes tried take up to 20.
const ROUNDS: usize = 1000;

/// Which way noise is taken out: spectra name it, so that none is taken for what another way gives.
pub const METHOD: u32 = 3;

/// What [`simplify`] did to a volume.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Simplification {
    /// [`METHOD`].
    pub method: u32,
    /// P, in units of the volume: no extremum is left that is paired with a saddle closer than this.
    pub persistence: f64,
    /// The largest change of a sample.
    pub largest_change: f64,
    /// The mean change of a sample.
    pub mean_change: f64,
    /// What the field as it was given has.
    pub before: Census,
    /// What the simplified field has.
    pub after: Census,
}

/// The critical points of a field, counted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Census {
    /// All of them.
    pub critical_points: usize,
    /// Minima paired with a saddle less than P above.
    pub minima_below: usize,
    /// Maxima paired with a saddle less than P below.
    pub maxima_below: usize,
    /// Minima, those above P included.
    pub minima: usize,
    /// Maxima, likewise.
    pub maxima: usize,
    /// Handles that open (as many close).
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

/// The field with what is smaller than `persistence` (units of the volume) taken out, and what was.
/// Samples of the new volume are float64.
///
/// # Errors
///
/// [`Error::Usage`] if `persistence` is not above 0 and below half of the volume's range, the
/// errors of [`Topology::compute`], and [`Error::Internal`] if extrema below `persistence` are left.
pub fn simplify(volume: &Volume, persistence: f64) -> Result<(Volume, Simplification)> {
    let (simplified, after) = counted(volume, persistence)?;
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

/// The volume that [`simplify`] makes, without the report.
///
/// # Errors
///
/// As [`simplify`].
pub fn simplified(volume: &Volume, persistence: f64) -> Result<Volume> {
    Ok(counted(volume, persistence)?.0)
}

/// The simplified volume and what it has: nothing below `persistence`.
fn counted(volume: &Volume, persistence: f64) -> Result<(Volume, Census)> {
    let (low, high) = volume.range();
    let half = 0.5 * (high - low);
    if !(persistence > 0.0 && persistence < half) {
        return Err(Error::Usage(format!(
            "persistence {persistence}, expected above 0 and below half of the volume's range, {half}"
        )));
    }
    let grain = Grain::of_range((low, high));
    let mut lattice = Lattice::of(volume, grain);
    let mut passes = PASSES.into_iter();
    with_samples!(volume.samples(), given => smooth(&mut lattice, given, persistence));
    let mut marked: [Vec<usize>; 2] = Default::default();
    for _ in 0..ROUNDS {
        let n_gone = drain(&mut lattice, persistence, &marked);
        if n_gone > 0 {
            if let Some(passes) = passes.next() {
                let relaxation = Relaxation { radius: persistence, passes };
                with_samples!(volume.samples(), given => relax(&mut lattice, given, relaxation));
            }
            continue;
        }
        let samples = Samples::from(lattice.into_samples());
        let simplified = volume.with_samples(samples)?;
        let census;
        (census, marked) = left(&simplified, persistence)?;
        if marked.iter().all(Vec::is_empty) {
            return Ok((simplified, census));
        }
        lattice = Lattice::of(&simplified, grain);
    }
    Err(Error::internal(format!("extrema of a persistence below {persistence} are left")))
}

/// Takes away minima, then maxima, shallower than `depth` or marked; how many went.
fn drain(lattice: &mut Lattice, depth: f64, marked: &[Vec<usize>; 2]) -> usize {
    let n_minima = drain_minima(lattice, depth, &marked[0]);
    lattice.turn();
    let n_maxima = drain_minima(lattice, depth, &marked[1]);
    lattice.turn();
    n_minima + n_maxima
}

/// The critical points of a volume, and the samples that are minima, and those that are maxima, of a persistence
/// below `persistence`, ascending.
fn left(volume: &Volume, persistence: f64) -> Result<(Census, [Vec<usize>; 2])> {
    let field = ExactField::new(volume)?;
    let topology = Topology::compute(&field)?;
    let [nx, ny, _] = volume.dims();
    let mut found: [Vec<usize>; 2] = Default::default();
    for pair in topology.extremum_pairs().iter().filter(|pair| pair.persistence < persistence) {
        let event = &topology.events[pair.extremum as usize];
        if let Place::Vertex(vertex) = event.place {
            let [x, y, z] = field.position(vertex).map(|p| p as usize);
            found[usize::from(event.kind == EventKind::Vanish)].push(x + nx * (y + ny * z));
        }
    }
    found.iter_mut().for_each(|samples| samples.sort_unstable());
    Ok((Census::count(&topology, persistence), found))
}
