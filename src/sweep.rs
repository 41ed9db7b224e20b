//! The sweep: from a volume to its spectrum.
//!
//! The contour tree cuts the isovalues of every component into arcs: between its two events the
//! topology of a component is constant. A mesh is extracted and remeshed at the start isovalue and
//! tracked up and down through the arcs (`chain`, `track`); where arcs meet, surgery turns the meshes
//! of some into those of others (`surgery`). Over stretches that no mesh gets through, and for
//! components too small or too short-lived for one, the exact extraction shows (`lattice`): that
//! depends on the field only, so a sweep always ends, and is right everywhere.

mod advance;
mod again;
mod batches;
mod block;
mod border;
mod caps;
mod chain;
mod course;
mod criteria;
mod crowd;
mod flips;
mod front;
mod glide;
mod graph;
mod idle;
mod initial;
mod lattice;
mod missed;
mod opening;
mod parameters;
mod recorder;
mod refine;
mod remesh;
mod simplify;
mod start;
mod surgery;
#[cfg(test)]
mod tests;
mod thin;
mod toil;
mod track;
mod tracked;
mod window;

pub use block::{Block, compute_block};
pub use parameters::{Parameters, Progress, Silent};
pub(crate) use tracked::tell_shares;

use std::sync::Arc as Shared;
use std::sync::Mutex;

use serde::{Deserialize, Serialize};

use crate::error::{Error, Result};
use crate::extract::extract;
use crate::kernels::Backend;
use crate::kernels::field::Field;
use crate::spectrum::{Event, Spectrum, SpectrumBuilder, VolumeInfo};
use crate::topology::Topology;
use crate::topology::exact::ExactField;
use crate::volume::Volume;

/// Components with fewer faces are left to the exact extraction, but where they last long; and those with fewer
/// than the second, where they do not follow by themselves.
const SMALL_FACES: usize = 300;
const SMALLEST_FACES: usize = 40;

/// Under this name the parameters of a spectrum tell the share of the isosurface's area, without caps, whose
/// triangles are tracked, mean over the range; over the rest the exact extraction shows.
pub const TRACKED_AREA_SHARE: &str = "tracked_area_share";

/// Under this name, the same at isovalues evenly spread over the range: [isovalue, share] each, ascending.
pub const TRACKED_AREA_SHARES: &str = "tracked_area_shares";

/// Share of the tolerance by which knots may be off the trajectory that is left without them.
const KNOT_SHARE: f32 = 0.15;

/// What happened during a sweep, counted. A spectrum keeps it: [`Counts::of`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
#[non_exhaustive]
pub struct Counts {
    /// Arcs of the contour tree that show inside the range, tracked or not.
    pub arcs: u64,
    /// Sampling steps taken.
    pub steps: u64,
    /// Sampling steps that failed a check and were taken shorter, by the check.
    pub refused: Refused,
    /// Times that a step was taken again because there were places that could not be tracked.
    pub repeated: u64,
    /// Exchanges between the tracked mesh and exact cells, cluster by cluster.
    pub exchanges: u64,
    /// How many of them were refused, and asked for otherwise.
    pub exchanges_refused: u64,
    /// Nodes of the contour tree passed by surgery on the meshes that arrived.
    pub surgeries: u64,
    /// Nodes where no surgery succeeded: the meshes end and others begin.
    pub surgeries_failed: u64,
    /// Meshes repaired between events: a block was replaced.
    pub repairs: u64,
    /// Components that had no mesh yet and were extracted and remeshed: at the start, and after parts have appeared.
    pub begun: u64,
    /// Components extracted and remeshed whose mesh was lost, to an event or on its way.
    pub extracted_afresh: u64,
    /// Stretches of arcs over which no mesh was tracked: the exact extraction shows there.
    pub untracked: u64,
    /// Arcs left to the exact extraction because no component was found where the contour tree has them.
    pub lost: u64,
}

/// Sampling steps that failed a check, by the first check they failed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
#[non_exhaustive]
pub struct Refused {
    /// A vertex did not reach the isosurface within the rules of projection.
    pub not_reached: u64,
    /// A face looked away from its vertices' normals.
    pub folded: u64,
    /// Half-way between the two sampling isovalues the mesh left the tolerance.
    pub off_midway: u64,
    /// The mesh passed through itself.
    pub intersecting: u64,
    /// Part of it left the volume, where it wants a cap, or ran over one.
    pub left_volume: u64,
    /// It went by a bump of the isosurface.
    pub missed: u64,
}

impl Refused {
    fn add(&mut self, o: &Refused) {
        self.not_reached += o.not_reached;
        self.folded += o.folded;
        self.off_midway += o.off_midway;
        self.intersecting += o.intersecting;
        self.left_volume += o.left_volume;
        self.missed += o.missed;
    }
}

impl Counts {
    /// Under this name the parameters of a spectrum tell them.
    const NAME: &str = "counts";

