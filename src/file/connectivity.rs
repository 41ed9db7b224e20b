//! Which vertices the triangles join and when they die, in about half a byte each.
//!
//! # Theory
//!
//! Triangles are kept by birth. Those born at one rank fill the holes that those dying at that rank
//! leave ([`Holes`]), and the reader knows the latter already. So it walks around the holes: the last gate opened is closed
//! first, by a triangle whose third vertex is most often a new one or the next along the hole. Where no gate is open (the first mesh, a
//! component that emerges) a triangle is given by its three vertices. Triangles that die where no vertex ends, and beside
//! none that does, tell when they do.
//!
//! New vertices are the next in number, so vertices are kept in order of their first use, too. This
//! order depends on what is joined and, where the walk starts anew, on the order given; taking the
//! order of a file gives the same file again.
//!
//! # Invariants
//!
//! Writer and reader do the same to the same [`Holes`].

use rayon::prelude::*;

use super::column::{CodedColumns, Column, Columns, unzigzag, zigzag};
use super::holes::{Gate, Holes, Question};
use crate::error::{Error, Result};
use crate::spectrum::Triangle;

/// The third vertex is a new one.
const NEW: u64 = 0;
/// No triangle here after all.
const SKIP: u64 = 1;
/// The third vertex is told by its number, less that of the gate's start.
const JUMP: u64 = 2;
/// The third vertex is told by its number, less that of the last one that was told by its number.
const LEAP: u64 = 3;
/// The third vertex is told by a gate in the stack.
const DEPTH: u64 = 4;

/// None, as the number of a vertex or an entry.
const NONE: u32 = u32::MAX;

/// Questions whether a triangle dies are told apart by whether all its vertices are lattice vertices, and whether the one
/// beside it dies at the end of one of its own.
const KINDS: usize = 4;

fn kind(question: Question, vertices: [u32; 3], is_lattice: impl FnMut(u32) -> bool) -> usize {
    2 * usize::from(vertices.into_iter().all(is_lattice)) + usize::from(question.at_an_end)
}

/// Numbers by rank; those of one rank come back newest first.
#[derive(Debug)]
pub(super) struct ByRank {
    newest: Vec<u32>,
    /// By number, the one before it of its rank.
    before: Vec<u32>,
}

impl ByRank {
    pub(super) fn new(n_ranks: usize) -> Self {
        ByRank { newest: vec![NONE; n_ranks], before: Vec::new() }
    }

    pub(super) fn push(&mut self, rank: u32, number: u32) {
        if self.before.len() <= number as usize {
            self.before.resize(number as usize + 1, NONE);
        }
        self.before[number as usize] = std::mem::replace(&mut self.newest[rank as usize], number);
    }

    pub(super) fn at(&self, rank: u32) -> impl Iterator<Item = u32> + '_ {
        let some = |number: u32| (number != NONE).then_some(number);
        std::iter::successors(some(self.newest[rank as usize]), move |&n| {
            some(self.before[n as usize])
        })
    }
}

/// What is arranged: triangles by birth, of how many vertices and isovalues, and of each vertex the rank at which it ends and whether it
/// is a lattice vertex.
pub(super) struct Meshes<'a> {
    pub(super) triangles: &'a [Triangle],
    pub(super) n_vertices: usize,
    pub(super) n_isovalues: usize,
    pub(super) last: &'a dyn Fn(u32) -> Option<u32>,
    pub(super) is_lattice: &'a dyn Fn(u32) -> bool,
}

/// The order in which a file keeps triangles and vertices.
#[derive(Clone, Debug, Default)]
pub(super) struct Arrangement {
    /// For each triangle of the file: its number in the spectrum.
    pub(super) triangles: Vec<u32>,
    /// And its vertices in the numbers of the file, the first of them as the file has it.
    pub(super) corners: Vec<[u32; 3]>,
    /// For each vertex of the file: its number in the spectrum.
    pub(super) vertices: Vec<u32>,
    /// And whether it is a lattice vertex.
    pub(super) is_lattice: Vec<bool>,
    /// For each triangle of the file, whether it has to tell when it dies.
    pub(super) is_told: Vec<bool>,
}

