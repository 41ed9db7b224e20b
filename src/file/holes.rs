//! The mesh of the living triangles, the holes that dying triangles leave, and how new triangles fill them: shared by the
//! writer and the reader of connectivity.
//!
//! # Theory
//!
//! A hole is bounded by loops of *gates*, directed edges at which a triangle is missing, as in Rossignac's Edgebreaker
//! (1999). A triangle at a gate replaces it by two gates; a gate is glued to a gate with the opposite edge, and both are
//! closed. The order of the gates in a loop follows from the triangles that have died, so loops that touch
//! at a vertex are kept apart.
//!
//! Most deaths need no number: all triangles around a vertex die at the end of its trajectory, and
//! their neighbours have flags that say whether they die too.
//!
//! # Invariants
//!
//! Twins are each other's twin, so every walk around a vertex ends, and no half-edge is on two of them. Twins of
//! half-edges of living triangles live. Gates form a stack; a gate that is closed by gluing is only marked and is removed
//! when it is on top. Open gates form loops. No search takes more than [`MAX_SEARCH`] steps, so no file can make a
//! reader slow.

/// Most gates that are searched at one vertex, and most steps along a loop that a code counts.
const MAX_SEARCH: usize = 64;

/// Memory for more gates is given back once they are closed.
const MAX_KEPT_GATES: usize = 1 << 16;

/// No half-edge, or no gate.
const NONE: u32 = u32::MAX;

/// In `twins`, marks the gate at a half-edge of a dying triangle.
const IS_GATE: u32 = 1 << 31;

/// In `flag_rank`: the triangle is dead; it had no flag yet.
const DEAD: u32 = u32::MAX;
const NEVER: u32 = u32::MAX - 1;

/// Most triangles whose half-edges can be numbered.
pub(super) const MAX_TRIANGLES: usize = (IS_GATE / 3) as usize;

/// The first code of a third vertex in the loop of the gate. Codes alternate between the start of the previous gate and the end of the next
/// one, then one gate further each, and so on.
pub(super) const FIRST_LOOP_CODE: u64 = 5;

/// A third vertex can be coded by a gate less deep in the stack than this.
const MAX_DEPTH: u64 = 256;

/// The next half-edge in the triangle.
fn next(h: u32) -> u32 {
    if h % 3 == 2 { h - 2 } else { h + 1 }
}

/// The previous half-edge in the triangle.
fn previous(h: u32) -> u32 {
    if h.is_multiple_of(3) { h + 2 } else { h - 1 }
}

/// A directed edge at which a triangle is missing.
#[derive(Clone, Copy, Debug)]
pub(super) struct Gate {
    pub(super) from: u32,
    pub(super) to: u32,
    is_open: bool,
    /// The next older gate that starts at the same vertex.
    older: u32,
    /// Its neighbours in the loop.
    previous: u32,
    next: u32,
    /// The half-edge on its other side.
    behind: u32,
}

/// A triangle that has a flag that says whether it dies.
#[derive(Clone, Copy, Debug)]
pub(super) struct Candidate {
    pub(super) triangle: u32,
    pub(super) reason: Reason,
}

/// Why a triangle may die.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Reason {
    /// A neighbour dies because one of its vertices ends.
    NearEnd,
    /// A neighbour dies for another reason.
    NearOther,
    /// A known triangle with its first half-edge is born.
    Replaced,
}

/// What is known of the deaths at a rank before any flag.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct KnownDeaths<'a> {
    /// Vertices that end.
    pub(super) ended: &'a [u32],
    /// Triangles that die.
    pub(super) dying: &'a [u32],
    /// The vertices of triangles that are born.
    pub(super) born: &'a [[u32; 3]],
}

/// The triangles that die at a rank, in the order in which they are found.
struct Deaths {
    rank: u32,
    dying: Vec<u32>,
    /// The number of them that die because a vertex ends; these come first.
    n_at_ends: usize,
    /// The number of them whose neighbours were visited.
    n_visited: usize,
}

/// All triangles so far, and the open gates.
#[derive(Clone, Debug)]
pub(super) struct Holes {
    gates: Vec<Gate>,
    /// The newest gate that starts at each vertex.
    newest_gate: Vec<u32>,
    /// By triangle, its vertices; half-edge 3 t + i starts at vertex i of triangle t.
    vertices: Vec<[u32; 3]>,
    /// By half-edge.
    twins: Vec<u32>,
    /// By vertex, a half-edge of a living triangle that starts there.
    outgoing: Vec<u32>,
    /// By triangle, the last rank at which it had a flag.
    flag_rank: Vec<u32>,
}

