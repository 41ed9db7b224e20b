//! The combinatorics of the isosurface in one cell: its loops, and whether a tunnel joins two of them.
//!
//! Corner c of a cell is at (c & 1, c >> 1 & 1, c >> 2 & 1). The isosurface crosses the
//! cell's faces along arcs from crossed edge to crossed edge; on a face whose corners alternate
//! the saddle determines which corners the two arcs cut off. Arcs are directed with the higher values on a fixed
//! side, so following them closes one to four oriented loops of 3 to 12 edges.
//!
//! A tunnel exists iff an index 1 body saddle is below the isovalue while the lower corners
//! form two components (joined over edges and faces), or an index 2 one above it while the higher
//! corners do; never both. It joins the two loops around the one component of the other side. Both
//! facts were checked on 40 million random cells.

use std::sync::LazyLock;

use super::lattice::{Cell, EDGES};
use crate::topology::exact::{ExactField, Trilinear, can_hold_body_saddle, is_saddle_above};

/// Corners of the faces, counter-clockwise seen from outside: +x, -x, +y, -y, +z, -z.
const FACES: [[u8; 4]; 6] =
    [[1, 3, 7, 5], [4, 6, 2, 0], [2, 6, 7, 3], [1, 5, 4, 0], [4, 5, 7, 6], [2, 3, 1, 0]];

/// The edge between corners `FACES[f][i]` and `FACES[f][i + 1]`.
const FACE_EDGES: [[u8; 4]; 6] = {
    let mut edges = [[0; 4]; 6];
    let mut f = 0;
    while f < 6 {
        let mut i = 0;
        while i < 4 {
            let (a, b) = (FACES[f][i], FACES[f][(i + 1) % 4]);
            let mut e = 0;
            while e < 12 {
                let (x, y) = EDGES[e];
                if (a == x && b == y) || (a == y && b == x) {
                    edges[f][i] = e as u8;
                }
                e += 1;
            }
            i += 1;
        }
        f += 1;
    }
    edges
};

/// Per edge: bit f is set iff it belongs to face f.
pub(crate) const EDGE_FACES: [u8; 12] = {
    let mut faces = [0; 12];
    let mut f = 0;
    while f < 6 {
        let mut i = 0;
        while i < 4 {
            faces[FACE_EDGES[f][i] as usize] |= 1 << f;
            i += 1;
        }
        f += 1;
    }
    faces
};

/// The loops of a cell.
#[derive(Clone, Debug)]
struct Loops {
    /// Edges of all loops, one loop after the other.
    edges: [u8; 12],
    /// Start of each loop in `edges`, and after the last one its end.
    starts: [u8; 5],
    n_loops: usize,
    /// Per corner: the smallest corner it is connected to along edges and decided faces.
    regions: [u8; 8],
    /// Whether the lower or the higher corners form more than one region.
    may_hold_tunnel: bool,
}

/// Whether the corners of a face alternate between inside and outside.
fn is_ambiguous(inside: u8, face: &[u8; 4]) -> bool {
    let s = face.map(|c| inside >> c & 1);
    s[0] == s[2] && s[1] == s[3] && s[0] != s[1]
}

/// By signs of the corners: the loops of cells without ambiguous faces; `None` for the others.
static PLAIN_LOOPS: LazyLock<Vec<Option<Loops>>> = LazyLock::new(|| {
    (0..=255)
        .map(|inside| {
            let ambiguous = FACES.iter().any(|f| is_ambiguous(inside, f));
            (!ambiguous).then(|| Loops::trace(inside, |_| unreachable!("no face is ambiguous")))
        })
        .collect()
});

impl Loops {
    /// Follows the arcs of a cell. `is_above(face)` is whether the saddle of an ambiguous face
    /// is above the isovalue.
    fn trace(inside: u8, is_above: impl Fn(&[u8; 4]) -> bool) -> Loops {
        const NONE: u8 = u8::MAX;
        let mut next = [NONE; 12];
        let mut regions: [u8; 8] = std::array::from_fn(|c| c as u8);
        for (a, b) in EDGES {
            if inside >> a & 1 == inside >> b & 1 {
                join(&mut regions, a, b);
            }
        }
        for (face, edges) in FACES.iter().zip(&FACE_EDGES) {
            let s = face.map(|c| inside >> c & 1 == 1);
            if is_ambiguous(inside, face) {
                let above = is_above(face);
                for i in 0..4 {
                    // Each arc cuts off one corner of the side that the saddle does not join.
                    let (before, after) = (edges[(i + 3) % 4], edges[i]);
                    match (above, s[i]) {
                        (true, false) => next[after as usize] = before,
                        (false, true) => next[before as usize] = after,
                        _ => join(&mut regions, face[i], face[(i + 2) % 4]),
                    }
                }
            } else {
                let rising = (0..4).find(|&i| !s[i] && s[(i + 1) % 4]);
                let falling = (0..4).find(|&i| s[i] && !s[(i + 1) % 4]);
                if let Some((r, f)) = rising.zip(falling) {
                    next[edges[r] as usize] = edges[f];
                }
            }
        }
        let mut loops =
            Loops { edges: [0; 12], starts: [0; 5], n_loops: 0, regions, may_hold_tunnel: false };
        let mut n = 0;
        for first in 0..12 {
            let mut edge = first;
            while next[edge] != NONE {
                loops.edges[n] = edge as u8;
                n += 1;
                edge = std::mem::replace(&mut next[edge], NONE) as usize;
            }
            if n > loops.starts[loops.n_loops] as usize {
                loops.n_loops += 1;
                loops.starts[loops.n_loops] = n as u8;
            }
        }
        loops.may_hold_tunnel = [0, 1].iter().any(|&side| loops.n_regions(inside, side) > 1);
        loops
    }

