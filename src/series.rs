//! Series of pictures and meshes: numbered files, films, and lists of files.
//!
//! [`Frames`] describes the pictures of a sweep over isovalues or of a turntable; a [`Series`] is where they are written.

mod film;
mod frames;
mod pattern;
mod pictures;
pub(crate) mod pvd;

pub use frames::{Frames, MAX_FRAMES, evenly_spaced};
pub use pattern::Pattern;
pub use pictures::Series;
