//! From a volume to its spectrum: the march, the exact cells, one patch.

use std::sync::Arc;

use rayon::prelude::*;

use super::area;
use super::chords::split_chords;
use super::context::Sweep;
use super::counts::Counts;
use super::exact::{ExactCells, ExactInterval};
use super::initial::{self, InitialMesh};
use super::isovalue_ranks::{IsovalueRanks, isovalues_of};
use super::life::merge_sorted;
use super::march::{Marched, march};
use super::parameters::Parameters;
use super::patch::{Recorded, Swept, Thinning, patch};
use super::record::Recorder;
use super::region::{self, PaddedGrid};
use super::seam_triangles::join_seam_triangles;
use super::shared::SharedPlanes;
use super::track::TrackCodes;
use crate::error::{Error, Result};
use crate::field::Field;
use crate::kernels::Backend;
use crate::progress::Progress;
use crate::spectrum::{About, Metadata, Patch, Spectrum, Triangle};
use crate::topology::Topology;
use crate::volume::Volume;

/// Computes the spectrum of a volume as it is; [`Prepared`](crate::Prepared) can process the volume before, and records that.
///
/// ```
/// use isospectrum::volume::phantom;
/// use isospectrum::{Backend, Choice, Parameters, Silent, compute};
///
/// let volume = std::sync::Arc::new(phantom("torus:12")?);
/// let backend = Backend::choose(Choice::Auto, None)?;
/// let spectrum = compute(&volume, &Parameters::default(), &backend, &Silent)?;
/// // Seen upwards a ring appears, and its hole closes.
/// assert!(spectrum.events().len() >= 2);
/// # Ok::<(), isospectrum::Error>(())
/// ```
///
/// # Errors
///
/// [`Error::Usage`] for parameters that contradict the volume, [`Error::Range`] for a start outside the range,
/// [`Error::Input`] for a bad initial mesh, [`Error::Gpu`], [`Error::Interrupted`], [`Error::Internal`] where the volume's
/// topology contradicts itself.
pub fn compute(
    volume: &Arc<Volume>,
    parameters: &Parameters,
    backend: &Backend,
    progress: &dyn Progress,
) -> Result<Spectrum> {
    compute_known(volume, parameters, backend, progress, None)
}

/// As [`compute`], for a volume whose topology may be known.
pub(crate) fn compute_known(
    volume: &Arc<Volume>,
    parameters: &Parameters,
    backend: &Backend,
    progress: &dyn Progress,
    known: Option<Topology>,
) -> Result<Spectrum> {
    let parameters = &parameters.within(volume.range())?;
    let range = parameters.range.unwrap_or(volume.range());
    let field = Arc::new(Field::new(volume.clone()));
    let given = initial::read(parameters, range, &field)?;
    parameters.check_sampling(range)?;
    let sweep = Sweep::new(volume, field, parameters, backend, progress, known)?;
    let initial = given.map(|given| initial::placed(&sweep, given)).transpose()?;
    let (swept, mut counts) = swept(&sweep, initial)?;
    counts.arcs = sweep.topology.n_arcs_in(sweep.range) as u64;
    let mut spectrum = finished(&sweep, swept.patch, &counts)?;
    // Triangles are in the order of their patches until they are written.
    let areas = area::shown_areas(&spectrum, swept.n_tracked);
    area::insert_area_shares(&mut spectrum, &areas);
    Ok(spectrum)
}

/// The whole sweep as one patch: the march's record, and the exact cells in the intervals in which they are exact.
pub(super) fn swept(sweep: &Sweep, initial: Option<InitialMesh>) -> Result<(Swept, Counts)> {
    let is_given = initial.is_some();
    let Marched { record, exact_intervals: mut intervals, counts } = march(sweep, initial)?;
    log::info!("{counts:?}");
    let grid = PaddedGrid::of(&sweep.exact);
    let (low, high) = sweep.range;
    let shared = SharedPlanes::of(&sweep.exact);
    let own = region::layer(grid).filter(|&cell| !shared.is_beyond(cell));
    intervals.extend(own.map(|cell| ExactInterval { cell, low, high }));
    let stage = sweep.stages.finishing(sweep.progress);
    stage.report(0.0);
    let recorded = recorded(sweep, record, intervals)?;
    stage.report(0.5);
    // An initial mesh is shown unchanged at its isovalue.
    let kept = sweep.parameters.start.filter(|_| is_given);
    let thinning = Thinning { tolerance: sweep.parameters.error as f32, kept };
    let patch = patch(recorded, &sweep.exact, sweep.range, thinning)?;
    stage.report(1.0);
    Ok((patch, counts))
}

/// The triangles that a march has recorded, and those of the cells that are exact in some intervals.
fn recorded(sweep: &Sweep, record: Recorder, intervals: Vec<ExactInterval>) -> Result<Recorded> {
    let Recorder { mut lives, knots, .. } = record;
    let mut inner = Vec::new();
    split_chords(&mut lives, &mut inner, &sweep.exact, sweep.range);
    let codes = TrackCodes::new(PaddedGrid::of(&sweep.exact), knots.len())?;
    let cells = ExactCells::new(&sweep.exact, &sweep.topology, intervals);
    let of_tracked = isovalues_of(&lives, |l, ends| ends.extend([l.low, l.high]));
    let ends = IsovalueRanks::new([of_tracked, cells.ends()].concat());
    let mut triangles: Vec<Triangle> = lives.par_iter().map(|l| l.coded(codes, &ends)).collect();
    drop(lives);
    triangles.par_sort_unstable_by_key(|t| (t.vertices, t.birth, t.death));
    merge_sorted(&mut triangles, 0);
    let is_on_seam = |t: &Triangle| t.vertices.iter().all(|&v| codes.is_edge(v));
    let (seam, mut triangles): (Vec<Triangle>, Vec<Triangle>) =
        triangles.into_iter().partition(is_on_seam);
    let n_tracked = triangles.len();
    cells.add_triangles((codes, &ends), &mut triangles, &mut inner);
    join_seam_triangles(&mut triangles, n_tracked, seam, codes.n_codes(inner.len())?);
    triangles.shrink_to_fit();
    log::info!("{n_tracked} tracked triangles, {} of exact cells", triangles.len() - n_tracked);
    Ok(Recorded { triangles, n_tracked, codes, ends, knots, inner })
}

/// The spectrum of a patch, with the sweep's metadata and events.
pub(super) fn finished(sweep: &Sweep, patch: Patch, counts: &Counts) -> Result<Spectrum> {
    let volume = sweep.exact.volume();
    let range = sweep.parameters.range.unwrap_or(volume.range());
    let parameters = metadata(sweep.parameters, &sweep.backend.name(), counts);
    let about = About {
        parameters: Metadata::from_value(parameters),
        events: sweep.events(range),
        ..About::new(volume.info(), range, sweep.parameters.error)
    };
    // Nothing was read from a file, so an invalid spectrum is a bug in the sweep.
    Spectrum::from_patch(about, patch).map_err(|error| match error {
        Error::Input(what) => Error::Internal(what),
        other => other,
    })
}

/// Metadata of a spectrum: how it was computed.
pub(crate) fn metadata(
    parameters: &Parameters,
    backend: &str,
    counts: &Counts,
) -> serde_json::Value {
    serde_json::json!({ "flags": parameters, "backend": backend, Counts::NAME: counts })
}
