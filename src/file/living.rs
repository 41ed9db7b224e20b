//! The mesh of a chunk rank by rank: its own triangles, which are coded, among those of the chunks above, which are known.
//!
//! # Theory
//!
//! Where a known triangle is born it fills a part of a hole, and where it dies it leaves one, as a triangle of the chunk does; but
//! neither takes a number. So holes are bounded by both, and a chunk continues the mesh of those above without a seam.

use std::ops::Range;

use super::by_rank::ByRank;
use super::holes::{Candidate, Gate, Holes, KnownDeaths};
use crate::spectrum::Triangle;

/// Marks a known triangle in [`Living::owners`].
const KNOWN: u32 = 1 << 31;

/// The known triangle is not in the mesh.
const ABSENT: u32 = u32::MAX;

/// The living triangles and the holes between them.
#[derive(Clone, Debug)]
pub(super) struct Living<'a> {
    holes: Holes,
    known: &'a [Triangle],
    /// The known triangles born and dying at each rank of the span.
    births: ByRank,
    deaths: ByRank,
    /// By known triangle, its number in `holes`.
    places: Vec<u32>,
    /// By triangle of `holes`, its number in the chunk, or [`KNOWN`] plus its number among the known ones; and by triangle of the chunk, its number
    /// in `holes`. Both are empty if there are no known triangles: then these numbers are the same.
    owners: Vec<u32>,
    own: Vec<u32>,
}

impl<'a> Living<'a> {
    /// No living triangles, of `n_vertices`; the chunk will have `n_own`. Known triangles that are not alive in the span are ignored.
    pub(super) fn new(
        [n_vertices, n_own]: [usize; 2],
        known: &'a [Triangle],
        span: &Range<u32>,
    ) -> Self {
        let (mut births, mut deaths) = (ByRank::new(span), ByRank::new(span));
        for (t, i) in known.iter().zip(0..) {
            births.push(t.birth, i);
            deaths.push(t.death, i);
        }
        let n_owners = if known.is_empty() { 0 } else { known.len() + n_own };
        Living {
            holes: Holes::new(n_vertices, known.len() + n_own),
            known,
            births,
            deaths,
            places: vec![ABSENT; known.len()],
            owners: Vec::with_capacity(n_owners),
            own: Vec::with_capacity(n_owners.min(n_own)),
        }
    }

    /// The mesh at the same rank without gates, for ranks downwards from there: births and deaths of known triangles are exchanged. A triangle
    /// dies at its birth, so one that is alive at a rank has not died there yet.
    pub(super) fn downwards(&mut self) -> Self {
        self.holes.clear_gates();
        let mut down = self.clone();
        std::mem::swap(&mut down.births, &mut down.deaths);
        down
    }

    pub(super) fn holes(&self) -> &Holes {
        &self.holes
    }

    /// Adds the known triangles that are alive at a rank.
    pub(super) fn add_known_at(&mut self, rank: u32) {
        for (i, t) in (0..).zip(self.known) {
            if t.birth <= rank && rank < t.death {
                self.add_known(i);
            }
        }
    }

    /// Adds the known triangles that are born at a rank.
    pub(super) fn add_known_born(&mut self, rank: u32) {
        let born: Vec<u32> = self.births.at(rank).collect();
        born.into_iter().for_each(|i| self.add_known(i));
    }

    fn add_known(&mut self, i: u32) {
        self.places[i as usize] = self.owners.len() as u32;
        self.owners.push(KNOWN | i);
        self.holes.add_seed(self.known[i as usize].vertices);
    }

    /// Finds the triangles that die at a rank and opens gates around the holes that they leave: known ones, those around the vertices
    /// `ended`, those of `explicit`, and candidates for which `dies` returns true, which gets the number of the
    /// triangle in the chunk. Returns the triangles of the chunk that die, and those of `explicit` that were not found otherwise.
    pub(super) fn deaths<E>(
        &mut self,
        rank: u32,
        ended: &[u32],
        explicit: impl Iterator<Item = u32>,
        mut dies: impl FnMut(u32, Candidate, [u32; 3]) -> Result<bool, E>,
    ) -> Result<[Vec<u32>; 2], E> {
        let Living { holes, known, births, deaths, places, owners, own } = self;
        let dying = deaths.at(rank).map(|i| places[i as usize]).filter(|&t| t != ABSENT);
        let born = births.at(rank).map(|i| known[i as usize].vertices);
        let (dying, born): (Vec<u32>, Vec<[u32; 3]>) = (dying.collect(), born.collect());
        let known = KnownDeaths { ended, dying: &dying, born: &born };
        let explicit = explicit.map(|i| number_in(own, i));
        let owner_of = |t: u32| number_in(owners, t);
        let dies = |holes: &Holes, candidate: Candidate| {
            let owner = owner_of(candidate.triangle);
            // All known triangles that die at the rank are dead.
            let is_own = owner & KNOWN == 0;
            Ok(is_own && dies(owner, candidate, holes.vertices(candidate.triangle))?)
        };
        let [found, explicit] = holes.dying(rank, known, explicit, dies)?;
        holes.open_gates(&found);
        let owned = |triangles: Vec<u32>| {
            let owners = triangles.into_iter().map(owner_of);
            owners.filter(|owner| owner & KNOWN == 0).collect()
        };
        Ok([owned(found), owned(explicit)])
    }

    /// Pops the newest open gate.
    pub(super) fn pop(&mut self) -> Option<Gate> {
        self.holes.pop()
    }

    /// Takes a popped gate that gets no triangle out of its loop.
    pub(super) fn skip(&mut self, gate: Gate) {
        self.holes.skip(gate);
    }

    /// Adds the next triangle of the chunk, of a popped gate and a third vertex.
    pub(super) fn fill(&mut self, gate: Gate, third: u32) {
        self.next_own();
        self.holes.fill(gate, third);
    }

    /// Adds the next triangle of the chunk, without a gate.
    pub(super) fn add_seed(&mut self, vertices: [u32; 3]) {
        self.next_own();
        self.holes.add_seed(vertices);
    }

    fn next_own(&mut self) {
        if self.known.is_empty() {
            return;
        }
        self.own.push(self.owners.len() as u32);
        self.owners.push(self.own.len() as u32 - 1);
    }

    /// The vertices of all triangles of the chunk.
    pub(super) fn into_vertices(self) -> Vec<[u32; 3]> {
        let Living { holes, known, own, .. } = self;
        let vertices = holes.into_vertices();
        if known.is_empty() {
            return vertices;
        }
        own.iter().map(|&t| vertices[t as usize]).collect()
    }
}

/// The number that a list has for `i`; `i` itself if the list is empty.
fn number_in(list: &[u32], i: u32) -> u32 {
    list.get(i as usize).copied().unwrap_or(i)
}
