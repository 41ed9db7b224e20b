//! Section `TRIA`: triangles and lifetimes.
//!
//! A triangle lives within the trajectories of its vertices. What it joins and when it is born is [`super::connectivity`]'s, and mostly
//! when it dies, too; where it is not found there, it is told by the way from its birth ([`super::stations`]), or to be
//! as that of the last one that told it. A lifetime that its vertices do not cover is refused.

use rayon::prelude::*;

use super::column::{CodedColumns, Content};
use super::connectivity::{ByRank, Meshes, Walk, WalkReader, arrange};
use super::facing::Units;
use super::holes::{Holes, MOST_TRIANGLES, Question};
use super::samples::Samples;
use super::stations::{Ways, write_ways};
use super::too_many_unused;
use super::trajectories::Ranks;
use crate::error::{Error, Result};
use crate::spectrum::{Collapse, Patch, Spectrum, Triangle};

/// Of a triangle: that it dies where it is found to; with the last one that told when; at the end of a way.
const FOUND: u64 = 0;
const AS_BEFORE: u64 = 1;
const BY_A_WAY: u64 = 2;
/// Added for caps.
const CAP: u64 = 3;

/// A spectrum in the order of the file.
pub(super) struct Arranged {
    pub(super) spectrum: Spectrum,
    /// What tells its triangles.
    walk: Walk,
    /// Of each triangle, whether it has to tell when it dies.
    is_told: Vec<bool>,
    /// Of each vertex, whether it is a lattice vertex.
    pub(super) is_lattice: Vec<bool>,
    /// Of each vertex, which it was.
    pub(super) order: Vec<u32>,
}

/// Puts a spectrum into the order of the file, with positions in some units. Columns of the
/// spectrum as it was go as soon as those in their place are there.
pub(super) fn arranged(spectrum: Spectrum, units: Units) -> Arranged {
    let n_vertices = spectrum.n_vertices();
    let samples = Samples::new(spectrum.volume(), units);
    let (about, patch) = spectrum.into_parts();
    let Patch { isovalues, first_knot, knots, mut triangles, collapses } = patch;
    let trajectory = |v: u32| {
        let [from, to] = [v as usize, v as usize + 1].map(|v| first_knot[v] as usize);
        &knots[from..to]
    };
    let lattice: Vec<bool> = (0..n_vertices as u32)
        .into_par_iter()
        .map(|v| samples.way_along(trajectory(v)).is_some())
        .collect();
    // Those of one rank are looked at together.
    triangles.par_sort_by_key(|t| t.birth);
    let (order, walk) = arrange(&Meshes {
        triangles: &triangles,
        n_vertices,
        n_isovalues: isovalues.len(),
        last: &|v| Some(trajectory(v).last()?.rank),
        is_lattice: &|v| lattice[v as usize],
    });
    let is_told = order.is_told;
    let old = triangles;
    let triangles = order.triangles.into_par_iter().zip(order.corners);
    let triangles = triangles.map(|(i, vertices)| Triangle { vertices, ..old[i as usize] });
    let triangles = triangles.collect();
    drop(old);
    let mut number = vec![0; n_vertices];
    let mut new_first = Vec::with_capacity(n_vertices + 1);
    new_first.push(0);
    let mut new_knots = Vec::with_capacity(knots.len());
    for (&v, new) in order.vertices.iter().zip(0..) {
        number[v as usize] = new;
        let [from, to] = [v as usize, v as usize + 1].map(|v| first_knot[v] as usize);
        new_knots.extend_from_slice(&knots[from..to]);
        new_first.push(new_knots.len() as u32);
    }
    drop((knots, first_knot));
    let collapses = collapses.iter().map(|c| Collapse {
        vertex: number[c.vertex as usize],
        target: number[c.target as usize],
        ..*c
    });
    let collapses = collapses.collect();
    let (first_knot, knots) = (new_first, new_knots);
    let patch = Patch { isovalues, first_knot, knots, triangles, collapses };
    let spectrum = Spectrum::unchecked(about, patch);
    Arranged { spectrum, walk, is_told, is_lattice: order.is_lattice, order: order.vertices }
}

