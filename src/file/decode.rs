//! From the chunks of a tree to a patch, or to the part of it that some ranks need.

use std::borrow::Cow;
use std::ops::RangeInclusive;

use super::encode::PARALLEL_SHARES;
use super::geometry::{PositionReader, read_geometry};
use super::header::in_section;
use super::index::{ChunkSize, IndexedTree};
use super::path::Path;
use super::predict::Surroundings;
use super::samples::Samples;
use super::seam::read_seam;
use super::section::{MAX_NUMBERS_PER_BYTE_OF_CHUNK, Section, split_section};
use super::trajectories::{Ranks, read_ranks};
use super::triangles::{ChunkTables, TriangleColumns, read_triangles};
use super::units::Units;
use crate::error::{Error, Result};
use crate::numbers::exact;
use crate::spectrum::{Knot, Patch, Triangle};

/// The number of vertices without a triangle in a chunk is at most this, divided by the number of chunks, plus [`UNUSED_PER_BYTE`] for each stored
/// byte of sections `VERT` and `POSN`. Without a limit a small file could have millions of them.
const FREE_UNUSED_VERTICES: usize = 4096;
pub(super) const UNUSED_PER_BYTE: usize = 2;

/// Chunks of fewer triangles in all are read on the thread of the caller: other threads would need memory of their own, and gain nothing.
const MIN_PARALLEL: u64 = 20_000;

/// The tables of a file that the chunks of one of its trees refer to.
pub(super) struct Decoder<'a, 's> {
    pub(super) tree: IndexedTree<'a>,
    /// Chunks of all trees.
    pub(super) n_chunks: usize,
    /// Whether chunks have a section `SEAM`.
    pub(super) has_seam: bool,
    pub(super) isovalues: &'a [f64],
    pub(super) samples: &'a Samples,
    pub(super) units: Units,
    /// The bytes of a chunk of the file.
    pub(super) bytes: &'a (dyn Fn(usize) -> Result<Cow<'s, [u8]>> + Sync),
}

/// Vertices and triangles of a tree.
pub(super) struct DecodedTree {
    pub(super) patch: Patch,
    /// Vertices that other trees may contain, too, ascending, with their keys.
    pub(super) shared: Vec<(u32, u64)>,
}

/// A chunk that was read.
struct DecodedChunk {
    ranks: Ranks,
    positions: Vec<[i32; 3]>,
    /// With vertices in numbers of the result.
    triangles: Vec<Triangle>,
    /// With vertices in numbers of the chunk.
    shared: Vec<(u32, u64)>,
}

/// Which chunks are read.
struct Wanted {
    /// By chunk, whether it is read.
    is_read: Vec<bool>,
    /// By chunk, the number of its first vertex among those that are read.
    first_vertex: Vec<u32>,
    /// Of all of them.
    size: ChunkSize,
}

impl Decoder<'_, '_> {
    /// The vertices and triangles of all chunks that contain triangles alive at the ranks, in the order of the file. Others may be among
    /// them. There are no collapses.
    ///
    /// # Errors
    ///
    /// Those of reading the bytes of a chunk; [`Error::Input`] if these are damaged.
    pub(super) fn decode(&self, ranks: RangeInclusive<u32>) -> Result<DecodedTree> {
        let wanted = self.wanted(ranks)?;
        let chunks = self.below(0, self.unpack(0)?, &wanted, &mut Path::default())?;
        Ok(self.joined(chunks, wanted.size))
    }

    /// Chunks of this size together, in the order of the file, as one.
    fn joined(&self, chunks: Vec<DecodedChunk>, size: ChunkSize) -> DecodedTree {
        let mut ranks = Ranks::default();
        let mut knots = Vec::with_capacity(size.knots as usize);
        let (mut triangles, mut shared) = (Vec::new(), Vec::new());
        for chunk in chunks {
            let first = ranks.n_vertices();
            shared.extend(chunk.shared.iter().map(|&(v, key)| (first + v, key)));
            ranks.append(&chunk.ranks);
            knots.extend(self.knots(&chunk.ranks, &chunk.positions));
            push_all(&mut triangles, chunk.triangles, size.triangles as usize);
        }
        self.patch(ranks.first_knot, knots, triangles, shared)
    }

    /// The chunks of a path, which ends with a chunk without children that has these triangles.
    pub(super) fn of_path(
        &self,
        path: Path,
        last: Vec<Triangle>,
        shared: Vec<(u32, u64)>,
    ) -> DecodedTree {
        let Path { ranks, positions, mut triangles, .. } = path;
        let knots = self.knots(&ranks, &positions).collect();
        drop(positions);
        let n = triangles.len() + last.len();
        push_all(&mut triangles, last, n);
        self.patch(ranks.first_knot, knots, triangles, shared)
    }

