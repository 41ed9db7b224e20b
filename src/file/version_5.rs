//! Section `TRIA` up to version 5, where each triangle tells when it dies and gates are found by the vertices that they join.
//!
//! # Invariants
//!
//! As [`Front`] has them.

mod front;

use super::LAST_WITHOUT_STATIONS;
use super::column::{Column, Columns, Content, collected, unzigzag};
use super::stations::Ways;
use super::trajectories::Ranks;
use super::triangles::{check_unused, outlives, span};
use crate::error::{Error, Result};
use crate::spectrum::Triangle;
use front::Front;

/// The third vertex is a new one.
const NEW: u64 = 0;
/// No triangle here after all.
const SKIP: u64 = 1;
/// The third vertex is told in the column of jumps.
const JUMP: u64 = 2;
/// The third vertex is where the gate that ends at this gate's start begins.
const BEFORE: u64 = 3;
/// The third vertex is the end of the first gate after this one; larger codes: of later ones.
const AFTER: u64 = 4;

/// Codes of deaths: with the first of the triangle's vertices to end; with the triangle before; by a way from its birth. Before
/// version 5, larger codes were so many ranks before the first of its vertices.
const WITH_A_VERTEX: u64 = 0;
const AS_BEFORE: u64 = 1;
const BY_A_WAY: u64 = 2;

/// Reads section `TRIA` of a version. At most `most_unused` vertices are in none of its triangles.
pub(super) fn read_triangles(
    content: &Content,
    ranks: &Ranks,
    n_isovalues: usize,
    version: u32,
    most_unused: usize,
) -> Result<Vec<Triangle>> {
    let mut columns = content.columns();
    let walk = WalkReader::new(&mut columns)?;
    let n = walk.n_triangles()?;
    let deaths = columns.column(n, 33)?;
    let mut ways = ways(&mut columns, (n, &deaths), n_isovalues, version)?;
    let caps = columns.column(n, 1)?;
    columns.end()?;
    let mut before = 0;
    let death = |i: usize, vertices: [u32; 3], birth: u32| {
        let code = deaths.get(i)?;
        let way = match &mut ways {
            Some(ways) if code == BY_A_WAY => u32::try_from(ways.next(birth)?).ok(),
            _ => None,
        };
        let death = span(vertices, ranks).and_then(|(first, last)| {
            let death = match code {
                // In version 1 the distance itself.
                _ if version == 1 => u64::from(last).checked_sub(code)? as u32,
                WITH_A_VERTEX => last,
                AS_BEFORE => before,
                _ if version <= LAST_WITHOUT_STATIONS => {
                    u64::from(last).checked_sub(code - AS_BEFORE)? as u32
                }
                _ => way?,
            };
            (first <= birth && birth < death && death <= last).then_some(death)
        });
        before = death.unwrap_or(0);
        death.ok_or_else(|| outlives(i))
    };
    let n_vertices = ranks.n_vertices() as usize;
    let (triangles, n_used) = walk.triangles(n_vertices, n_isovalues, death)?;
    ways.map_or(Ok(()), Ways::end)?;
    check_unused(ranks, n_used as u32, most_unused)?;
    collected(triangles.len(), |i| {
        let (vertices, birth, death) = triangles[i];
        Ok(Triangle { vertices, birth, death, cap: caps.get(i)? == 1 })
    })
}

/// The ways from birth to death, of the triangles that are told by one; before version 5 there are none.
fn ways<'a>(
    columns: &mut Columns<'a>,
    (n, deaths): (usize, &Column),
    n_isovalues: usize,
    version: u32,
) -> Result<Option<Ways<'a>>> {
    if version <= LAST_WITHOUT_STATIONS {
        return Ok(None);
    }
    let mut n_ways = 0;
    for i in 0..n {
        n_ways += usize::from(deaths.get(i)? == BY_A_WAY);
    }
    Ways::new(columns, n_ways, n_isovalues).map(Some)
}

/// A triangle of a walk: its vertices, and the ranks of its birth and death.
type Told = ([u32; 3], u32, u32);

