//! A walk along the chunks of a file: the spectrum of those that an isovalue needs. Chunks that the next isovalue needs, too, stay in memory.

use std::collections::HashMap;
use std::ops::Range;
use std::sync::Arc;

use rayon::prelude::*;

use super::counted::{Counted, all_isovalues};
use super::decode::DecodedTree;
use super::index::IndexedTree;
use super::read_patch::{Chunks, append, wanted};
use super::spectrum_file::SpectrumFile;
use super::tree_walk::{TreeWalk, Walked};
use crate::error::Result;
use crate::spectrum::{About, Joiner, Patch, Spectrum};

/// A place in a file.
pub(crate) struct FileWalk {
    file: Arc<SpectrumFile>,
    /// Without events.
    about: About,
    trees: Vec<InTree>,
    /// The walk has been at all chunks of lower isovalues.
    next: f64,
    counted: Option<Counted>,
    /// Of the chunks in memory; none before it is asked for.
    spectrum: Option<Arc<Spectrum>>,
    numbers: Numbers,
    /// By key of a shared vertex, the number that it has in the file where it was met first.
    shared: HashMap<u64, u64>,
    /// By chunk of the file, the number of its first vertex; and the number of all.
    first_vertex: Vec<u64>,
}

/// The numbers in the file of the vertices of a spectrum.
enum Numbers {
    /// Those of each chunk, one after the other.
    Ranges(Vec<Range<u64>>),
    Each(Vec<u64>),
}

impl Default for Numbers {
    fn default() -> Self {
        Numbers::Ranges(Vec::new())
    }
}

/// A place in a tree.
#[derive(Default)]
struct InTree {
    walk: TreeWalk,
    /// The chunk without children where the walk is.
    end: Option<usize>,
    /// What was read there; in a file with one tree it becomes the spectrum.
    walked: Option<Walked>,
}

impl std::fmt::Debug for FileWalk {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("FileWalk").field("file", &self.file).finish_non_exhaustive()
    }
}

impl FileWalk {
    /// Without any chunk yet.
    pub(crate) fn new(file: Arc<SpectrumFile>) -> FileWalk {
        let index = &file.tables().index;
        let mut first_vertex = vec![0];
        for (i, size) in index.sizes().iter().enumerate() {
            first_vertex.push(first_vertex[i] + size.vertices);
        }
        FileWalk {
            about: file.tables().about.clone(),
            trees: (0..index.n_trees()).map(|_| InTree::default()).collect(),
            next: all_isovalues(file.tables()).first().copied().unwrap_or(0.0),
            counted: None,
            spectrum: None,
            numbers: Numbers::default(),
            shared: HashMap::new(),
            first_vertex,
            file,
        }
    }

    /// A walk that checks the whole file on its way: see [`FileWalk::finish`].
    pub(crate) fn counting(file: Arc<SpectrumFile>) -> FileWalk {
        FileWalk { counted: Some(Counted::new(file.tables())), ..FileWalk::new(file) }
    }

    pub(crate) fn file(&self) -> &Arc<SpectrumFile> {
        &self.file
    }

    /// Whether other chunks are needed at an isovalue than where the walk is.
    pub(crate) fn needs_others(&self, isovalue: f64) -> bool {
        let places = places(&self.file, isovalue);
        self.trees.iter().zip(places).any(|(tree, place)| tree.end != place.map(|place| place.end))
    }

    /// Walks to an isovalue: reads the chunks that it needs and that are not in memory. If the walk counts, `take` is called with birth and
    /// death of each triangle of chunks that were not read before, as ranks of [`FileWalk::isovalues`].
    ///
    /// # Errors
    ///
    /// [`Error::Input`](crate::Error::Input) if a chunk is damaged.
    pub(crate) fn to(&mut self, isovalue: f64, take: &mut dyn FnMut(u32, u32)) -> Result<()> {
        if !self.needs_others(isovalue) {
            return Ok(());
        }
        self.numbers = Numbers::default();
        // What is above the next chunk is taken from the old spectrum, which is dropped before chunks are read.
        let old = self.spectrum.take().map(|old| Arc::unwrap_or_clone(old).into_parts().1);
        if let ([tree], Some(old)) = (&mut self.trees[..], old) {
            tree.walk.keep(old);
        }
        let read = self.read(isovalue, take);
        if read.is_err() {
            self.trees.iter_mut().for_each(|tree| *tree = InTree::default());
        }
        read.map_err(|e| e.of_file(self.file.path()))
    }

    fn read(&mut self, isovalue: f64, take: &mut dyn FnMut(u32, u32)) -> Result<()> {
        let (tables, chunks, about) = (self.file.tables(), self.file.chunks(), &self.about);
        let trees = self.trees.par_iter_mut().zip(places(&self.file, isovalue));
        let moved: Vec<Result<bool>> =
            trees.map(|(tree, place)| tree.to(place, &chunks, about)).collect();
        for (i, (tree, is_new)) in self.trees.iter().zip(moved).enumerate() {
            let walked = tree.walked.as_ref().filter(|_| is_new.as_ref().is_ok_and(|new| *new));
            is_new?;
            if let (Some(counted), Some(walked)) = (&mut self.counted, walked) {
                counted.add(tables, (i, walked), take);
            }
        }
        Ok(())
    }

    /// Whether there are chunks of isovalues up to this one where the walk has not been.
    pub(crate) fn is_behind(&self, isovalue: f64) -> bool {
        self.next <= isovalue && self.next < f64::INFINITY
    }

    /// Walks from where it has not been yet up to an isovalue, as [`FileWalk::to`].
    ///
    /// # Errors
    ///
    /// As [`FileWalk::to`].
    pub(crate) fn up_to(&mut self, isovalue: f64, take: &mut dyn FnMut(u32, u32)) -> Result<()> {
        while self.is_behind(isovalue) {
            self.to(self.next, take)?;
            self.next = self.file.same_chunks(self.next).end;
        }
        Ok(())
    }

