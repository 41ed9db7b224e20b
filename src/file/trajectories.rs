//! Section `VERT`: the ranks of the knots.
//!
//! Ranks come before the triangles in the file and positions after them, so that a position can be
//! predicted from neighbours that are already known ([`super::geometry`]). Lattice vertices have knots at values of
//! samples, other vertices at isovalues of the sweep, so each kind has its own rank intervals.

use super::column::{CodedColumns, Column, Columns, Content, zigzag};
use super::rank_intervals::{IntervalReader, write_intervals};
use crate::error::{Error, Result};

/// The ranks of all trajectories, which are known before the positions.
#[derive(Clone, Debug)]
pub(super) struct Ranks {
    /// As [`Spectrum::first_knot`](crate::Spectrum::first_knot).
    pub(super) first_knot: Vec<u32>,
    /// As in [`Spectrum::knots`](crate::Spectrum::knots).
    pub(super) ranks: Vec<u32>,
    /// By vertex, whether it is a lattice vertex.
    pub(super) is_lattice: Vec<bool>,
}

impl Default for Ranks {
    fn default() -> Self {
        Ranks { first_knot: vec![0], ranks: Vec::new(), is_lattice: Vec::new() }
    }
}

impl Ranks {
    /// Appends a vertex.
    pub(super) fn push(&mut self, ranks: impl Iterator<Item = u32>, is_lattice: bool) {
        self.ranks.extend(ranks);
        self.first_knot.push(self.ranks.len() as u32);
        self.is_lattice.push(is_lattice);
    }

    /// Appends all vertices of other ranks.
    pub(super) fn append(&mut self, other: &Ranks) {
        let n_knots = self.ranks.len() as u32;
        self.ranks.extend(&other.ranks);
        self.first_knot.extend(other.first_knot[1..].iter().map(|first| first + n_knots));
        self.is_lattice.extend(&other.is_lattice);
    }

    /// Keeps only the first vertices, and as many knots as these have.
    pub(super) fn truncate(&mut self, n_vertices: usize, n_knots: usize) {
        self.ranks.truncate(n_knots);
        self.first_knot.truncate(n_vertices + 1);
        self.is_lattice.truncate(n_vertices);
    }

    /// The first and the last rank of a vertex, if it has knots.
    pub(super) fn life(&self, v: u32) -> Option<(u32, u32)> {
        let ranks = self.of(v)?;
        Some((*ranks.first()?, *ranks.last()?))
    }

    /// The ranks of one vertex; none if there is no such vertex.
    pub(super) fn of(&self, v: u32) -> Option<&[u32]> {
        let v = v as usize;
        let (&start, &end) = (self.first_knot.get(v)?, self.first_knot.get(v + 1)?);
        self.ranks.get(start as usize..end as usize)
    }

    pub(super) fn n_vertices(&self) -> u32 {
        self.first_knot.len() as u32 - 1
    }

    pub(super) fn is_lattice(&self, v: u32) -> bool {
        self.is_lattice[v as usize]
    }
}

/// The error for `n` vertices without a triangle where at most `max` are allowed.
pub(super) fn too_many_unused(n: usize, max: usize) -> Error {
    Error::input(format!("{n} vertices without a triangle, expected at most {max}"))
}

/// Writes section `VERT` of a chunk, of a table of `n_isovalues` ranks.
pub(super) fn write_ranks(ranks: &Ranks, pivot: Option<u32>, n_isovalues: u32) -> Content<'static> {
    let mut columns = CodedColumns::new();
    columns.count(ranks.n_vertices() as usize);
    let (mut counts, mut flags, mut firsts) = (Vec::new(), Vec::new(), Vec::new());
    // Of lattice vertices, and of others.
    let mut intervals: [Vec<(u32, u32)>; 2] = Default::default();
    let mut down = Vec::new();
    let mut previous_first = 0;
    for v in 0..ranks.n_vertices() {
        let trajectory = ranks.of(v).expect("the vertex exists");
        counts.push(trajectory.len() as u64);
        let Some(&first) = trajectory.first() else { continue };
        if trajectory.len() == 2 {
            flags.push(ranks.is_lattice(v).into());
        }
        match pivot {
            Some(pivot) => down.push((n_isovalues - 1 - pivot, n_isovalues - first)),
            None => firsts.push(zigzag(i64::from(first) - i64::from(previous_first))),
        }
        previous_first = first;
        let kind = usize::from(!ranks.is_lattice(v));
        intervals[kind].extend(trajectory.windows(2).map(|pair| (pair[0], pair[1])));
    }
    for column in [&counts, &flags, &firsts] {
        columns.column(column.iter().copied());
    }
    if pivot.is_some() {
        write_intervals(&mut columns, &down);
    }
    intervals.iter().for_each(|intervals| write_intervals(&mut columns, intervals));
    columns.end()
}

