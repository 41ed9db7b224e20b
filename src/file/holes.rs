//! The triangles that live, the holes that dying ones leave, and how new ones fill them: what writer and reader of
//! connectivity share.
//!
//! # Theory
//!
//! A hole is bounded by loops of *gates*, directed edges at which a triangle is missing, as in Rossignac's Edgebreaker
//! (1999). A triangle at a gate puts two gates in its place; a gate whose edge another one has from its other side is glued
//! to that, and both are closed. Which gate comes after which follows from the triangles that have died, so loops that touch
//! at a vertex are not taken for one another.
//!
//! Which triangles die need not be told one by one: all around a vertex do at the end of its trajectory, and others beside
//! those, which are asked.
//!
//! # Invariants
//!
//! Twins are each other's twin: so every way around a vertex comes to an end, and no half-edge is on two of them. Twins of
//! the half-edges of living triangles live. Gates form a stack; one that is closed from elsewhere is only marked and leaves
//! when the stack gets down to it. Open gates form loops. No search takes more than [`MOST_GATES`] steps, so no file can make a
//! reader slow.

/// How many gates at one vertex are looked at, and how many along a loop a code may go.
const MOST_GATES: usize = 64;

/// None, as the number of a half-edge or a gate.
const NONE: u32 = u32::MAX;

/// In place of the twin of a dying triangle's half-edge: the gate there.
const IS_GATE: u32 = 1 << 31;

/// In place of the rank at which a triangle was asked: it is dead. Of a rank: not asked yet.
const DEAD: u32 = u32::MAX;
const NEVER: u32 = u32::MAX - 1;

/// The half-edges of so many triangles have numbers.
pub(super) const MOST_TRIANGLES: usize = (IS_GATE / 3) as usize;

/// The codes of third vertices that are along a gate's loop: where the gate before comes from, where the gate after leads to, and
/// so on, in turn.
pub(super) const ALONG: u64 = 5;

/// A vertex may be told by a gate so deep in the stack.
pub(super) const MOST_DEPTH: u64 = 256;

/// The half-edge after one in its triangle.
fn next(h: u32) -> u32 {
    if h % 3 == 2 { h - 2 } else { h + 1 }
}

/// The half-edge before one in its triangle.
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
    /// The gates beside it in its loop.
    before: u32,
    after: u32,
    /// The half-edge on its other side.
    behind: u32,
}

/// A triangle that may die with one that dies beside it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Question {
    pub(super) triangle: u32,
    /// Whether the one beside dies as one of its vertices ends.
    pub(super) at_an_end: bool,
}

/// The triangles that die at a rank, in the order in which they are found.
struct Spread {
    rank: u32,
    dying: Vec<u32>,
    /// So many of them die at the ends of their vertices.
    n_at_ends: usize,
    /// What is beside so many of them has been asked.
    n_asked: usize,
}

/// The triangles so far, and the open gates.
#[derive(Debug)]
pub(super) struct Holes {
    gates: Vec<Gate>,
    /// The newest gate that starts at each vertex.
    starting: Vec<u32>,
    /// By triangle, its vertices; half-edge 3 t + i goes from vertex i of triangle t to the next.
    vertices: Vec<[u32; 3]>,
    /// By half-edge.
    twins: Vec<u32>,
    /// By vertex, a half-edge of a living triangle that starts there.
    leaving: Vec<u32>,
    /// By triangle, the last rank at which it was asked whether it dies.
    asked: Vec<u32>,
}

impl Holes {
    /// No gates, no triangles. Vertices count up to `n_vertices`.
    pub(super) fn new(n_vertices: usize) -> Self {
        Holes {
            gates: Vec::new(),
            starting: vec![NONE; n_vertices],
            vertices: Vec::new(),
            twins: Vec::new(),
            leaving: vec![NONE; n_vertices],
            asked: Vec::new(),
        }
    }

    /// The vertices of all triangles.
    pub(super) fn into_vertices(self) -> Vec<[u32; 3]> {
        self.vertices
    }

    pub(super) fn vertices(&self, triangle: u32) -> [u32; 3] {
        self.vertices[triangle as usize]
    }