impl Holes {
    /// No gates, no triangles. Vertices count up to `n_vertices`, and there will be `n_triangles`.
    pub(super) fn new(n_vertices: usize, n_triangles: usize) -> Self {
        Holes {
            gates: Vec::new(),
            newest_gate: vec![NONE; n_vertices],
            vertices: Vec::with_capacity(n_triangles),
            twins: Vec::with_capacity(3 * n_triangles),
            outgoing: vec![NONE; n_vertices],
            flag_rank: Vec::with_capacity(n_triangles),
        }
    }

    /// The vertices of all triangles.
    pub(super) fn into_vertices(self) -> Vec<[u32; 3]> {
        self.vertices
    }

    pub(super) fn vertices(&self, triangle: u32) -> [u32; 3] {
        self.vertices[triangle as usize]
    }

    /// Finds the triangles that die at a rank: those around vertices that end, and others that are known; those replaced by triangles
    /// that are born, if `dies` returns true; then the triangles of `explicit`, whose death is stored; and before and after
    /// each of these, neighbours of dying triangles for which `dies` returns true. Returns all of them in this order, and the
    /// triangles of `explicit` that were not found otherwise.
    pub(super) fn dying<E>(
        &mut self,
        rank: u32,
        known: KnownDeaths,
        explicit: impl Iterator<Item = u32>,
        mut dies: impl FnMut(&Holes, Candidate) -> Result<bool, E>,
    ) -> Result<[Vec<u32>; 2], E> {
        let (mut dying, mut needed) = (Vec::new(), Vec::new());
        for &v in known.ended {
            self.kill_around(v, &mut dying);
        }
        let n_at_ends = dying.len();
        for &t in known.dying {
            self.kill(t, &mut dying);
        }
        let mut deaths = Deaths { rank, n_at_ends, dying, n_visited: 0 };
        // One half-edge of each: looking at all three takes more time than it saves bytes.
        for &[from, to, _] in known.born {
            if let Some(triangle) = self.at_edge(from, to) {
                self.ask(Candidate { triangle, reason: Reason::Replaced }, &mut deaths, &mut dies)?;
            }
        }
        self.visit_neighbours(&mut deaths, &mut dies)?;
        for t in explicit {
            if self.kill(t, &mut deaths.dying) {
                needed.push(t);
                self.visit_neighbours(&mut deaths, &mut dies)?;
            }
        }
        Ok([deaths.dying, needed])
    }

    /// The living triangle with a half-edge, if it is found near the outgoing half-edge of its start.
    fn at_edge(&self, from: u32, to: u32) -> Option<u32> {
        let first = self.outgoing[from as usize];
        let end = |h: u32| self.vertices[(next(h) / 3) as usize][next(h) as usize % 3];
        let some = |h: u32| (h != NONE).then_some(h);
        let one_way =
            std::iter::successors(some(first), |&h| some(self.twins[previous(h) as usize]));
        let other_way =
            std::iter::successors(some(first), |&h| some(self.twins[h as usize]).map(next));
        let mut around = one_way.take(MAX_SEARCH).chain(other_way.take(MAX_SEARCH));
        around.find(|&h| end(h) == to).map(|h| h / 3)
    }

    /// Evaluates the flag of a triangle, unless it is dead or had one at this rank.
    fn ask<E>(
        &mut self,
        candidate: Candidate,
        deaths: &mut Deaths,
        dies: &mut impl FnMut(&Holes, Candidate) -> Result<bool, E>,
    ) -> Result<(), E> {
        let flag_rank = &mut self.flag_rank[candidate.triangle as usize];
        if [DEAD, deaths.rank].contains(flag_rank) {
            return Ok(());
        }
        *flag_rank = deaths.rank;
        if dies(self, candidate)? {
            self.kill(candidate.triangle, &mut deaths.dying);
        }
        Ok(())
    }

    /// Marks a triangle as dead; returns whether it was alive.
    fn kill(&mut self, t: u32, dying: &mut Vec<u32>) -> bool {
        let was_alive = std::mem::replace(&mut self.flag_rank[t as usize], DEAD) != DEAD;
        if was_alive {
            dying.push(t);
        }
        was_alive
    }

    /// Kills the triangles around a vertex.
    fn kill_around(&mut self, v: u32, dying: &mut Vec<u32>) {
        let first = self.outgoing[v as usize];
        if first == NONE {
            return;
        }
        let mut h = first;
        loop {
            self.kill(h / 3, dying);
            h = self.twins[previous(h) as usize];
            if h == first {
                return;
            }
            if h == NONE {
                break;
            }
        }
        // At a boundary: in the other direction from the first half-edge.
        h = self.twins[first as usize];
        while h != NONE {
            self.kill(h / 3, dying);
            h = self.twins[next(h) as usize];
        }
    }