/// What the walk around the holes tells, as section `TRIA` keeps it.
#[derive(Clone, Debug, Default)]
pub(super) struct Walk {
    /// How many triangles are born at each rank.
    births: Vec<u32>,
    /// For each gate, where the third vertex is.
    codes: Vec<u8>,
    /// The third vertices that no code finds, from another vertex.
    jumps: Vec<u64>,
    /// The last of them.
    last: u32,
    /// How deep gates lie that third vertices are told by.
    depths: Vec<u8>,
    /// The vertices of triangles without a gate, from the number of vertices so far.
    starts: Vec<u32>,
    /// By kind of question, the answers.
    answers: [Vec<bool>; KINDS],
}

impl Walk {
    /// Tells a vertex by its number, from the nearer one of a gate's start and the last that was told so. Returns the code.
    fn jump(&mut self, from: u32, to: u32) -> u64 {
        let last = std::mem::replace(&mut self.last, to);
        let is_leap = to.abs_diff(last) < to.abs_diff(from);
        let (from, code) = if is_leap { (last, LEAP) } else { (from, JUMP) };
        self.jumps.push(zigzag(i64::from(to) - i64::from(from)));
        code
    }

    /// Appends the walk to a section.
    pub(super) fn write(&self, columns: &mut CodedColumns) {
        columns.counted(self.births.iter().map(|&n| n.into()));
        columns.counted(self.codes.iter().map(|&code| code.into()));
        columns.counted(self.jumps.iter().copied());
        columns.counted(self.depths.iter().map(|&depth| depth.into()));
        columns.counted(self.starts.iter().map(|&start| start.into()));
        for answers in &self.answers {
            columns.counted(answers.iter().map(|&dies| dies.into()));
        }
    }
}

/// Arranges the triangles of a spectrum and tells how a reader finds them.
pub(super) fn arrange(meshes: &Meshes) -> (Arrangement, Walk) {
    let &Meshes { triangles, n_vertices, n_isovalues, last, .. } = meshes;
    let mut batches = triangles.chunk_by(|t, u| t.birth == u.birth).peekable();
    let mut first = 0;
    let mut ends = ByRank::new(n_isovalues);
    (0..n_vertices as u32).for_each(|v| {
        last(v).into_iter().for_each(|rank| ends.push(rank, v));
    });
    let mut arranger = Arranger {
        meshes,
        holes: Holes::new(n_vertices),
        number: vec![NONE; n_vertices],
        sides_of: vec![(0, 0); n_vertices],
        dying: ByRank::new(n_isovalues),
        arrangement: Arrangement::default(),
        walk: Walk { births: vec![0; n_isovalues], ..Walk::default() },
    };
    for rank in 0..n_isovalues as u32 {
        arranger.die(rank, &ends);
        if let Some(batch) = batches.next_if(|batch| batch[0].birth == rank) {
            arranger.batch(first, batch);
            first += batch.len() as u32;
        }
    }
    // Vertices that no triangle uses come last.
    let Arranger { number, mut arrangement, walk, holes, .. } = arranger;
    arrangement.corners = holes.into_vertices();
    let unused = (0..n_vertices as u32).filter(|&v| number[v as usize] == NONE);
    for v in unused {
        arrangement.vertices.push(v);
        arrangement.is_lattice.push((meshes.is_lattice)(v));
    }
    (arrangement, walk)
}

struct Arranger<'a> {
    meshes: &'a Meshes<'a>,
    holes: Holes,
    /// The number in the file of each vertex of the spectrum, once it has one.
    number: Vec<u32>,
    /// By vertex of the spectrum, from where to where the sides lie that start there, of those of the rank.
    sides_of: Vec<(u32, u32)>,
    /// The triangles of the file that die at each rank.
    dying: ByRank,
    arrangement: Arrangement,
    walk: Walk,
}

