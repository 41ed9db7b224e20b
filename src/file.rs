//! The spectrum file, `.isp`, and the layout of the thesis. The reader and the writer of each part are in one file.
//!
//! FORMAT.md describes the file byte by byte. It is small because numbers are stored as
//! differences from predictions (`predict`) and entropy coded (`coder`). A mesh needs only some of its chunks, which form a tree (`tree`);
//! `encode` and `decode` go through this. A spectrum that was computed in bricks has a tree for each (`index`, `writer`, `read_patch`). It is safe to read from untrusted
//! sources: sections have lengths and checksums (`section`), the positions of chunks follow from their lengths (`container`), and the result passes
//! [`Spectrum::check`](crate::Spectrum::check).

mod by_rank;
mod coder;
mod column;
mod connectivity;
mod container;
mod copy;
mod counted;
mod decode;
mod encode;
mod facing;
mod file_query;
mod file_walk;
mod geometry;
mod header;
mod holes;
mod index;
mod living;
mod partial_spectrum;
mod parts;
mod path;
mod predict;
mod rank_intervals;
mod read_patch;
mod samples;
mod seam;
mod section;
mod source;
mod spectrum_file;
mod summary;
mod table_places;
mod tables;
pub mod thesis;
mod trajectories;
mod tree;
mod tree_walk;
mod triangles;
mod units;
mod writer;

pub use crate::atomic_file::{block_writes, final_path, parent_folder, write_atomically};
pub use crate::atomic_folder::{TemporaryFolder, WorkFolder};
pub use crate::output::Output;
pub use copy::copy;
pub use file_query::FileQuery;
pub(crate) use file_walk::FileWalk;
pub use header::{MAGIC, VERSION};
pub use partial_spectrum::PartialSpectrum;
pub(crate) use parts::Parts;
#[cfg(test)]
pub(crate) use spectrum_file::to_bytes_in_chunks_of;
pub use spectrum_file::{
    SpectrumFile, Written, from_bytes, in_file_order, into_bytes, read, to_bytes, write,
};
pub use summary::Summary;
pub(crate) use table_places::TablePlaces;
pub(crate) use units::Units;
pub(crate) use writer::{PackedTree, Shared, TreeWriter};
