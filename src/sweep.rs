//! The sweep: from a volume to its spectrum.
//!
//! # Theory
//!
//! The isosurface is tracked where it is calm, and exact where it is not. At every isovalue it is one mesh of two kinds of
//! pieces. In the *exact* cells it is the exact extraction, whose vertices slide along lattice edges. Everywhere else it is
//! the *tracked* mesh, of vertices that are moved with the isovalue and good triangles between them. Its boundary is the
//! *seam*: the polyline of the exact extraction on the squares between the two, so that nothing has to be matched while the
//! isovalue moves. Events take place in exact cells, so the tracked mesh knows none; and where nothing can be tracked,
//! everything is exact, which depends on the field only. So a sweep always ends, and is right everywhere.

mod area;
mod block;
mod calendar;
mod check;
mod chords;
mod clusters;
mod counts;
mod exact;
mod exchange;
mod initial;
mod march;
mod mend;
mod parameters;
mod part;
mod patch;
mod polyline;
mod record;
mod region;
mod remesh;
mod shared;
mod thin;
mod tracked;
mod transport;

pub use crate::progress::{Progress, Silent};
pub(crate) use area::tell_shares;
pub use block::{Block, compute_block};
pub use counts::Counts;
pub use parameters::Parameters;
pub(crate) use shared::WholeEdge;

use std::sync::Arc;

use crate::error::{Error, Result};
use crate::kernels::Backend;
use crate::kernels::field::Field;
use crate::spectrum::{About, Event, Spectrum, SpectrumBuilder, Told};
use crate::topology::Topology;
use crate::topology::exact::ExactField;
use crate::volume::Volume;
use chords::split_chords;
use initial::InitialMesh;
use march::{Marched, march};
use patch::{Swept, Thinning, patch};
use region::Grid;
use shared::Shared;

/// Under this name the parameters of a spectrum tell the share of the isosurface's area, without caps, whose
/// triangles are tracked, mean over the range; over the rest the exact extraction shows.
pub const TRACKED_AREA_SHARE: &str = "tracked_area_share";

/// Under this name, the same at isovalues evenly spread over the range: [isovalue, share] each, ascending.
pub const TRACKED_AREA_SHARES: &str = "tracked_area_shares";

/// What does not change during a sweep.
struct Sweep<'a> {
    exact: ExactField<'a>,
    topology: Topology,
    field: Arc<Field>,
    backend: &'a Backend,
    parameters: &'a Parameters,
    progress: &'a dyn Progress,
    /// The isovalues swept: those asked for, and one more where the isosurface does not end with them
    /// (see [`swept_end`]).
    range: (f64, f64),
}

/// Computes the spectrum of a volume as it is; [`Prepared`](crate::Prepared) does something to it before, and tells so.
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
/// [`Error::Usage`] for parameters that contradict the volume, [`Error::Input`] for a bad initial
/// mesh, [`Error::Gpu`], [`Error::Interrupted`], [`Error::Internal`] where the volume's topology contradicts itself.
pub fn compute(
    volume: &Arc<Volume>,
    parameters: &Parameters,
    backend: &Backend,
    progress: &dyn Progress,
) -> Result<Spectrum> {
    let parameters = &parameters.within(volume.range())?;
    let range = parameters.range.unwrap_or(volume.range());
    let field = Arc::new(Field::new(volume.clone()));
    let given = initial::read(parameters, range, &field)?;
    progress.report(0.0, "topology");
    let sweep = Sweep::new(volume, field, parameters, (backend, progress))?;
    let initial = given.map(|given| initial::placed(&sweep, given)).transpose()?;
    let (swept, mut counts) = swept(&sweep, initial)?;
    counts.arcs = sweep.topology.n_arcs_in(sweep.range) as u64;
    let mut builder = SpectrumBuilder::new();
    builder.push_patch(swept.patch);
    let mut spectrum = finished(&sweep, builder, &counts)?;
    // Triangles are in the order of their patches until they are written.
    let areas = area::shown_areas(&spectrum, swept.n_tracked);
    area::tell_shares(&mut spectrum, &areas);
    Ok(spectrum)
}

/// All of a sweep, as one patch: the march's record, and the exact cells while they are exact.
fn swept(sweep: &Sweep, initial: Option<InitialMesh>) -> Result<(Swept, Counts)> {
    let is_given = initial.is_some();
    let Marched { mut record, mut shown, counts } = march(sweep, initial)?;
    log::info!("{counts:?}");
    let grid = Grid::of(&sweep.exact);
    let (low, high) = sweep.range;
    let shared = Shared::of(&sweep.exact);
    let own = region::layer(grid).filter(|&cell| !shared.is_beyond(cell));
    shown.extend(own.map(|cell| (cell, low, high)));
    shown.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
    let mut joined: Vec<exact::Shown> = Vec::with_capacity(shown.len());
    for s in shown {
        match joined.last_mut() {
            Some(last) if last.0 == s.0 && last.2 == s.1 => last.2 = s.2,
            _ => joined.push(s),
        }
    }
    let n_tracked = record.lives.len();
    let mut inner = exact::extend(&mut record, &sweep.exact, &sweep.topology, &joined);
    log::info!("{n_tracked} tracked triangles, {} of exact cells", record.lives.len() - n_tracked);
    split_chords(&mut record.lives, &mut inner, &sweep.exact, sweep.range);
    // A mesh from outside is shown as it was given.
    let kept = sweep.parameters.start.filter(|_| is_given);
    let thinning = Thinning { tolerance: sweep.parameters.error as f32, kept };
    Ok((patch(record, inner, &sweep.exact, sweep.range, thinning), counts))
}

/// The spectrum of what was swept.
fn finished(sweep: &Sweep, builder: SpectrumBuilder, counts: &Counts) -> Result<Spectrum> {
    let volume = sweep.exact.volume();
    let range = sweep.parameters.range.unwrap_or(volume.range());
    let parameters = told(sweep.parameters, &sweep.backend.name(), counts);
    let finished = builder.finish(About {
        parameters: Told::of_value(parameters),
        events: sweep.events(range),
        ..About::new(volume.info(), range, sweep.parameters.error)
    });
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
        field: Arc<Field>,
        parameters: &'a Parameters,
        (backend, progress): (&'a Backend, &'a dyn Progress),
    ) -> Result<Self> {
        let exact = ExactField::new(volume)?;
        let topology = Topology::compute(&exact)?;
        let (low, high) = parameters.range.unwrap_or(volume.range());
        let range = (low, swept_end(&exact, high));
        Ok(Sweep { exact, topology, field, backend, parameters, progress, range })
    }
}

/// Up to where a range is swept that ends at an isovalue. Lifetimes are half-open, so what is swept up to there is
/// gone there: where the isosurface is not, it is swept up to the next number.
fn swept_end(exact: &ExactField, high: f64) -> f64 {
    if exact.has_surface(high) { high.next_up() } else { high }
}

impl Sweep<'_> {
    /// The events inside a range, those of the ramp left out.
    fn events(&self, (low, high): (f64, f64)) -> Vec<Event> {
        let inside = |e: &Event| low <= e.isovalue && e.isovalue <= high;
        self.topology.net_events().into_iter().filter(inside).collect()
    }

    /// [`Error::Interrupted`] if the caller wants the sweep to stop.
    fn cancelled(&self) -> Result<()> {
        if self.progress.cancelled() { Err(Error::Interrupted) } else { Ok(()) }
    }
}