impl Arranger<'_> {
    /// Opens the holes that the triangles leave which die at a rank.
    fn die(&mut self, rank: u32, ends: &ByRank) {
        let Arranger { meshes, holes, number, dying, arrangement, walk, .. } = self;
        let numbers = ends.at(rank).map(|v| number[v as usize]);
        let mut ended: Vec<u32> = numbers.filter(|&v| v != NONE).collect();
        ended.sort_unstable();
        let dies = |holes: &Holes, question: Question| {
            let Question { triangle, .. } = question;
            let is_lattice = |v: u32| arrangement.is_lattice[v as usize];
            let kind = kind(question, holes.vertices(triangle), is_lattice);
            let was = arrangement.triangles[triangle as usize];
            let dies = meshes.triangles[was as usize].death == rank;
            walk.answers[kind].push(dies);
            Ok::<bool, std::convert::Infallible>(dies)
        };
        let Ok([found, told]) = holes.dying(rank, &ended, dying.at(rank), dies);
        told.iter().for_each(|&t| arrangement.is_told[t as usize] = true);
        holes.open(&found);
    }

    /// Tells the triangles born at one rank, from the `start`th on, in the spectrum's order.
    fn batch(&mut self, start: u32, batch: &[Triangle]) {
        self.walk.births[batch[0].birth as usize] = batch.len() as u32;
        // By directed edge, then by order: what fills a gate.
        let mut sides = Vec::with_capacity(3 * batch.len());
        for (triangle, at) in batch.iter().zip(0u32..) {
            let [a, b, c] = triangle.vertices;
            sides.extend([([a, b], at), ([b, c], at), ([c, a], at)]);
        }
        sides.par_sort_unstable();
        let mut end = 0;
        for of_one in sides.chunk_by(|a, b| a.0[0] == b.0[0]) {
            let first = end;
            end += of_one.len() as u32;
            self.sides_of[of_one[0].0[0] as usize] = (first, end);
        }
        // At the first of equal sides, how many of them are known to be told: none is looked at twice.
        let mut n_told = vec![0u32; sides.len()];
        let mut told = vec![false; batch.len()];
        let mut next = 0;
        let mut left = batch.len();
        while left > 0 {
            let Some(gate) = self.holes.pop() else {
                while told[next] {
                    next += 1;
                }
                told[next] = true;
                left -= 1;
                self.start(start + next as u32);
                continue;
            };
            let side = [gate.from, gate.to].map(|v| self.arrangement.vertices[v as usize]);
            let (first, end) = self.sides_of[side[0] as usize];
            let of_one = &sides[first as usize..end as usize];
            let first = first as usize + of_one.partition_point(|&(other, _)| other < side);
            // Behind the last side there are none.
            let mut nothing = 0;
            let n_told = n_told.get_mut(first).unwrap_or(&mut nothing);
            let mut i = first + *n_told as usize;
            while sides.get(i).is_some_and(|&(other, at)| other == side && told[at as usize]) {
                i += 1;
            }
            *n_told = (i - first) as u32;
            let Some(&(_, at)) = sides.get(i).filter(|&&(other, _)| other == side) else {
                self.walk.codes.push(SKIP as u8);
                self.holes.leave(gate);
                continue;
            };
            told[at as usize] = true;
            left -= 1;
            self.fill(start + at, gate, side);
        }
        sides.iter().for_each(|&([from, _], _)| self.sides_of[from as usize] = (0, 0));
    }

    /// Tells the triangle `i` on a gate by its third vertex.
    fn fill(&mut self, i: u32, gate: Gate, side: [u32; 2]) {
        let third = self.meshes.triangles[i as usize].vertices.into_iter();
        let third = { third }.find(|v| !side.contains(v));
        let (c, is_new) = self.number_of(third.expect("triangles have three different vertices"));
        let code = if is_new { Some(NEW) } else { self.holes.code_of(&gate, c) };
        let code = code.unwrap_or_else(|| match self.holes.depth_of(c) {
            Some(depth) => {
                self.walk.depths.push(depth as u8);
                DEPTH
            }
            None => self.walk.jump(gate.from, c),
        });
        self.walk.codes.push(code as u8);
        self.tell(i);
        self.holes.fill(gate, c);
    }

    /// Tells the triangle `i` by its three vertices.
    fn start(&mut self, i: u32) {
        let vertices = self.meshes.triangles[i as usize].vertices.map(|v| {
            let n_before = self.arrangement.vertices.len() as u32;
            let (v, _) = self.number_of(v);
            self.walk.starts.push(n_before - v);
            v
        });
        self.tell(i);
        self.holes.start(vertices);
    }

    fn tell(&mut self, i: u32) {
        let number = self.arrangement.triangles.len() as u32;
        self.dying.push(self.meshes.triangles[i as usize].death, number);
        self.arrangement.triangles.push(i);
        self.arrangement.is_told.push(false);
    }

    /// The number in the file of a vertex of the spectrum, and whether it has it only now.
    fn number_of(&mut self, v: u32) -> (u32, bool) {
        let number = &mut self.number[v as usize];
        let is_new = *number == NONE;
        if is_new {
            *number = self.arrangement.vertices.len() as u32;
            self.arrangement.vertices.push(v);
            self.arrangement.is_lattice.push((self.meshes.is_lattice)(v));
        }
        (*number, is_new)
    }
}

