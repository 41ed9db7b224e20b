//! Writes a spectrum as a web page that needs no server and no network, or as one that is linked to a spectrum file on a server.
//!
//! The page contains the spectrum, the shaders, plain scripts (`page/*.js`) and styles; its content security policy forbids all
//! requests, but those to the origin of a linked file. It does not contain the volume, but its rounded samples if slices are wanted ([`Page::slice`]). It draws with the WGSL of [`crate::render`] on WebGPU, with a GLSL twin of it on
//! WebGL2, and shows a still picture where there is neither.
//!
//! The spectrum is stored as the columns of its file, predicted and deflated (`data`), in base64. Positions are rounded more than
//! in the file, to steps of [`Page::step`] voxels: a page is looked at, and coarser numbers take fewer bytes.
//!
//! # Invariants
//!
//! All input (title, caption, credit, names in the spectrum) is escaped: it becomes text of the page, never markup. Equal input
//! gives equal bytes.

mod compact;
mod curves;
mod data;
mod document;
mod field;
mod first;
mod knots;
mod link;
mod names;
mod options;
mod range;
mod script;
mod slice;
mod still;
mod template;
mod tokens;

pub use data::DEFAULT_STEP;
pub use document::{Sizes, html, linked};
pub use knots::with_fewer_knots;
pub use link::Link;
pub use options::{Look, Page};
pub use range::with_range;
pub use still::still;
