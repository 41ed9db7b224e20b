//! Which cells are exact, and the lattice squares between them and the others.
//!
//! # Theory
//!
//! Around a sample are eight cells, its *octants*. A square of the lattice between an exact cell and one that is not
//! belongs to the *seam*. At every sample of the seam the squares around it must form one cycle, so that the seam is
//! a surface: then the exact extraction meets it in closed polylines.
//!
//! # Invariants
//!
//! 1. The cells of the layer around the volume are exact, so every square of the seam is in the volume.
//! 2. Cells are exact by blocks of [`BLOCK`]^3: the seam has fewer corners at which it turns.

use std::collections::BTreeSet;

use glam::Vec3;

use crate::topology::critical::GridElement;
use crate::topology::exact::ExactField;

/// Cells along the side of a block.
pub(super) const BLOCK: usize = 2;

/// A direction along the lattice: twice the axis, and one more for the positive sense.
pub(super) type Direction = u8;

/// The seam around a sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Link {
    /// The sample is not on the seam.
    Away,
    /// The directions of the seam's lattice edges, in cyclic order, and how many there are.
    Cycle([Direction; 6], u8),
    /// The squares do not form one cycle.
    Pinched,
}

/// A lattice edge: its lower end and its axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(super) struct LatticeEdge {
    pub(super) from: u32,
    pub(super) axis: u8,
}

/// A square of the lattice: its lowest sample and the axis that it is normal to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(super) struct Square {
    pub(super) corner: u32,
    pub(super) axis: u8,
}

/// The padded grid of a volume: vertices, cells (by their lowest vertex) and blocks by number.
#[derive(Clone, Copy, Debug)]
pub(super) struct PaddedGrid {
    pub(super) dims: [usize; 3],
    pub(super) strides: [u32; 3],
}

impl PaddedGrid {
    pub(super) fn of(field: &ExactField) -> PaddedGrid {
        PaddedGrid { dims: field.dims(), strides: field.strides() }
    }

    /// Position of a vertex in the padded grid.
    pub(super) fn position(&self, v: u32) -> [usize; 3] {
        let [nx, ny] = [self.dims[0] as u32, self.dims[1] as u32];
        let row = v / nx;
        [(v - row * nx) as usize, (row % ny) as usize, (row / ny) as usize]
    }

    pub(super) fn vertex(&self, p: [usize; 3]) -> u32 {
        (0..3).map(|a| p[a] as u32 * self.strides[a]).sum()
    }

    /// Whether a cell is one of the volume and not of the layer around it.
    pub(super) fn is_cell(&self, p: [usize; 3]) -> bool {
        (0..3).all(|a| p[a] >= 1 && p[a] + 2 < self.dims[a])
    }

    /// The neighbour of a vertex in a direction.
    pub(super) fn neighbour(&self, v: u32, direction: Direction) -> u32 {
        let stride = self.strides[direction as usize / 2];
        if direction % 2 == 1 { v + stride } else { v - stride }
    }

    /// The lattice edge that leaves a vertex in a direction.
    pub(super) fn edge(&self, v: u32, direction: Direction) -> LatticeEdge {
        let from = if direction % 2 == 1 { v } else { self.neighbour(v, direction) };
        LatticeEdge { from, axis: direction / 2 }
    }

    /// The lattice edge between two samples.
    pub(super) fn edge_between(&self, (a, b): (u32, u32)) -> LatticeEdge {
        let from = a.min(b);
        let axis = self.strides.iter().position(|&s| s == a.max(b) - from);
        LatticeEdge { from, axis: axis.expect("ends of a lattice edge") as u8 }
    }

    /// Both ends of a lattice edge.
    pub(super) fn ends(&self, e: LatticeEdge) -> [u32; 2] {
        [e.from, e.from + self.strides[e.axis as usize]]
    }

    /// The cell in an octant of a vertex of the volume: bit a is set for the upper side along axis a.
    pub(super) fn octant(&self, v: u32, o: u8) -> u32 {
        let back: u32 = (0..3).filter(|&a| o >> a & 1 == 0).map(|a| self.strides[a as usize]).sum();
        v - back
    }