    /// The triangles that die at a rank, and after them those of `told` that are not found otherwise: those around the
    /// vertices that end there, those told, and those beside dying ones, one after the other, of which `dies` says so.
    pub(super) fn dying<E>(
        &mut self,
        rank: u32,
        ended: &[u32],
        told: impl Iterator<Item = u32>,
        mut dies: impl FnMut(&Holes, Question) -> Result<bool, E>,
    ) -> Result<[Vec<u32>; 2], E> {
        let (mut dying, mut needed) = (Vec::new(), Vec::new());
        for &v in ended {
            self.kill_around(v, &mut dying);
        }
        let mut spread = Spread { rank, n_at_ends: dying.len(), dying, n_asked: 0 };
        self.spread(&mut spread, &mut dies)?;
        for t in told {
            if self.kill(t, &mut spread.dying) {
                needed.push(t);
                self.spread(&mut spread, &mut dies)?;
            }
        }
        Ok([spread.dying, needed])
    }

    /// Whether a triangle has lived until now.
    fn kill(&mut self, t: u32, dying: &mut Vec<u32>) -> bool {
        let lived = std::mem::replace(&mut self.asked[t as usize], DEAD) != DEAD;
        if lived {
            dying.push(t);
        }
        lived
    }

    fn kill_around(&mut self, v: u32, dying: &mut Vec<u32>) {
        let first = self.leaving[v as usize];
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
        // The other way, from where it began.
        h = self.twins[first as usize];
        while h != NONE {
            self.kill(h / 3, dying);
            h = self.twins[next(h) as usize];
        }
    }

    /// Asks the triangles beside dying ones, and those beside them.
    fn spread<E>(
        &mut self,
        spread: &mut Spread,
        dies: &mut impl FnMut(&Holes, Question) -> Result<bool, E>,
    ) -> Result<(), E> {
        while let Some(&beside) = spread.dying.get(spread.n_asked) {
            let at_an_end = spread.n_asked < spread.n_at_ends;
            spread.n_asked += 1;
            for h in 3 * beside..3 * beside + 3 {
                let twin = self.twins[h as usize];
                let triangle = twin / 3;
                if twin == NONE || [DEAD, spread.rank].contains(&self.asked[triangle as usize]) {
                    continue;
                }
                self.asked[triangle as usize] = spread.rank;
                if dies(self, Question { triangle, at_an_end })? {
                    self.kill(triangle, &mut spread.dying);
                }
            }
        }
        Ok(())
    }

    /// Closes what is still open and opens the gates around dying triangles.
    pub(super) fn open(&mut self, dying: &[u32]) {
        for gate in self.gates.drain(..) {
            self.starting[gate.from as usize] = NONE;
        }
        let is_dead = |asked: &[u32], h: u32| asked[(h / 3) as usize] == DEAD;
        let mut sides = Vec::new();
        for h in dying.iter().flat_map(|t| 3 * t..3 * t + 3) {
            let [from, to] = [h, next(h)].map(|h| self.vertices[(h / 3) as usize][h as usize % 3]);
            if self.leaving[from as usize] == h {
                self.leaving[from as usize] = NONE;
            }
            let twin = self.twins[h as usize];
            if twin != NONE && is_dead(&self.asked, twin) {
                continue;
            }
            if twin != NONE {
                self.twins[twin as usize] = NONE;
                self.leaving[to as usize] = twin;
                self.leaving[from as usize] = next(twin);
            }
            sides.push(h);
            self.twins[h as usize] = IS_GATE | self.push([from, to], twin);
        }
        for (gate, &h) in (0u32..).zip(&sides) {
            let mut h = next(h);
            while self.twins[h as usize] & IS_GATE == 0 {
                h = next(self.twins[h as usize]);
            }
            self.link(gate, self.twins[h as usize] & !IS_GATE);
        }
    }

    /// Takes the newest open gate.
    pub(super) fn pop(&mut self) -> Option<Gate> {
        loop {
            let gate = self.gates.pop()?;
            self.starting[gate.from as usize] = gate.older;
            if gate.is_open {
                return Some(gate);
            }
        }
    }

    /// Leaves a gate that was taken without a triangle.
    pub(super) fn leave(&mut self, gate: Gate) {
        if gate.after != self.gates.len() as u32 {
            self.link(gate.before, gate.after);
        }
    }

    /// The code by which [`Holes::third`] finds a third vertex; none where it does not.
    pub(super) fn code_of(&self, gate: &Gate, third: u32) -> Option<u64> {
        let (mut before, mut after) = (self.before(gate), self.after(gate));
        (ALONG..).step_by(2).take(MOST_GATES).find_map(|code| {
            let found = [before.next(), after.next()].map(|v| v == Some(third));
            let place = found.into_iter().position(|found| found)?;
            Some(code + place as u64)
        })
    }

