//! Half-edge mesh: a closed oriented triangle 2-manifold that can be edited; measures of triangles.

mod bins;
mod check;
mod connectivity;
mod edit;
mod half_edge;
mod intersect;
mod measure;
mod replace;
#[cfg(test)]
pub(crate) mod shapes;

pub use connectivity::Connectivity;
pub use edit::{Collapsed, Flipped, SplitEdge};
pub use half_edge::{Compacted, Edge, Face, HalfEdge, HalfEdgeMesh, Spokes, Vertex};
pub use intersect::intersecting;
pub use measure::{area, bounds, nearest_on_triangle, normal, radius_ratio};
pub(crate) use replace::Replacement;
