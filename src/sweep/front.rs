//! The front: the isosurface tracked where it is calm, exact where it is not.
//!
//! # Theory
//!
//! At every isovalue the surface is one mesh of two kinds of pieces. In the *exact* cells it is the exact extraction,
//! whose vertices slide along lattice edges. Everywhere else it is the *tracked* mesh, of vertices that are moved
//! with the isovalue and good triangles between them. Its boundary is the *seam*: the polyline of the exact
//! extraction on the squares between the two, so that nothing has to be matched while the isovalue moves.
//! Events take place in exact cells, so the tracked mesh knows none.

mod calendar;
mod check;
mod chords;
mod clusters;
mod exact;
mod exchange;
mod improve;
mod march;
mod mend;
mod part;
mod polyline;
mod record;
mod region;
mod remesh;
mod shared;
mod tracked;
mod transport;

use super::{Counts, Sweep};
use crate::error::Result;
use chords::split_chords;
use march::March;
use region::Grid;
use shared::Shared;

pub(super) use exact::Swept;
pub(crate) use shared::WholeEdge;

/// All of a sweep, as one patch.
pub(super) fn sweep(sweep: &Sweep, start: f64, counts: &mut Counts) -> Result<Swept> {
    let mut march = March::new(sweep);
    let mut kernels = sweep.backend.kernels(&sweep.field)?;
    march.run(start, &mut *kernels)?;
    log::info!("{:?}", march.tally);
    march.tally.tell(counts);
    let grid = Grid::of(&sweep.exact);
    let (low, high) = sweep.range;
    let mut shown = std::mem::take(&mut march.shown);
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
    let mut record = std::mem::take(&mut march.record);
    let n_tracked = record.lives.len();
    let mut inner = exact::extend(&mut record, &sweep.exact, &sweep.topology, &joined);
    log::info!("{n_tracked} tracked triangles, {} of exact cells", record.lives.len() - n_tracked);
    split_chords(&mut record.lives, &mut inner, &sweep.exact, sweep.range);
    let error = super::KNOT_SHARE * sweep.parameters.error as f32;
    Ok(exact::patch(record, &inner, &sweep.exact, sweep.range, error))
}