    /// The cells that contain or touch a critical point; none for one in the layer.
    pub(super) fn cells_at(&self, place: GridElement) -> Vec<u32> {
        match place {
            GridElement::Vertex(v) => (0..8).map(|o| self.octant(v, o)).collect(),
            GridElement::Face { corner, axis } => {
                vec![corner, corner - self.strides[axis as usize]]
            }
            GridElement::Cell(corner) => vec![corner],
            GridElement::Layer => vec![],
        }
    }

    /// The four cells around a lattice edge.
    pub(super) fn cells_around(&self, e: LatticeEdge) -> [u32; 4] {
        let [u, v] = [1, 2].map(|n| self.strides[(e.axis as usize + n) % 3]);
        [e.from, e.from - u, e.from - v, e.from - u - v]
    }

    /// The four corners of a square in cyclic order.
    pub(super) fn corners(&self, s: Square) -> [u32; 4] {
        let [u, v] = [1, 2].map(|n| self.strides[(s.axis as usize + n) % 3]);
        [s.corner, s.corner + u, s.corner + u + v, s.corner + v]
    }

    /// The six squares of a cell, each with the cell on its other side.
    pub(super) fn squares_of(&self, cell: u32) -> [(Square, u32); 6] {
        std::array::from_fn(|i| {
            let (axis, stride) = ((i / 2) as u8, self.strides[i / 2]);
            if i % 2 == 0 {
                (Square { corner: cell, axis }, cell - stride)
            } else {
                (Square { corner: cell + stride, axis }, cell + stride)
            }
        })
    }

    /// The two cells that share a square, the lower one first.
    pub(super) fn adjacent_cells(&self, s: Square) -> [u32; 2] {
        [s.corner - self.strides[s.axis as usize], s.corner]
    }

    /// How many blocks there are along each axis.
    pub(super) fn blocks(&self) -> [usize; 3] {
        self.dims.map(|d| (d - 3).div_ceil(BLOCK))
    }

    /// The block of a cell of the volume, by its position.
    pub(super) fn block(&self, p: [usize; 3]) -> u32 {
        self.block_number(p.map(|x| (x - 1) / BLOCK))
    }

    /// The block at a position among the blocks.
    fn block_number(&self, [i, j, k]: [usize; 3]) -> u32 {
        let [nx, ny, _] = self.blocks();
        (i + nx * (j + ny * k)) as u32
    }

    /// The block of a cell; none of a cell of the layer.
    pub(super) fn block_of_cell(&self, cell: u32) -> Option<u32> {
        let p = self.position(cell);
        self.is_cell(p).then(|| self.block(p))
    }

    /// The cell around a place, in voxels, by its position; the nearest one of the volume.
    fn cell_position(&self, x: Vec3) -> [usize; 3] {
        std::array::from_fn(|a| (x[a].max(0.0) as usize).min(self.dims[a] - 4) + 1)
    }

    /// The cell around a place, in voxels; the nearest one of the volume.
    pub(super) fn cell_at(&self, x: Vec3) -> u32 {
        self.vertex(self.cell_position(x))
    }

    /// The block around a place, in voxels.
    pub(super) fn block_at(&self, x: Vec3) -> u32 {
        self.block(self.cell_position(x))
    }

    pub(super) fn block_position(&self, block: u32) -> [usize; 3] {
        let [bx, by, _] = self.blocks();
        let b = block as usize;
        [b % bx, b / bx % by, b / (bx * by)]
    }

    /// The cells of a block, as ranges of positions.
    fn block_cells(&self, block: u32) -> [std::ops::Range<usize>; 3] {
        let b = self.block_position(block);
        std::array::from_fn(|a| {
            let first = 1 + BLOCK * b[a];
            first..(first + BLOCK).min(self.dims[a] - 2)
        })
    }

    pub(super) fn cells_of(&self, block: u32) -> impl Iterator<Item = u32> + use<> {
        let grid = *self;
        positions(self.block_cells(block)).map(move |p| grid.vertex(p))
    }

