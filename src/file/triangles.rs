//! Section `TRIA`: triangles and lifetimes.
//!
//! The lifetime of a triangle is within the trajectories of its vertices; the reader refuses others.
//! [`super::connectivity`] codes vertices and births, and most deaths. The other deaths are explicit: a rank interval from
//! the birth ([`super::rank_intervals`]), or the same rank as the last explicit death.

use rayon::prelude::*;

use super::column::{CodedColumns, Content};
use super::connectivity::{ByRank, FileOrder, Input, Traversal, TraversalReader, traverse};
use super::holes::{Candidate, Holes, MAX_TRIANGLES};
use super::rank_intervals::{IntervalReader, write_intervals};
use super::samples::Samples;
use super::trajectories::{Ranks, too_many_unused};
use super::units::Units;
use crate::error::{Error, Result};
use crate::spectrum::{Collapse, Patch, Spectrum, Triangle};

/// How the death of a triangle is stored: by death flags; equal to the last explicit one; by a rank interval.
const BY_FLAGS: u64 = 0;
const AS_BEFORE: u64 = 1;
const BY_INTERVAL: u64 = 2;
/// Added to these for caps.
const CAP: u64 = 3;

/// A spectrum in the order of the file.
pub(super) struct Arranged {
    pub(super) spectrum: Spectrum,
    traversal: Traversal,
    /// By triangle, whether it needs an explicit death.
    has_explicit_death: Vec<bool>,
    /// By vertex, whether it is a lattice vertex.
    pub(super) is_lattice: Vec<bool>,
    /// By vertex, its number in the original spectrum.
    pub(super) order: Vec<u32>,
}

/// Puts a spectrum into the order of the file, given the units of its positions. To save memory, each array of
/// the original is dropped as soon as it has been copied.
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
        .map(|v| samples.edge_of(trajectory(v)).is_some())
        .collect();
    triangles.par_sort_by_key(|t| t.birth);
    let (order, traversal) = traverse(&Input {
        triangles: &triangles,
        n_vertices,
        n_isovalues: isovalues.len(),
        last: &|v| Some(trajectory(v).last()?.rank),
        is_lattice: &|v| lattice[v as usize],
    });
    let FileOrder { triangles: numbers, corners, vertices: order, is_lattice, has_explicit_death } =
        order;
    let old = triangles;
    let triangles = numbers.into_par_iter().zip(corners);
    let triangles = triangles.map(|(i, vertices)| Triangle { vertices, ..old[i as usize] });
    let triangles = triangles.collect();
    drop(old);
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
    Arranged { spectrum, traversal, has_explicit_death, is_lattice, order }
}

/// Writes section `TRIA`.
pub(super) fn write_triangles(arranged: &Arranged) -> Content<'static> {
    let Arranged { spectrum, traversal, has_explicit_death, .. } = arranged;
    let mut columns = CodedColumns::new();
    traversal.write(&mut columns);
    let mut before = 0;
    let mut intervals = Vec::new();
    let mut kinds: Vec<u8> = Vec::with_capacity(has_explicit_death.len());
    for (t, &is_explicit) in spectrum.triangles().iter().zip(has_explicit_death) {
        let death = match is_explicit {
            false => BY_FLAGS,
            true if std::mem::replace(&mut before, t.death) == t.death => AS_BEFORE,
            true => {
                intervals.push((t.birth, t.death));
                BY_INTERVAL
            }
        };
        kinds.push((death + CAP * u64::from(t.cap)) as u8);
    }
    columns.column(kinds.iter().map(|&kind| kind.into()));
    write_intervals(&mut columns, &intervals);
    columns.end()
}

/// Reads section `TRIA`. At most `max_unused` vertices may be in none of its triangles.
pub(super) fn read_triangles(
    content: &Content,
    ranks: &Ranks,
    n_isovalues: usize,
    max_unused: usize,
) -> Result<Vec<Triangle>> {
    let mut columns = content.columns();
    let traversal = TraversalReader::new(&mut columns, n_isovalues)?;
    let n = traversal.n_triangles()?;
    if n > MAX_TRIANGLES {
        return Err(Error::input(format!("{n} triangles, expected at most {MAX_TRIANGLES}")));
    }
    let kinds = columns.column(n, 3)?;
    let mut n_intervals = 0;
    for i in 0..n {
        n_intervals += usize::from(kinds.get(i)? % CAP == BY_INTERVAL);
    }
    let mut intervals = IntervalReader::new(&mut columns, n_intervals, n_isovalues)?;
    columns.end()?;
    let mut before = 0;
    let mut attributes = |i: usize, birth: u32| {
        let kind = kinds.get(i)?;
        let death = match kind % CAP {
            BY_FLAGS => None,
            AS_BEFORE => Some(before),
            _ => {
                before = intervals.next(birth)?;
                Some(before)
            }
        };
        Ok((death, kind >= CAP))
    };
    let reader = Reader::new(ranks, n_isovalues, n);
    let (triangles, n_used) = reader.read(traversal, n_isovalues, &mut attributes)?;
    intervals.end()?;
    let n_unused = (ranks.n_vertices() - n_used) as usize;
    if n_unused > max_unused { Err(too_many_unused(n_unused, max_unused)) } else { Ok(triangles) }
}