/// A column, and how much of it is read.
#[derive(Debug)]
struct Queue<'a> {
    n: usize,
    column: Column<'a>,
    n_read: usize,
}

impl<'a> Queue<'a> {
    /// Takes a counted column off the front of a section.
    fn new(columns: &mut Columns<'a>, bits: u32) -> Result<Self> {
        let n = columns.count()?;
        Ok(Queue { n, column: columns.column(n, bits)?, n_read: 0 })
    }

    fn next(&mut self) -> Result<u64> {
        if self.n_read == self.n {
            return Err(Error::input("less is told than the triangles need"));
        }
        self.n_read += 1;
        self.column.get(self.n_read - 1)
    }
}

/// The columns of a walk.
#[derive(Debug)]
pub(super) struct WalkReader<'a> {
    births: Queue<'a>,
    codes: Queue<'a>,
    jumps: Queue<'a>,
    last: u32,
    depths: Queue<'a>,
    starts: Queue<'a>,
    answers: [Queue<'a>; KINDS],
}

impl<'a> WalkReader<'a> {
    /// Takes the columns of a walk off the front of a section, for so many ranks.
    pub(super) fn new(columns: &mut Columns<'a>, n_isovalues: usize) -> Result<Self> {
        let mut next = |bits: u32| Queue::new(columns, bits);
        let (births, codes, jumps) = (next(32)?, next(8)?, next(33)?);
        let (depths, starts) = (next(8)?, next(32)?);
        let answers = [next(1)?, next(1)?, next(1)?, next(1)?];
        if births.n != n_isovalues {
            let n = births.n;
            return Err(Error::input(format!("births at {n} ranks, expected {n_isovalues}")));
        }
        Ok(WalkReader { births, codes, jumps, last: 0, depths, starts, answers })
    }

    /// How many triangles there are.
    pub(super) fn n_triangles(&self) -> Result<usize> {
        // Each triangle takes a code or three starts: this is as many as the section can hold.
        let most = self.codes.n + self.starts.n / 3;
        let mut n = 0;
        for rank in 0..self.births.n {
            n += self.births.column.get(rank)? as usize;
            if n > most {
                return Err(Error::input(format!("more triangles than the {most} it tells of")));
            }
        }
        Ok(n)
    }

    /// How many triangles are born at the next rank.
    pub(super) fn births(&mut self) -> Result<u64> {
        self.births.next()
    }

    /// Whether a triangle dies that is asked.
    pub(super) fn dies(
        &mut self,
        question: Question,
        vertices: [u32; 3],
        is_lattice: impl FnMut(u32) -> bool,
    ) -> Result<bool> {
        Ok(self.answers[kind(question, vertices, is_lattice)].next()? == 1)
    }

    /// The third vertex of the triangle at a gate; none if there is no triangle.
    pub(super) fn third(&mut self, holes: &Holes, gate: &Gate, n_used: u32) -> Result<Option<u32>> {
        let third = match self.codes.next()? {
            NEW => Some(n_used),
            SKIP => return Ok(None),
            code @ (JUMP | LEAP) => {
                let from = if code == LEAP { self.last } else { gate.from };
                let third = i64::from(from) + unzigzag(self.jumps.next()?);
                let third = u32::try_from(third).ok().filter(|&third| third < n_used);
                third.inspect(|&third| self.last = third)
            }
            DEPTH => holes.at_depth(self.depths.next()?),
            code => holes.third(gate, code),
        };
        third.map(Some).ok_or_else(|| Error::input("a triangle has a vertex that does not exist"))
    }

    /// The vertices of a triangle without a gate.
    pub(super) fn start(&mut self, mut n_used: u32) -> Result<[u32; 3]> {
        let mut vertices = [0; 3];
        for vertex in &mut vertices {
            let back = self.starts.next()?;
            *vertex = u32::try_from(u64::from(n_used).wrapping_sub(back))
                .map_err(|_| Error::input("a triangle starts before the first vertex"))?;
            n_used += u32::from(back == 0);
        }
        Ok(vertices)
    }

    /// Ends reading: nothing may be left.
    pub(super) fn end(self) -> Result<()> {
        let WalkReader { births, codes, jumps, depths, starts, answers, .. } = self;
        let queues = [births, codes, jumps, depths, starts].into_iter().chain(answers);
        match { queues }.all(|queue| queue.n_read == queue.n) {
            true => Ok(()),
            false => Err(Error::input("more is told than the triangles need")),
        }
    }
}
