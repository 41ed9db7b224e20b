//! The vertices and deaths of triangles, in about half a byte each.
//!
//! # Theory
//!
//! Triangles are sorted by birth. Those born at one rank fill the holes that those dying at that rank
//! leave ([`Holes`]), which the reader already knows. So both traverse the boundaries of the holes: the newest open gate is closed
//! first, by a triangle whose third vertex is most often a new one or the next along the hole. Where no gate is open (the first mesh, a
//! component that emerges) a triangle is given by its three vertices, a *seed*. Triangles that die where no vertex ends, and without
//! a dying neighbour, have an explicit death.
//!
//! New vertices get the next number, so vertices are sorted by their first use. The
//! order depends on the connectivity and, where seeds are needed, on the given order; a spectrum in the order of a file
//! gives the same file again.
//!
//! # Invariants
//!
//! Writer and reader do the same to the same [`Holes`].

use rayon::prelude::*;

use super::by_rank::ByRank;
use super::column::{CodedColumns, Column, Columns, unzigzag, zigzag};
use super::holes::{Candidate, Gate, Holes, Reason};
use super::living::Living;
use super::path::Path;
use super::tree::{Chunk, DOWNWARDS, UPWARDS, end_of};
use crate::error::{Error, Result};
use crate::spectrum::Triangle;

/// The third vertex is a new one.
const NEW: u64 = 0;
/// There is no triangle at the gate.
const SKIP: u64 = 1;
/// The third vertex is coded by an offset from the start of the gate.
const OFFSET_FROM_GATE: u64 = 2;
/// The third vertex is coded by an offset from the last vertex that was coded by an offset.
const OFFSET_FROM_LAST: u64 = 3;
/// The third vertex is coded by the depth of a gate in the stack.
const DEPTH: u64 = 4;

/// No vertex.
const NONE: u32 = u32::MAX;

/// Kinds of death flags. Each has a column, as the frequencies differ: by whether all vertices of the candidate are lattice vertices, and
/// whether a neighbour dies with a vertex; or, in chunks below others, one for candidates that are replaced.
const KINDS: usize = 5;
const REPLACED: usize = 4;

fn kind(candidate: Candidate, vertices: [u32; 3], is_lattice: impl FnMut(u32) -> bool) -> usize {
    match candidate.reason {
        Reason::Replaced => REPLACED,
        Reason::NearEnd => 2 * usize::from(vertices.into_iter().all(is_lattice)) + 1,
        Reason::NearOther => 2 * usize::from(vertices.into_iter().all(is_lattice)),
    }
}

/// The number of columns of death flags in a chunk.
fn n_kinds(is_root: bool) -> usize {
    if is_root { REPLACED } else { KINDS }
}

/// The triangles of a chunk to be written, by birth.
///
/// Vertices have *local* numbers: those of chunks above their numbers on the path, those of the chunk the next ones, in any order.
pub(super) struct Input<'a> {
    pub(super) triangles: &'a [Triangle],
    pub(super) n_vertices: u32,
    pub(super) chunk: &'a Chunk,
    pub(super) above: &'a Path,
    /// The first and the last rank of a vertex.
    pub(super) life: &'a dyn Fn(u32) -> Option<(u32, u32)>,
    pub(super) is_lattice: &'a dyn Fn(u32) -> bool,
}

/// The order of triangles and vertices in a chunk.
#[derive(Clone, Debug, Default)]
pub(super) struct FileOrder {
    /// For each triangle of the chunk, its number in the input.
    pub(super) triangles: Vec<u32>,
    /// For each triangle of the chunk, its vertices in the numbers of the path, rotated as in the file.
    pub(super) corners: Vec<[u32; 3]>,
    /// For each vertex of the path up to the chunk, its local number.
    pub(super) vertices: Vec<u32>,
    /// By direction and triangle of the chunk, whether it needs an explicit end.
    pub(super) has_explicit_end: [Vec<bool>; 2],
}