    /// The samples on the hull of a block.
    pub(super) fn samples_around(&self, block: u32) -> impl Iterator<Item = u32> + use<> {
        let grid = *self;
        let sides = self.block_cells(block).map(|cells| cells.start..=cells.end);
        let of_block = positions(sides.clone());
        let is_on_hull = move |p: &[usize; 3]| {
            (0..3).any(|a| p[a] == *sides[a].start() || p[a] == *sides[a].end())
        };
        of_block.filter(is_on_hull).map(move |p| grid.vertex(p))
    }

    /// By block, whether it is at most `distance` blocks away along every axis from one of some blocks.
    pub(super) fn marked(&self, blocks: impl Iterator<Item = u32>, distance: usize) -> Vec<bool> {
        let [nx, ny, nz] = self.blocks();
        let mut marked = vec![false; nx * ny * nz];
        for b in blocks {
            let p = self.block_position(b);
            let [x, y, z] = std::array::from_fn(|a| {
                p[a].saturating_sub(distance)..(p[a] + distance + 1).min([nx, ny, nz][a])
            });
            for row in z.flat_map(|k| y.clone().map(move |j| nx * (j + ny * k))) {
                marked[row + x.start..row + x.end].fill(true);
            }
        }
        marked
    }

    /// The blocks that a box, in voxels, touches.
    pub(super) fn blocks_in(&self, low: Vec3, high: Vec3) -> impl Iterator<Item = u32> + use<> {
        let (grid, n) = (*self, self.blocks());
        let sides = [0, 1, 2].map(|a| {
            let at = |x: f32| (x.max(0.0) as usize / BLOCK).min(n[a] - 1);
            at(low[a])..=at(high[a])
        });
        positions(sides).map(move |p| grid.block_number(p))
    }

    /// A block and those around it.
    pub(super) fn blocks_around(&self, block: u32) -> impl Iterator<Item = u32> + use<> {
        let (grid, n, p) = (*self, self.blocks(), self.block_position(block));
        let sides = [0, 1, 2].map(|a| p[a].saturating_sub(1)..(p[a] + 2).min(n[a]));
        positions(sides).map(move |p| grid.block_number(p))
    }
}

/// Which cells are exact.
#[derive(Clone, Debug)]
pub(super) struct Region {
    pub(super) grid: PaddedGrid,
    /// By cell, a bit each, the lowest first: regions are copied in every step.
    exact: Vec<u64>,
    /// The exact blocks; if everything is exact, those that the isosurface meets.
    blocks: BTreeSet<u32>,
    is_all_exact: bool,
}

impl Region {
    /// Only the layer is exact.
    pub(super) fn layer_exact(grid: PaddedGrid) -> Region {
        let mut region = Region::all_exact(grid, BTreeSet::new());
        region.is_all_exact = false;
        for k in 1..grid.dims[2] - 2 {
            for j in 1..grid.dims[1] - 2 {
                let first = grid.vertex([1, j, k]);
                let end = first + grid.dims[0] as u32 - 3;
                region.clear(first, end);
            }
        }
        region
    }

    /// Everything is exact; `blocks` are those that the isosurface meets while it is.
    pub(super) fn all_exact(grid: PaddedGrid, blocks: BTreeSet<u32>) -> Region {
        let n_words = grid.dims.iter().product::<usize>().div_ceil(64);
        Region { grid, exact: vec![u64::MAX; n_words], blocks, is_all_exact: true }
    }

    /// Whether everything is exact.
    pub(super) fn is_all_exact(&self) -> bool {
        self.is_all_exact
    }

    #[inline]
    pub(super) fn is_exact(&self, cell: u32) -> bool {
        self.exact[cell as usize / 64] >> (cell % 64) & 1 == 1
    }

    fn set(&mut self, cell: u32, is_exact: bool) {
        let (word, bit) = (&mut self.exact[cell as usize / 64], 1 << (cell % 64));
        if is_exact {
            *word |= bit;
        } else {
            *word &= !bit;
        }
    }

    /// Makes the cells from `first` to before `end` no longer exact, a word at a time.
    fn clear(&mut self, first: u32, end: u32) {
        let (from, to) = (first as usize / 64, (end - 1) as usize / 64);
        let [low, high] = [u64::MAX << (first % 64), u64::MAX >> (63 - (end - 1) % 64)];
        for word in from..=to {
            let low = if word == from { low } else { u64::MAX };
            let high = if word == to { high } else { u64::MAX };
            self.exact[word] &= !(low & high);
        }
    }