/// Writes section `TRIA`.
pub(super) fn write_triangles(arranged: &Arranged) -> Content<'static> {
    let Arranged { spectrum, walk, is_told, .. } = arranged;
    let mut columns = CodedColumns::new();
    walk.write(&mut columns);
    let mut before = 0;
    let mut ways = Vec::new();
    let mut kinds: Vec<u8> = Vec::with_capacity(is_told.len());
    for (t, &is_told) in spectrum.triangles().iter().zip(is_told) {
        let death = match is_told {
            false => FOUND,
            true if std::mem::replace(&mut before, t.death) == t.death => AS_BEFORE,
            true => {
                ways.push((t.birth, t.death));
                BY_A_WAY
            }
        };
        kinds.push((death + CAP * u64::from(t.cap)) as u8);
    }
    columns.column(kinds.iter().map(|&kind| kind.into()));
    write_ways(&mut columns, &ways);
    columns.end()
}

/// Reads section `TRIA`. At most `most_unused` vertices are in none of its triangles.
pub(super) fn read_triangles(
    content: &Content,
    ranks: &Ranks,
    n_isovalues: usize,
    most_unused: usize,
) -> Result<Vec<Triangle>> {
    let mut columns = content.columns();
    let walk = WalkReader::new(&mut columns, n_isovalues)?;
    let n = walk.n_triangles()?;
    if n > MOST_TRIANGLES {
        return Err(Error::input(format!("{n} triangles, expected at most {MOST_TRIANGLES}")));
    }
    let kinds = columns.column(n, 3)?;
    let mut n_ways = 0;
    for i in 0..n {
        n_ways += usize::from(kinds.get(i)? % CAP == BY_A_WAY);
    }
    let mut ways = Ways::new(&mut columns, n_ways, n_isovalues)?;
    columns.end()?;
    let mut before = 0;
    let mut told = |i: usize, birth: u32| {
        let kind = kinds.get(i)?;
        let death = match kind % CAP {
            FOUND => None,
            AS_BEFORE => Some(before),
            _ => {
                before = ways.next(birth)?;
                Some(before)
            }
        };
        Ok((death, kind >= CAP))
    };
    let reader = Reader::new(ranks, n_isovalues, n);
    let (triangles, n_used) = reader.read(walk, n_isovalues, &mut told)?;
    ways.end()?;
    check_unused(ranks, n_used, most_unused)?;
    Ok(triangles)
}

/// Reads triangles rank by rank.
struct Reader<'a> {
    ranks: &'a Ranks,
    holes: Holes,
    /// Vertices by where they end, and triangles by the deaths that they tell.
    ends: ByRank,
    told: ByRank,
    /// By triangle; its vertices are in the holes.
    births: Vec<u32>,
    deaths: Vec<u32>,
    caps: Vec<bool>,
    n_used: u32,
}

/// When triangle `i` dies that is born at a rank, if it tells, and whether it is a cap.
type Tells<'a> = &'a mut dyn FnMut(usize, u32) -> Result<(Option<u64>, bool)>;

impl<'a> Reader<'a> {
    fn new(ranks: &'a Ranks, n_isovalues: usize, n: usize) -> Self {
        let n_vertices = ranks.n_vertices();
        let mut ends = ByRank::new(n_isovalues);
        // Newest first, so they come back in their order.
        for v in (0..n_vertices).rev() {
            let last = ranks.of(v).and_then(<[u32]>::last);
            last.into_iter().for_each(|&rank| ends.push(rank, v));
        }
        Reader {
            ranks,
            holes: Holes::new(n_vertices as usize),
            ends,
            told: ByRank::new(n_isovalues),
            births: Vec::with_capacity(n),
            deaths: Vec::with_capacity(n),
            caps: Vec::with_capacity(n),
            n_used: 0,
        }
    }