/// The columns of connectivity in section `TRIA`.
#[derive(Clone, Debug, Default)]
pub(super) struct Traversal {
    /// The number of triangles born at each rank of the span; at a pivot, all triangles.
    births: Vec<u32>,
    /// For each gate, the code of the third vertex.
    codes: Vec<u8>,
    /// Third vertices that no other code reaches, as offsets.
    offsets: Vec<u64>,
    /// The last vertex coded by an offset.
    last: u32,
    /// Depths in the stack of gates that start at third vertices.
    depths: Vec<u8>,
    /// The vertices of triangles without a gate, each as the number of vertices so far minus the vertex.
    seeds: Vec<u32>,
    /// The death flags by kind.
    death_flags: [Vec<bool>; KINDS],
}

impl Traversal {
    /// Codes a vertex by an offset from a gate's start or from the last such vertex, whichever is nearer. Returns the code.
    fn push_offset(&mut self, from: u32, to: u32) -> u64 {
        let last = std::mem::replace(&mut self.last, to);
        let is_near_last = to.abs_diff(last) < to.abs_diff(from);
        let (from, code) =
            if is_near_last { (last, OFFSET_FROM_LAST) } else { (from, OFFSET_FROM_GATE) };
        self.offsets.push(zigzag(i64::from(to) - i64::from(from)));
        code
    }

    /// Appends the columns to a section. The root has no chunk above.
    pub(super) fn write(&self, columns: &mut CodedColumns, is_root: bool) {
        columns.counted(self.births.iter().map(|&n| n.into()));
        columns.counted(self.codes.iter().map(|&code| code.into()));
        columns.counted(self.offsets.iter().copied());
        columns.counted(self.depths.iter().map(|&depth| depth.into()));
        columns.counted(self.seeds.iter().map(|&seed| seed.into()));
        for flags in &self.death_flags[..n_kinds(is_root)] {
            columns.counted(flags.iter().map(|&dies| dies.into()));
        }
    }
}

/// Finds the order of a chunk, and codes the connectivity.
pub(super) fn traverse(input: &Input) -> (FileOrder, Traversal) {
    let &Input { triangles, n_vertices, chunk, above, .. } = input;
    let counts = [n_vertices as usize, triangles.len()];
    let n_above = above.n_vertices();
    let mut number = vec![NONE; n_vertices as usize];
    (0..n_above).for_each(|v| number[v as usize] = v);
    let mut writer = Writer {
        input,
        living: Living::new(counts, &above.triangles, &chunk.span),
        number,
        edges_of: vec![(0, 0); n_vertices as usize],
        order: FileOrder { vertices: (0..n_above).collect(), ..FileOrder::default() },
        traversal: Traversal::default(),
    };
    match chunk.pivot {
        Some(pivot) => writer.around_pivot(pivot),
        None => writer.rank_by_rank(),
    }
    let Writer { number, mut order, traversal, living, .. } = writer;
    order.corners = living.into_vertices();
    // Vertices that no triangle of the chunk uses come last.
    order.vertices.extend((n_above..n_vertices).filter(|&v| number[v as usize] == NONE));
    (order, traversal)
}

struct Writer<'a> {
    input: &'a Input<'a>,
    living: Living<'a>,
    /// By local number of a vertex, its number on the path, once it has one.
    number: Vec<u32>,
    /// By local number of a vertex, the range of the directed edges that start there, among those of triangles born at the current rank.
    edges_of: Vec<(u32, u32)>,
    order: FileOrder,
    traversal: Traversal,
}