    /// The third vertex at a gate that was taken, for a code of [`ALONG`] or more.
    pub(super) fn third(&self, gate: &Gate, code: u64) -> Option<u32> {
        let (k, is_after) = ((code - ALONG) / 2, (code - ALONG) % 2 == 1);
        let k = usize::try_from(k).ok()?;
        if is_after { self.after(gate).nth(k) } else { self.before(gate).nth(k) }
    }

    /// The vertices along the loop of a gate that was taken, from the one before its start on.
    fn before(&self, gate: &Gate) -> impl Iterator<Item = u32> + '_ {
        let some = |g: u32| self.gates.get(g as usize);
        let gates = std::iter::successors(some(gate.before), move |gate| some(gate.before));
        gates.map(|gate| gate.from).take(MOST_GATES)
    }

    /// Those the other way, from the one after its end on.
    fn after(&self, gate: &Gate) -> impl Iterator<Item = u32> + '_ {
        let some = |g: u32| self.gates.get(g as usize);
        let gates = std::iter::successors(some(gate.after), move |gate| some(gate.after));
        gates.map(|gate| gate.to).take(MOST_GATES)
    }

    /// How deep in the stack the newest gate lies that starts at a vertex.
    pub(super) fn depth_of(&self, v: u32) -> Option<u64> {
        let gate = Some(self.starting[v as usize]).filter(|&g| g != NONE)?;
        let depth = self.gates.len() as u64 - 1 - u64::from(gate);
        (depth < MOST_DEPTH).then_some(depth)
    }

    /// The vertex at which the gate starts that lies so deep in the stack.
    pub(super) fn at_depth(&self, depth: u64) -> Option<u32> {
        let gate = (self.gates.len() as u64).checked_sub(depth + 1)?;
        Some(self.gates[gate as usize].from)
    }

    /// Adds the triangle between a gate that was taken and a third vertex.
    pub(super) fn fill(&mut self, gate: Gate, third: u32) {
        let Gate { from, to, before, after, behind, .. } = gate;
        let taken = self.gates.len() as u32;
        let h = self.add([from, to, third]);
        self.set_twins(h, behind);
        let second = self.push([third, to], h + 1);
        let first = self.push([from, third], h + 2);
        self.link(first, second);
        self.link(if before == taken { second } else { before }, first);
        self.link(second, if after == taken { first } else { after });
        self.glue_if_beside(second);
        self.glue_if_beside(first);
    }

    /// Adds a triangle without a gate.
    pub(super) fn start(&mut self, vertices: [u32; 3]) {
        let h = self.add(vertices);
        let [a, b, c] = vertices;
        let gates = [([b, a], h), ([a, c], h + 2), ([c, b], h + 1)].map(|(g, h)| self.push(g, h));
        (0..3).for_each(|i| self.link(gates[i], gates[(i + 1) % 3]));
        gates.into_iter().for_each(|g| self.glue_if_beside(g));
    }

    /// Adds a triangle beside none. Returns its first half-edge.
    fn add(&mut self, vertices: [u32; 3]) -> u32 {
        let h = self.twins.len() as u32;
        self.vertices.push(vertices);
        self.twins.extend([NONE; 3]);
        self.asked.push(NEVER);
        for (v, h) in vertices.into_iter().zip(h..) {
            self.leaving[v as usize] = h;
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

    fn link(&mut self, before: u32, after: u32) {
        self.gates[before as usize].after = after;
        self.gates[after as usize].before = before;
    }

    /// Opens a gate that is in no loop yet.
    fn push(&mut self, [from, to]: [u32; 2], behind: u32) -> u32 {
        let index = self.gates.len() as u32;
        let older = std::mem::replace(&mut self.starting[from as usize], index);
        let (before, after) = (index, index);
        self.gates.push(Gate { from, to, is_open: true, older, before, after, behind });
        index
    }

    /// Closes a gate with the one that has its edge from the other side, if there is one: one beside it in its loop before others.
    fn glue_if_beside(&mut self, gate: u32) {
        let Gate { from, to, is_open, before, after, .. } = self.gates[gate as usize];
        if !is_open {
            return;
        }
        let is_it = |i: u32| {
            let other = &self.gates[i as usize];
            i != gate && other.is_open && (other.from, other.to) == (to, from)
        };
        let some = |i: u32| (i != NONE).then_some(i);
        let at_end = std::iter::successors(some(self.starting[to as usize]), |&i| {
            some(self.gates[i as usize].older)
        });
        let mut others = [before, after].into_iter().chain(at_end.take(MOST_GATES));
        if let Some(other) = others.find(|&i| is_it(i)) {
            self.glue(gate, other);
        }
    }

    fn glue(&mut self, x: u32, y: u32) {
        let [a, b] = [x, y].map(|g| self.gates[g as usize]);
        self.set_twins(a.behind, b.behind);
        match (a.after == x, b.after == y) {
            (true, true) => {}
            // One that is alone in its loop leaves no one behind.
            (true, false) => self.link(b.before, b.after),
            (false, true) => self.link(a.before, a.after),
            (false, false) => {
                if a.after != y {
                    self.link(b.before, a.after);
                }
                if b.after != x {
                    self.link(a.before, b.after);
                }
            }
        }
        [x, y].into_iter().for_each(|g| self.gates[g as usize].is_open = false);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Triangles around vertices, each around so many others in turn.
    fn fans(n_vertices: usize, fans: &[(u32, &[u32])]) -> Holes {
        let mut holes = Holes::new(n_vertices);
        for (hub, around) in fans {
            let next = around.iter().cycle().skip(1);
            around.iter().zip(next).for_each(|(&a, &b)| holes.start([*hub, a, b]));
        }
        holes
    }

    fn never(_: &Holes, _: Question) -> Result<bool, ()> {
        Ok(false)
    }

    #[test]
    fn all_around_a_vertex_die_with_it_and_leave_one_hole() {
        let mut holes = fans(7, &[(6, &[0, 1, 2, 3, 4, 5])]);
        let [found, told] = holes.dying(1, &[6], std::iter::empty(), never).expect("no question");
        assert_eq!((found.len(), told.len()), (6, 0));
        holes.open(&found);
        // Along the hole, from any of its gates: the five other vertices and back.
        let gate = holes.pop().expect("a gate");
        let along: Vec<u32> = holes.after(&gate).collect();
        let way: Vec<u32> = (1..=5).map(|k| (gate.to + k) % 6).collect();
        assert_eq!(along, way, "from {gate:?}");
        let back: Vec<u32> = (1..=5).map(|k| (gate.from + 6 - k) % 6).collect();
        assert_eq!(holes.before(&gate).collect::<Vec<u32>>(), back, "from {gate:?}");
        let code = holes.code_of(&gate, way[1]).expect("along the hole");
        assert_eq!((code, holes.third(&gate, code)), (ALONG + 3, Some(way[1])));
        assert_eq!(holes.code_of(&gate, 6), None);
    }

    #[test]
    fn a_hole_that_is_filled_again_has_no_gates_and_neighbours_are_found_again() {
        let mut holes = fans(6, &[(5, &[0, 1, 2, 3, 4])]);
        let [found, _] = holes.dying(1, &[5], std::iter::empty(), never).expect("no question");
        holes.open(&found);
        for _ in 0..3 {
            let gate = holes.pop().expect("a gate");
            let third = holes.third(&gate, ALONG + 1).expect("the gate after");
            holes.fill(gate, third);
        }
        assert!(holes.pop().is_none());
        // The first of the three dies by what it tells, and asks the two beside it, one after the other.
        let mut asked = Vec::new();
        let dies = |_: &Holes, question: Question| {
            asked.push(question.triangle);
            Ok::<bool, ()>(true)
        };
        let [found, told] = holes.dying(2, &[], std::iter::once(5), dies).expect("answered");
        assert_eq!((found.len(), told.as_slice()), (3, &[5][..]));
        assert_eq!(asked.len(), 2);
        // Who is dead is neither found nor asked again.
        let [found, told] =
            holes.dying(3, &[0, 1], [5, 6].into_iter(), never).expect("no question");
        assert!(found.is_empty() && told.is_empty());
    }

    #[test]
    fn loops_that_touch_at_a_vertex_are_told_apart() {
        // Two fans, around 6 and 7, with vertex 0 in common.
        let mut holes = fans(8, &[(6, &[0, 1, 2]), (7, &[0, 3, 4])]);
        let [found, _] = holes.dying(1, &[6, 7], std::iter::empty(), never).expect("no question");
        holes.open(&found);
        assert_eq!((found.len(), holes.gates.len()), (6, 6));
        for gate in &holes.gates {
            let next = holes.gates[gate.after as usize];
            let is_first = |g: &Gate| [g.from, g.to].iter().any(|v| [1, 2].contains(v));
            assert_eq!(next.from, gate.to);
            assert_eq!(is_first(&next), is_first(gate), "{gate:?} is followed by {next:?}");
        }
    }
}
