//! The sweep: from a volume to its spectrum.
//!
//! The contour tree cuts the isovalues of every component into arcs: between its two events the
//! topology of a component is constant. Each arc is a piece of work of its own: the component is
//! extracted at an isovalue inside the arc, remeshed to the tolerance, and tracked to both ends.
//! Where tracking fails a check, the rest of the arc is extracted afresh; that depends on the field
//! only, so it always ends. Local surgery, when it comes, replaces the extraction at the start of an
//! arc by the meshes of the arcs before it: see `start`.

mod batches;
mod caps;
mod criteria;
mod flips;
mod initial;
mod parameters;
mod recorder;
mod refine;
mod remesh;
mod simplify;
mod slide;
mod start;
mod track;

pub use parameters::{Parameters, Progress, Silent};

use std::sync::Arc as Shared;
use std::sync::Mutex;

use rayon::prelude::*;
use serde::Serialize;

use crate::error::{Error, Result};
use crate::extract::Extraction;
use crate::kernels::Backend;
use crate::kernels::field::Field;
use crate::spectrum::{Event, Patch, Spectrum, SpectrumBuilder, VolumeInfo};
use crate::topology::Topology;
use crate::topology::exact::ExactField;
use crate::volume::Volume;
use track::Way;

/// Pieces shorter than this share of the range are shown by sliding extractions at once.
const SHORT_SHARE: f64 = 5e-4;

/// A component with fewer faces is shown by its extraction where that just slides.
const SMALL_FACES: usize = 300;

/// A stretch that tracking left over is not tracked again after so many attempts.
const MAX_DEPTH: u32 = 1;

/// A stretch shorter than this share of the piece it is left over from is not tracked again.
const SLIDE_SHARE: f64 = 0.25;

/// Share of a piece, at each end, over which the mesh may stay as it is where tracking fails.
const HOLD_SHARE: f64 = 0.02;

/// What happened during a sweep, counted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Counts {
    /// Arcs of the contour tree tracked.
    pub arcs: u64,
    /// Sampling steps taken.
    pub steps: u64,
    /// Sampling steps that failed a check and were taken shorter, by the check.
    pub refused: Refused,
    /// Components extracted afresh inside an arc because tracking failed a check.
    pub extracted_afresh: u64,
    /// Ends of pieces where the mesh stays as it is, because tracking failed just before an event.
    pub held: u64,
    /// Stretches covered by a sliding extraction.
    pub sliding: u64,
    /// Stretches too short for anything else, covered by an unmoving extraction.
    pub unmoving: u64,
}

/// Sampling steps that failed a check, by the first check they failed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Refused {
    /// A vertex did not reach the isosurface within the rules of projection.
    pub not_reached: u64,
    /// A face looked away from its vertices' normals.
    pub folded: u64,
    /// Half-way between the two sampling isovalues the mesh left the tolerance.
    pub off_midway: u64,
    /// The mesh passed through itself.
    pub intersecting: u64,
}

impl Refused {
    fn total(&self) -> u64 {
        self.not_reached + self.folded + self.off_midway + self.intersecting
    }

    fn add(&mut self, o: &Refused) {
        self.not_reached += o.not_reached;
        self.folded += o.folded;
        self.off_midway += o.off_midway;
        self.intersecting += o.intersecting;
    }
}

impl Counts {
    fn add(&mut self, o: &Counts) {
        self.arcs += o.arcs;
        self.steps += o.steps;
        self.refused.add(&o.refused);
        self.extracted_afresh += o.extracted_afresh;
        self.held += o.held;
        self.sliding += o.sliding;
        self.unmoving += o.unmoving;
    }
}

/// A stretch of an arc: one component over an interval of isovalues without events on it.
#[derive(Clone, Copy, Debug)]
struct Piece {
    arc: usize,
    low: f64,
    high: f64,
    depth: u32,
}