impl Writer<'_> {
    /// Codes the triangles of a chunk without a pivot.
    fn rank_by_rank(&mut self) {
        let Input { triangles, chunk, .. } = self.input;
        let mut batches = triangles.chunk_by(|t, u| t.birth == u.birth).peekable();
        let mut first = 0;
        let ends = self.ends(UPWARDS);
        let mut explicit = ByRank::new(&chunk.span);
        if let Some(before) = chunk.span.start.checked_sub(1) {
            self.living.add_known_at(before);
        }
        for rank in chunk.span.clone() {
            self.deaths(rank, UPWARDS, &ends, &explicit);
            self.living.add_known_born(rank);
            let batch = batches.next_if(|batch| batch[0].birth == rank).unwrap_or_default();
            self.births(first, batch);
            let numbers = &self.order.triangles[first as usize..];
            for (&i, number) in numbers.iter().zip(first..) {
                explicit.push(triangles[i as usize].death, number);
            }
            first += batch.len() as u32;
        }
    }

    /// Codes the triangles of a chunk, all of which are alive at its pivot: the mesh there, then their deaths upwards and their births
    /// downwards from it.
    fn around_pivot(&mut self, pivot: u32) {
        let Input { triangles, chunk, .. } = self.input;
        self.living.add_known_at(pivot);
        self.births(0, triangles);
        let mut down = self.living.downwards();
        for direction in [UPWARDS, DOWNWARDS] {
            let ends = self.ends(direction);
            let mut explicit = ByRank::new(&chunk.span);
            for (&i, number) in self.order.triangles.iter().zip(0..) {
                explicit.push(end_of(&triangles[i as usize], direction), number);
            }
            if direction == DOWNWARDS {
                std::mem::swap(&mut self.living, &mut down);
            }
            for rank in chunk.ranks_from(pivot, direction) {
                self.deaths(rank, direction, &ends, &explicit);
            }
        }
    }

    /// The vertices by the rank at which they end in a direction.
    fn ends(&self, direction: usize) -> ByRank {
        let mut ends = ByRank::new(&self.input.chunk.span);
        for v in 0..self.input.n_vertices {
            if let Some(life) = (self.input.life)(v) {
                ends.push([life.1, life.0][direction], v);
            }
        }
        ends
    }

    /// Codes the deaths at a rank and opens gates around the holes.
    fn deaths(&mut self, rank: u32, direction: usize, ends: &ByRank, explicit: &ByRank) {
        let Writer { input, living, number, order, traversal, .. } = self;
        let numbers = ends.at(rank).map(|v| number[v as usize]);
        let mut ended: Vec<u32> = numbers.filter(|&v| v != NONE).collect();
        ended.sort_unstable();
        let dies = |i: u32, candidate: Candidate, vertices: [u32; 3]| {
            let is_lattice = |v: u32| (input.is_lattice)(order.vertices[v as usize]);
            let kind = kind(candidate, vertices, is_lattice);
            let triangle = &input.triangles[order.triangles[i as usize] as usize];
            let dies = end_of(triangle, direction) == rank;
            traversal.death_flags[kind].push(dies);
            Ok::<bool, std::convert::Infallible>(dies)
        };
        let Ok([_, explicit]) = living.deaths(rank, &ended, explicit.at(rank), dies);
        let has_explicit_end = &mut order.has_explicit_end[direction];
        has_explicit_end.resize(order.triangles.len(), false);
        explicit.iter().for_each(|&t| has_explicit_end[t as usize] = true);
    }

    /// Codes triangles that are born together, which in the input start at number `start`.
    fn births(&mut self, start: u32, batch: &[Triangle]) {
        self.traversal.births.push(batch.len() as u32);
        // Sorted by directed edge, then by triangle, to find the triangle at a gate.
        let mut edges = Vec::with_capacity(3 * batch.len());
        for (triangle, at) in batch.iter().zip(0u32..) {
            let [a, b, c] = triangle.vertices;
            edges.extend([([a, b], at), ([b, c], at), ([c, a], at)]);
        }
        edges.par_sort_unstable();
        let mut end = 0;
        for of_one in edges.chunk_by(|a, b| a.0[0] == b.0[0]) {
            let first = end;
            end += of_one.len() as u32;
            self.edges_of[of_one[0].0[0] as usize] = (first, end);
        }
        // At the first of equal edges, the number of them whose triangles are done, so that none is looked at twice.
        let mut n_done = vec![0u32; edges.len()];
        let mut done = vec![false; batch.len()];
        let mut next = 0;
        let mut left = batch.len();
        while left > 0 {
            let Some(gate) = self.living.pop() else {
                while done[next] {
                    next += 1;
                }
                done[next] = true;
                left -= 1;
                self.add_seed(start + next as u32);
                continue;
            };
            let edge = [gate.from, gate.to].map(|v| self.order.vertices[v as usize]);
            let (first, end) = self.edges_of[edge[0] as usize];
            let of_one = &edges[first as usize..end as usize];
            let first = first as usize + of_one.partition_point(|&(other, _)| other < edge);
            // There is no entry after the last edge.
            let mut nothing = 0;
            let n_done = n_done.get_mut(first).unwrap_or(&mut nothing);
            let mut i = first + *n_done as usize;
            while edges.get(i).is_some_and(|&(other, at)| other == edge && done[at as usize]) {
                i += 1;
            }
            *n_done = (i - first) as u32;
            let Some(&(_, at)) = edges.get(i).filter(|&&(other, _)| other == edge) else {
                self.traversal.codes.push(SKIP as u8);
                self.living.skip(gate);
                continue;
            };
            done[at as usize] = true;
            left -= 1;
            self.fill(start + at, gate, edge);
        }
        edges.iter().for_each(|&([from, _], _)| self.edges_of[from as usize] = (0, 0));
    }

    /// Codes triangle `i`, which is at a gate with this edge of the input, by its third vertex.
    fn fill(&mut self, i: u32, gate: Gate, edge: [u32; 2]) {
        let mut corners = self.input.triangles[i as usize].vertices.into_iter();
        let third = corners.find(|v| !edge.contains(v));
        let (c, is_new) = self.number_of(third.expect("triangles have three different vertices"));
        let code = if is_new { Some(NEW) } else { self.living.holes().code_of(&gate, c) };
        let code = code.unwrap_or_else(|| match self.living.holes().depth_of(c) {
            Some(depth) => {
                self.traversal.depths.push(depth as u8);
                DEPTH
            }
            None => self.traversal.push_offset(gate.from, c),
        });
        self.traversal.codes.push(code as u8);
        self.order.triangles.push(i);
        self.living.fill(gate, c);
    }

    /// Codes triangle `i` by its three vertices.
    fn add_seed(&mut self, i: u32) {
        let vertices = self.input.triangles[i as usize].vertices.map(|v| {
            let n_before = self.order.vertices.len() as u32;
            let (v, _) = self.number_of(v);
            self.traversal.seeds.push(n_before - v);
            v
        });
        self.order.triangles.push(i);
        self.living.add_seed(vertices);
    }

    /// The number on the path of a vertex of the input, and whether it is new.
    fn number_of(&mut self, v: u32) -> (u32, bool) {
        let number = &mut self.number[v as usize];
        let is_new = *number == NONE;
        if is_new {
            *number = self.order.vertices.len() as u32;
            self.order.vertices.push(v);
        }
        (*number, is_new)
    }
}

