//! Bricks: a volume cut into blocks that are swept apart, by as many processes as there are, and joined.
//!
//! # Theory
//!
//! A brick has the samples on its border in common with the bricks beside it. The layer around a swept block is exact, so
//! its surface ends there at the polyline of the exact extraction, which depends on the samples of the border alone: both
//! sides have the same vertices, one per lattice edge, with the same trajectories and lifetimes, bit by bit. So a merge
//! concatenates the parts and unites the vertices of equal lattice edges. Nothing is matched, and a difference is an error.
//!
//! The events of the volume are no sum over bricks. Each tells of the critical points that it owns and where walks from there end,
//! which is all that the sweeps of the whole ask for ([`crate::topology::blocks`]): they are exact, and the volume is not needed
//! as a whole.
//!
//! # Invariants
//!
//! - Bricks depend on the dimensions of the volume and the side asked for alone, and the order in which parts are joined on
//!   their numbers: the bytes of the result do not depend on who computed which part when.
//! - A part names the hash of all that it was made from ([`Plan::hash`]), the samples included.

mod columns;
mod critical;
mod local;
mod part;
mod parts;
mod plan;
mod source;
mod split;
mod survey;
mod unite;

pub use local::{Limits, compute_parts, part_of};
pub use part::{Border, Part, PartHead};
pub use parts::Parts;
pub use plan::{Blocks, Brick, Plan, Recipe, cut};
pub use source::{Held, Opened, ReadBlocks, Source};
pub use split::merge_to_folder;
pub use survey::Survey;
pub use unite::merge;

/// Cells along the side of a brick where nothing else is asked for.
pub const SIDE: usize = 128;
