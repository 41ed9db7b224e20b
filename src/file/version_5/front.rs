//! The rim of the holes that are being filled: as files up to version 5 find them.
//!
//! # Invariants
//!
//! Gates form a stack, and each is also in the lists of the vertices it joins, newest first. A gate
//! that is filled from elsewhere is only marked and leaves when the stack gets down to it. Every
//! list is followed for at most [`MOST_GATES`] steps, so no file can make a reader slow.

use super::{AFTER, BEFORE};

/// How many gates along the hole a code may go.
const MOST_AFTER: usize = 64;

/// How many gates at one vertex are looked at.
const MOST_GATES: usize = 64;

/// Following codes along the hole may take a look at so many gates per code, and so many more in all. Most codes take
/// one or two; all together may not take 64 times 64 each.
const GATES_PER_CODE: usize = 64;
const FREE_GATES: usize = 1 << 20;

/// None, in the lists of gates and triangles.
const NONE: u32 = u32::MAX;

/// The open gates, and the triangles that will open the next ones when they die.
#[derive(Debug)]
pub(super) struct Front {
    gates: Vec<Gate>,
    /// The newest gate that starts at each vertex.
    starting: Vec<u32>,
    /// The newest gate that ends at each vertex.
    ending: Vec<u32>,
    /// The last triangle so far to die at each rank.
    dying: Vec<u32>,
    /// All triangles so far: vertices, and the next to die at the same rank.
    triangles: Vec<([u32; 3], u32)>,
    /// How many gates were looked at to follow codes.
    n_looked: usize,
}

#[derive(Clone, Copy, Debug)]
struct Gate {
    from: u32,
    to: u32,
    open: bool,
    next_starting: u32,
    next_ending: u32,
}

impl Front {
    /// No gates, no triangles. Vertices count up to `n_vertices`, ranks to `n_isovalues`.
    pub(super) fn new(n_vertices: usize, n_isovalues: usize) -> Self {
        Front {
            gates: Vec::new(),
            starting: vec![NONE; n_vertices],
            ending: vec![NONE; n_vertices],
            dying: vec![NONE; n_isovalues],
            triangles: Vec::new(),
            n_looked: 0,
        }
    }

    /// Closes what is still open and opens the gates around the triangles that die at `rank`.
    pub(super) fn open(&mut self, rank: u32) {
        for gate in self.gates.drain(..) {
            self.starting[gate.from as usize] = NONE;
            self.ending[gate.to as usize] = NONE;
        }
        let mut next = self.dying[rank as usize];
        while next != NONE {
            let ([a, b, c], after) = self.triangles[next as usize];
            for (from, to) in [(a, b), (b, c), (c, a)] {
                // Between two dying triangles there is nothing to fill.
                self.cancel_or_push((to, from), (from, to));
            }
            next = after;
        }
    }

    /// Takes the newest open gate: (from, to).
    pub(super) fn pop(&mut self) -> Option<(u32, u32)> {
        loop {
            let gate = self.gates.pop()?;
            self.starting[gate.from as usize] = gate.next_starting;
            self.ending[gate.to as usize] = gate.next_ending;
            if gate.open {
                return Some((gate.from, gate.to));
            }
        }
    }

    /// Adds a triangle without a gate.
    pub(super) fn start(&mut self, [a, b, c]: [u32; 3], death: u32) {
        for (p, q) in [(a, b), (b, c), (c, a)] {
            self.cancel_or_push((p, q), (q, p));
        }
        self.add([a, b, c], death);
    }

    /// Adds the triangle (from, to, third) at the gate from -> to, which was taken before.
    pub(super) fn fill(&mut self, [from, to, third]: [u32; 3], death: u32) {
        for (p, q) in [(to, third), (third, from)] {
            self.cancel_or_push((p, q), (q, p));
        }
        self.add([from, to, third], death);
    }

    /// The third vertex at the gate from -> to for a code of [`BEFORE`] or more, the code being number `n_codes`. None
    /// where there is no such vertex, or the search for it takes too long.
    pub(super) fn third(&mut self, [from, to]: [u32; 2], code: u64, n_codes: usize) -> Option<u32> {
        if code == BEFORE {
            return self.before(from);
        }
        let steps = usize::try_from(code - AFTER).ok().filter(|&steps| steps < MOST_AFTER)?;
        let (third, n_looked) = self.along(to).nth(steps)?;
        self.spend(n_looked, n_codes).then_some(third)
    }

