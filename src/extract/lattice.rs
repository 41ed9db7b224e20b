//! The cells that an isosurface crosses, in order, and numbers for the lattice edges that it crosses.

use crate::topology::exact::{BRICK, ExactField};

/// Corners of the edges, lower first: four along x, four along y, four along z.
pub(crate) const EDGES: [(u8, u8); 12] = [
    (0, 1),
    (2, 3),
    (4, 5),
    (6, 7),
    (0, 2),
    (1, 3),
    (4, 6),
    (5, 7),
    (0, 4),
    (1, 5),
    (2, 6),
    (3, 7),
];

/// A cell with corners on both sides of the isovalue.
pub(crate) struct Cell {
    /// Its lowest vertex.
    pub(crate) corner: u32,
    /// Its position in the padded grid, from 0; the index frame's is one less.
    pub(crate) position: [u32; 3],
    /// Bit x + 2 y + 4 z is set iff that corner is above the isovalue.
    pub(crate) inside: u8,
}

impl Cell {
    /// The cell whose lowest corner is given, at an isovalue.
    pub(crate) fn at(field: &ExactField, corner: u32, isovalue: f64) -> Cell {
        let level = field.isovalue_level(isovalue);
        let levels = field.levels_at(corner, field.cell_offsets());
        let inside = (0..8).fold(0, |bits, c| bits | u8::from(levels[c] > level) << c);
        Cell { corner, position: field.position(corner).map(|p| (p + 1) as u32), inside }
    }

    /// The crossing on a crossed edge, with the number `next`. `offsets` are the field's cell offsets.
    pub(crate) fn crossing(&self, offsets: &[u32; 8], edge: usize, next: usize) -> Crossing {
        let (a, b) = EDGES[edge];
        let [from, to] = [a, b].map(|c| self.corner + offsets[c as usize]);
        let (low, high) = if self.inside >> a & 1 == 1 { (to, from) } else { (from, to) };
        Crossing { vertex: next as u32, low, high }
    }

    /// A corner's position in the index frame.
    pub(crate) fn corner_position(&self, corner: u8) -> [i64; 3] {
        std::array::from_fn(|a| self.position[a] as i64 - 1 + (corner >> a & 1) as i64)
    }
}

/// Calls `visit` for every cell that the isosurface crosses, x fastest, skipping bricks whose
/// range of levels does not contain the isovalue.
pub(crate) fn for_each_crossed_cell(
    field: &ExactField,
    isovalue: f64,
    mut visit: impl FnMut(Cell),
) {
    // Inside bits of the four corners of one x, (y, z) = 00 10 01 11, moved to corners 0 2 4 6.
    const SPREAD: [u8; 16] = [0, 1, 4, 5, 16, 17, 20, 21, 64, 65, 68, 69, 80, 81, 84, 85];
    let level = field.isovalue_level(isovalue);
    let [nx, ny, nz] = field.dims();
    let [_, sy, sz] = field.strides();
    let [bx, by, _] = field.brick_dims();
    let column = |v: u32| {
        let levels = field.levels_at(v, [0, sy, sz, sy + sz]);
        let bits = (0..4).fold(0, |bits, n| bits | usize::from(levels[n] > level) << n);
        SPREAD[bits]
    };
    for k in 0..nz - 1 {
        for j in 0..ny - 1 {
            let row = (nx * (j + ny * k)) as u32;
            let first_brick = bx * (j / BRICK + by * (k / BRICK));
            for b in 0..bx {
                if !field.is_brick_active(first_brick + b, level) {
                    continue;
                }
                let mut left = column(row + (b * BRICK) as u32);
                for i in b * BRICK..((b + 1) * BRICK).min(nx - 1) {
                    let corner = row + i as u32;
                    let right = column(corner + 1);
                    let inside = left | right << 1;
                    left = right;
                    if inside != 0 && inside != 255 {
                        visit(Cell { corner, position: [i, j, k].map(|p| p as u32), inside });
                    }
                }
            }
        }
    }
}

/// A crossed lattice edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Crossing {
    /// Its number.
    pub(crate) vertex: u32,
    /// Its end that is not above the isovalue.
    pub(crate) low: u32,
    /// Its end above the isovalue.
    pub(crate) high: u32,
}

/// Numbers the crossed lattice edges around the cells of a walk in the order of
/// [`for_each_crossed_cell`]. Two layers of edges are stored. An entry of an earlier layer is recognised by its ends, so entries
/// are never cleared.
pub(crate) struct Crossings {
    /// Edges along x and y of even layers, then of odd layers, then edges along z.
    entries: [Vec<Crossing>; 5],
    strides: [u32; 3],
    offsets: [u32; 8],
}

impl Crossings {
    /// No crossings yet.
    pub(crate) fn new(field: &ExactField) -> Self {
        let empty = Crossing { vertex: u32::MAX, low: u32::MAX, high: u32::MAX };
        let n = field.dims()[0] * field.dims()[1];
        Crossings {
            entries: std::array::from_fn(|_| vec![empty; n]),
            strides: field.strides(),
            offsets: field.cell_offsets(),
        }
    }

    /// The crossing on a crossed edge of a cell, and whether it is new; a new one gets the number
    /// `next`.
    #[inline]
    pub(crate) fn vertex(&mut self, cell: &Cell, edge: usize, next: usize) -> (Crossing, bool) {
        let a = EDGES[edge].0;
        let from = cell.corner + self.offsets[a as usize];
        let crossing = cell.crossing(&self.offsets, edge, next);
        let layer = cell.position[2] + (a >> 2) as u32;
        let kind = if edge < 8 { (layer % 2) as usize * 2 + edge / 4 } else { 4 };
        let entry = &mut self.entries[kind][(from - layer * self.strides[2]) as usize];
        if (entry.low, entry.high) == (crossing.low, crossing.high) {
            return (*entry, false);
        }
        *entry = crossing;
        (*entry, true)
    }
}
