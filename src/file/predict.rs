//! Predicts where a vertex is from what stands before it in the file.
//!
//! # Theory
//!
//! The neighbours of a vertex at its birth are near it, most of all where it was born by a split,
//! and they move as it does. So the first knot is expected at the mean of those neighbours that
//! have a lower number, at the same isovalue; the next ones where the vertex gets when it moves as
//! they do. Without such neighbours the last vertex's first knot, and the last knot, have to
//! do.
//!
//! # Invariants
//!
//! A reader must predict exactly what the writer did: everything is a whole number except for where
//! an isovalue lies between two others, which takes -, * and / on f64 in the order written here and
//! in FORMAT.md.

use super::trajectories::Ranks;
use crate::spectrum::Triangle;

/// Predicts knot after knot, in the order of the file.
#[derive(Debug)]
pub(super) struct Predictor<'a> {
    ranks: &'a Ranks,
    isovalues: &'a [f64],
    /// Start of each vertex's neighbours in `neighbours`, and the end.
    first_neighbour: Vec<u32>,
    neighbours: Vec<u32>,
    positions: Vec<[i32; 3]>,
    /// The vertex that had knots last.
    last_vertex: Option<u32>,
}

/// A place or a way, quanta.
type Place = [i64; 3];

impl<'a> Predictor<'a> {
    /// A predictor that knows no knot yet. The triangles must lie within the trajectories.
    pub(super) fn new(ranks: &'a Ranks, isovalues: &'a [f64], triangles: &[Triangle]) -> Self {
        let (first_neighbour, neighbours) = lower_neighbours(ranks, triangles);
        Predictor {
            ranks,
            isovalues,
            first_neighbour,
            neighbours,
            positions: Vec::with_capacity(ranks.ranks.len()),
            last_vertex: None,
        }
    }

    /// The next knot is this.
    pub(super) fn push(&mut self, position: [i32; 3]) {
        self.positions.push(position);
    }

    /// Where the next knot, one of vertex `v`, is expected to be.
    pub(super) fn predict(&mut self, v: u32) -> [i32; 3] {
        let knot = self.positions.len();
        let rank = self.ranks.ranks[knot];
        let range = self.first_neighbour[v as usize]..self.first_neighbour[v as usize + 1];
        let neighbours = &self.neighbours[range.start as usize..range.end as usize];
        let place = if knot == self.ranks.first_knot[v as usize] as usize {
            let last = self.last_vertex.replace(v);
            if neighbours.is_empty() {
                let knot = last.map(|u| self.ranks.first_knot[u as usize] as usize);
                knot.map(|knot| self.place(knot)).unwrap_or_default()
            } else {
                mean(neighbours.iter().map(|&u| self.place_at(u, rank)))
            }
        } else {
            let before = self.ranks.ranks[knot - 1];
            let here = self.place(knot - 1);
            let alive = |u: &&u32| {
                self.ranks.of(**u).and_then(<[u32]>::last).is_some_and(|&last| last >= rank)
            };
            let moves = neighbours.iter().filter(alive).map(|&u| {
                let (from, to) = (self.place_at(u, before), self.place_at(u, rank));
                combine(from, to, |from, to| to - from)
            });
            combine(here, mean(moves), |here, step| here + step)
        };
        place.map(|x| x.clamp(i32::MIN.into(), i32::MAX.into()) as i32)
    }

    /// A knot that is known.
    fn place(&self, knot: usize) -> Place {
        self.positions[knot].map(i64::from)
    }

    /// Vertex `u`, all of whose knots are known, at `rank`.
    fn place_at(&self, u: u32, rank: u32) -> Place {
        let start = self.ranks.first_knot[u as usize] as usize;
        let ranks = self.ranks.of(u).expect("a neighbour is a vertex");
        let next = ranks.partition_point(|&r| r <= rank);
        if next == 0 {
            return self.place(start);
        }
        let before = self.place(start + next - 1);
        if next == ranks.len() || ranks[next - 1] == rank {
            return before;
        }
        let isovalue = |rank: u32| self.isovalues[rank as usize];
        let (low, high) = (0.5 * isovalue(ranks[next - 1]), 0.5 * isovalue(ranks[next]));
        // In [0, 2^16]: from here on whole numbers do, and are the same everywhere. Zero where the
        // isovalues are so small that halving makes them equal.
        let t = (65536.0 * ((0.5 * isovalue(rank) - low) / (high - low))) as i64;
        combine(before, self.place(start + next), |a, b| a + ((t * (b - a) + 32768) >> 16))
    }
}

/// For each vertex, the lower-numbered vertices of the triangles born with it, in the order of
/// the triangles and as often as they occur.
fn lower_neighbours(ranks: &Ranks, triangles: &[Triangle]) -> (Vec<u32>, Vec<u32>) {
    let birth = |v: u32| ranks.of(v).and_then(<[u32]>::first).copied();
    let sorted = |triangle: &Triangle| {
        let mut vertices = triangle.vertices;
        vertices.sort_unstable();
        (birth(vertices[2]) == Some(triangle.birth)).then_some(vertices)
    };
    let mut first = vec![0u32; ranks.n_vertices() as usize + 1];
    for [_, _, v] in triangles.iter().filter_map(sorted) {
        first[v as usize + 1] += 2;
    }
    for v in 1..first.len() {
        first[v] += first[v - 1];
    }
    let mut next = first.clone();
    let mut neighbours = vec![0; first[first.len() - 1] as usize];
    for [a, b, v] in triangles.iter().filter_map(sorted) {
        let at = next[v as usize] as usize;
        neighbours[at..at + 2].copy_from_slice(&[a, b]);
        next[v as usize] += 2;
    }
    (first, neighbours)
}

fn combine(a: Place, b: Place, f: impl Fn(i64, i64) -> i64) -> Place {
    std::array::from_fn(|i| f(a[i], b[i]))
}

/// The mean, rounded down; zero of nothing.
fn mean(places: impl Iterator<Item = Place>) -> Place {
    let (mut sum, mut n) = (Place::default(), 0);
    for place in places {
        sum = combine(sum, place, |sum, x| sum + x);
        n += 1;
    }
    combine(sum, Place::default(), |sum, _| sum.div_euclid(n.max(1)))
}