/// Reads a counted column from the front.
#[derive(Debug)]
struct ColumnReader {
    n: usize,
    column: Column<'static>,
    n_read: usize,
}

impl ColumnReader {
    /// Takes a counted column off the front of a section.
    fn new(columns: &mut Columns, bits: u32) -> Result<Self> {
        let n = columns.count()?;
        Ok(ColumnReader { n, column: columns.column(n, bits)?.into_owned(), n_read: 0 })
    }

    fn next(&mut self) -> Result<u64> {
        if self.n_read == self.n {
            return Err(Error::input("a column has fewer numbers than its triangles need"));
        }
        self.n_read += 1;
        self.column.get(self.n_read - 1)
    }
}

/// Reads what [`Traversal`] writes.
#[derive(Debug)]
pub(super) struct TraversalReader {
    births: ColumnReader,
    codes: ColumnReader,
    offsets: ColumnReader,
    last: u32,
    depths: ColumnReader,
    seeds: ColumnReader,
    death_flags: Vec<ColumnReader>,
}

impl TraversalReader {
    /// Takes the columns off the front of a section, with so many numbers of births.
    pub(super) fn new(columns: &mut Columns, n_births: usize, is_root: bool) -> Result<Self> {
        let mut next = |bits: u32| ColumnReader::new(columns, bits);
        let (births, codes, offsets) = (next(32)?, next(8)?, next(33)?);
        let (depths, seeds) = (next(8)?, next(32)?);
        let death_flags = (0..n_kinds(is_root)).map(|_| next(1)).collect::<Result<_>>()?;
        if births.n != n_births {
            let n = births.n;
            return Err(Error::input(format!("births at {n} ranks, expected {n_births}")));
        }
        Ok(TraversalReader { births, codes, offsets, last: 0, depths, seeds, death_flags })
    }

