//! Predicts the position of a knot from what precedes it in the file.
//!
//! # Theory
//!
//! The neighbours of a vertex at its birth are near it, most of all where it was born by a split,
//! and they move as it does. So its first knot is predicted at the mean of those neighbours that
//! have a lower number, at the same isovalue, and its further knots by moving as they do.
//! Without such neighbours the prediction is the first knot of the last vertex, and the previous knot.
//!
//! # Invariants
//!
//! A reader must predict exactly what the writer did. All arithmetic is on integers, except where
//! an isovalue is interpolated: this takes -, * and / on f64 in the order written here and
//! in FORMAT.md.

use super::trajectories::Ranks;
use crate::error::{Error, Result};
use crate::spectrum::Triangle;

/// Most look-ups of neighbours per knot, in the mean over all knots, and a number that is allowed in addition. If
/// no vertex has more than 64 neighbours the limit cannot be reached, and in a mesh the mean is 6. Without it a
/// small file could make the reader look up each of its vertices at each of its knots.
const LOOKUPS_PER_KNOT: usize = 64;
const FREE_LOOKUPS: usize = 1 << 20;

/// A chunk, and the path to it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Surroundings<'a> {
    /// Of all vertices of the path up to the chunk.
    pub(super) ranks: &'a Ranks,
    pub(super) isovalues: &'a [f64],
    /// The triangles of the chunk.
    pub(super) triangles: &'a [Triangle],
    /// Vertices of the chunks above.
    pub(super) n_above: u32,
    pub(super) pivot: Option<u32>,
    /// Chunks of the file.
    pub(super) n_chunks: usize,
}

/// Predicts knot after knot of a chunk, in the order of the file.
#[derive(Debug)]
pub(super) struct Predictor<'a> {
    ranks: &'a Ranks,
    isovalues: &'a [f64],
    n_above: u32,
    /// Start of the neighbours of each vertex of the chunk in `neighbours`, and the end.
    first_neighbour: Vec<u32>,
    neighbours: Vec<Neighbour>,
    /// Of the knots of the path.
    positions: Vec<[i32; 3]>,
    pivot: Option<u32>,
}

/// A neighbour, and the number of times that it occurs.
#[derive(Clone, Copy, Debug, Default)]
struct Neighbour {
    vertex: u32,
    times: u32,
}

/// A position or a difference of positions, quanta.
type Vector = [i64; 3];

impl<'a> Predictor<'a> {
    /// A predictor that knows the positions of the knots of the chunks above. Lifetimes of triangles must be within the trajectories.
    ///
    /// # Errors
    ///
    /// [`Error::Input`] if there are more look-ups of neighbours than any mesh needs.
    pub(super) fn new(of: Surroundings<'a>, positions: Vec<[i32; 3]>) -> Result<Self> {
        let Surroundings { ranks, isovalues, n_above, pivot, n_chunks, .. } = of;
        let (first_neighbour, neighbours) = lower_neighbours(of);
        let lookups = first_neighbour.windows(2).zip(n_above..).map(|(range, v)| {
            let n_knots = ranks.of(v).map_or(0, <[u32]>::len);
            (range[1] - range[0]) as usize * n_knots
        });
        let lookups = lookups.sum::<usize>();
        let n_knots = ranks.ranks.len() - ranks.first_knot[n_above as usize] as usize;
        let max = FREE_LOOKUPS / n_chunks + LOOKUPS_PER_KNOT * n_knots;
        if lookups > max {
            return Err(Error::input(format!(
                "{lookups} neighbours of all knots, expected at most {max} for {n_knots} knots"
            )));
        }
        Ok(Predictor { ranks, isovalues, n_above, first_neighbour, neighbours, positions, pivot })
    }

    /// The number of the first knot of a vertex.
    pub(super) fn first_knot(&self, v: u32) -> usize {
        self.ranks.first_knot[v as usize] as usize
    }

    /// The positions of a vertex whose knots are known.
    pub(super) fn trajectory(&self, v: u32) -> &[[i32; 3]] {
        &self.positions[self.first_knot(v)..self.first_knot(v + 1)]
    }

    /// The positions of all knots so far.
    pub(super) fn into_positions(self) -> Vec<[i32; 3]> {
        self.positions
    }

    /// Sets the position of a knot.
    pub(super) fn set(&mut self, knot: usize, position: [i32; 3]) {
        if self.positions.len() <= knot {
            self.positions.resize(knot + 1, [0; 3]);
        }
        self.positions[knot] = position;
    }

