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
mod cause;
mod check;
mod chords;
mod clusters;
mod compute;
mod context;
mod counts;
mod exact;
mod exchange;
mod exchanged;
mod fans;
mod initial;
mod isovalue_ranks;
mod join;
mod life;
mod march;
mod parameters;
mod part;
mod patch;
mod places;
mod polyline;
mod ranked_set;
mod record;
mod region;
mod remesh;
mod repair;
mod seam_triangles;
mod shared;
mod stages;
mod thin;
mod track;
mod tracked;
mod transport;

pub(crate) use area::insert_area_shares;
pub use area::{TRACKED_AREA_SHARE, TRACKED_AREA_SHARES};
pub use block::{Block, compute_block};
pub use compute::compute;
pub(crate) use compute::compute_known;
pub(crate) use compute::metadata;
pub use counts::Counts;
pub use parameters::Parameters;
