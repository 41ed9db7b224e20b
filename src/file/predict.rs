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
use crate::error::{Error, Result};
use crate::spectrum::Triangle;

/// Neighbours are looked up so many times per knot at most, in the mean over all knots, and so many times more. Where
/// no vertex has more than 64 neighbours this cannot be reached, and a mesh has 6 in the mean; without it a
/// small file could ask for a look at each of its vertices at each of its knots.
const LOOKS_PER_KNOT: usize = 64;
const FREE_LOOKS: usize = 1 << 20;

/// Predicts knot after knot, in the order of the file.
#[derive(Debug)]
pub(super) struct Predictor<'a> {
    ranks: &'a Ranks,
    isovalues: &'a [f64],
    /// Start of each vertex's neighbours in `neighbours`, and the end.
    first_neighbour: Vec<u32>,
    neighbours: Vec<Neighbour>,
    positions: Vec<[i32; 3]>,
    /// The vertex that had knots last.
    last_vertex: Option<u32>,
}

/// A neighbour, and how often it occurs.
#[derive(Clone, Copy, Debug, Default)]
struct Neighbour {
    vertex: u32,
    times: u32,
}

/// A place or a way, quanta.
type Place = [i64; 3];

impl<'a> Predictor<'a> {
    /// A predictor that knows no knot yet. The triangles must lie within the trajectories.
    ///
    /// # Errors
    ///
    /// [`Error::Input`] if so many triangles meet at vertices of so many knots that no mesh has them.
    pub(super) fn new(
        ranks: &'a Ranks,
        isovalues: &'a [f64],
        triangles: &[Triangle],
    ) -> Result<Self> {
        let (first_neighbour, neighbours) = lower_neighbours(ranks, triangles);
        let looks = first_neighbour.windows(2).zip(0..).map(|(range, v)| {
            let n_knots = ranks.of(v).map_or(0, <[u32]>::len);
            (range[1] - range[0]) as usize * n_knots
        });
        let (looks, most) = (looks.sum::<usize>(), FREE_LOOKS + LOOKS_PER_KNOT * ranks.ranks.len());
        if looks > most {
            return Err(Error::input(format!(
                "{looks} neighbours of all knots, expected at most {most} for {} knots",
                ranks.ranks.len()
            )));
        }
        Ok(Predictor {
            ranks,
            isovalues,
            first_neighbour,
            neighbours,
            positions: Vec::with_capacity(ranks.ranks.len()),
            last_vertex: None,
        })
    }

    /// The next knot is this.
    pub(super) fn push(&mut self, position: [i32; 3]) {
        self.positions.push(position);
    }

    /// Where the next knot, one of vertex `v`, is expected to be.
    pub(super) fn predict(&mut self, v: u32) -> [i32; 3] {
        let knot = self.positions.len();
        let is_first = knot == self.ranks.first_knot[v as usize] as usize;
        let last = if is_first { self.last_vertex.replace(v) } else { None };
        self.expected(v, knot, last)
    }

