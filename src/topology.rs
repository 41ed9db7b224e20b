//! The topology of every isosurface of a volume: critical points, events, components.

pub mod exact;
