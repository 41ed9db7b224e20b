//! Section `TRIA` of a chunk: triangles and lifetimes.
//!
//! The lifetime of a triangle is within the trajectories of its vertices; the reader refuses others.
//! [`super::connectivity`] codes vertices and births, and most deaths. The other deaths are explicit: a rank interval from
//! the birth ([`super::rank_intervals`]), or the same rank as the last explicit death. In a chunk with a pivot deaths are coded upwards from
//! there, and births in the same way downwards.

use super::by_rank::ByRank;
use super::column::{CodedColumns, Column, Columns, Content};
use super::connectivity::{FileOrder, Traversal, TraversalReader};
use super::holes::{Candidate, MAX_TRIANGLES};
use super::living::Living;
use super::path::Path;
use super::predict::Surroundings;
use super::rank_intervals::{IntervalReader, write_intervals};
use super::trajectories::{Ranks, too_many_unused};
use super::tree::{Chunk, DOWNWARDS, UPWARDS};
use crate::error::{Error, Result};
use crate::spectrum::Triangle;

/// How the end of a triangle is stored: by death flags; equal to the last explicit one; by a rank interval.
const BY_FLAGS: u64 = 0;
const AS_BEFORE: u64 = 1;
const BY_INTERVAL: u64 = 2;
/// Added to the kind of death for caps.
const CAP: u64 = 3;

/// The rank interval to the end of a triangle in a direction from its birth or the pivot, `from`, in a table of `n_isovalues` ranks. Downwards ranks
/// count from the last one, and the interval ends after the birth, so it is not empty.
fn interval(from: u32, triangle: &Triangle, direction: usize, n_isovalues: u32) -> (u32, u32) {
    match direction {
        UPWARDS => (from, triangle.death),
        _ => (n_isovalues - 1 - from, n_isovalues - triangle.birth),
    }
}

/// Writes section `TRIA` of a chunk.
pub(super) fn write_triangles(
    (order, traversal): (&FileOrder, &Traversal),
    of: Surroundings,
) -> Content<'static> {
    let Surroundings { triangles, n_above, pivot, isovalues, .. } = of;
    let n_isovalues = isovalues.len() as u32;
    let mut columns = CodedColumns::new();
    traversal.write(&mut columns, n_above == 0);
    for &direction in directions(pivot) {
        let mut before = 0;
        let mut intervals = Vec::new();
        let mut kinds: Vec<u8> = Vec::with_capacity(triangles.len());
        for (t, &is_explicit) in triangles.iter().zip(&order.has_explicit_end[direction]) {
            let (from, end) = interval(pivot.unwrap_or(t.birth), t, direction, n_isovalues);
            let kind = match is_explicit {
                false => BY_FLAGS,
                true if std::mem::replace(&mut before, end) == end => AS_BEFORE,
                true => {
                    intervals.push((from, end));
                    BY_INTERVAL
                }
            };
            let is_cap = t.cap && direction == UPWARDS;
            kinds.push((kind + CAP * u64::from(is_cap)) as u8);
        }
        columns.column(kinds.iter().map(|&kind| kind.into()));
        write_intervals(&mut columns, &intervals);
    }
    columns.end()
}

/// The directions in which the triangles of a chunk end.
fn directions(pivot: Option<u32>) -> &'static [usize] {
    if pivot.is_some() { &[UPWARDS, DOWNWARDS] } else { &[UPWARDS] }
}

/// The columns of section `TRIA` of a chunk.
pub(super) struct TriangleColumns {
    traversal: TraversalReader,
    /// By direction.
    ends: Vec<EndReader>,
    n: usize,
}

impl TriangleColumns {
    /// Unpacks the section of a chunk that has so many vertices above it, in a file of `n_isovalues` ranks.
    pub(super) fn unpack(
        content: &Content,
        chunk: &Chunk,
        n_above: u32,
        n_isovalues: u32,
    ) -> Result<Self> {
        let mut columns = content.columns();
        let n_births = if chunk.pivot.is_some() { 1 } else { chunk.span.len() };
        let traversal = TraversalReader::new(&mut columns, n_births, n_above == 0)?;
        let n = traversal.n_triangles()?;
        if n > MAX_TRIANGLES {
            return Err(too_many(n));
        }
        let mut ends = Vec::new();
        for _ in directions(chunk.pivot) {
            ends.push(EndReader::new(&mut columns, n, n_isovalues)?);
        }
        columns.end()?;
        Ok(TriangleColumns { traversal, ends, n })
    }
}

fn too_many(n: usize) -> Error {
    Error::input(format!("{n} triangles, expected at most {MAX_TRIANGLES}"))
}

