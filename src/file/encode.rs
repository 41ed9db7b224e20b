//! From a spectrum to the contents of its chunks.

use std::ops::Range;
use std::sync::atomic::{AtomicU32, Ordering};

use rayon::prelude::*;

use super::column::Content;
use super::connectivity::{FileOrder, Input, Traversal, traverse};
use super::geometry::write_geometry;
use super::index::ChunkSize;
use super::path::Path;
use super::predict::Surroundings;
use super::samples::Samples;
use super::trajectories::{Ranks, write_ranks};
use super::tree::Tree;
use super::triangles::write_triangles;
use super::units::Units;
use crate::error::Result;
use crate::grouped::grouped;
use crate::spectrum::{Collapse, Knot, Patch, Spectrum, Triangle};

/// Chunks below a chunk are encoded or decoded in parallel if they have at least one in so many of all triangles.
pub(super) const PARALLEL_SHARES: u64 = 8;

/// For [`encode`]: the number of chunks of the file is not known yet. Limits that a reader divides by it are taken to be 0.
pub(super) const UNKNOWN: usize = usize::MAX;

/// A spectrum in chunks.
pub(super) struct Encoded {
    /// The spectrum in the order of the file: chunk after chunk.
    pub(super) spectrum: Spectrum,
    /// By vertex, its number in the original spectrum.
    pub(super) order: Vec<u32>,
    /// By chunk of the tree.
    pub(super) chunks: Vec<ChunkContents>,
}

/// The contents of the sections of a chunk.
pub(super) struct ChunkContents {
    pub(super) size: ChunkSize,
    /// Vertices that are in none of its triangles.
    pub(super) n_unused: usize,
    /// `VERT`, `TRIA` and `POSN`.
    pub(super) sections: [Content<'static>; 3],
}

/// A chunk, and its vertices in the order of the file.
struct EncodedChunk {
    contents: ChunkContents,
    /// Numbers in the original spectrum.
    vertices: Vec<u32>,
}

/// Encodes a spectrum, whose positions must be rounded as by [`Units::rounded`] unless these units have no other rounding along the surface, as
/// one tree of a file with so many chunks in all; [`UNKNOWN`] serves for any number.
///
/// # Errors
///
/// [`crate::Error::Input`] if vertices with many knots have more neighbours than a reader accepts, which no mesh has.
pub(super) fn encode(
    spectrum: Spectrum,
    tree: &Tree,
    n_chunks: usize,
    units: Units,
) -> Result<Encoded> {
    // The triangles are changed in place, and all else stays until they are in the order of the file.
    let (about, mut patch) = spectrum.into_parts();
    let (starts, mut triangles) = by_chunk(tree, std::mem::take(&mut patch.triangles));
    let rest = Spectrum::unchecked(about, patch);
    let encoder = Encoder::new(&rest, (&starts, &triangles), tree, (n_chunks, units));
    let chunks = encoder.below(0, &mut Path::default(), &mut triangles)?;
    drop(encoder);
    let n_vertices = rest.n_vertices();
    let (about, patch) = rest.into_parts();
    let Patch { isovalues, first_knot, knots, collapses, .. } = patch;
    let mut order = Vec::with_capacity(n_vertices);
    let mut contents = Vec::with_capacity(chunks.len());
    for chunk in chunks {
        order.extend(chunk.vertices);
        contents.push(chunk.contents);
    }
    let mut number = vec![0; n_vertices];
    let mut new_first = Vec::with_capacity(n_vertices + 1);
    new_first.push(0);
    let mut new_knots = Vec::with_capacity(knots.len());
    for (&v, new) in order.iter().zip(0..) {
        number[v as usize] = new;
        let [from, to] = [v as usize, v as usize + 1].map(|v| first_knot[v] as usize);
        new_knots.extend_from_slice(&knots[from..to]);
        new_first.push(new_knots.len() as u32);
    }
    let renumbered = |c: &Collapse| Collapse {
        vertex: number[c.vertex as usize],
        target: number[c.target as usize],
        ..*c
    };
    let collapses = collapses.iter().map(renumbered).collect();
    let (first_knot, knots) = (new_first, new_knots);
    let patch = Patch { isovalues, first_knot, knots, triangles, collapses };
    Ok(Encoded { spectrum: Spectrum::unchecked(about, patch), order, chunks: contents })
}

/// Triangles by chunk, those of a chunk by birth, otherwise in their order; and where each chunk begins, with the end.
fn by_chunk(tree: &Tree, triangles: Vec<Triangle>) -> (Vec<usize>, Vec<Triangle>) {
    // A number for each chunk and rank of its span.
    let mut first_number = vec![0u32];
    for (i, chunk) in tree.chunks().iter().enumerate() {
        first_number.push(first_number[i] + chunk.span.len() as u32);
    }
    let numbered = triangles.iter().map(|t| {
        let chunk = tree.chunk_of(t) as usize;
        (first_number[chunk] + (t.birth - tree.chunks()[chunk].span.start), *t)
    });
    let n = first_number[tree.chunks().len()];
    let (starts, sorted) = grouped(n as usize, numbered);
    (first_number.iter().map(|&first| starts[first as usize] as usize).collect(), sorted)
}

struct Encoder<'a> {
    /// Without its triangles.
    spectrum: &'a Spectrum,
    tree: &'a Tree,
    n_chunks: usize,
    units: Units,
    samples: Samples,
    /// By vertex of the spectrum.
    is_lattice: Vec<bool>,
    /// By chunk, the number of its first triangle, and at the end the number of all; and its vertices: numbers in the spectrum.
    first_triangle: &'a [usize],
    vertices: Vec<Vec<u32>>,
    /// By vertex of the spectrum: its chunk, its place in the list of this chunk, and its number on the path once that is known.
    chunk_of: Vec<u32>,
    place: Vec<u32>,
    on_path: Vec<AtomicU32>,
    /// By chunk, the number of its first vertex in the file.
    first_vertex: Vec<u32>,
}

