//! Section `VERT`: when the vertices are somewhere.
//!
//! Ranks come before the triangles in the file and positions after them, so that a position can be
//! predicted from the neighbours that are known already ([`super::geometry`]). Lattice vertices have knots at samples'
//! values, others where the mesh was looked at: ways to their further knots lie apart, each kind with stations of its own.

use super::column::{CodedColumns, Column, Columns, Content, zigzag};
use super::stations::{Ways, write_ways};
use super::{LAST_WITHOUT_STATIONS, too_many_unused};
use crate::error::{Error, Result};
use crate::spectrum::Spectrum;

/// The ranks of all trajectories: what of them is known before positions are.
#[derive(Clone, Debug, Default)]
pub(super) struct Ranks {
    /// As [`Spectrum::first_knot`].
    pub(super) first_knot: Vec<u32>,
    /// As in [`Spectrum::knots`].
    pub(super) ranks: Vec<u32>,
    /// By vertex, whether it is a lattice vertex; files before version 5 tell that with the positions.
    pub(super) is_lattice: Option<Vec<bool>>,
}

impl Ranks {
    /// Those of a spectrum of which it is known what its lattice vertices are.
    pub(super) fn new(spectrum: &Spectrum, is_lattice: Vec<bool>) -> Self {
        Ranks {
            first_knot: spectrum.first_knot().to_vec(),
            ranks: spectrum.knots().iter().map(|knot| knot.rank).collect(),
            is_lattice: Some(is_lattice),
        }
    }

    /// The ranks of one vertex; none if there is no such vertex.
    pub(super) fn of(&self, v: u32) -> Option<&[u32]> {
        let v = v as usize;
        let (&start, &end) = (self.first_knot.get(v)?, self.first_knot.get(v + 1)?);
        self.ranks.get(start as usize..end as usize)
    }

    pub(super) fn n_vertices(&self) -> u32 {
        self.first_knot.len().saturating_sub(1) as u32
    }

    pub(super) fn is_lattice(&self, v: u32) -> bool {
        self.is_lattice.as_ref().is_some_and(|is_lattice| is_lattice[v as usize])
    }
}

/// Writes section `VERT`.
pub(super) fn write_ranks(ranks: &Ranks) -> Content<'static> {
    let mut columns = CodedColumns::new();
    columns.count(ranks.n_vertices() as usize);
    let (mut counts, mut flags, mut firsts) = (Vec::new(), Vec::new(), Vec::new());
    // Of lattice vertices, and of others.
    let mut ways: [Vec<(u32, u32)>; 2] = Default::default();
    let mut previous_first = 0;
    for v in 0..ranks.n_vertices() {
        let trajectory = ranks.of(v).expect("the vertex exists");
        counts.push(trajectory.len() as u64);
        let Some(&first) = trajectory.first() else { continue };
        if trajectory.len() == 2 {
            flags.push(ranks.is_lattice(v).into());
        }
        firsts.push(zigzag(i64::from(first) - i64::from(previous_first)));
        previous_first = first;
        let kind = usize::from(!ranks.is_lattice(v));
        ways[kind].extend(trajectory.windows(2).map(|pair| (pair[0], pair[1])));
    }
    for column in [&counts, &flags, &firsts] {
        columns.column(column.iter().copied());
    }
    ways.iter().for_each(|ways| write_ways(&mut columns, ways));
    columns.end()
}