    pub(super) fn blocks(&self) -> &BTreeSet<u32> {
        &self.blocks
    }

    /// Whether a block is one of the exact ones.
    pub(super) fn holds(&self, block: u32) -> bool {
        self.blocks.contains(&block)
    }

    /// Copies the state of blocks from another region.
    pub(super) fn follow(&mut self, other: &Region, blocks: &[u32]) {
        for &b in blocks {
            if other.holds(b) {
                self.add(b);
            } else if self.blocks.remove(&b) {
                self.grid.cells_of(b).for_each(|c| self.set(c, false));
            }
        }
    }

    /// Makes a block exact. Returns whether it was not.
    pub(super) fn add(&mut self, block: u32) -> bool {
        let is_new = self.blocks.insert(block);
        if is_new {
            self.grid.cells_of(block).for_each(|c| self.set(c, true));
        }
        is_new
    }

    /// Makes the fewest blocks around a sample exact such that `is_bad` is false for its octants; returns these blocks.
    /// `is_bad` must be false if all octants are exact.
    pub(super) fn add_fewest(&mut self, v: u32, is_bad: impl Fn(u8) -> bool) -> Vec<u32> {
        let octants = self.octants(v);
        if !is_bad(octants) {
            return Vec::new();
        }
        let mut blocks: Vec<(u32, u8)> = Vec::new();
        for o in (0..8u8).filter(|o| octants >> o & 1 == 0) {
            let block =
                self.grid.block_of_cell(self.grid.octant(v, o)).expect("the layer is exact");
            match blocks.iter_mut().find(|b| b.0 == block) {
                Some(b) => b.1 |= 1 << o,
                None => blocks.push((block, 1 << o)),
            }
        }
        let mut choices: Vec<u32> = (1..1 << blocks.len()).collect();
        choices.sort_by_key(|c| (c.count_ones(), *c));
        let is_in = |choice: u32, i: usize| choice >> i & 1 == 1;
        let with = |choice: u32| {
            let chosen = (0..blocks.len()).filter(|&i| is_in(choice, i));
            chosen.fold(octants, |bits, i| bits | blocks[i].1)
        };
        let choice = choices.into_iter().find(|&c| !is_bad(with(c))).expect("all of them");
        let chosen = (0..blocks.len()).filter(|&i| is_in(choice, i)).map(|i| blocks[i].0);
        let chosen: Vec<u32> = chosen.collect();
        for &b in &chosen {
            self.add(b);
        }
        chosen
    }

    /// Whether a square is between an exact cell and one that is not.
    pub(super) fn is_seam(&self, s: Square) -> bool {
        let [a, b] = self.grid.adjacent_cells(s);
        self.is_exact(a) != self.is_exact(b)
    }

    /// Whether a lattice edge is a side of a square of the seam.
    pub(super) fn is_on_seam(&self, e: LatticeEdge) -> bool {
        let cells = self.grid.cells_around(e);
        cells.iter().any(|&c| self.is_exact(c) != self.is_exact(cells[0]))
    }

    /// Which octants of a sample of the volume are exact, by bits.
    pub(super) fn octants(&self, v: u32) -> u8 {
        (0..8).fold(0, |bits, o| bits | u8::from(self.is_exact(self.grid.octant(v, o))) << o)
    }

    /// How the seam runs around a sample of the volume.
    pub(super) fn link(&self, v: u32) -> Link {
        link(self.octants(v))
    }
}

/// The positions in a box, the first coordinate fastest.
fn positions<R: Iterator<Item = usize> + Clone>(
    [x, y, z]: [R; 3],
) -> impl Iterator<Item = [usize; 3]> {
    z.flat_map(move |k| {
        let x = x.clone();
        y.clone().flat_map(move |j| x.clone().map(move |i| [i, j, k]))
    })
}

/// The cells of the layer around the volume.
pub(super) fn layer(grid: PaddedGrid) -> impl Iterator<Item = u32> {
    let all = positions(grid.dims.map(|d| 0..d - 1));
    all.filter(move |&p| !grid.is_cell(p)).map(move |p| grid.vertex(p))
}