    /// The path with the first vertices and triangles of a patch, given which vertices are lattice vertices.
    pub(super) fn path_of(&self, patch: &Patch, is_lattice: Vec<bool>) -> Path {
        let Patch { first_knot, knots, triangles, .. } = patch;
        let ranks = knots.iter().map(|knot| knot.rank).collect();
        Path {
            ranks: Ranks { first_knot: first_knot.clone(), ranks, is_lattice },
            positions: knots.iter().map(|knot| self.units.of(knot)).collect(),
            triangles: triangles.clone(),
            numbers: Vec::new(),
        }
    }

    fn knots(&self, ranks: &Ranks, positions: &[[i32; 3]]) -> impl Iterator<Item = Knot> {
        let position = |x: &[i32; 3]| x.map(|x| self.units.coordinate(x));
        let knots = ranks.ranks.iter().zip(positions);
        knots.map(move |(&rank, x)| Knot { rank, position: position(x) })
    }

    fn patch(
        &self,
        first_knot: Vec<u32>,
        knots: Vec<Knot>,
        triangles: Vec<Triangle>,
        shared: Vec<(u32, u64)>,
    ) -> DecodedTree {
        let isovalues = self.isovalues.to_vec();
        let patch = Patch { isovalues, first_knot, knots, triangles, collapses: Vec::new() };
        DecodedTree { patch, shared }
    }

    /// By chunk of the tree.
    fn sizes(&self) -> &[ChunkSize] {
        self.tree.sizes
    }

    fn wanted(&self, ranks: RangeInclusive<u32>) -> Result<Wanted> {
        let mut is_read = vec![false; self.sizes().len()];
        self.tree.tree.at(ranks).for_each(|i| is_read[i] = true);
        let (mut first_vertex, mut size) = (Vec::new(), ChunkSize::default());
        for (of_chunk, &is_read) in self.sizes().iter().zip(&is_read) {
            first_vertex.push(size.vertices as u32);
            if is_read {
                size.add(of_chunk);
            }
        }
        size.check_sum()?;
        Ok(Wanted { is_read, first_vertex, size })
    }

    /// Reads a chunk, which is unpacked, and those below it, in pre-order. The path ends above the chunk, then and afterwards.
    fn below(
        &self,
        i: usize,
        unpacked: Unpacked,
        wanted: &Wanted,
        path: &mut Path,
    ) -> Result<Vec<DecodedChunk>> {
        let end_above = path.end();
        let chunk = &self.tree.tree.chunks()[i];
        let children = chunk.pivot.map(|_| self.tree.tree.children(i));
        let [first, second] = children.map_or([None; 2], |children| {
            children.map(|child| Some(child).filter(|&child| wanted.is_read[child]))
        });
        // Chunks are unpacked by themselves, while those above are put together.
        let unpack = |child: Option<usize>| child.map(|child| self.unpack(child)).transpose();
        let (built, (first_unpacked, second_unpacked)) = self.join(
            || self.built(i, unpacked, wanted.first_vertex[i], path),
            || self.join(|| unpack(first), || unpack(second)),
        );
        let mut all = vec![built?];
        let first = first.zip(first_unpacked?);
        let second = second.zip(second_unpacked?);
        let n: u64 = self.sizes()[i..chunk.end].iter().map(|size| size.triangles).sum();
        let is_large = n.saturating_mul(PARALLEL_SHARES) >= wanted.size.triangles;
        match (first, second) {
            (Some((first, a)), Some((second, b))) if is_large => {
                let mut other = path.clone();
                let (a, b) = self.join(
                    || self.below(first, a, wanted, path),
                    || self.below(second, b, wanted, &mut other),
                );
                all.extend(a?.into_iter().chain(b?));
            }
            children => {
                for (child, unpacked) in [children.0, children.1].into_iter().flatten() {
                    all.extend(self.below(child, unpacked, wanted, path)?);
                }
            }
        }
        path.truncate(end_above);
        Ok(all)
    }

    /// The results of both, side by side if the file is large.
    pub(super) fn join<A: Send, B: Send>(
        &self,
        a: impl FnOnce() -> A + Send,
        b: impl FnOnce() -> B + Send,
    ) -> (A, B) {
        let n: u64 = self.sizes().iter().map(|size| size.triangles).sum();
        if n < MIN_PARALLEL { (a(), b()) } else { rayon::join(a, b) }
    }

