//! Which vertices the triangles join, in less than a byte per triangle.
//!
//! # Theory
//!
//! Triangles are kept by birth. Those born at one rank fill the hole that those dying at that rank
//! leave, and the reader knows the latter already. So it walks around the hole: a *gate* is a
//! directed edge at which a triangle is missing; the last gate opened is closed first, by a triangle
//! whose third vertex is most often a new one or the next along the hole, as in Rossignac's
//! Edgebreaker (1999). Where no gate is open (the first mesh, a component that emerges) a triangle
//! is given by its three vertices.
//!
//! New vertices are the next in number, so vertices are kept in order of their first use, too. This
//! order depends on what is joined and, where the walk starts anew, on the order given; taking the
//! order of a file gives the same file again.
//!
//! # Invariants
//!
//! Writer and reader do the same to the same [`Front`].

use super::column::{Column, Columns, unzigzag, write_column, zigzag};
use super::front::Front;
use crate::error::{Error, Result};
use crate::spectrum::Triangle;

/// The third vertex is a new one.
const NEW: u64 = 0;
/// No triangle here after all.
const SKIP: u64 = 1;
/// The third vertex is told in the column of jumps.
const JUMP: u64 = 2;
/// The third vertex is where the gate that ends at this gate's start begins.
pub(super) const BEFORE: u64 = 3;
/// The third vertex is the end of the first gate after this one; larger codes: of later ones.
pub(super) const AFTER: u64 = 4;

/// None, as the number of a vertex.
const NONE: u32 = u32::MAX;

/// The order in which a file keeps triangles and vertices.
#[derive(Clone, Debug, Default)]
pub(super) struct Arrangement {
    /// For each triangle of the file: its number in the spectrum, and its vertices in the numbers
    /// of the file, the first of them as the file has it.
    pub(super) triangles: Vec<(u32, [u32; 3])>,
    /// For each vertex of the file: its number in the spectrum.
    pub(super) vertices: Vec<u32>,
}

/// What the walk around the holes tells, as section `TRIA` keeps it.
#[derive(Clone, Debug, Default)]
pub(super) struct Walk {
    /// How many triangles are born at each rank.
    births: Vec<u64>,
    /// For each gate, where the third vertex is.
    codes: Vec<u64>,
    /// The third vertices that no code finds, from the gate's start.
    jumps: Vec<u64>,
    /// The vertices of triangles without a gate, from the number of vertices so far.
    starts: Vec<u64>,
}

impl Walk {
    /// Appends the walk to a section.
    pub(super) fn write(&self, bytes: &mut Vec<u8>) {
        for column in [&self.births, &self.codes, &self.jumps, &self.starts] {
            bytes.extend((column.len() as u64).to_le_bytes());
            write_column(bytes, column);
        }
    }
}

/// Arranges the triangles of a spectrum of `n_vertices` vertices and `n_isovalues` isovalues and
/// tells how a reader finds them.
pub(super) fn arrange(
    triangles: &[Triangle],
    n_vertices: usize,
    n_isovalues: usize,
) -> (Arrangement, Walk) {
    let mut by_birth: Vec<u32> = (0..triangles.len() as u32).collect();
    by_birth.sort_by_key(|&i| triangles[i as usize].birth);
    let mut arranger = Arranger {
        front: Front::new(n_vertices, n_isovalues),
        number: vec![NONE; n_vertices],
        arrangement: Arrangement::default(),
        walk: Walk { births: vec![0; n_isovalues], ..Walk::default() },
    };
    for batch in
        by_birth.chunk_by(|&i, &j| triangles[i as usize].birth == triangles[j as usize].birth)
    {
        arranger.batch(triangles, batch);
    }
    // Vertices that no triangle uses come last.
    let Arranger { number, mut arrangement, walk, .. } = arranger;
    let unused = (0..n_vertices as u32).filter(|&v| number[v as usize] == NONE);
    arrangement.vertices.extend(unused);
    (arrangement, walk)
}

