//! Section `VERT`: when the vertices are somewhere.
//!
//! Ranks come before the triangles in the file and positions after them, so that a position can be
//! predicted from the neighbours that are known already ([`super::geometry`]).

use super::column::{Columns, write_column, zigzag};
use super::too_many_unused;
use crate::error::{Error, Result};
use crate::spectrum::Spectrum;

/// The ranks of all trajectories: what of them is known before positions are.
#[derive(Clone, Debug, Default)]
pub(super) struct Ranks {
    /// As [`Spectrum::first_knot`].
    pub(super) first_knot: Vec<u32>,
    /// As in [`Spectrum::knots`].
    pub(super) ranks: Vec<u32>,
}

impl Ranks {
    pub(super) fn new(spectrum: &Spectrum) -> Self {
        Ranks {
            first_knot: spectrum.first_knot().to_vec(),
            ranks: spectrum.knots().iter().map(|knot| knot.rank).collect(),
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
}

/// Writes section `VERT`.
pub(super) fn write_ranks(ranks: &Ranks) -> Vec<u8> {
    let mut bytes = u64::from(ranks.n_vertices()).to_le_bytes().to_vec();
    let (mut counts, mut firsts, mut steps) = (Vec::new(), Vec::new(), Vec::new());
    let mut previous_first = 0;
    for v in 0..ranks.n_vertices() {
        let trajectory = ranks.of(v).expect("the vertex exists");
        counts.push(trajectory.len() as u64);
        let Some(&first) = trajectory.first() else { continue };
        firsts.push(zigzag(i64::from(first) - i64::from(previous_first)));
        previous_first = first;
        steps.extend(trajectory.windows(2).map(|pair| u64::from(pair[1] - pair[0] - 1)));
    }
    write_column(&mut bytes, &counts);
    write_column(&mut bytes, &firsts);
    write_column(&mut bytes, &steps);
    bytes
}

/// Reads section `VERT`; every rank is below `n_isovalues`. At most `most_unused` vertices have fewer than the two
/// knots that a triangle needs.
pub(super) fn read_ranks(bytes: &[u8], n_isovalues: usize, most_unused: usize) -> Result<Ranks> {
    let mut columns = Columns::new(bytes);
    let n = columns.count()?;
    if n >= u32::MAX as usize {
        return Err(Error::input(format!("{n} vertices, expected fewer than 2^32")));
    }
    let counts = columns.column(n, 32)?;
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
    let firsts = columns.column(n_moving, 33)?;
    let steps = columns.column(n_knots as usize - n_moving, 32)?;
    columns.end()?;
    let mut ranks = Vec::with_capacity(n_knots as usize);
    let (mut next_first, mut next_step) = (0, 0);
    let mut previous_first = 0;
    for v in 0..n {
        let mut rank = 0;
        for i in first_knot[v]..first_knot[v + 1] {
            if i == first_knot[v] {
                rank = previous_first + firsts.get_signed(next_first)?;
                previous_first = rank;
                next_first += 1;
            } else {
                rank += 1 + steps.get(next_step)? as i64;
                next_step += 1;
            }
            if !(0..n_isovalues as i64).contains(&rank) {
                return Err(Error::input(format!(
                    "vertex {v} has a knot of rank {rank}, expected one of {n_isovalues} isovalues"
                )));
            }
            ranks.push(rank as u32);
        }
    }
    Ok(Ranks { first_knot, ranks })
}