    /// Whether `n_looked` more gates may be looked at for the sake of `n_codes` codes; if so, they are.
    fn spend(&mut self, n_looked: usize, n_codes: usize) -> bool {
        let sum = self.n_looked + n_looked;
        let may = sum <= FREE_GATES + GATES_PER_CODE * n_codes;
        if may {
            self.n_looked = sum;
        }
        may
    }

    /// The vertices along the hole from `v` on, and how many gates were looked at up to each.
    fn along(&self, v: u32) -> impl Iterator<Item = (u32, usize)> + '_ {
        let next = |(v, n_looked): (u32, usize)| {
            let list = self.list(self.starting[v as usize], |gate| gate.next_starting);
            let (place, i) = { list }.next()?;
            Some((self.gates[i].to, n_looked + place + 1))
        };
        std::iter::successors(next((v, 0)), move |&at| next(at))
    }

    fn add(&mut self, vertices: [u32; 3], death: u32) {
        let next = std::mem::replace(&mut self.dying[death as usize], self.triangles.len() as u32);
        self.triangles.push((vertices, next));
    }

    /// Closes the open gate `cancelled` if there is one, and opens `pushed` otherwise.
    fn cancel_or_push(&mut self, cancelled: (u32, u32), pushed: (u32, u32)) {
        let found = self.starting_at(cancelled.0).find(|&i| self.gates[i].to == cancelled.1);
        if let Some(i) = found {
            self.gates[i].open = false;
            return;
        }
        let (from, to) = pushed;
        let index = self.gates.len() as u32;
        let next_starting = std::mem::replace(&mut self.starting[from as usize], index);
        let next_ending = std::mem::replace(&mut self.ending[to as usize], index);
        self.gates.push(Gate { from, to, open: true, next_starting, next_ending });
    }

    /// Where the newest open gate to `v` comes from.
    fn before(&self, v: u32) -> Option<u32> {
        let list = self.list(self.ending[v as usize], |gate| gate.next_ending);
        { list }.next().map(|(_, i)| self.gates[i].from)
    }

    fn starting_at(&self, v: u32) -> impl Iterator<Item = usize> + '_ {
        self.list(self.starting[v as usize], |gate| gate.next_starting).map(|(_, i)| i)
    }

    /// The open gates among the first few of a list, each with its place in it.
    fn list(
        &self,
        first: u32,
        next: fn(&Gate) -> u32,
    ) -> impl Iterator<Item = (usize, usize)> + '_ {
        let some = |i: u32| (i != NONE).then_some(i as usize);
        std::iter::successors(some(first), move |&i| some(next(&self.gates[i])))
            .take(MOST_GATES)
            .enumerate()
            .filter(|&(_, i)| self.gates[i].open)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_that_lead_past_many_closed_gates_come_to_an_end() {
        let mut front = Front::new(4, 1);
        let nowhere = (3, 3);
        // A way from 0 to 1 and back, each behind as many closed gates as are looked at with it.
        for (from, to) in [(0, 1), (1, 0)] {
            front.cancel_or_push(nowhere, (from, to));
            (1..MOST_GATES).for_each(|_| front.cancel_or_push(nowhere, (from, 2)));
            (1..MOST_GATES).for_each(|_| front.cancel_or_push((from, 2), nowhere));
        }
        // Two steps take twice what a code may take: what all codes have in common is used up.
        let n_looked = 2 * MOST_GATES;
        let most = FREE_GATES / (n_looked - GATES_PER_CODE);
        for n_codes in 1..=most {
            assert_eq!(front.third([2, 0], AFTER + 1, n_codes), Some(0), "{n_codes}");
        }
        assert_eq!(front.third([2, 0], AFTER + 1, most + 1), None);
        // A step that costs no more than its share is still found.
        assert_eq!(front.third([2, 0], AFTER, most + 1), Some(1));
    }
}