    /// The knots of a vertex in the order in which they are stored, each with the one before it in this order. The first is that at the pivot or
    /// before it, if the chunk has one: all of its mesh exists there. Those of lattice vertices are stored in their order.
    pub(super) fn knots(&self, v: u32) -> impl Iterator<Item = (usize, Option<usize>)> + use<> {
        let (first, end) = (self.first_knot(v), self.first_knot(v + 1));
        let ranks = &self.ranks.ranks[first..end];
        let middle = match self.pivot {
            Some(pivot) if !self.ranks.is_lattice(v) => {
                first + ranks.partition_point(|&rank| rank <= pivot).saturating_sub(1)
            }
            _ => first,
        };
        let start = (middle < end).then_some((middle, None));
        let upwards = (middle + 1..end).map(|knot| (knot, Some(knot - 1)));
        let downwards = (first..middle).rev().map(|knot| (knot, Some(knot + 1)));
        start.into_iter().chain(upwards).chain(downwards)
    }

    /// The predicted position of a knot of vertex `v`, given that before it in the order of [`Predictor::knots`]. `last` is the last vertex
    /// before `v` that has knots.
    pub(super) fn expected(
        &self,
        v: u32,
        (knot, before): (usize, Option<usize>),
        last: Option<u32>,
    ) -> [i32; 3] {
        let rank = self.ranks.ranks[knot];
        let at = (v - self.n_above) as usize;
        let range = self.first_neighbour[at]..self.first_neighbour[at + 1];
        let neighbours = &self.neighbours[range.start as usize..range.end as usize];
        let predicted = match before {
            None if neighbours.is_empty() => {
                let knot = last.map(|u| self.ranks.first_knot[u as usize] as usize);
                knot.map(|knot| self.position(knot)).unwrap_or_default()
            }
            None => mean(neighbours.iter().map(|u| (self.position_at(u.vertex, rank), u.times))),
            Some(before) => {
                let rank_before = self.ranks.ranks[before];
                let here = self.position(before);
                let is_upwards = before < knot;
                let alive = |u: &&Neighbour| {
                    self.ranks.life(u.vertex).is_some_and(|(first, last)| {
                        if is_upwards { last >= rank } else { first <= rank }
                    })
                };
                let moves = neighbours.iter().filter(alive).map(|u| {
                    let (from, to) =
                        (self.position_at(u.vertex, rank_before), self.position_at(u.vertex, rank));
                    (combine(from, to, |from, to| to - from), u.times)
                });
                combine(here, mean(moves), |here, step| here + step)
            }
        };
        predicted.map(|x| x.clamp(i32::MIN.into(), i32::MAX.into()) as i32)
    }

    /// The position of a known knot.
    fn position(&self, knot: usize) -> Vector {
        self.positions[knot].map(i64::from)
    }

    /// The position at `rank` of vertex `u`, all of whose knots are known.
    fn position_at(&self, u: u32, rank: u32) -> Vector {
        let start = self.ranks.first_knot[u as usize] as usize;
        let ranks = self.ranks.of(u).expect("a neighbour is a vertex");
        let next = ranks.partition_point(|&r| r <= rank);
        if next == 0 {
            return self.position(start);
        }
        let before = self.position(start + next - 1);
        if next == ranks.len() || ranks[next - 1] == rank {
            return before;
        }
        let isovalue = |rank: u32| self.isovalues[rank as usize];
        let (low, high) = (0.5 * isovalue(ranks[next - 1]), 0.5 * isovalue(ranks[next]));
        // In [0, 2^16]; the rest is integer arithmetic, which is the same everywhere. 0 if the
        // isovalues are so small that halving makes them equal.
        let t = (65536.0 * ((0.5 * isovalue(rank) - low) / (high - low))) as i64;
        combine(before, self.position(start + next), |a, b| a + ((t * (b - a) + 32768) >> 16))
    }
}

/// For each vertex of a chunk, the lower-numbered vertices of the triangles born with it (of all triangles, if the chunk has a pivot), by number.
fn lower_neighbours(of: Surroundings) -> (Vec<u32>, Vec<Neighbour>) {
    let Surroundings { ranks, triangles, n_above, pivot, .. } = of;
    // The largest vertex is counted from the first one of the chunk.
    let sorted = |triangle: &Triangle| {
        let mut vertices = triangle.vertices;
        vertices.sort_unstable();
        let [a, b, v] = vertices;
        let is_first = || ranks.life(v).is_some_and(|(first, _)| first == triangle.birth);
        let at = v.checked_sub(n_above)?;
        (pivot.is_some() || is_first()).then_some([a, b, at])
    };
    let mut first = vec![0u32; (ranks.n_vertices() - n_above) as usize + 1];
    for [_, _, v] in triangles.iter().filter_map(sorted) {
        first[v as usize + 1] += 2;
    }
    for v in 1..first.len() {
        first[v] += first[v - 1];
    }
    let mut neighbours = vec![0; first[first.len() - 1] as usize];
    // From here on `first` is the index at which the next neighbour of a vertex is written; in the end, the end of its neighbours.
    for [a, b, v] in triangles.iter().filter_map(sorted) {
        let at = first[v as usize] as usize;
        neighbours[at..at + 2].copy_from_slice(&[a, b]);
        first[v as usize] += 2;
    }
    let mut counted: Vec<Neighbour> = Vec::with_capacity(neighbours.len() / 2);
    let mut start = 0;
    for end in &mut first {
        let of_one = &mut neighbours[start..*end as usize];
        start = *end as usize;
        of_one.sort_unstable();
        let runs = of_one.chunk_by(|u, v| u == v);
        counted.extend(runs.map(|run| Neighbour { vertex: run[0], times: run.len() as u32 }));
        *end = counted.len() as u32;
    }
    // The ends of all vertices but the last are the starts of all but the first.
    first.rotate_right(1);
    first[0] = 0;
    (first, counted)
}