impl<'a> Encoder<'a> {
    /// An encoder of a spectrum whose triangles are apart, by chunk.
    fn new(
        spectrum: &'a Spectrum,
        (first_triangle, triangles): (&'a [usize], &[Triangle]),
        tree: &'a Tree,
        (n_chunks, units): (usize, Units),
    ) -> Self {
        let samples = Samples::new(spectrum.volume(), units);
        let n_vertices = spectrum.n_vertices();
        let all = (0..n_vertices as u32).into_par_iter();
        let is_lattice = all.map(|v| samples.edge_of(spectrum.trajectory(v)).is_some()).collect();
        let n = tree.chunks().len();
        let mut chunk_of = vec![u32::MAX; n_vertices];
        for (chunk, range) in (0..).zip(first_triangle.windows(2)) {
            for v in triangles[range[0]..range[1]].iter().flat_map(|t| t.vertices) {
                let of_vertex = &mut chunk_of[v as usize];
                *of_vertex =
                    if *of_vertex == u32::MAX { chunk } else { tree.common(*of_vertex, chunk) };
            }
        }
        let mut vertices = vec![Vec::new(); n];
        let mut place = vec![0; n_vertices];
        for v in 0..n_vertices {
            // Vertices without a triangle are the last ones of the file.
            chunk_of[v] = chunk_of[v].min(n as u32 - 1);
            let of_chunk = &mut vertices[chunk_of[v] as usize];
            place[v] = of_chunk.len() as u32;
            of_chunk.push(v as u32);
        }
        let mut first_vertex = Vec::with_capacity(n);
        let mut n = 0;
        for of_chunk in &vertices {
            first_vertex.push(n);
            n += of_chunk.len() as u32;
        }
        let on_path = (0..n_vertices).map(|_| AtomicU32::new(0)).collect();
        Encoder {
            spectrum,
            tree,
            n_chunks,
            units,
            samples,
            is_lattice,
            first_triangle,
            vertices,
            chunk_of,
            place,
            on_path,
            first_vertex,
        }
    }

    /// Encodes a chunk and those below it, in pre-order, and brings their triangles in the order of the file. The path ends above the chunk, then and
    /// afterwards.
    fn below(
        &self,
        i: usize,
        path: &mut Path,
        triangles: &mut [Triangle],
    ) -> Result<Vec<EncodedChunk>> {
        let end_above = path.end();
        let chunk = &self.tree.chunks()[i];
        let n = triangles.len();
        let (own, below) = triangles.split_at_mut(self.n_triangles(i..i + 1));
        let mut all = vec![self.chunk(i, path, own)?];
        if chunk.pivot.is_some() {
            let [first, second] = self.tree.children(i);
            let (of_first, of_second) = below.split_at_mut(self.n_triangles(first..second));
            if n as u64 * PARALLEL_SHARES >= self.n_triangles(0..self.tree.chunks().len()) as u64 {
                let mut other = path.clone();
                let (a, b) = rayon::join(
                    || self.below(first, path, of_first),
                    || self.below(second, &mut other, of_second),
                );
                all.extend(a?.into_iter().chain(b?));
            } else {
                all.extend(self.below(first, path, of_first)?);
                all.extend(self.below(second, path, of_second)?);
            }
        }
        path.truncate(end_above);
        Ok(all)
    }

    /// The number of triangles in some chunks.
    fn n_triangles(&self, chunks: Range<usize>) -> usize {
        self.first_triangle[chunks.end] - self.first_triangle[chunks.start]
    }

    /// Encodes a chunk and appends it to the path. Its triangles are brought in the order of the file.
    fn chunk(&self, i: usize, path: &mut Path, own: &mut [Triangle]) -> Result<EncodedChunk> {
        let chunk = &self.tree.chunks()[i];
        let n_above = path.n_vertices();
        let (mut order, traversal) = self.traversed(i, path, own);
        let FileOrder { triangles: numbers, corners, vertices, .. } = &mut order;
        let n_used = corners.as_flattened().iter().map(|&v| v + 1).max().unwrap_or(0).max(n_above);
        let in_spectrum = |&local: &u32| self.vertices[i][(local - n_above) as usize];
        let vertices: Vec<u32> = vertices[n_above as usize..].iter().map(in_spectrum).collect();
        let mut ranks = Ranks::default();
        for (&v, k) in vertices.iter().zip(0..) {
            self.on_path[v as usize].store(n_above + k, Ordering::Relaxed);
            let knots: &[Knot] = self.spectrum.trajectory(v);
            ranks.push(knots.iter().map(|knot| knot.rank), self.is_lattice[v as usize]);
            path.positions.extend(knots.iter().map(|knot| self.units.of(knot)));
            path.numbers.push(self.first_vertex[i] + k);
        }
        path.ranks.append(&ranks);
        permute(own, numbers);
        own.par_iter_mut().zip(&*corners).for_each(|(t, corners)| t.vertices = *corners);
        // Large lists are dropped as soon as possible.
        (order.triangles, order.corners) = (Vec::new(), Vec::new());
        let n_isovalues = self.spectrum.isovalues().len() as u32;
        let of = Surroundings {
            ranks: &path.ranks,
            isovalues: self.spectrum.isovalues(),
            triangles: own,
            n_above,
            pivot: chunk.pivot,
            n_chunks: self.n_chunks,
        };
        let (triangles, (vert, positions)) = rayon::join(
            || write_triangles((&order, &traversal), of),
            || {
                let vert = write_ranks(&ranks, chunk.pivot, n_isovalues);
                (vert, write_geometry(of, &mut path.positions, &self.samples))
            },
        );
        let size = ChunkSize {
            vertices: vertices.len() as u64,
            knots: ranks.ranks.len() as u64,
            triangles: own.len() as u64,
            ..ChunkSize::default()
        };
        let n_unused = (path.n_vertices() - n_used) as usize;
        let contents = ChunkContents { size, n_unused, sections: [vert, triangles, positions?] };
        if chunk.pivot.is_some() {
            path.triangles.extend_from_slice(own);
        }
        for t in own {
            t.vertices = t.vertices.map(|v| path.numbers[v as usize]);
        }
        Ok(EncodedChunk { contents, vertices })
    }

    /// The order of a chunk, and its connectivity. Its triangles get local numbers of vertices.
    fn traversed(&self, i: usize, path: &Path, own: &mut [Triangle]) -> (FileOrder, Traversal) {
        let n_above = path.n_vertices();
        let vertices = &self.vertices[i];
        let local = |v: u32| match self.chunk_of[v as usize] as usize == i {
            true => n_above + self.place[v as usize],
            false => self.on_path[v as usize].load(Ordering::Relaxed),
        };
        own.par_iter_mut().for_each(|t| t.vertices = t.vertices.map(local));
        let own_of = |local: u32| local.checked_sub(n_above).map(|k| vertices[k as usize]);
        let life = |local: u32| match own_of(local) {
            None => path.ranks.life(local),
            Some(v) => {
                let knots = self.spectrum.trajectory(v);
                Some((knots.first()?.rank, knots.last()?.rank))
            }
        };
        let is_lattice = |local: u32| match own_of(local) {
            None => path.ranks.is_lattice(local),
            Some(v) => self.is_lattice[v as usize],
        };
        traverse(&Input {
            triangles: own,
            n_vertices: n_above + vertices.len() as u32,
            chunk: &self.tree.chunks()[i],
            above: path,
            life: &life,
            is_lattice: &is_lattice,
        })
    }
}

/// Brings items in an order: by place, the number of the item that belongs there, each once. All numbers are lost.
fn permute<T: Copy>(items: &mut [T], order: &mut [u32]) {
    for start in 0..items.len() {
        let first = items[start];
        let mut at = start;
        loop {
            let next = std::mem::replace(&mut order[at], at as u32) as usize;
            if next == start {
                items[at] = first;
                break;
            }
            items[at] = items[next];
            at = next;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn items_are_brought_in_an_order() {
        let mut items = ['a', 'b', 'c', 'd', 'e', 'f'];
        permute(&mut items, &mut [2, 1, 4, 5, 0, 3]);
        assert_eq!(items, ['c', 'b', 'e', 'f', 'a', 'd']);
    }
}