    /// Unpacks a chunk.
    pub(super) fn unpack(&self, i: usize) -> Result<Unpacked> {
        self.unpacked(i).map_err(|e| self.in_chunk(i, e))
    }

    fn unpacked(&self, i: usize) -> Result<Unpacked> {
        let bytes = (self.bytes)(self.tree.first + i)?;
        let sections = Sections::split(&bytes, self.has_seam)?;
        let size = self.sizes()[i];
        let max_unused = sections.max_unused(self.n_chunks)?;
        let chunk = &self.tree.tree.chunks()[i];
        let n_isovalues = self.isovalues.len() as u32;
        let above =
            self.tree.tree.above(i).map(|above| self.sizes()[above].vertices).sum::<u64>() as u32;
        let triangles = || {
            let content = sections.triangles.content()?;
            TriangleColumns::unpack(&content, chunk, above, n_isovalues).map_err(in_section("TRIA"))
        };
        let rest = || {
            let content = sections.ranks.content()?;
            let ranks = read_ranks(&content, chunk.pivot, n_isovalues, max_unused)
                .map_err(in_section("VERT"))?;
            check_count("vertices", ranks.n_vertices().into(), size.vertices)?;
            check_count("knots", ranks.ranks.len() as u64, size.knots)?;
            let content = sections.positions.content()?;
            let positions = PositionReader::unpack(&content, &ranks).map_err(in_section("POSN"))?;
            Ok((ranks, positions))
        };
        let (triangles, rest) = self.join(triangles, rest);
        let (ranks, positions) = rest?;
        let shared = self.shared(&sections, &ranks, size)?;
        Ok(Unpacked { ranks, triangles: triangles?, positions, shared, max_unused })
    }

    /// The shared vertices of a chunk: none in a file with one tree.
    fn shared(
        &self,
        sections: &Sections,
        ranks: &Ranks,
        size: ChunkSize,
    ) -> Result<Vec<(u32, u64)>> {
        let Some(seam) = &sections.seam else { return Ok(Vec::new()) };
        let read = read_seam(seam.content()?.columns(), ranks.n_vertices());
        let shared = read.map_err(in_section("SEAM"))?;
        if let Some(s) = shared.iter().find(|s| ranks.of(s.0).is_none_or(|ranks| ranks.len() != 2))
        {
            let v = s.0;
            return Err(Error::input(format!(
                "section SEAM: vertex {v} is shared, expected two knots"
            )));
        }
        if size.repeated > shared.len() as u64 {
            let (declared, n) = (size.repeated, shared.len());
            return Err(Error::input(format!(
                "section INDX: {declared} repeated vertices, found {n} shared ones"
            )));
        }
        Ok(shared)
    }

    /// Puts a chunk together and appends it to the path. `first_vertex` is the number of its first vertex in the result.
    fn built(
        &self,
        i: usize,
        unpacked: Unpacked,
        first_vertex: u32,
        path: &mut Path,
    ) -> Result<DecodedChunk> {
        let knots_above = path.positions.len();
        let ranks = unpacked.ranks.clone();
        path.numbers.extend(first_vertex..first_vertex + ranks.n_vertices());
        let Appended { mut triangles, shared } = self.append(i, unpacked, path)?;
        if self.tree.tree.chunks()[i].pivot.is_some() {
            path.triangles.extend_from_slice(&triangles);
        }
        for t in &mut triangles {
            t.vertices = t.vertices.map(|v| path.numbers[v as usize]);
        }
        let positions = path.positions[knots_above..].to_vec();
        Ok(DecodedChunk { ranks, positions, triangles, shared })
    }

    /// Appends the vertices of a chunk to the path.
    pub(super) fn append(&self, i: usize, unpacked: Unpacked, path: &mut Path) -> Result<Appended> {
        self.put_together(i, unpacked, path).map_err(|e| self.in_chunk(i, e))
    }