    /// Those of the sweep that a spectrum comes from; none of a spectrum that another program wrote. What an older
    /// version did not count is 0.
    pub fn of(spectrum: &Spectrum) -> Option<Counts> {
        let told = spectrum.parameters.get(Counts::NAME)?;
        Counts::deserialize(told).ok()
    }

    pub(crate) fn add(&mut self, o: &Counts) {
        self.arcs += o.arcs;
        self.steps += o.steps;
        self.repeated += o.repeated;
        self.exchanges += o.exchanges;
        self.exchanges_refused += o.exchanges_refused;
        self.refused.add(&o.refused);
        self.surgeries += o.surgeries;
        self.surgeries_failed += o.surgeries_failed;
        self.repairs += o.repairs;
        self.begun += o.begun;
        self.extracted_afresh += o.extracted_afresh;
        self.untracked += o.untracked;
        self.lost += o.lost;
    }
}

/// A stretch of an arc: one component over an interval of isovalues without events on it.
#[derive(Clone, Copy, Debug)]
struct Piece {
    arc: usize,
    low: f64,
    high: f64,
}

/// Everything a piece needs to be tracked.
struct Sweep<'a> {
    exact: ExactField<'a>,
    topology: Topology,
    field: Shared<Field>,
    backend: &'a Backend,
    parameters: &'a Parameters,
    progress: &'a dyn Progress,
    /// The isovalues swept: those asked for, and one more where the isosurface does not end with them
    /// (see [`swept_end`]).
    range: (f64, f64),
    /// Isovalue of each event of the topology, batches as one.
    event_isovalues: Vec<f64>,
    /// Meshes from outside that pieces start from.
    initial: initial::InitialMeshes,
    done: Mutex<f64>,
    total: f64,
}

/// Computes the spectrum of a volume.
///
/// # Errors
///
/// [`Error::Usage`] for parameters that contradict the volume, [`Error::Input`] for a bad initial
/// mesh, [`Error::Gpu`], [`Error::Interrupted`], [`Error::Internal`] where the volume's topology contradicts itself.
pub fn compute(
    volume: &Shared<Volume>,
    parameters: &Parameters,
    backend: &Backend,
    progress: &dyn Progress,
) -> Result<Spectrum> {
    let range = checked_range(volume.range(), parameters)?;
    let field = Shared::new(Field::new(volume.clone()));
    let given = initial::read(parameters, range, &field)?;
    progress.report(0.0, "topology");
    let mut sweep = Sweep::new(volume, field, parameters, (backend, progress))?;
    if let Some(given) = given {
        sweep.initial = initial::on_arcs(&sweep, given)?;
    }
    let start = sweep.start_isovalue();
    let whole = extract(&sweep.exact, start);
    let pieces = sweep.pieces();
    sweep.total = pieces.iter().map(|p| sweep.weight(p)).sum::<f64>().max(1e-300);
    let mut counts = Counts { arcs: pieces.len() as u64, ..Counts::default() };
    let mut builder = SpectrumBuilder::new();
    let n_tracked = if !parameters.is_by_component() {
        let swept = front::sweep(&sweep, start, &mut counts)?;
        builder.push_patch(swept.patch);
        swept.n_tracked
    } else {
        let swept = chain::sweep_all(&sweep, (start, &whole), &mut counts)?;
        counts.untracked = swept.leftovers.len() as u64;
        let patch = swept.log.patch(KNOT_SHARE * sweep.parameters.error as f32);
        let n_tracked = patch.triangles.len();
        builder.push_patch(patch);
        builder.push_patch(lattice::patch(&sweep, &swept.leftovers)?);
        n_tracked
    };
    let mut spectrum = finished(&sweep, builder, &counts)?;
    // Triangles are in the order of their patches until they are written.
    let areas = tracked::shown_areas(&spectrum, n_tracked);
    tracked::tell_shares(&mut spectrum, &areas);
    Ok(spectrum)
}

/// The range to cover of a volume's own.
///
/// # Errors
///
/// [`Error::Usage`] for one that is not inside the volume's.
pub(crate) fn checked_range(
    (least, most): (f64, f64),
    parameters: &Parameters,
) -> Result<(f64, f64)> {
    let (low, high) = parameters.range.unwrap_or((least, most));
    // A range that is not a number is not inside either.
    if least <= low && low < high && high <= most {
        return Ok((low, high));
    }
    Err(Error::Usage(format!(
        "range {low} to {high}, expected inside the volume's {least} to {most}"
    )))
}

/// The spectrum of what was swept.
fn finished(sweep: &Sweep, builder: SpectrumBuilder, counts: &Counts) -> Result<Spectrum> {
    let volume = sweep.exact.volume();
    let range = sweep.parameters.range.unwrap_or(volume.range());
    let parameters = told(sweep.parameters, &sweep.backend.name(), counts);
    let info = VolumeInfo::of(volume);
    let events = sweep.events(range);
    let finished = builder.finish(info, range, sweep.parameters.error, parameters, events);
    // Nothing of it was read: what is wrong with it is the sweep's fault.
    finished.map_err(|error| match error {
        Error::Input(what) => Error::Internal(what),
        other => other,
    })
}