/// The chunk whose triangles are read.
#[derive(Clone, Copy)]
pub(super) struct ChunkTables<'a> {
    pub(super) chunk: &'a Chunk,
    /// The path to it. Its ranks are those of the vertices of the chunk, too.
    pub(super) path: &'a Path,
    /// Vertices of the chunks above.
    pub(super) n_above: u32,
    pub(super) n_isovalues: u32,
    /// Most vertices of the chunk that may be in none of its triangles.
    pub(super) max_unused: usize,
}

/// The triangles of a chunk. Vertices have their numbers on the path.
pub(super) fn read_triangles(
    columns: TriangleColumns,
    tables: ChunkTables,
) -> Result<Vec<Triangle>> {
    let ChunkTables { chunk, path, n_above, max_unused, .. } = tables;
    let TriangleColumns { traversal, mut ends, n } = columns;
    if n + path.triangles.len() > MAX_TRIANGLES {
        return Err(too_many(n + path.triangles.len()));
    }
    let mut reader = Reader {
        tables,
        living: Living::new([path.n_vertices() as usize, n], &path.triangles, &chunk.span),
        traversal,
        lives: Vec::with_capacity(n),
        caps: Vec::with_capacity(n),
        n_used: n_above,
    };
    match chunk.pivot {
        Some(pivot) => reader.around_pivot(pivot, &mut ends)?,
        None => reader.rank_by_rank(&mut ends[UPWARDS])?,
    }
    ends.into_iter().try_for_each(EndReader::end)?;
    let n_unused = (path.n_vertices() - reader.n_used) as usize;
    if n_unused > max_unused {
        return Err(too_many_unused(n_unused, max_unused));
    }
    reader.end()
}

/// Reads how triangles end in a direction.
struct EndReader {
    kinds: Column<'static>,
    intervals: IntervalReader,
    /// The last explicit end, counted in the direction.
    before: u64,
}

impl EndReader {
    fn new(columns: &mut Columns, n: usize, n_isovalues: u32) -> Result<Self> {
        let kinds = columns.column(n, 3)?.into_owned();
        let mut n_intervals = 0;
        for i in 0..n {
            n_intervals += usize::from(kinds.get(i)? % CAP == BY_INTERVAL);
        }
        let intervals = IntervalReader::new(columns, n_intervals, n_isovalues + 1)?;
        Ok(EndReader { kinds, intervals, before: 0 })
    }

    /// The explicit end of triangle `i`, if it has one, after the rank `from` in the direction, and whether it is a cap.
    fn next(&mut self, i: u32, from: u32) -> Result<(Option<u64>, bool)> {
        let kind = self.kinds.get(i as usize)?;
        if kind % CAP == BY_INTERVAL {
            self.before = self.intervals.next(from)?;
        }
        Ok(((kind % CAP != BY_FLAGS).then_some(self.before), kind >= CAP))
    }

    fn end(self) -> Result<()> {
        self.intervals.end()
    }
}

/// Reads the triangles of a chunk.
struct Reader<'a> {
    tables: ChunkTables<'a>,
    living: Living<'a>,
    traversal: TraversalReader,
    /// By triangle of the chunk, where it ends by direction: its death and its birth.
    lives: Vec<[u32; 2]>,
    /// By triangle, whether it is a cap.
    caps: Vec<bool>,
    /// Vertices of the path that are used, or are in chunks above.
    n_used: u32,
}

/// No end was found yet.
const NO_END: u32 = u32::MAX;