/// Everything a piece needs to be tracked.
struct Sweep<'a> {
    exact: ExactField<'a>,
    topology: Topology,
    field: Shared<Field>,
    backend: &'a Backend,
    parameters: &'a Parameters,
    progress: &'a dyn Progress,
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
/// mesh, [`Error::Gpu`], [`Error::Interrupted`].
pub fn compute(
    volume: &Shared<Volume>,
    parameters: &Parameters,
    backend: &Backend,
    progress: &dyn Progress,
) -> Result<Spectrum> {
    let range = parameters.range.unwrap_or(volume.range());
    // A range that is not a number is not inside either.
    let is_inside = volume.range().0 <= range.0 && range.0 < range.1 && range.1 <= volume.range().1;
    if !is_inside {
        return Err(Error::Usage(format!(
            "range {} to {}, expected inside the volume's {} to {}",
            range.0,
            range.1,
            volume.range().0,
            volume.range().1
        )));
    }
    let field = Shared::new(Field::new(volume.clone()));
    let given = initial::read(parameters, range, &field)?;
    progress.report(0.0, "topology");
    let exact = ExactField::new(volume)?;
    let topology = Topology::compute(&exact)?;
    let event_isovalues = batches::batched_isovalues(&topology, volume.range());
    let mut sweep = Sweep {
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
    };
    if let Some(given) = given {
        sweep.initial = initial::on_arcs(&sweep, given)?;
    }
    let pieces = sweep.pieces();
    sweep.total = pieces.iter().map(|p| sweep.weight(p)).sum::<f64>().max(1e-300);
    let groups = sweep.groups(&pieces);
    let tracked: Vec<Result<(Vec<Patch>, Counts)>> =
        groups.par_iter().map(|(isovalue, pieces)| sweep.track_group(*isovalue, pieces)).collect();
    let mut counts = Counts { arcs: pieces.len() as u64, ..Counts::default() };
    let mut builder = SpectrumBuilder::new();
    for result in tracked {
        let (patches, c) = result?;
        counts.add(&c);
        for patch in patches {
            builder.push_patch(patch);
        }
    }
    let parameters = serde_json::json!({
        "flags": parameters,
        "backend": backend.name(),
        "counts": counts,
    });
    let info = VolumeInfo {
        name: volume.name().to_string(),
        dims: volume.dims(),
        sample_type: volume.samples().type_name().to_string(),
        range: volume.range(),
        placement: *volume.placement(),
        outside: volume.outside(),
    };
    let events = sweep.events();
    builder.finish(info, range, sweep.parameters.error, parameters, events)
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
            .map(|(arc, (low, high))| Piece { arc, low, high, depth: 0 })
            .collect()
    }

    /// The events inside the range, those of the ramp left out.
    fn events(&self) -> Vec<Event> {
        let inside = |e: &Event| e.isovalue >= self.range.0 && e.isovalue <= self.range.1;
        self.topology.net_events().into_iter().filter(inside).collect()
    }

    /// How much of the work a piece is thought to be.
    fn weight(&self, piece: &Piece) -> f64 {
        0.01 + (piece.high - piece.low) / (self.range.1 - self.range.0)
    }

    /// The isovalue at which a piece is extracted: its middle, between two samples' values where
    /// samples are integers.
    fn start_isovalue(&self, piece: &Piece) -> f64 {
        if let Some(start) = self.parameters.start
            && piece.low <= start
            && start < piece.high
        {
            return start;
        }
        let middle = 0.5 * (piece.low + piece.high);
        let between = middle.floor() + 0.5;
        let integer = self.exact.volume().samples().is_integer();
        if integer && piece.low < between && between < piece.high { between } else { middle }
    }

    /// Pieces by start isovalue, so that the volume is scanned once for each.
    fn groups(&self, pieces: &[Piece]) -> Vec<(f64, Vec<Piece>)> {
        let mut order: Vec<(f64, Piece)> =
            pieces.iter().map(|p| (self.start_isovalue(p), *p)).collect();
        order.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.arc.cmp(&b.1.arc)));
        order
            .chunk_by(|a, b| a.0 == b.0)
            .map(|g| (g[0].0, g.iter().map(|x| x.1).collect()))
            .collect()
    }

    /// Extracts the pieces of one start isovalue and tracks each.
    fn track_group(&self, isovalue: f64, pieces: &[Piece]) -> Result<(Vec<Patch>, Counts)> {
        let starts = start::components_at(self, isovalue, pieces)?;
        let results: Vec<Result<(Vec<Patch>, Counts)>> = pieces
            .par_iter()
            .zip(&starts)
            .map(|(piece, exact)| {
                let mut patches = Vec::new();
                let mut counts = Counts::default();
                self.track_piece(piece, isovalue, exact, &mut patches, &mut counts)?;
                self.advance_progress(self.weight(piece));
                Ok((patches, counts))
            })
            .collect();
        let mut all = Vec::new();
        let mut counts = Counts::default();
        for result in results {
            let (patches, c) = result?;
            all.extend(patches);
            counts.add(&c);
        }
        Ok((all, counts))
    }

    /// Tracks one piece from its start to both ends. A long stretch that is not reached is extracted
    /// afresh in its own middle; a short one is covered by sliding extractions.
    fn track_piece(
        &self,
        piece: &Piece,
        isovalue: f64,
        exact: &Extraction,
        patches: &mut Vec<Patch>,
        counts: &mut Counts,
    ) -> Result<()> {
        let given = self.initial.of(piece, isovalue).is_some();
        let short = piece.high - piece.low < SHORT_SHARE * (self.range.1 - self.range.0);
        if short && !given {
            return slide::slide(self, piece, patches, counts);
        }
        let small = exact.faces.len() < SMALL_FACES && !given;
        if small && (piece.depth > 0 || slide::slides(self, piece)?) {
            return slide::slide(self, piece, patches, counts);
        }
        let before = *counts;
        let Some(tracked) = start::track_both_ways(self, piece, isovalue, exact, counts)? else {
            log::debug!("arc {} [{}, {}): cannot be remeshed", piece.arc, piece.low, piece.high);
            return slide::slide(self, piece, patches, counts);
        };
        log::debug!(
            "arc {} [{}, {}) depth {}: tracked [{}, {}) from {isovalue}, {} steps, {} refused ({:?} so far), {} triangles",
            piece.arc,
            piece.low,
            piece.high,
            piece.depth,
            tracked.low,
            tracked.high,
            counts.steps - before.steps,
            counts.refused.total() - before.refused.total(),
            counts.refused,
            tracked.patch.triangles.len()
        );
        patches.push(tracked.patch);
        let rest = [(piece.low, tracked.low), (tracked.high, piece.high)];
        for (low, high) in rest.into_iter().filter(|r| r.0 < r.1) {
            let rest = Piece { arc: piece.arc, low, high, depth: piece.depth + 1 };
            counts.extracted_afresh += 1;
            if rest.depth > MAX_DEPTH || high - low < SLIDE_SHARE * (piece.high - piece.low) {
                slide::slide(self, &rest, patches, counts)?;
            } else {
                let isovalue = self.start_isovalue(&rest);
                let exact = start::component_at(self, &rest, isovalue)?;
                self.track_piece(&rest, isovalue, &exact, patches, counts)?;
            }
        }
        Ok(())
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

    /// The way from a start isovalue to one end of a piece.
    fn way(&self, piece: &Piece, up: bool) -> Way {
        let length = piece.high - piece.low;
        let margin = 1e-3 * length.min(0.01 * (self.range.1 - self.range.0));
        let fixed = self.parameters.step.or_else(|| {
            self.parameters.samples.map(|n| (self.range.1 - self.range.0) / n.max(1) as f64)
        });
        let (direction, end, last) = if up {
            (recorder::Direction::Up, piece.high, piece.high - margin)
        } else {
            (recorder::Direction::Down, piece.low, piece.low + margin)
        };
        Way {
            direction,
            end,
            last,
            fixed: fixed.map(|step| (self.range.0, step)),
            hold: HOLD_SHARE * length,
            min_step: 1e-5 * (self.range.1 - self.range.0).min(100.0 * length),
        }
    }
}
