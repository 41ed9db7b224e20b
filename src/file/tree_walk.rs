//! A walk along the chunks of a tree. The chunks above the one that is read stay in memory, so a walk towards higher isovalues reads
//! each chunk once.

use super::decode::{Appended, DecodedTree, Decoder};
use super::index::ChunkSize;
use super::path::{Path, PathEnd};
use crate::error::Result;
use crate::spectrum::Patch;

/// A place in a tree: what is above a chunk without children.
#[derive(Default)]
pub(super) struct TreeWalk {
    /// From the root on.
    above: Vec<Above>,
    /// The length of the path with all of them.
    end: PathEnd,
    /// By vertex of this path.
    is_lattice: Vec<bool>,
    /// The path, if what was read last was [kept](TreeWalk::keep).
    kept: Option<Patch>,
}

/// A chunk with children.
struct Above {
    /// Its number in the tree.
    number: usize,
    /// The length of the path above it.
    start: PathEnd,
    /// Its shared vertices, in numbers of the path.
    shared: Vec<(u32, u64)>,
}

/// The chunks from the root to one without children.
pub(super) struct Walked {
    pub(super) tree: DecodedTree,
    /// The numbers of these chunks in the file.
    pub(super) chunks: Vec<usize>,
}

impl TreeWalk {
    /// Keeps what is above the chunk where the walk is, of the patch that was read there. Otherwise it is read again.
    pub(super) fn keep(&mut self, mut patch: Patch) {
        patch.first_knot.truncate(self.end.vertices + 1);
        patch.knots.truncate(self.end.knots);
        patch.triangles.truncate(self.end.triangles);
        patch.knots.shrink_to_fit();
        patch.triangles.shrink_to_fit();
        self.kept = Some(patch);
    }

    /// Walks to a rank and reads the chunks with the triangles that are alive there, but those that are in memory already.
    ///
    /// # Errors
    ///
    /// As [`Decoder::decode`].
    pub(super) fn to(&mut self, decoder: &Decoder, rank: u32) -> Result<Walked> {
        let walked = self.read(decoder, rank);
        if walked.is_err() {
            *self = TreeWalk::default();
        }
        walked
    }

    fn read(&mut self, decoder: &Decoder, rank: u32) -> Result<Walked> {
        let chunks: Vec<usize> = decoder.tree.tree.at(rank..=rank).collect();
        let mut size = ChunkSize::default();
        chunks.iter().for_each(|&i| size.add(&decoder.tree.sizes[i]));
        size.check_sum()?;
        let mut path = self.path_to(decoder, &chunks);
        let mut number = chunks[self.above.len()];
        let mut unpacked = decoder.unpack(number)?;
        loop {
            let (start, first) = (path.end(), path.n_vertices());
            // The next chunk is unpacked by itself, while this one is put together.
            let next = chunks.get(self.above.len() + 1);
            let (appended, after) = decoder.join(
                || decoder.append(number, unpacked, &mut path),
                || next.map(|&next| decoder.unpack(next).map(|unpacked| (next, unpacked))),
            );
            let Appended { triangles, mut shared } = appended?;
            shared.iter_mut().for_each(|(v, _)| *v += first);
            let Some(after) = after else {
                self.end = start;
                self.is_lattice = path.ranks.is_lattice[..start.vertices].to_vec();
                let above = self.above.iter().flat_map(|above| &above.shared).copied();
                let tree = decoder.of_path(path, triangles, above.chain(shared).collect());
                let chunks = chunks.iter().map(|i| decoder.tree.first + i).collect();
                return Ok(Walked { tree, chunks });
            };
            path.triangles.extend(triangles);
            self.above.push(Above { number, start, shared });
            (number, unpacked) = after?;
        }
    }

    /// The path with those of some chunks that are in memory. All others are forgotten.
    fn path_to(&mut self, decoder: &Decoder, chunks: &[usize]) -> Path {
        let Some(kept) = self.kept.take() else {
            *self = TreeWalk::default();
            return Path::default();
        };
        let mut path = decoder.path_of(&kept, std::mem::take(&mut self.is_lattice));
        let n_same = self.above.iter().zip(chunks).take_while(|(a, i)| a.number == **i).count();
        if let Some(first) = self.above.get(n_same) {
            path.truncate(first.start);
            self.above.truncate(n_same);
        }
        path
    }
}