    /// Evaluates the flags of the neighbours of dying triangles, and of the neighbours of those that die too.
    fn visit_neighbours<E>(
        &mut self,
        deaths: &mut Deaths,
        dies: &mut impl FnMut(&Holes, Candidate) -> Result<bool, E>,
    ) -> Result<(), E> {
        while let Some(&dead) = deaths.dying.get(deaths.n_visited) {
            let is_at_end = deaths.n_visited < deaths.n_at_ends;
            let reason = if is_at_end { Reason::NearEnd } else { Reason::NearOther };
            deaths.n_visited += 1;
            for h in 3 * dead..3 * dead + 3 {
                let twin = self.twins[h as usize];
                if twin != NONE {
                    self.ask(Candidate { triangle: twin / 3, reason }, deaths, dies)?;
                }
            }
        }
        Ok(())
    }

    /// Removes all gates.
    pub(super) fn clear_gates(&mut self) {
        for gate in self.gates.drain(..) {
            self.newest_gate[gate.from as usize] = NONE;
        }
        // Triangles of chunks above are added without gates, and leave three each.
        self.gates.shrink_to(MAX_KEPT_GATES);
    }

    /// Removes all gates, and opens gates around the dying triangles.
    pub(super) fn open_gates(&mut self, dying: &[u32]) {
        self.clear_gates();
        let is_dead = |flag_rank: &[u32], h: u32| flag_rank[(h / 3) as usize] == DEAD;
        let mut border = Vec::new();
        for h in dying.iter().flat_map(|t| 3 * t..3 * t + 3) {
            let [from, to] = [h, next(h)].map(|h| self.vertices[(h / 3) as usize][h as usize % 3]);
            if self.outgoing[from as usize] == h {
                self.outgoing[from as usize] = NONE;
            }
            let twin = self.twins[h as usize];
            if twin != NONE && is_dead(&self.flag_rank, twin) {
                continue;
            }
            if twin != NONE {
                self.twins[twin as usize] = NONE;
                self.outgoing[to as usize] = twin;
                self.outgoing[from as usize] = next(twin);
            }
            border.push(h);
            self.twins[h as usize] = IS_GATE | self.push([from, to], twin);
        }
        for (gate, &h) in (0u32..).zip(&border) {
            let mut h = next(h);
            while self.twins[h as usize] & IS_GATE == 0 {
                h = next(self.twins[h as usize]);
            }
            self.link(gate, self.twins[h as usize] & !IS_GATE);
        }
    }

    /// Pops the newest open gate.
    pub(super) fn pop(&mut self) -> Option<Gate> {
        loop {
            let gate = self.gates.pop()?;
            self.newest_gate[gate.from as usize] = gate.older;
            if gate.is_open {
                return Some(gate);
            }
        }
    }

    /// Takes a popped gate that gets no triangle out of its loop.
    pub(super) fn skip(&mut self, gate: Gate) {
        if gate.next != self.gates.len() as u32 {
            self.link(gate.previous, gate.next);
        }
    }

    /// The code for which [`Holes::third`] returns a vertex; none if there is none.
    pub(super) fn code_of(&self, gate: &Gate, third: u32) -> Option<u64> {
        let (mut starts, mut ends) = (self.previous_starts(gate), self.next_ends(gate));
        (FIRST_LOOP_CODE..).step_by(2).take(MAX_SEARCH).find_map(|code| {
            let found = [starts.next(), ends.next()].map(|v| v == Some(third));
            let place = found.into_iter().position(|found| found)?;
            Some(code + place as u64)
        })
    }

    /// The third vertex at a popped gate, for a code of at least [`FIRST_LOOP_CODE`].
    pub(super) fn third(&self, gate: &Gate, code: u64) -> Option<u32> {
        let (k, is_next) = ((code - FIRST_LOOP_CODE) / 2, (code - FIRST_LOOP_CODE) % 2 == 1);
        let k = usize::try_from(k).ok()?;
        if is_next { self.next_ends(gate).nth(k) } else { self.previous_starts(gate).nth(k) }
    }