struct Arranger {
    front: Front,
    /// The number in the file of each vertex of the spectrum, once it has one.
    number: Vec<u32>,
    arrangement: Arrangement,
    walk: Walk,
}

impl Arranger {
    /// Tells the triangles born at one rank, in the spectrum's numbers and order.
    fn batch(&mut self, triangles: &[Triangle], batch: &[u32]) {
        let rank = triangles[batch[0] as usize].birth;
        self.walk.births[rank as usize] = batch.len() as u64;
        self.front.open(rank);
        // By directed edge, then by order: what fills a gate.
        let mut sides = Vec::with_capacity(3 * batch.len());
        for (&i, at) in batch.iter().zip(0u32..) {
            let [a, b, c] = triangles[i as usize].vertices;
            sides.extend([([a, b], at), ([b, c], at), ([c, a], at)]);
        }
        sides.sort_unstable();
        // At the first of equal sides, how many of them are known to be told: none is looked at twice.
        let mut n_told = vec![0u32; sides.len()];
        let mut told = vec![false; batch.len()];
        let mut next = 0;
        let mut left = batch.len();
        while left > 0 {
            let Some((from, to)) = self.front.pop() else {
                while told[next] {
                    next += 1;
                }
                told[next] = true;
                left -= 1;
                self.start(triangles, batch[next]);
                continue;
            };
            let side = [from, to].map(|v| self.arrangement.vertices[v as usize]);
            let first = sides.partition_point(|&(other, _)| other < side);
            // Behind the last side there are none.
            let mut nothing = 0;
            let n_told = n_told.get_mut(first).unwrap_or(&mut nothing);
            let mut i = first + *n_told as usize;
            while sides.get(i).is_some_and(|&(other, at)| other == side && told[at as usize]) {
                i += 1;
            }
            *n_told = (i - first) as u32;
            let Some(&(_, at)) = sides.get(i).filter(|&&(other, _)| other == side) else {
                self.walk.codes.push(SKIP);
                continue;
            };
            let at = at as usize;
            told[at] = true;
            left -= 1;
            let triangle = &triangles[batch[at] as usize];
            let third = triangle.vertices.iter().copied().find(|v| !side.contains(v));
            let third = third.expect("triangles have three different vertices");
            self.fill(batch[at], triangle.death, [from, to], third);
        }
    }

    /// Tells the triangle `i` on a gate by its third vertex.
    fn fill(&mut self, i: u32, death: u32, [from, to]: [u32; 2], third: u32) {
        let (c, is_new) = self.number_of(third);
        let n_codes = self.walk.codes.len() + 1;
        let code = if is_new { Some(NEW) } else { self.front.code_of([from, to], c, n_codes) };
        self.walk.codes.push(code.unwrap_or(JUMP));
        if code.is_none() {
            self.walk.jumps.push(zigzag(i64::from(c) - i64::from(from)));
        }
        self.front.fill([from, to, c], death);
        self.arrangement.triangles.push((i, [from, to, c]));
    }

    /// Tells the triangle `i` by its three vertices.
    fn start(&mut self, triangles: &[Triangle], i: u32) {
        let triangle = &triangles[i as usize];
        let vertices = triangle.vertices.map(|v| {
            let n_before = self.arrangement.vertices.len() as u32;
            let (v, _) = self.number_of(v);
            self.walk.starts.push(u64::from(n_before - v));
            v
        });
        self.front.start(vertices, triangle.death);
        self.arrangement.triangles.push((i, vertices));
    }

    /// The number in the file of a vertex of the spectrum, and whether it has it only now.
    fn number_of(&mut self, v: u32) -> (u32, bool) {
        let number = &mut self.number[v as usize];
        let is_new = *number == NONE;
        if is_new {
            *number = self.arrangement.vertices.len() as u32;
            self.arrangement.vertices.push(v);
        }
        (*number, is_new)
    }
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
        let (n, column) = [self.codes, self.jumps, self.starts][which];
        let i = self.n_read[which];
        if i == n {
            return Err(Error::input("less is told than the triangles need"));
        }
        self.n_read[which] += 1;
        column.get(i)
    }
}