/// Reads section `VERT` of a chunk; every rank is below `n_isovalues`. At most `max_unused` vertices may have fewer than
/// the two knots that a triangle needs.
pub(super) fn read_ranks(
    content: &Content,
    pivot: Option<u32>,
    n_isovalues: u32,
    max_unused: usize,
) -> Result<Ranks> {
    let mut columns = content.columns();
    let n = columns.count()?;
    if n >= u32::MAX as usize {
        return Err(Error::input(format!("{n} vertices, expected fewer than 2^32")));
    }
    let (first_knot, n_with_knots) = read_counts(&columns.column(n, 32)?, n, max_unused)?;
    let is_lattice = read_flags(&mut columns, &first_knot)?;
    let mut ranks = Ranks { first_knot, ranks: Vec::new(), is_lattice };
    let firsts = columns.column(if pivot.is_some() { 0 } else { n_with_knots }, 33)?;
    let mut down = match pivot {
        Some(_) => Some(IntervalReader::new(&mut columns, n_with_knots, n_isovalues + 1)?),
        None => None,
    };
    let n_knots = ranks.first_knot[n] as usize;
    let n_lattice = ranks.is_lattice.iter().filter(|is| **is).count();
    let mut reader = |n| IntervalReader::new(&mut columns, n, n_isovalues);
    // Of lattice vertices, and of others.
    let mut intervals = [reader(n_lattice)?, reader(n_knots - n_with_knots - n_lattice)?];
    columns.end()?;
    ranks.ranks.reserve_exact(n_knots);
    let (mut next_first, mut previous_first) = (0, 0);
    for v in 0..n as u32 {
        let mut rank = 0;
        let [start, end] = [v, v + 1].map(|v| ranks.first_knot[v as usize]);
        for i in start..end {
            if let (true, Some((down, pivot))) = (i == start, down.as_mut().zip(pivot)) {
                rank = i64::from(n_isovalues) - down.next(n_isovalues - 1 - pivot)? as i64;
            } else if i == start {
                rank = previous_first + firsts.get_signed(next_first)?;
                previous_first = rank;
                next_first += 1;
            } else {
                rank = intervals[usize::from(!ranks.is_lattice(v))].next(rank as u32)? as i64;
            }
            if !(0..i64::from(n_isovalues)).contains(&rank) {
                return Err(Error::input(format!(
                    "vertex {v} has a knot of rank {rank}, expected one of {n_isovalues} isovalues"
                )));
            }
            ranks.ranks.push(rank as u32);
        }
    }
    intervals.into_iter().chain(down).try_for_each(IntervalReader::end)?;
    Ok(ranks)
}

/// The index of the first knot of each of `n` vertices, with the end, and the number of vertices with knots.
fn read_counts(counts: &Column, n: usize, max_unused: usize) -> Result<(Vec<u32>, usize)> {
    let mut n_unused = 0;
    for v in 0..n {
        n_unused += usize::from(counts.get(v)? < 2);
    }
    if n_unused > max_unused {
        return Err(too_many_unused(n_unused, max_unused));
    }
    let mut first_knot = Vec::with_capacity(n + 1);
    first_knot.push(0);
    let (mut n_knots, mut n_with_knots) = (0u32, 0);
    for v in 0..n {
        let count = counts.get(v)? as u32;
        n_knots = n_knots.checked_add(count).ok_or_else(|| Error::input("more than 2^32 knots"))?;
        n_with_knots += usize::from(count > 0);
        first_knot.push(n_knots);
    }
    Ok((first_knot, n_with_knots))
}

/// By vertex, whether it is a lattice vertex. Only vertices with two knots have a flag.
fn read_flags(columns: &mut Columns, first_knot: &[u32]) -> Result<Vec<bool>> {
    let has_flag = |knots: &[u32]| knots[1] - knots[0] == 2;
    let n = first_knot.windows(2).filter(|knots| has_flag(knots)).count();
    let flags = columns.column(n, 1)?;
    let mut is_lattice = Vec::with_capacity(first_knot.len() - 1);
    let mut next = 0;
    for knots in first_knot.windows(2) {
        is_lattice.push(has_flag(knots) && flags.get(next)? == 1);
        next += usize::from(has_flag(knots));
    }
    Ok(is_lattice)
}