/// The cycle of a seam around a sample whose octants are exact as `octants` has bits.
pub(super) fn link(octants: u8) -> Link {
    if octants == 0 || octants == 255 {
        return Link::Away;
    }
    let mut neighbours = [[u8::MAX; 2]; 6];
    let mut degree = [0usize; 6];
    for axis in 0..3u8 {
        let (b, c) = ((axis + 1) % 3, (axis + 2) % 3);
        for quadrant in 0..4u8 {
            let (sb, sc) = (quadrant & 1, quadrant >> 1);
            let low = sb << b | sc << c;
            let differs = octants >> low & 1 != octants >> (low | 1 << axis) & 1;
            if differs {
                let ends = [2 * b + sb, 2 * c + sc];
                for (d, other) in [(ends[0], ends[1]), (ends[1], ends[0])] {
                    if degree[d as usize] == 2 {
                        return Link::Pinched;
                    }
                    neighbours[d as usize][degree[d as usize]] = other;
                    degree[d as usize] += 1;
                }
            }
        }
    }
    let n = degree.iter().filter(|&&d| d > 0).count();
    let first = degree.iter().position(|&d| d > 0).expect("octants differ") as u8;
    let mut cycle = [u8::MAX; 6];
    let (mut at, mut before, mut length) = (first, u8::MAX, 0);
    loop {
        cycle[length] = at;
        length += 1;
        let [p, q] = neighbours[at as usize];
        let next = if p == before { q } else { p };
        (before, at) = (at, next);
        if at == first || length == 6 {
            break;
        }
    }
    if at == first && length == n { Link::Cycle(cycle, n as u8) } else { Link::Pinched }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_seam_around_a_sample_is_one_cycle_or_pinched() {
        for octants in 0..=255u8 {
            let l = link(octants);
            assert_eq!(l == Link::Away, octants == 0 || octants == 255);
            // The exact octants are connected by faces, and so are the others, or the seam is pinched.
            let joined = |bits: u8| {
                let first = 1 << bits.trailing_zeros();
                let mut seen: u8 = first;
                for _ in 0..8 {
                    let before = seen;
                    for o in (0..8u8).filter(|o| before >> o & 1 == 1) {
                        for a in 0..3 {
                            seen |= 1 << (o ^ 1 << a) & bits;
                        }
                    }
                }
                seen == bits
            };
            if let Link::Cycle(cycle, n) = l {
                assert!(joined(octants) && joined(!octants), "{octants:08b}");
                let mut sorted = cycle[..n as usize].to_vec();
                sorted.sort_unstable();
                sorted.dedup();
                assert!(sorted.len() == n as usize && n >= 3, "{octants:08b}");
                // Neighbours in the cycle span a square: they are not opposite.
                for i in 0..n as usize {
                    assert_ne!(cycle[i] / 2, cycle[(i + 1) % n as usize] / 2);
                }
            }
        }
        assert_eq!(link(0b1000_0001), Link::Pinched);
        assert!(matches!(link(0b0000_1111), Link::Cycle(_, 4)));
        assert!(matches!(link(0b0000_0001), Link::Cycle(_, 3)));
    }

    #[test]
    fn a_pinched_seam_is_resolved_by_the_fewest_blocks() {
        let grid = PaddedGrid { dims: [13, 13, 13], strides: [1, 13, 169] };
        // A sample in which eight blocks meet.
        let v = grid.vertex([1 + 2 * BLOCK, 1 + 2 * BLOCK, 1 + 2 * BLOCK]);
        let block = |o: u8| grid.block_of_cell(grid.octant(v, o)).expect("a cell of the volume");
        for (octants, n_added) in [([0, 7], 2), ([0, 3], 1), ([0, 1], 0)] {
            let mut region = Region::layer_exact(grid);
            octants.iter().for_each(|&o| assert!(region.add(block(o))));
            let added = region.add_fewest(v, |bits| link(bits) == Link::Pinched);
            assert_eq!(added.len(), n_added, "{octants:?}");
            assert_ne!(region.link(v), Link::Pinched);
            assert_eq!(region.blocks().len(), 2 + n_added);
        }
    }
}