    /// How many regions the corners of one side (1: inside) form.
    fn n_regions(&self, inside: u8, side: u8) -> usize {
        (0..8).filter(|&c| self.regions[c] as usize == c && inside >> c & 1 == side).count()
    }

    fn edges_of(&self, l: usize) -> &[u8] {
        &self.edges[self.starts[l] as usize..self.starts[l + 1] as usize]
    }
}

/// Unites the regions of two corners; the smallest corner represents a region.
fn join(regions: &mut [u8; 8], a: u8, b: u8) {
    let (a, b) = (regions[a as usize], regions[b as usize]);
    for r in regions {
        if *r == a.max(b) {
            *r = a.min(b);
        }
    }
}

/// Loops from the table, or those of this cell.
enum LoopsOf {
    Plain(&'static Loops),
    Decided(Loops),
}

/// The isosurface in one cell.
pub(crate) struct CellSurface {
    loops: LoopsOf,
    /// The two loops that a tunnel joins.
    pub(crate) tunnel: Option<(usize, usize)>,
}

impl CellSurface {
    /// Decides the isosurface in a cell that it crosses.
    pub(crate) fn of(field: &ExactField, cell: &Cell, isovalue_key: i128) -> CellSurface {
        let inside = cell.inside;
        if let Some(loops) = &PLAIN_LOOPS[inside as usize] {
            let tunnel = loops.may_hold_tunnel.then(|| {
                let keys = field.cell_keys(cell.corner);
                find_tunnel(loops, inside, &keys, isovalue_key)
            });
            return CellSurface { loops: LoopsOf::Plain(loops), tunnel: tunnel.flatten() };
        }
        let keys = field.cell_keys(cell.corner);
        let loops = Loops::trace(inside, |face| {
            let v = face.map(|c| keys[c as usize]);
            let (even, odd) = ([v[0], v[2]], [v[1], v[3]]);
            if v[0] > v[1] {
                is_saddle_above(odd, even, isovalue_key)
            } else {
                is_saddle_above(even, odd, isovalue_key)
            }
        });
        let tunnel = loops
            .may_hold_tunnel
            .then(|| find_tunnel(&loops, inside, &keys, isovalue_key))
            .flatten();
        CellSurface { loops: LoopsOf::Decided(loops), tunnel }
    }

    fn get(&self) -> &Loops {
        match &self.loops {
            LoopsOf::Plain(loops) => loops,
            LoopsOf::Decided(loops) => loops,
        }
    }

    /// How many loops there are.
    pub(crate) fn n_loops(&self) -> usize {
        self.get().n_loops
    }

    /// The edges of a loop in order; triangles that are counter-clockwise along it face lower values.
    pub(crate) fn loop_edges(&self, l: usize) -> &[u8] {
        self.get().edges_of(l)
    }
}

/// The two loops that a tunnel joins.
fn find_tunnel(
    loops: &Loops,
    inside: u8,
    keys: &[i128; 8],
    isovalue_key: i128,
) -> Option<(usize, usize)> {
    if !can_hold_body_saddle(keys) {
        return None;
    }
    let field = Trilinear::new(keys);
    let joined_side = field.body_saddle_indices().into_iter().flatten().find_map(|index| {
        // Index 1 below the isovalue joins lower corners (side 0), index 2 above it higher ones.
        let side = index - 1;
        let joins = loops.n_regions(inside, side) > 1
            && field.is_body_saddle_above(index, isovalue_key) == (index == 2);
        joins.then_some(side)
    })?;
    let other_region = |l: usize| {
        let (a, b) = EDGES[loops.edges_of(l)[0] as usize];
        let corner = if inside >> a & 1 == joined_side { b } else { a };
        loops.regions[corner as usize]
    };
    (0..loops.n_loops).find_map(|l| {
        let partner = (l + 1..loops.n_loops).find(|&m| other_region(m) == other_region(l))?;
        Some((l, partner))
    })
}
