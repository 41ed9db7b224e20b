//! The sweep of a block of a volume, whose spectrum fits those of the neighbouring blocks.

use std::sync::Arc;

use super::area;
use super::compute::{finished, swept};
use super::context::Sweep;
use super::counts::Counts;
use super::parameters::Parameters;
use super::shared::WholeEdge;
use crate::error::Result;
use crate::field::Field;
use crate::kernels::Backend;
use crate::progress::Progress;
use crate::spectrum::Spectrum;
use crate::volume::Volume;

/// The result of the sweep of a block.
#[derive(Clone, Debug)]
pub struct Block {
    /// The block's spectrum in the frame of the whole volume. It is open where the block is cut from the whole, and has
    /// no events, as events of a block are not events of the whole.
    pub spectrum: Spectrum,
    /// The vertices on planes that the block shares with others, ascending, each with the number of its lattice edge in the
    /// whole. Blocks have the same vertices there, with the same trajectories.
    pub shared: Vec<(u32, WholeEdge)>,
    /// The area, without caps, of tracked and of other triangles at isovalues evenly spread over the range.
    pub areas: Vec<[f64; 2]>,
    /// What happened.
    pub counts: Counts,
}

/// Computes a block ([`Volume::block`]) of a volume, over the range of [`Parameters::range`], or the whole volume's.
///
/// # Errors
///
/// [`Error::Usage`](crate::Error::Usage) for parameters that contradict the volume, or that name an initial mesh;
/// [`Error::Gpu`](crate::Error::Gpu), [`Error::Interrupted`](crate::Error::Interrupted),
/// [`Error::Internal`](crate::Error::Internal) as of [`compute`](super::compute).
pub fn compute_block(
    volume: &Arc<Volume>,
    parameters: &Parameters,
    backend: &Backend,
    progress: &dyn Progress,
) -> Result<Block> {
    let parameters = &parameters.within(volume.range())?;
    parameters.check_for_blocks()?;
    let field = Arc::new(Field::new(volume.clone()));
    let sweep = Sweep::new(volume, field, parameters, backend, progress, None)?;
    let (swept, counts) = swept(&sweep, None)?;
    let mut spectrum = finished(&sweep, swept.patch, &counts)?;
    spectrum.about_mut().events.clear();
    let areas = area::shown_areas(&spectrum, swept.n_tracked);
    Ok(Block { spectrum, shared: swept.shared, areas, counts })
}