fn combine(a: Vector, b: Vector, f: impl Fn(i64, i64) -> i64) -> Vector {
    std::array::from_fn(|i| f(a[i], b[i]))
}

/// The mean of vectors that each occur a number of times, rounded down; zero if there are none.
fn mean(vectors: impl Iterator<Item = (Vector, u32)>) -> Vector {
    let (mut sum, mut n) = (Vector::default(), 0);
    for (vector, times) in vectors {
        sum = combine(sum, vector, |sum, x| sum + i64::from(times) * x);
        n += i64::from(times);
    }
    combine(sum, Vector::default(), |sum, _| sum.div_euclid(n.max(1)))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `n_others` vertices with knots at the first and last rank, and one with a knot at each of `n_ranks`.
    fn ranks(n_others: u32, n_ranks: u32) -> Ranks {
        let mut ranks = Ranks::default();
        for _ in 0..n_others {
            ranks.ranks.extend([0, n_ranks - 1]);
            ranks.first_knot.push(ranks.ranks.len() as u32);
        }
        ranks.ranks.extend(0..n_ranks);
        ranks.first_knot.push(ranks.ranks.len() as u32);
        ranks
    }

    fn whole<'a>(
        ranks: &'a Ranks,
        isovalues: &'a [f64],
        triangles: &'a [Triangle],
    ) -> Surroundings<'a> {
        Surroundings { ranks, isovalues, triangles, n_above: 0, pivot: None, n_chunks: 1 }
    }

    fn triangle(vertices: [u32; 3]) -> Triangle {
        Triangle { vertices, birth: 0, death: 1, cap: false }
    }

    #[test]
    fn a_neighbour_that_occurs_several_times_is_looked_up_once_and_weighted() {
        let ranks = ranks(3, 4);
        let isovalues = [0.0, 1.0, 2.0, 3.0];
        let triangles = [[0, 1, 3], [3, 1, 0], [1, 3, 2], [0, 3, 1]].map(triangle);
        let of = whole(&ranks, &isovalues, &triangles);
        let mut predictor = Predictor::new(of, Vec::new()).expect("few neighbours");
        let counted: Vec<_> = predictor.neighbours.iter().map(|u| (u.vertex, u.times)).collect();
        assert_eq!(counted, [(0, 3), (1, 4), (2, 1)]);
        assert_eq!(predictor.first_neighbour, [0, 0, 0, 0, 3]);
        for position in [[80, 0, 0], [8, 0, 0], [0, 16, 0]] {
            let knot = predictor.positions.len();
            [knot, knot + 1].into_iter().for_each(|knot| predictor.set(knot, position));
        }
        // (3 * 80 + 4 * 8) / 8 and 16 / 8.
        assert_eq!(predictor.expected(3, (6, None), Some(2)), [34, 2, 0]);
    }

    #[test]
    fn more_lookups_than_any_mesh_needs_are_refused() {
        let isovalues: Vec<f64> = (0..4096).map(f64::from).collect();
        let lookups = |n_others: u32, triangles: &[Triangle]| {
            let ranks = ranks(n_others, 4096);
            let of = whole(&ranks, &isovalues, triangles);
            Predictor::new(of, Vec::new()).map(|p| p.neighbours.len() * 4096)
        };
        // The same two neighbours, whatever the number of triangles.
        let again = vec![triangle([0, 1, 2]); 100_000];
        assert_eq!(lookups(2, &again).expect("two neighbours"), 2 * 4096);
        // As many neighbours as knots: quadratic work.
        let fan: Vec<_> = (0..2048).map(|i| triangle([2 * i, 2 * i + 1, 4096])).collect();
        let error = lookups(4096, &fan).expect_err("quadratic work").to_string();
        assert!(error.contains("16777216 neighbours of all knots"), "{error}");
        // A mesh may have a fan of 128 neighbours.
        assert_eq!(lookups(4096, &fan[..64]).expect("a fan"), 128 * 4096);
    }
}