/// The columns of a walk.
#[derive(Debug)]
pub(super) struct WalkReader<'a> {
    births: (usize, Column<'a>),
    codes: (usize, Column<'a>),
    jumps: (usize, Column<'a>),
    starts: (usize, Column<'a>),
    /// How many of codes, jumps and starts are read.
    n_read: [usize; 3],
}

impl<'a> WalkReader<'a> {
    /// Takes the columns of a walk off the front of a section.
    pub(super) fn new(columns: &mut Columns<'a>) -> Result<Self> {
        let mut next = |bits: u32| -> Result<(usize, Column<'a>)> {
            let n = columns.count()?;
            Ok((n, columns.column(n, bits)?))
        };
        let (births, codes, jumps, starts) = (next(32)?, next(8)?, next(33)?, next(32)?);
        Ok(WalkReader { births, codes, jumps, starts, n_read: [0; 3] })
    }

    /// How many triangles there are.
    pub(super) fn n_triangles(&self) -> Result<usize> {
        // Each triangle takes a code or three starts: this is as many as the section can hold.
        let most = self.codes.0 + self.starts.0 / 3;
        let mut n = 0;
        for rank in 0..self.births.0 {
            n += self.births.1.get(rank)? as usize;
            if n > most {
                return Err(Error::input(format!("more triangles than the {most} it tells of")));
            }
        }
        Ok(n)
    }

    /// Walks: the vertices, births and deaths of all triangles, and how many vertices they use. `death` tells, for triangle `i` with these
    /// vertices and birth, the rank at which it dies, which must exist.
    pub(super) fn triangles(
        mut self,
        n_vertices: usize,
        n_isovalues: usize,
        mut death: impl FnMut(usize, [u32; 3], u32) -> Result<u32>,
    ) -> Result<(Vec<Told>, usize)> {
        if self.births.0 != n_isovalues {
            return Err(Error::input(format!(
                "births at {} ranks, expected {n_isovalues}",
                self.births.0
            )));
        }
        let mut triangles = Vec::with_capacity(self.n_triangles()?);
        let mut front = Front::new(n_vertices, n_isovalues);
        let mut n_used = 0;
        for rank in 0..n_isovalues as u32 {
            let mut left = self.births.1.get(rank as usize)?;
            if left > 0 {
                front.open(rank);
            }
            while left > 0 {
                let gate = front.pop();
                let vertices = match gate {
                    Some(gate) => match self.third(&mut front, gate, n_used)? {
                        Some(third) => [gate.0, gate.1, third],
                        None => continue,
                    },
                    None => self.start(n_used)?,
                };
                let [a, b, c] = vertices;
                n_used = n_used.max(a.max(b).max(c) + 1);
                if n_used as usize > n_vertices || a == b || b == c || c == a {
                    return Err(Error::input(format!(
                        "triangle {} has vertices {a}, {b}, {c}, expected three different ones below {n_vertices}",
                        triangles.len()
                    )));
                }
                let death = death(triangles.len(), vertices, rank)?;
                match gate {
                    Some(_) => front.fill(vertices, death),
                    None => front.start(vertices, death),
                }
                triangles.push((vertices, rank, death));
                left -= 1;
            }
        }
        if self.n_read != [self.codes.0, self.jumps.0, self.starts.0] {
            return Err(Error::input("more is told than the triangles need"));
        }
        Ok((triangles, n_used as usize))
    }

    /// The third vertex of the triangle at a gate; none if there is no triangle.
    fn third(&mut self, front: &mut Front, gate: (u32, u32), n_used: u32) -> Result<Option<u32>> {
        let third = match self.next(0)? {
            NEW => Some(n_used),
            SKIP => return Ok(None),
            JUMP => {
                let third = i64::from(gate.0) + unzigzag(self.next(1)?);
                u32::try_from(third).ok().filter(|&third| third < n_used)
            }
            code => front.third([gate.0, gate.1], code, self.n_read[0]),
        };
        third.map(Some).ok_or_else(|| {
            Error::input("a triangle has a vertex that does not exist or is too far to search")
        })
    }

    /// The vertices of a triangle without a gate.
    fn start(&mut self, mut n_used: u32) -> Result<[u32; 3]> {
        let mut vertices = [0; 3];
        for vertex in &mut vertices {
            let back = self.next(2)?;
            *vertex = u32::try_from(u64::from(n_used).wrapping_sub(back))
                .map_err(|_| Error::input("a triangle starts before the first vertex"))?;
            n_used += u32::from(back == 0);
        }
        Ok(vertices)
    }

    /// The next number of codes (0), jumps (1) or starts (2).
    fn next(&mut self, which: usize) -> Result<u64> {
        let (n, column) = [&self.codes, &self.jumps, &self.starts][which];
        let i = self.n_read[which];
        if i == *n {
            return Err(Error::input("less is told than the triangles need"));
        }
        self.n_read[which] += 1;
        column.get(i)
    }
}