    /// Walks to the end, as [`FileWalk::up_to`]. If the walk counts, checks that the size of the whole and the collapses are as declared.
    ///
    /// # Errors
    ///
    /// As [`FileWalk::to`].
    pub(crate) fn finish(&mut self, take: &mut dyn FnMut(u32, u32)) -> Result<()> {
        self.up_to(f64::INFINITY, take)?;
        let checked = self.counted.iter().try_for_each(|counted| counted.check(self.file.tables()));
        checked.map_err(|e| e.of_file(self.file.path()))
    }

    /// The spectrum of the chunks where the walk is, without events. Its meshes elsewhere are incomplete.
    ///
    /// # Errors
    ///
    /// [`Error::Input`](crate::Error::Input) if trees contradict each other.
    pub(crate) fn spectrum(&mut self) -> Result<Arc<Spectrum>> {
        if let Some(spectrum) = &self.spectrum {
            return Ok(spectrum.clone());
        }
        let joined = match &mut self.trees[..] {
            [InTree { walked, .. }] => {
                let walked = walked.take();
                let chunks = walked.iter().flat_map(|walked| self.ranges_of(walked));
                self.numbers = Numbers::Ranges(chunks.collect());
                let patch = walked.map_or_else(Patch::empty, |walked| walked.tree.patch);
                // It was checked when it was read.
                Ok(Spectrum::unchecked(self.about.clone(), patch))
            }
            _ => self.joined().and_then(|patch| Spectrum::new(self.about.clone(), patch)),
        };
        let spectrum = Arc::new(joined.map_err(|e| e.of_file(self.file.path()))?);
        self.spectrum = Some(spectrum.clone());
        Ok(spectrum)
    }

    /// The isovalues of the whole.
    pub(crate) fn isovalues(&self) -> Vec<f64> {
        all_isovalues(self.file.tables())
    }

    /// The number of vertices in all trees. Numbers in the file are below it.
    pub(crate) fn n_vertices(&self) -> u64 {
        self.first_vertex.last().copied().unwrap_or(0)
    }

    /// The number in the file of a vertex of the spectrum, the same wherever the walk is.
    pub(crate) fn number_of(&self, vertex: u32) -> u64 {
        match &self.numbers {
            Numbers::Ranges(ranges) => {
                let mut first = 0;
                let found = ranges.iter().find_map(|range| {
                    let at = u64::from(vertex) - first;
                    first += range.end - range.start;
                    (u64::from(vertex) < first).then(|| range.start + at)
                });
                found.expect("a vertex of the spectrum")
            }
            Numbers::Each(numbers) => numbers[vertex as usize],
        }
    }

    /// The chunks of all trees as one patch.
    fn joined(&mut self) -> Result<Patch> {
        let mut joiner = Joiner::default();
        let mut numbers = Vec::new();
        for walked in self.trees.iter().filter_map(|tree| tree.walked.as_ref()) {
            let DecodedTree { patch, shared } = &walked.tree;
            let mut in_file: Vec<u64> = self.ranges_of(walked).flatten().collect();
            for &(v, key) in shared {
                let number = &mut in_file[v as usize];
                *number = *self.shared.entry(key).or_insert(*number);
            }
            let (first, last) = (walked.chunks[0], walked.chunks[walked.chunks.len() - 1]);
            let in_whole = append(&mut joiner, (patch, shared), &(first..last + 1))?;
            for (in_whole, in_file) in in_whole.into_iter().zip(in_file) {
                // Other vertices were in an earlier tree.
                if in_whole as usize == numbers.len() {
                    numbers.push(in_file);
                }
            }
        }
        self.numbers = Numbers::Each(numbers);
        Ok(joiner.finish())
    }

    /// The numbers of vertices in the file, by chunk.
    fn ranges_of(&self, walked: &Walked) -> impl Iterator<Item = Range<u64>> {
        walked.chunks.iter().map(|&i| self.first_vertex[i]..self.first_vertex[i + 1])
    }
}

/// Where an isovalue is in a tree.
#[derive(Clone, Copy)]
struct Place<'a> {
    tree: IndexedTree<'a>,
    rank: u32,
    /// The last chunk on the way from the root.
    end: usize,
}

/// By tree, the place of an isovalue; none in trees without triangles there.
fn places(file: &SpectrumFile, isovalue: f64) -> Vec<Option<Place<'_>>> {
    let tables = file.tables();
    let mut places = vec![None; tables.index.n_trees()];
    for (tree, ranks) in wanted(tables, &(isovalue..=isovalue)) {
        let rank = *ranks.start();
        let end = tree.tree.at(rank..=rank).last().unwrap_or(0);
        places[tree.number] = Some(Place { tree, rank, end });
    }
    places
}

impl InTree {
    /// Walks to a place, or forgets all chunks if there is none. Returns whether chunks were read.
    fn to(&mut self, place: Option<Place>, chunks: &Chunks, about: &About) -> Result<bool> {
        let Some(Place { tree, rank, end }) = place else {
            *self = InTree::default();
            return Ok(false);
        };
        if self.end == Some(end) {
            return Ok(false);
        }
        if let Some(walked) = self.walked.take() {
            self.walk.keep(walked.tree.patch);
        }
        let mut walked = chunks.with_decoder(tree, |decoder| self.walk.to(decoder, rank))?;
        let checked = Spectrum::new(about.clone(), walked.tree.patch)?;
        walked.tree.patch = checked.into_parts().1;
        (self.walked, self.end) = (Some(walked), Some(end));
        Ok(true)
    }
}
