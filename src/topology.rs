//! Topology of the isosurface at every isovalue, exactly: events, arcs, components, Euler
//! characteristic.
//!
//! # Theory
//!
//! The field is made generic by an invisibly small ramp ([`exact`]); then the trilinear field
//! has simple critical points only, found by local analysis ([`critical`]). Two union-find sweeps
//! give the components of {f <= c} and of {f > c} (`merge`), both together the contour tree
//! (`contour_tree`), whose arcs are the isosurface components: each separates the volume, with one
//! component of {f <= c} on one side and one of {f > c} on the other.
//!
//! The layer around the volume counts as one point: the padded volume with its border collapsed is
//! a 3-sphere, and the layer is its lowest minimum ([`Outside::Low`]) or highest maximum
//! ([`Outside::High`]). The alternating sum of all critical points of a 3-sphere is 0; it is checked
//! on every run, also in release builds, as are the properties listed in `contour_tree`.
//!
//! # Invariants
//!
//! Events are ascending in the generic field. An event at exactly the isovalue c has happened at c:
//! everything here is continuous from the right.
//!
//! [`Outside::Low`]: crate::volume::Outside::Low
//! [`Outside::High`]: crate::volume::Outside::High

mod arcs;
pub mod blocks;
mod compute;
mod contour_tree;
pub mod critical;
pub mod dust;
mod event;
pub mod exact;
mod merge;
mod net;
mod pairs;
pub mod simplify;

pub use arcs::Arc;
pub use compute::Topology;
pub use event::{Event, EventKind, TopologyEvent};
pub use pairs::ExtremumPair;