/// Reads section `VERT` of a version; every rank is below `n_isovalues`. At most `most_unused` vertices have fewer than
/// the two knots that a triangle needs.
pub(super) fn read_ranks(
    content: &Content,
    n_isovalues: usize,
    version: u32,
    most_unused: usize,
) -> Result<Ranks> {
    let mut columns = content.columns();
    let n = columns.count()?;
    if n >= u32::MAX as usize {
        return Err(Error::input(format!("{n} vertices, expected fewer than 2^32")));
    }
    let (first_knot, n_moving) = read_counts(&columns.column(n, 32)?, n, most_unused)?;
    let is_lattice = match version {
        ..=LAST_WITHOUT_STATIONS => None,
        _ => Some(read_flags(&mut columns, &first_knot)?),
    };
    let mut ranks = Ranks { first_knot, ranks: Vec::new(), is_lattice };
    let firsts = columns.column(n_moving, 33)?;
    let mut further = Further::new(&mut columns, &ranks, n_moving, n_isovalues)?;
    columns.end()?;
    let n_knots = ranks.first_knot[n] as usize;
    ranks.ranks.reserve_exact(n_knots);
    let (mut next_first, mut previous_first) = (0, 0);
    for v in 0..n as u32 {
        let mut rank = 0;
        let [start, end] = [v, v + 1].map(|v| ranks.first_knot[v as usize]);
        for i in start..end {
            if i == start {
                rank = previous_first + firsts.get_signed(next_first)?;
                previous_first = rank;
                next_first += 1;
            } else {
                rank = further.next(rank as u32, ranks.is_lattice(v))? as i64;
            }
            if !(0..n_isovalues as i64).contains(&rank) {
                return Err(Error::input(format!(
                    "vertex {v} has a knot of rank {rank}, expected one of {n_isovalues} isovalues"
                )));
            }
            ranks.ranks.push(rank as u32);
        }
    }
    further.end()?;
    Ok(ranks)
}

/// The first knot of each of `n` vertices, one more than there are, and how many have knots.
fn read_counts(counts: &Column, n: usize, most_unused: usize) -> Result<(Vec<u32>, usize)> {
    let mut n_unused = 0;
    for v in 0..n {
        n_unused += usize::from(counts.get(v)? < 2);
    }
    if n_unused > most_unused {
        return Err(too_many_unused(n_unused, most_unused));
    }
    let mut first_knot = Vec::with_capacity(n + 1);
    first_knot.push(0);
    let (mut n_knots, mut n_moving) = (0u32, 0);
    for v in 0..n {
        let count = counts.get(v)? as u32;
        n_knots = n_knots.checked_add(count).ok_or_else(|| Error::input("more than 2^32 knots"))?;
        n_moving += usize::from(count > 0);
        first_knot.push(n_knots);
    }
    Ok((first_knot, n_moving))
}

/// By vertex, whether it is a lattice vertex: those with two knots may be.
pub(super) fn read_flags(columns: &mut Columns, first_knot: &[u32]) -> Result<Vec<bool>> {
    let may_be = |knots: &[u32]| knots[1] - knots[0] == 2;
    let n = first_knot.windows(2).filter(|knots| may_be(knots)).count();
    let flags = columns.column(n, 1)?;
    let mut is_lattice = Vec::with_capacity(first_knot.len() - 1);
    let mut next = 0;
    for knots in first_knot.windows(2) {
        is_lattice.push(may_be(knots) && flags.get(next)? == 1);
        next += usize::from(may_be(knots));
    }
    Ok(is_lattice)
}

/// The ranks of further knots, vertex by vertex.
#[derive(Debug)]
enum Further<'a> {
    /// Each less the one before and 1.
    Steps { steps: Column<'a>, next: usize },
    /// By ways: of lattice vertices, and of others.
    Ways(Box<[Ways<'a>; 2]>),
}

impl<'a> Further<'a> {
    /// Takes their columns off the front of a section. The ranks are none yet.
    fn new(
        columns: &mut Columns<'a>,
        ranks: &Ranks,
        n_moving: usize,
        n_isovalues: usize,
    ) -> Result<Self> {
        let n = ranks.first_knot.last().map_or(0, |&n| n as usize) - n_moving;
        let Some(is_lattice) = &ranks.is_lattice else {
            return Ok(Further::Steps { steps: columns.column(n, 32)?, next: 0 });
        };
        let n_lattice = is_lattice.iter().filter(|is| **is).count();
        let mut ways = |n| Ways::new(columns, n, n_isovalues);
        Ok(Further::Ways(Box::new([ways(n_lattice)?, ways(n - n_lattice)?])))
    }

    /// The rank of the next one, after a rank.
    fn next(&mut self, from: u32, is_lattice: bool) -> Result<u64> {
        match self {
            Further::Steps { steps, next } => {
                *next += 1;
                Ok(u64::from(from) + 1 + steps.get(*next - 1)?)
            }
            Further::Ways(ways) => ways[usize::from(!is_lattice)].next(from),
        }
    }

    fn end(self) -> Result<()> {
        match self {
            Further::Steps { .. } => Ok(()),
            Further::Ways(ways) => ways.into_iter().try_for_each(Ways::end),
        }
    }
}