    /// Where a knot of vertex `v` is expected to be, by those before it. `last` is the vertex that had knots before `v`.
    pub(super) fn expected(&self, v: u32, knot: usize, last: Option<u32>) -> [i32; 3] {
        let rank = self.ranks.ranks[knot];
        let range = self.first_neighbour[v as usize]..self.first_neighbour[v as usize + 1];
        let neighbours = &self.neighbours[range.start as usize..range.end as usize];
        let place = if knot == self.ranks.first_knot[v as usize] as usize {
            if neighbours.is_empty() {
                let knot = last.map(|u| self.ranks.first_knot[u as usize] as usize);
                knot.map(|knot| self.place(knot)).unwrap_or_default()
            } else {
                mean(neighbours.iter().map(|u| (self.place_at(u.vertex, rank), u.times)))
            }
        } else {
            let before = self.ranks.ranks[knot - 1];
            let here = self.place(knot - 1);
            let alive = |u: &&Neighbour| {
                self.ranks.of(u.vertex).and_then(<[u32]>::last).is_some_and(|&last| last >= rank)
            };
            let moves = neighbours.iter().filter(alive).map(|u| {
                let (from, to) = (self.place_at(u.vertex, before), self.place_at(u.vertex, rank));
                (combine(from, to, |from, to| to - from), u.times)
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

/// For each vertex, the lower-numbered vertices of the triangles born with it, by number.
fn lower_neighbours(ranks: &Ranks, triangles: &[Triangle]) -> (Vec<u32>, Vec<Neighbour>) {
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
    let mut neighbours = vec![0; first[first.len() - 1] as usize];
    // From here on `first` tells where the next neighbour of a vertex goes; in the end, where its neighbours end.
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

fn combine(a: Place, b: Place, f: impl Fn(i64, i64) -> i64) -> Place {
    std::array::from_fn(|i| f(a[i], b[i]))
}

/// The mean of places that each occur so many times, rounded down; zero of nothing.
fn mean(places: impl Iterator<Item = (Place, u32)>) -> Place {
    let (mut sum, mut n) = (Place::default(), 0);
    for (place, times) in places {
        sum = combine(sum, place, |sum, x| sum + i64::from(times) * x);
        n += i64::from(times);
    }
    combine(sum, Place::default(), |sum, _| sum.div_euclid(n.max(1)))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// So many vertices with knots at rank 0 and the last, and one with a knot at each of `n_ranks`.
    fn ranks(n_others: u32, n_ranks: u32) -> Ranks {
        let mut ranks = Ranks { first_knot: vec![0], ..Ranks::default() };
        for _ in 0..n_others {
            ranks.ranks.extend([0, n_ranks - 1]);
            ranks.first_knot.push(ranks.ranks.len() as u32);
        }
        ranks.ranks.extend(0..n_ranks);
        ranks.first_knot.push(ranks.ranks.len() as u32);
        ranks
    }

    fn triangle(vertices: [u32; 3]) -> Triangle {
        Triangle { vertices, birth: 0, death: 1, cap: false }
    }

    #[test]
    fn a_neighbour_that_occurs_often_is_looked_up_once_and_counts_as_often() {
        let ranks = ranks(3, 4);
        let isovalues = [0.0, 1.0, 2.0, 3.0];
        let triangles = [[0, 1, 3], [3, 1, 0], [1, 3, 2], [0, 3, 1]].map(triangle);
        let mut predictor = Predictor::new(&ranks, &isovalues, &triangles).expect("few neighbours");
        let counted: Vec<_> = predictor.neighbours.iter().map(|u| (u.vertex, u.times)).collect();
        assert_eq!(counted, [(0, 3), (1, 4), (2, 1)]);
        assert_eq!(predictor.first_neighbour, [0, 0, 0, 0, 3]);
        for place in [[80, 0, 0], [8, 0, 0], [0, 16, 0]] {
            predictor.push(place);
            predictor.push(place);
        }
        // (3 * 80 + 4 * 8) / 8 and 16 / 8.
        assert_eq!(predictor.predict(3), [34, 2, 0]);
    }

    #[test]
    fn more_looks_than_any_mesh_asks_for_are_refused() {
        let isovalues: Vec<f64> = (0..4096).map(f64::from).collect();
        let looks = |n_others: u32, triangles: &[Triangle]| {
            let ranks = ranks(n_others, 4096);
            Predictor::new(&ranks, &isovalues, triangles).map(|p| p.neighbours.len() * 4096)
        };
        // The same two neighbours, whatever the number of triangles.
        let again = vec![triangle([0, 1, 2]); 100_000];
        assert_eq!(looks(2, &again).expect("two neighbours"), 2 * 4096);
        // As many neighbours as knots: the work of a square.
        let fan: Vec<_> = (0..2048).map(|i| triangle([2 * i, 2 * i + 1, 4096])).collect();
        let error = looks(4096, &fan).expect_err("a square").to_string();
        assert!(error.contains("16777216 neighbours of all knots"), "{error}");
        // A fan of 128 neighbours is a mesh someone may have.
        assert_eq!(looks(4096, &fan[..64]).expect("a fan"), 128 * 4096);
    }
}