/// What a spectrum tells of how it was computed.
pub(crate) fn told(parameters: &Parameters, backend: &str, counts: &Counts) -> serde_json::Value {
    serde_json::json!({ "flags": parameters, "backend": backend, Counts::NAME: counts })
}

impl<'a> Sweep<'a> {
    /// Finds the topology of a volume, and all else that does not change while it is swept.
    fn new(
        volume: &'a Volume,
        field: Shared<Field>,
        parameters: &'a Parameters,
        (backend, progress): (&'a Backend, &'a dyn Progress),
    ) -> Result<Self> {
        let exact = ExactField::new(volume)?;
        let topology = Topology::compute(&exact)?;
        let event_isovalues = batches::batched_isovalues(&topology, volume.range());
        let (low, high) = parameters.range.unwrap_or(volume.range());
        let range = (low, swept_end(&exact, high));
        Ok(Sweep {
            exact,
            topology,
            field,
            backend,
            parameters,
            progress,
            range,
            event_isovalues,
            initial: initial::InitialMeshes::default(),
            done: Mutex::new(0.0),
            total: 1.0,
        })
    }
}

/// Up to where a range is swept that ends at an isovalue. Lifetimes are half-open, so what is swept up to there is
/// gone there: where the isosurface is not, it is swept up to the next number.
fn swept_end(exact: &ExactField, high: f64) -> f64 {
    if exact.has_surface(high) { high.next_up() } else { high }
}

impl Sweep<'_> {
    /// The isovalues between which an arc shows; equal where it never does.
    fn shown(&self, arc: &crate::topology::Arc) -> (f64, f64) {
        let at = |event: Option<u32>, else_at: f64| {
            event.map_or(else_at, |e| self.event_isovalues[e as usize])
        };
        let low = at(arc.birth_event, arc.birth).max(self.range.0);
        let high = at(arc.death_event, arc.death).min(self.range.1);
        (low, high.max(low))
    }

    /// The arcs that show inside the range, as pieces, in the order of the contour tree.
    fn pieces(&self) -> Vec<Piece> {
        let arcs = self.topology.arcs.iter().enumerate();
        let shown = arcs.map(|(arc, a)| (arc, self.shown(a)));
        shown
            .filter(|(_, (low, high))| low < high)
            .map(|(arc, (low, high))| Piece { arc, low, high })
            .collect()
    }

    /// The events inside a range, those of the ramp left out.
    fn events(&self, (low, high): (f64, f64)) -> Vec<Event> {
        let inside = |e: &Event| low <= e.isovalue && e.isovalue <= high;
        self.topology.net_events().into_iter().filter(inside).collect()
    }

    /// How much of the work a piece is thought to be.
    fn weight(&self, piece: &Piece) -> f64 {
        0.01 + (piece.high - piece.low) / (self.range.1 - self.range.0)
    }

    /// The isovalues of a piece at which its component is there. The events of a batch are shown at one isovalue, but
    /// where samples are equal but for rounding, a batch reaches as far as the next one is away, so a piece may begin
    /// to show before its component is, or show for longer. Where the range cuts all of that off, the piece itself.
    fn alive(&self, piece: &Piece) -> (f64, f64) {
        let arc = &self.topology.arcs[piece.arc];
        let (low, high) = (piece.low.max(arc.birth), piece.high.min(arc.death));
        if low < high { (low, high) } else { (piece.low, piece.high) }
    }

    /// The isovalue at which a piece is extracted: the middle of where its component is, between two samples' values
    /// where samples are integers.
    fn middle(&self, piece: &Piece) -> f64 {
        let (low, high) = self.alive(piece);
        // Halves do not overflow; between neighbouring numbers the middle rounds to one of them.
        let middle = 0.5 * low + 0.5 * high;
        let middle = if middle < high { middle } else { low };
        let between = middle.floor() + 0.5;
        let integer = self.exact.volume().samples().is_integer();
        if integer && low < between && between < high { between } else { middle }
    }

    /// The isovalue that the sweep starts from: as told, else the middle of the longest arc.
    fn start_isovalue(&self) -> f64 {
        let length = |p: &Piece| p.high - p.low;
        let longest = self.pieces().into_iter().min_by(|a, b| length(b).total_cmp(&length(a)));
        self.parameters.start.unwrap_or_else(|| longest.map_or(self.range.0, |p| self.middle(&p)))
    }

    /// Tells the caller that more of the work is done.
    fn advance_progress(&self, weight: f64) {
        let mut done = self.done.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
        *done += weight;
        self.progress.report((*done / self.total).min(1.0), "tracking");
    }

    /// [`Error::Interrupted`] if the caller wants the sweep to stop.
    fn cancelled(&self) -> Result<()> {
        if self.progress.cancelled() { Err(Error::Interrupted) } else { Ok(()) }
    }
}
