//! Bricks: a volume is cut into blocks that are swept independently, by any number of processes, and merged.
//!
//! # Theory
//!
//! Neighbouring bricks share a plane of samples. The layer around a swept block is exact, so its surface ends there at the
//! polyline of the exact extraction, which depends on the samples of the plane alone. Both sides therefore have the same
//! vertices, one per lattice edge, with the same trajectories and lifetimes, bit by bit. A merge concatenates the parts and unites
//! vertices of equal lattice edges; no geometry is matched, and a difference is an error.
//!
//! The events of the volume are not the sum of the events of its bricks. Each brick contributes the critical points that it owns and
//! the ends of the monotone walks that start in it, from which the events of the whole are joined exactly
//! ([`crate::topology::blocks`]), without the whole volume in memory.
//!
//! # Invariants
//!
//! - The bricks depend only on the dimensions of the volume and the requested side, and parts are merged in the order of their
//!   numbers: the bytes of the result do not depend on who computes which part when.
//! - A part names the hash of everything it was computed from ([`Plan::hash`]), including the samples.

mod blocks;
mod columns;
mod critical;
mod head;
mod local;
mod merge;
mod merge_file;
mod part;
mod parts;
mod plan;
mod source;
mod strategy;
mod survey;

pub use blocks::{Blocks, check_side, cut};
pub use head::PartHead;
pub use local::{BrickLimits, compute_part, compute_parts};
pub use merge::merge;
pub use merge_file::{Merged, merge_to_file, merge_to_path};
pub use part::{Part, PartBorder};
pub use parts::Parts;
pub use plan::{Brick, Plan, Recipe, SIDE};
pub use source::{OpenVolume, ReadBlocks, SampleBox, VolumeSource};
pub use strategy::{Strategy, is_divisible, side_within};
pub use survey::Survey;