    /// The starts of the gates before a popped gate in its loop, nearest first.
    fn previous_starts(&self, gate: &Gate) -> impl Iterator<Item = u32> + '_ {
        let some = |g: u32| self.gates.get(g as usize);
        let gates = std::iter::successors(some(gate.previous), move |gate| some(gate.previous));
        gates.map(|gate| gate.from).take(MAX_SEARCH)
    }

    /// The ends of the gates after a popped gate in its loop, nearest first.
    fn next_ends(&self, gate: &Gate) -> impl Iterator<Item = u32> + '_ {
        let some = |g: u32| self.gates.get(g as usize);
        let gates = std::iter::successors(some(gate.next), move |gate| some(gate.next));
        gates.map(|gate| gate.to).take(MAX_SEARCH)
    }

    /// The depth in the stack of the newest gate that starts at a vertex.
    pub(super) fn depth_of(&self, v: u32) -> Option<u64> {
        let gate = Some(self.newest_gate[v as usize]).filter(|&g| g != NONE)?;
        let depth = self.gates.len() as u64 - 1 - u64::from(gate);
        (depth < MAX_DEPTH).then_some(depth)
    }

    /// The start of the gate at a depth in the stack.
    pub(super) fn at_depth(&self, depth: u64) -> Option<u32> {
        let gate = (self.gates.len() as u64).checked_sub(depth + 1)?;
        Some(self.gates[gate as usize].from)
    }

    /// Adds the triangle of a popped gate and a third vertex.
    pub(super) fn fill(&mut self, gate: Gate, third: u32) {
        let Gate { from, to, previous, next, behind, .. } = gate;
        let popped = self.gates.len() as u32;
        let h = self.add([from, to, third]);
        self.set_twins(h, behind);
        let second = self.push([third, to], h + 1);
        let first = self.push([from, third], h + 2);
        self.link(first, second);
        self.link(if previous == popped { second } else { previous }, first);
        self.link(second, if next == popped { first } else { next });
        self.glue_if_possible(second);
        self.glue_if_possible(first);
    }

    /// Adds a triangle without a gate.
    pub(super) fn add_seed(&mut self, vertices: [u32; 3]) {
        let h = self.add(vertices);
        let [a, b, c] = vertices;
        let gates = [([b, a], h), ([a, c], h + 2), ([c, b], h + 1)].map(|(g, h)| self.push(g, h));
        (0..3).for_each(|i| self.link(gates[i], gates[(i + 1) % 3]));
        gates.into_iter().for_each(|g| self.glue_if_possible(g));
    }

    /// Adds a triangle without twins. Returns its first half-edge.
    fn add(&mut self, vertices: [u32; 3]) -> u32 {
        let h = self.twins.len() as u32;
        self.vertices.push(vertices);
        self.twins.extend([NONE; 3]);
        self.flag_rank.push(NEVER);
        for (v, h) in vertices.into_iter().zip(h..) {
            self.outgoing[v as usize] = h;
        }
        h
    }

    fn set_twins(&mut self, a: u32, b: u32) {
        for (h, twin) in [(a, b), (b, a)] {
            if h != NONE {
                self.twins[h as usize] = twin;
            }
        }
    }

    /// Makes two gates neighbours in a loop.
    fn link(&mut self, previous: u32, next: u32) {
        self.gates[previous as usize].next = next;
        self.gates[next as usize].previous = previous;
    }

    /// Pushes an open gate in a loop of its own.
    fn push(&mut self, [from, to]: [u32; 2], behind: u32) -> u32 {
        let index = self.gates.len() as u32;
        let older = std::mem::replace(&mut self.newest_gate[from as usize], index);
        let (previous, next) = (index, index);
        self.gates.push(Gate { from, to, is_open: true, older, previous, next, behind });
        index
    }

    /// Glues a gate to an open gate with the opposite edge, if one is found: a neighbour in its loop, else the newest.
    fn glue_if_possible(&mut self, gate: u32) {
        let Gate { from, to, is_open, previous, next, .. } = self.gates[gate as usize];
        if !is_open {
            return;
        }
        let is_opposite = |i: u32| {
            let other = &self.gates[i as usize];
            i != gate && other.is_open && (other.from, other.to) == (to, from)
        };
        let some = |i: u32| (i != NONE).then_some(i);
        let at_end = std::iter::successors(some(self.newest_gate[to as usize]), |&i| {
            some(self.gates[i as usize].older)
        });
        let mut others = [previous, next].into_iter().chain(at_end.take(MAX_SEARCH));
        if let Some(other) = others.find(|&i| is_opposite(i)) {
            self.glue(gate, other);
        }
    }

    fn glue(&mut self, x: u32, y: u32) {
        let [a, b] = [x, y].map(|g| self.gates[g as usize]);
        self.set_twins(a.behind, b.behind);
        match (a.next == x, b.next == y) {
            (true, true) => {}
            // One is alone in its loop.
            (true, false) => self.link(b.previous, b.next),
            (false, true) => self.link(a.previous, a.next),
            (false, false) => {
                if a.next != y {
                    self.link(b.previous, a.next);
                }
                if b.next != x {
                    self.link(a.previous, b.next);
                }
            }
        }
        [x, y].into_iter().for_each(|g| self.gates[g as usize].is_open = false);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Fans of triangles: hubs, each with the vertices around it in order.
    fn fans(n_vertices: usize, fans: &[(u32, &[u32])]) -> Holes {
        let mut holes = Holes::new(n_vertices, 0);
        for (hub, around) in fans {
            let next = around.iter().cycle().skip(1);
            around.iter().zip(next).for_each(|(&a, &b)| holes.add_seed([*hub, a, b]));
        }
        holes
    }

    fn ended(ended: &[u32]) -> KnownDeaths<'_> {
        KnownDeaths { ended, ..KnownDeaths::default() }
    }

    fn never(_: &Holes, _: Candidate) -> Result<bool, ()> {
        Ok(false)
    }

    #[test]
    fn the_triangles_around_a_vertex_die_with_it_and_leave_one_hole() {
        let mut holes = fans(7, &[(6, &[0, 1, 2, 3, 4, 5])]);
        let [found, explicit] =
            holes.dying(1, ended(&[6]), std::iter::empty(), never).expect("no candidate");
        assert_eq!((found.len(), explicit.len()), (6, 0));
        holes.open_gates(&found);
        // Along the hole, from any of its gates: the five other vertices and back.
        let gate = holes.pop().expect("a gate");
        let ends: Vec<u32> = holes.next_ends(&gate).collect();
        let expected: Vec<u32> = (1..=5).map(|k| (gate.to + k) % 6).collect();
        assert_eq!(ends, expected, "from {gate:?}");
        let back: Vec<u32> = (1..=5).map(|k| (gate.from + 6 - k) % 6).collect();
        assert_eq!(holes.previous_starts(&gate).collect::<Vec<u32>>(), back, "from {gate:?}");
        let code = holes.code_of(&gate, expected[1]).expect("along the hole");
        assert_eq!((code, holes.third(&gate, code)), (FIRST_LOOP_CODE + 3, Some(expected[1])));
        assert_eq!(holes.code_of(&gate, 6), None);
    }

    #[test]
    fn a_filled_hole_has_no_gates_and_its_triangles_are_neighbours() {
        let mut holes = fans(6, &[(5, &[0, 1, 2, 3, 4])]);
        let [found, _] =
            holes.dying(1, ended(&[5]), std::iter::empty(), never).expect("no candidate");
        holes.open_gates(&found);
        for _ in 0..3 {
            let gate = holes.pop().expect("a gate");
            let third = holes.third(&gate, FIRST_LOOP_CODE + 1).expect("the gate after");
            holes.fill(gate, third);
        }
        assert!(holes.pop().is_none());
        // The first of the three has an explicit death; its two neighbours are candidates, one after the other.
        let mut candidates = Vec::new();
        let dies = |_: &Holes, candidate: Candidate| {
            candidates.push(candidate.triangle);
            Ok::<bool, ()>(true)
        };
        let [found, explicit] =
            holes.dying(2, ended(&[]), std::iter::once(5), dies).expect("answered");
        assert_eq!((found.len(), explicit.as_slice()), (3, &[5][..]));
        assert_eq!(candidates.len(), 2);
        // Dead triangles are neither found nor candidates again.
        let [found, explicit] =
            holes.dying(3, ended(&[0, 1]), [5, 6].into_iter(), never).expect("no candidate");
        assert!(found.is_empty() && explicit.is_empty());
    }

    #[test]
    fn loops_that_touch_at_a_vertex_are_kept_apart() {
        // Two fans, around 6 and 7, with vertex 0 in common.
        let mut holes = fans(8, &[(6, &[0, 1, 2]), (7, &[0, 3, 4])]);
        let [found, _] =
            holes.dying(1, ended(&[6, 7]), std::iter::empty(), never).expect("no candidate");
        holes.open_gates(&found);
        assert_eq!((found.len(), holes.gates.len()), (6, 6));
        for gate in &holes.gates {
            let next = holes.gates[gate.next as usize];
            let is_first = |g: &Gate| [g.from, g.to].iter().any(|v| [1, 2].contains(v));
            assert_eq!(next.from, gate.to);
            assert_eq!(is_first(&next), is_first(gate), "{gate:?} is followed by {next:?}");
        }
    }
}