impl Reader<'_> {
    fn rank_by_rank(&mut self, ends: &mut EndReader) -> Result<()> {
        let ChunkTables { chunk, .. } = self.tables;
        let last_ranks = self.vertices_by_end(UPWARDS);
        let mut explicit = ByRank::new(&chunk.span);
        if let Some(before) = chunk.span.start.checked_sub(1) {
            self.living.add_known_at(before);
        }
        for rank in chunk.span.clone() {
            self.deaths(rank, UPWARDS, &last_ranks, &explicit)?;
            self.living.add_known_born(rank);
            let n = self.births()?;
            for i in self.lives.len() as u32..self.lives.len() as u32 + n {
                let (death, cap) = ends.next(i, rank)?;
                if let Some(death) = death.and_then(|death| u32::try_from(death).ok()) {
                    explicit.push(death, i);
                }
                self.lives.push([NO_END, rank]);
                self.caps.push(cap);
            }
        }
        Ok(())
    }

    fn around_pivot(&mut self, pivot: u32, ends: &mut [EndReader]) -> Result<()> {
        let ChunkTables { chunk, n_isovalues, .. } = self.tables;
        self.living.add_known_at(pivot);
        let n = self.births()?;
        self.lives.resize(n as usize, [NO_END; 2]);
        self.caps.resize(n as usize, false);
        let mut down = self.living.downwards();
        for (direction, ends) in ends.iter_mut().enumerate() {
            let end_ranks = self.vertices_by_end(direction);
            let mut explicit = ByRank::new(&chunk.span);
            let last = u64::from(n_isovalues);
            for (is_cap, i) in self.caps.iter_mut().zip(0..) {
                let from = if direction == UPWARDS { pivot } else { n_isovalues - 1 - pivot };
                let (end, cap) = ends.next(i, from)?;
                let rank =
                    |end: u64| if direction == UPWARDS { Some(end) } else { last.checked_sub(end) };
                if let Some(end) = end.and_then(rank).and_then(|end| u32::try_from(end).ok()) {
                    explicit.push(end, i);
                }
                *is_cap |= cap;
            }
            if direction == DOWNWARDS {
                std::mem::swap(&mut self.living, &mut down);
            }
            for rank in chunk.ranks_from(pivot, direction) {
                self.deaths(rank, direction, &end_ranks, &explicit)?;
            }
        }
        Ok(())
    }

    /// The vertices by the rank at which they end in a direction.
    fn vertices_by_end(&self, direction: usize) -> ByRank {
        let ChunkTables { chunk, path, .. } = self.tables;
        let mut ends = ByRank::new(&chunk.span);
        // In reverse: the lists return the newest number first.
        for v in (0..path.n_vertices()).rev() {
            if let Some((first, last)) = path.ranks.life(v) {
                ends.push([last, first][direction], v);
            }
        }
        ends
    }

    /// Finds the triangles that end at a rank and opens gates around the holes that they leave.
    fn deaths(
        &mut self,
        rank: u32,
        direction: usize,
        ends: &ByRank,
        explicit: &ByRank,
    ) -> Result<()> {
        let ranks: &Ranks = &self.tables.path.ranks;
        let ended: Vec<u32> = ends.at(rank).collect();
        let traversal = &mut self.traversal;
        let dies = |_, candidate: Candidate, vertices: [u32; 3]| {
            traversal.dies(candidate, vertices, |v| ranks.is_lattice(v))
        };
        let [found, _] = self.living.deaths(rank, &ended, explicit.at(rank), dies)?;
        found.into_iter().for_each(|i| self.lives[i as usize][direction] = rank);
        Ok(())
    }

    /// Reads the vertices of triangles that are born together. Returns their number.
    fn births(&mut self) -> Result<u32> {
        let n = self.traversal.births()?;
        let mut left = n;
        while left > 0 {
            let gate = self.living.pop();
            let vertices = match &gate {
                Some(gate) => self
                    .traversal
                    .third(self.living.holes(), gate, self.n_used)?
                    .map(|third| [gate.from, gate.to, third]),
                None => Some(self.traversal.seed(self.n_used)?),
            };
            if let Some(vertices) = vertices {
                self.check_vertices(vertices)?;
                left -= 1;
            }
            match (gate, vertices) {
                (Some(gate), Some([.., third])) => self.living.fill(gate, third),
                (Some(gate), None) => self.living.skip(gate),
                (None, vertices) => vertices.into_iter().for_each(|v| self.living.add_seed(v)),
            }
        }
        Ok(n as u32)
    }

    /// Checks that the vertices of a triangle exist and differ.
    fn check_vertices(&mut self, vertices: [u32; 3]) -> Result<()> {
        let ([a, b, c], n_vertices) = (vertices, self.tables.path.n_vertices());
        self.n_used = self.n_used.max(a.max(b).max(c) + 1);
        if self.n_used <= n_vertices && a != b && b != c && c != a {
            return Ok(());
        }
        Err(Error::input(format!(
            "a triangle has vertices {a}, {b}, {c}, expected three different ones below {n_vertices}"
        )))
    }

    /// The triangles, whose lifetimes must be within the trajectories of their vertices.
    fn end(self) -> Result<Vec<Triangle>> {
        let Reader { tables, living, traversal, lives, caps, .. } = self;
        traversal.end()?;
        // All else of the mesh is dropped before.
        let vertices = living.into_vertices();
        let mut triangles = Vec::with_capacity(vertices.len());
        for ((vertices, [death, birth]), cap) in vertices.into_iter().zip(lives).zip(caps) {
            let is_within = birth != NO_END
                && death != NO_END
                && birth < death
                && vertices.iter().all(|&v| {
                    let life = tables.path.ranks.life(v);
                    life.is_some_and(|(first, last)| first <= birth && death <= last)
                });
            if !is_within {
                return Err(Error::input(format!(
                    "triangle {} outlives its vertices",
                    triangles.len()
                )));
            }
            triangles.push(Triangle { vertices, birth, death, cap });
        }
        Ok(triangles)
    }
}