    /// All triangles, and how many vertices they use.
    fn read(
        mut self,
        mut walk: WalkReader,
        n_isovalues: usize,
        tells: Tells,
    ) -> Result<(Vec<Triangle>, u32)> {
        for rank in 0..n_isovalues as u32 {
            self.die(&mut walk, rank)?;
            let mut left = walk.births()?;
            while left > 0 {
                let gate = self.holes.pop();
                let vertices = match &gate {
                    Some(gate) => walk
                        .third(&self.holes, gate, self.n_used)?
                        .map(|third| [gate.from, gate.to, third]),
                    None => Some(walk.start(self.n_used)?),
                };
                if let Some(vertices) = vertices {
                    self.add(vertices, rank, tells)?;
                    left -= 1;
                }
                match (gate, vertices) {
                    (Some(gate), Some([.., third])) => self.holes.fill(gate, third),
                    (Some(gate), None) => self.holes.leave(gate),
                    (None, vertices) => vertices.into_iter().for_each(|v| self.holes.start(v)),
                }
            }
        }
        walk.end()?;
        if let Some(i) = self.deaths.iter().position(|&death| death == NEVER) {
            return Err(outlives(i));
        }
        let lives = self.births.into_iter().zip(self.deaths).zip(self.caps);
        let triangles = self.holes.into_vertices().into_iter().zip(lives);
        let triangle = |(vertices, ((birth, death), cap))| Triangle { vertices, birth, death, cap };
        Ok((triangles.map(triangle).collect(), self.n_used))
    }

    /// Opens the holes that the triangles leave which die at a rank.
    fn die(&mut self, walk: &mut WalkReader, rank: u32) -> Result<()> {
        let ended: Vec<u32> = self.ends.at(rank).collect();
        let dies = |holes: &Holes, question: Question| {
            let vertices = holes.vertices(question.triangle);
            walk.dies(question, vertices, |v| self.ranks.is_lattice(v))
        };
        let [found, _] = self.holes.dying(rank, &ended, self.told.at(rank), dies)?;
        for &t in &found {
            self.deaths[t as usize] = rank;
        }
        self.holes.open(&found);
        Ok(())
    }

    /// Adds a triangle that is born at a rank.
    fn add(&mut self, vertices: [u32; 3], birth: u32, tells: Tells) -> Result<()> {
        let [a, b, c] = vertices;
        let (i, n_vertices) = (self.deaths.len(), self.ranks.n_vertices());
        self.n_used = self.n_used.max(a.max(b).max(c) + 1);
        if self.n_used > n_vertices || a == b || b == c || c == a {
            return Err(Error::input(format!(
                "triangle {i} has vertices {a}, {b}, {c}, expected three different ones below {n_vertices}"
            )));
        }
        let (first, last) = span(vertices, self.ranks).ok_or_else(|| outlives(i))?;
        let (death, cap) = tells(i, birth)?;
        let is_within = |death: u64| (u64::from(birth) + 1..=u64::from(last)).contains(&death);
        if first > birth || birth >= last || death.is_some_and(|death| !is_within(death)) {
            return Err(outlives(i));
        }
        death.into_iter().for_each(|death| self.told.push(death as u32, i as u32));
        self.births.push(birth);
        self.deaths.push(NEVER);
        self.caps.push(cap);
        Ok(())
    }
}

/// The death of a triangle that has not died yet.
const NEVER: u32 = u32::MAX;

pub(super) fn outlives(i: usize) -> Error {
    Error::input(format!("triangle {i} outlives its vertices"))
}

/// Checks how many vertices no triangle uses.
pub(super) fn check_unused(ranks: &Ranks, n_used: u32, most_unused: usize) -> Result<()> {
    let n = (ranks.n_vertices() - n_used) as usize;
    if n > most_unused { Err(too_many_unused(n, most_unused)) } else { Ok(()) }
}

/// The first and last rank at which all three vertices have knots around them; none if one of
/// the vertices has no knots at all or does not exist.
pub(super) fn span(vertices: [u32; 3], ranks: &Ranks) -> Option<(u32, u32)> {
    let mut span = (0, u32::MAX);
    for v in vertices {
        let trajectory = ranks.of(v)?;
        span = (span.0.max(*trajectory.first()?), span.1.min(*trajectory.last()?));
    }
    Some(span)
}