/// Reads triangles rank by rank.
struct Reader<'a> {
    ranks: &'a Ranks,
    holes: Holes,
    /// Vertices by their last rank.
    ends: ByRank,
    /// Triangles by their explicit deaths.
    explicit: ByRank,
    /// By triangle; its vertices are in `holes`.
    births: Vec<u32>,
    deaths: Vec<u32>,
    caps: Vec<bool>,
    n_used: u32,
}

/// Returns the explicit death of triangle `i`, born at a rank, if it has one, and whether it is a cap.
type Attributes<'a> = &'a mut dyn FnMut(usize, u32) -> Result<(Option<u64>, bool)>;

impl<'a> Reader<'a> {
    fn new(ranks: &'a Ranks, n_isovalues: usize, n: usize) -> Self {
        let n_vertices = ranks.n_vertices();
        let mut ends = ByRank::new(n_isovalues);
        // In reverse: the lists return the newest number first.
        for v in (0..n_vertices).rev() {
            let last = ranks.of(v).and_then(<[u32]>::last);
            last.into_iter().for_each(|&rank| ends.push(rank, v));
        }
        Reader {
            ranks,
            holes: Holes::new(n_vertices as usize),
            ends,
            explicit: ByRank::new(n_isovalues),
            births: Vec::with_capacity(n),
            deaths: Vec::with_capacity(n),
            caps: Vec::with_capacity(n),
            n_used: 0,
        }
    }

    /// All triangles, and the number of vertices that they use.
    fn read(
        mut self,
        mut traversal: TraversalReader,
        n_isovalues: usize,
        attributes: Attributes,
    ) -> Result<(Vec<Triangle>, u32)> {
        for rank in 0..n_isovalues as u32 {
            self.deaths(&mut traversal, rank)?;
            let mut left = traversal.births()?;
            while left > 0 {
                let gate = self.holes.pop();
                let vertices = match &gate {
                    Some(gate) => traversal
                        .third(&self.holes, gate, self.n_used)?
                        .map(|third| [gate.from, gate.to, third]),
                    None => Some(traversal.seed(self.n_used)?),
                };
                if let Some(vertices) = vertices {
                    self.add(vertices, rank, attributes)?;
                    left -= 1;
                }
                match (gate, vertices) {
                    (Some(gate), Some([.., third])) => self.holes.fill(gate, third),
                    (Some(gate), None) => self.holes.skip(gate),
                    (None, vertices) => vertices.into_iter().for_each(|v| self.holes.add_seed(v)),
                }
            }
        }
        traversal.end()?;
        if let Some(i) = self.deaths.iter().position(|&death| death == NO_DEATH) {
            return Err(outlives(i));
        }
        let lives = self.births.into_iter().zip(self.deaths).zip(self.caps);
        let triangles = self.holes.into_vertices().into_iter().zip(lives);
        let triangle = |(vertices, ((birth, death), cap))| Triangle { vertices, birth, death, cap };
        Ok((triangles.map(triangle).collect(), self.n_used))
    }

    /// Finds the triangles that die at a rank and opens gates around the holes that they leave.
    fn deaths(&mut self, traversal: &mut TraversalReader, rank: u32) -> Result<()> {
        let ended: Vec<u32> = self.ends.at(rank).collect();
        let dies = |holes: &Holes, candidate: Candidate| {
            let vertices = holes.vertices(candidate.triangle);
            traversal.dies(candidate, vertices, |v| self.ranks.is_lattice(v))
        };
        let [found, _] = self.holes.dying(rank, &ended, self.explicit.at(rank), dies)?;
        for &t in &found {
            self.deaths[t as usize] = rank;
        }
        self.holes.open_gates(&found);
        Ok(())
    }

    /// Adds a triangle that is born at a rank.
    fn add(&mut self, vertices: [u32; 3], birth: u32, attributes: Attributes) -> Result<()> {
        let [a, b, c] = vertices;
        let (i, n_vertices) = (self.deaths.len(), self.ranks.n_vertices());
        self.n_used = self.n_used.max(a.max(b).max(c) + 1);
        if self.n_used > n_vertices || a == b || b == c || c == a {
            return Err(Error::input(format!(
                "triangle {i} has vertices {a}, {b}, {c}, expected three different ones below {n_vertices}"
            )));
        }
        let (first, last) = span(vertices, self.ranks).ok_or_else(|| outlives(i))?;
        let (death, cap) = attributes(i, birth)?;
        let is_within = |death: u64| (u64::from(birth) + 1..=u64::from(last)).contains(&death);
        if first > birth || birth >= last || death.is_some_and(|death| !is_within(death)) {
            return Err(outlives(i));
        }
        death.into_iter().for_each(|death| self.explicit.push(death as u32, i as u32));
        self.births.push(birth);
        self.deaths.push(NO_DEATH);
        self.caps.push(cap);
        Ok(())
    }
}

/// The death of a triangle that has not died yet.
const NO_DEATH: u32 = u32::MAX;

fn outlives(i: usize) -> Error {
    Error::input(format!("triangle {i} outlives its vertices"))
}

/// The ranks at which all three vertices exist, from the first to the last; none if one of
/// the vertices has no knots or does not exist.
fn span(vertices: [u32; 3], ranks: &Ranks) -> Option<(u32, u32)> {
    let mut span = (0, u32::MAX);
    for v in vertices {
        let trajectory = ranks.of(v)?;
        span = (span.0.max(*trajectory.first()?), span.1.min(*trajectory.last()?));
    }
    Some(span)
}
