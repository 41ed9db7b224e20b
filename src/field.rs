//! The trilinear field in single precision: its values, rays through it, and how a vertex reaches an isosurface.
//!
//! The kernels that move vertices ([`crate::kernels`]) and the criteria of remeshing compute with it. Topology has an exact
//! field of its own ([`crate::topology`]), and verification follows lines in f64.
//!
//! | module | WGSL twin | subject |
//! |---|---|---|
//! | `grid` | `grid.wgsl` | [`Field`]: samples, the layer around them, values and gradients |
//! | [`ray`] | `ray.wgsl` | the first crossing of an isovalue along a ray |
//! | [`step`] | `step.wgsl` | how one vertex reaches an isosurface |
//! | `deviation` | | the distance of a face from the isosurface |

mod deviation;
mod grid;
pub mod ray;
pub mod step;

pub use deviation::face_deviation;
pub use grid::Field;
pub use step::{Status, project_point};