    fn put_together(&self, i: usize, unpacked: Unpacked, path: &mut Path) -> Result<Appended> {
        let Unpacked { ranks, triangles, positions, shared, max_unused } = unpacked;
        let chunk = &self.tree.tree.chunks()[i];
        let n_above = path.n_vertices();
        path.ranks.append(&ranks);
        drop(ranks);
        let n_isovalues = self.isovalues.len() as u32;
        let tables = ChunkTables { chunk, path, n_above, n_isovalues, max_unused };
        let triangles = read_triangles(triangles, tables).map_err(in_section("TRIA"))?;
        check_count("triangles", triangles.len() as u64, self.sizes()[i].triangles)?;
        let of = Surroundings {
            ranks: &path.ranks,
            isovalues: self.isovalues,
            triangles: &triangles,
            n_above,
            pivot: chunk.pivot,
            n_chunks: self.n_chunks,
        };
        read_geometry(positions, of, &mut path.positions, self.samples, self.units)
            .map_err(in_section("POSN"))?;
        Ok(Appended { triangles, shared })
    }

    /// Adds the number and the isovalues of a chunk to an error, if there are several.
    fn in_chunk(&self, i: usize, error: Error) -> Error {
        match error {
            Error::Input(what) if self.n_chunks > 1 => {
                let span = &self.tree.tree.chunks()[i].span;
                let [low, high] =
                    [span.start, span.end - 1].map(|rank| exact(self.isovalues[rank as usize]));
                let i = self.tree.first + i;
                Error::input(format!("chunk {i} (isovalues {low} to {high}): {what}"))
            }
            other => other,
        }
    }
}

/// A chunk whose vertices are on the path.
pub(super) struct Appended {
    /// With vertices in numbers of the path.
    pub(super) triangles: Vec<Triangle>,
    /// With vertices in numbers of the chunk.
    pub(super) shared: Vec<(u32, u64)>,
}

/// A chunk whose numbers are unpacked.
pub(super) struct Unpacked {
    ranks: Ranks,
    triangles: TriangleColumns,
    positions: PositionReader,
    shared: Vec<(u32, u64)>,
    max_unused: usize,
}

/// Appends triangles to a list that will have `n` in all. The longer of both stays where it is.
fn push_all(list: &mut Vec<Triangle>, mut more: Vec<Triangle>, n: usize) {
    if list.len() >= more.len() {
        list.reserve_exact(n - list.len());
        list.append(&mut more);
    } else {
        more.reserve_exact(n - more.len());
        more.splice(0..0, list.drain(..));
        *list = more;
    }
}

fn check_count(what: &str, found: u64, declared: u64) -> Result<()> {
    if found == declared {
        return Ok(());
    }
    Err(Error::input(format!("section INDX: {declared} {what}, found {found}")))
}

/// The sections of a chunk, not unpacked.
struct Sections<'a> {
    ranks: Section<'a>,
    triangles: Section<'a>,
    positions: Section<'a>,
    /// In a file with several trees.
    seam: Option<Section<'a>>,
}

impl<'a> Sections<'a> {
    fn split(mut rest: &'a [u8], has_seam: bool) -> Result<Self> {
        let mut next = |tag: &[u8; 4]| split_section(&mut rest, *tag);
        let (ranks, triangles, positions) = (next(b"VERT")?, next(b"TRIA")?, next(b"POSN")?);
        let seam = if has_seam { Some(next(b"SEAM")?) } else { None };
        [ranks, triangles, positions].iter().try_for_each(|section| section.check_coded(true))?;
        seam.iter().try_for_each(|section| section.check_coded(false))?;
        if !rest.is_empty() {
            return Err(Error::input(format!("{} bytes after its last section", rest.len())));
        }
        let all = [ranks, triangles, positions];
        let numbers =
            all.iter().fold(0usize, |sum, section| sum.saturating_add(section.n_content()));
        let bytes = all.iter().map(Section::n_stored).sum::<usize>();
        if numbers > bytes.saturating_mul(MAX_NUMBERS_PER_BYTE_OF_CHUNK) {
            return Err(Error::input(format!("{bytes} bytes cannot hold {numbers} numbers")));
        }
        Ok(Sections { ranks, triangles, positions, seam })
    }

    /// The most vertices without a triangle. Each of the others takes a number of `TRIA` where it is used
    /// first, so a chunk with too many vertices is refused before they are unpacked.
    fn max_unused(&self, n_chunks: usize) -> Result<usize> {
        let n_stored = self.ranks.n_stored().saturating_add(self.positions.n_stored());
        let max = n_stored.saturating_mul(UNUSED_PER_BYTE) + FREE_UNUSED_VERTICES / n_chunks;
        let n = self.ranks.first_count().unwrap_or(0);
        if n > max.saturating_add(self.triangles.n_content()) as u64 {
            return Err(Error::input(format!(
                "section VERT: {n} vertices, expected no more than sections VERT and TRIA have room for"
            )));
        }
        Ok(max)
    }
}