    /// The number of triangles.
    pub(super) fn n_triangles(&self) -> Result<usize> {
        // Each triangle takes a code or three seeds, so the section cannot hold more.
        let max = self.codes.n + self.seeds.n / 3;
        let mut n = 0;
        for rank in 0..self.births.n {
            n += self.births.column.get(rank)? as usize;
            if n > max {
                return Err(Error::input(format!(
                    "more triangles than its codes and seeds can describe ({max})"
                )));
            }
        }
        Ok(n)
    }

    /// The number of triangles born at the next rank.
    pub(super) fn births(&mut self) -> Result<u64> {
        self.births.next()
    }

    /// The death flag of a candidate.
    pub(super) fn dies(
        &mut self,
        candidate: Candidate,
        vertices: [u32; 3],
        is_lattice: impl FnMut(u32) -> bool,
    ) -> Result<bool> {
        Ok(self.death_flags[kind(candidate, vertices, is_lattice)].next()? == 1)
    }

    /// The third vertex of the triangle at a gate; none if there is no triangle.
    pub(super) fn third(&mut self, holes: &Holes, gate: &Gate, n_used: u32) -> Result<Option<u32>> {
        let third = match self.codes.next()? {
            NEW => Some(n_used),
            SKIP => return Ok(None),
            code @ (OFFSET_FROM_GATE | OFFSET_FROM_LAST) => {
                let from = if code == OFFSET_FROM_LAST { self.last } else { gate.from };
                let third = i64::from(from) + unzigzag(self.offsets.next()?);
                let third = u32::try_from(third).ok().filter(|&third| third < n_used);
                third.inspect(|&third| self.last = third)
            }
            DEPTH => holes.at_depth(self.depths.next()?),
            code => holes.third(gate, code),
        };
        third.map(Some).ok_or_else(|| Error::input("a triangle has a vertex that does not exist"))
    }

    /// The vertices of a triangle without a gate.
    pub(super) fn seed(&mut self, mut n_used: u32) -> Result<[u32; 3]> {
        let mut vertices = [0; 3];
        for vertex in &mut vertices {
            let back = self.seeds.next()?;
            *vertex = u32::try_from(u64::from(n_used).wrapping_sub(back))
                .map_err(|_| Error::input("a seed refers to a vertex before the first one"))?;
            n_used += u32::from(back == 0);
        }
        Ok(vertices)
    }

    /// Checks that all columns were read to their ends.
    pub(super) fn end(self) -> Result<()> {
        let TraversalReader { births, codes, offsets, depths, seeds, death_flags, .. } = self;
        let mut columns = [births, codes, offsets, depths, seeds].into_iter().chain(death_flags);
        match columns.all(|column| column.n_read == column.n) {
            true => Ok(()),
            false => Err(Error::input("a column has more numbers than its triangles need")),
        }
    }
}
