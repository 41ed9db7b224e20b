//! What a sweep works on: the exact field, its topology, the field in single precision, the device, the parameters.

use std::sync::Arc;

use super::parameters::Parameters;
use super::region::PaddedGrid;
use super::stages::Stages;
use super::track::TrackCodes;
use crate::error::{Error, Result};
use crate::field::Field;
use crate::kernels::Backend;
use crate::progress::Progress;
use crate::spectrum::Event;
use crate::topology::Topology;
use crate::topology::exact::ExactField;
use crate::volume::Volume;

/// Everything that is constant during a sweep.
pub(super) struct Sweep<'a> {
    pub(super) exact: ExactField<'a>,
    pub(super) topology: Topology,
    pub(super) field: Arc<Field>,
    pub(super) backend: &'a Backend,
    pub(super) parameters: &'a Parameters,
    pub(super) progress: &'a dyn Progress,
    pub(super) stages: Stages,
    /// The isovalues swept: the requested range, extended as in [`swept_end`].
    pub(super) range: (f64, f64),
}

impl<'a> Sweep<'a> {
    /// Computes the topology of a volume, unless it is known.
    pub(super) fn new(
        volume: &'a Volume,
        field: Arc<Field>,
        parameters: &'a Parameters,
        backend: &'a Backend,
        progress: &'a dyn Progress,
        known: Option<Topology>,
    ) -> Result<Self> {
        let exact = ExactField::new(volume)?;
        TrackCodes::new(PaddedGrid::of(&exact), 0)?;
        let (low, high) = parameters.range.unwrap_or(volume.range());
        let range = (low, swept_end(&exact, high));
        let stages = Stages::of(&exact, range);
        let stage = stages.topology(progress);
        let topology = match known {
            Some(topology) => topology,
            None => Topology::compute_with_progress(&exact, &|done| stage.report(done))?,
        };
        Ok(Sweep { exact, topology, field, backend, parameters, progress, stages, range })
    }
}

/// The end of the sweep for a range that ends at `high`. Lifetimes are half-open, so triangles that end at `high` are not
/// shown there: if there is an isosurface at `high`, the sweep ends at the next floating point number.
fn swept_end(exact: &ExactField, high: f64) -> f64 {
    if exact.has_surface(high) { high.next_up() } else { high }
}

impl Sweep<'_> {
    /// The events inside a range, without those of the layer around the volume.
    pub(super) fn events(&self, (low, high): (f64, f64)) -> Vec<Event> {
        let inside = |e: &Event| low <= e.isovalue && e.isovalue <= high;
        self.topology.net_events().into_iter().filter(inside).collect()
    }

    /// [`Error::Interrupted`] if the caller has cancelled the sweep.
    pub(super) fn cancelled(&self) -> Result<()> {
        if self.progress.cancelled() { Err(Error::Interrupted) } else { Ok(()) }
    }
}
