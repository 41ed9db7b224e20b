//! What the isovalue passes and when: samples, saddles of lattice squares, critical points.
//!
//! # Theory
//!
//! Between two isovalues the seam changes only where a sample on it is passed. Where that sample is *regular* for the
//! field on the seam (its neighbours below it, in the cycle of the seam around it, are one run), the polyline of
//! the exact extraction goes over it without changing how it is joined. Everything else that may happen on a seam
//! (an extremum or a saddle of the field on it, a saddle inside one of its squares) is kept off it: the cells around
//! become exact before the isovalue gets there (`close`).

use std::collections::BTreeSet;

use rayon::prelude::*;

use super::region::{Grid, Link, Region, Square, link};
use crate::topology::Topology;
use crate::topology::critical::Place;
use crate::topology::exact::{ExactField, ORDER_BITS};

/// All that the isovalues of a range pass, by order key: these follow from what is passed, as they take more memory.
pub(super) struct Calendar<'a> {
    pub(super) field: &'a ExactField<'a>,
    samples: Vec<u32>,
    /// Those with a saddle inside, by its key.
    squares: Vec<Square>,
    /// Those whose samples are equal, by the key of their corner.
    flats: Vec<Square>,
    /// Of the whole volume.
    critical: Vec<(i128, Place)>,
}

/// The order keys between two isovalues: above the first, not above the second.
#[derive(Clone, Copy, Debug)]
pub(super) struct Passage {
    low: i128,
    high: i128,
}

impl Passage {
    /// Between two isovalues, in either order.
    pub(super) fn between(field: &ExactField, a: f64, b: f64) -> Passage {
        let key = |c: f64| field.isovalue_key(c) << ORDER_BITS;
        Passage { low: key(a.min(b)), high: key(a.max(b)) }
    }

    fn holds(&self, key: i128) -> bool {
        self.low < key && key <= self.high
    }

    /// Whether an isosurface of the passage, its ends among them, meets what has samples of these keys.
    pub(super) fn meets(&self, low: i128, high: i128) -> bool {
        low <= self.high >> ORDER_BITS && high > self.low >> ORDER_BITS
    }

    fn of<'t, T>(&self, sorted: &'t [T], key: impl Fn(&T) -> i128) -> &'t [T] {
        let first = sorted.partition_point(|x| key(x) <= self.low);
        let end = sorted.partition_point(|x| key(x) <= self.high);
        &sorted[first..end]
    }
}

impl<'a> Calendar<'a> {
    /// Which share of the work of a range is between two isovalues in it: the way along the range, and the samples passed,
    /// half each.
    pub(super) fn work(&self, (low, high): (f64, f64), [from, to]: [f64; 2]) -> f64 {
        let n = |a: f64, b: f64| self.samples(Passage::between(self.field, a, b)).len() as f64;
        // Halves do not overflow.
        let way = (0.5 * to - 0.5 * from).abs() / (0.5 * high - 0.5 * low);
        0.5 * (way + n(from, to) / n(low, high).max(1.0))
    }

    pub(super) fn new(
        field: &'a ExactField<'a>,
        topology: &Topology,
        (low, high): (f64, f64),
    ) -> Calendar<'a> {
        let range = Passage::between(field, low, high);
        let [nx, ny, nz] = field.dims();
        let [_, sy, sz] = field.strides();
        let rows = (1..nz as u32 - 1).into_par_iter();
        let rows = rows.flat_map_iter(|k| (1..ny as u32 - 1).map(move |j| j * sy + k * sz));
        let vertices = rows.flat_map_iter(|row| row + 1..row + nx as u32 - 1);
        // The next values beyond the range's ends are looked at as well.
        let values = vertices.clone().map(|v| field.sample(v));
        let [below, above] = [f64::NEG_INFINITY, f64::INFINITY];
        let (below, above) = values
            .map(|x| (if x <= low { x } else { below }, if x > high { x } else { above }))
            .reduce(|| (below, above), |a, b| (a.0.max(b.0), a.1.min(b.1)));
        let is_near = |v: u32| (below..=above).contains(&field.sample(v));
        let mut samples: Vec<u32> = vertices.clone().filter(|&v| is_near(v)).collect();
        samples.par_sort_unstable_by_key(|&v| (field.key(v), v));
        let grid = Grid::of(field);
        let squares_from = |v: u32| {
            let last = move |axis: usize| field.position(v)[axis] + 3 == field.dims()[axis] as i64;
            (0..3u8).map(move |axis| Square { corner: v, axis }).filter(move |s| {
                let [i, j] = [1, 2].map(|n| (s.axis as usize + n) % 3);
                !last(i) && !last(j)
            })
        };
        let is_flat = |s: &Square| {
            grid.corners(*s).map(|c| field.sample(c) == field.sample(s.corner)) == [true; 4]
        };
        let flats =
            samples.par_iter().flat_map_iter(|&v| squares_from(v).filter(is_flat)).collect();
        let saddle = |s: Square| {
            let key = field.face_saddle(s.corner, s.axis as usize)?.order_key();
            range.holds(key).then_some((key, s))
        };
        // The corner of a square whose saddle is in the range need not be.
        let mut squares: Vec<(i128, Square)> =
            vertices.flat_map_iter(|v| squares_from(v).filter_map(saddle)).collect();
        squares.par_sort_unstable();
        let squares = squares.into_iter().map(|s| s.1).collect();
        let critical = topology.events.iter().map(|e| (e.key, e.place)).collect();
        Calendar { field, samples, squares, flats, critical }
    }

    /// The samples passed, ascending.
    pub(super) fn samples(&self, passage: Passage) -> &[u32] {
        passage.of(&self.samples, |&v| self.field.order_key(v))
    }

    /// The critical points passed, ascending.
    pub(super) fn critical(&self, passage: Passage) -> &[(i128, Place)] {
        passage.of(&self.critical, |c| c.0)
    }

    /// The blocks with flat squares over which an isosurface of the passage jumps.
    pub(super) fn flats(&self, passage: Passage) -> impl Iterator<Item = u32> {
        let grid = Grid::of(self.field);
        let flats = passage.of(&self.flats, |s| self.field.order_key(s.corner)).iter();
        let beside = flats.flat_map(move |&s| grid.cells_beside(s));
        beside.filter_map(move |cell| grid.block_of_cell(cell))
    }

    /// A passage made longer at its end, but not beyond the sample value that comes there next.
    pub(super) fn up_to_next_value(&self, passage: Passage, longer: Passage) -> Passage {
        let key = |v: u32| self.field.order_key(v);
        let above = self.samples.partition_point(|&v| key(v) <= passage.high);
        let high = self.samples.get(above).map_or(passage.high, |&next| {
            let equal = |&v: &u32| self.field.sample(v) <= self.field.sample(next);
            key(self.samples[self.samples.partition_point(equal) - 1])
        });
        let below = self.samples.partition_point(|&v| key(v) <= passage.low);
        let low = below.checked_sub(1).map_or(passage.low, |last| {
            let less = |&v: &u32| self.field.sample(v) < self.field.sample(self.samples[last]);
            key(self.samples[self.samples.partition_point(less)]) - 1
        });
        Passage { low: longer.low.max(low), high: longer.high.min(high) }
    }

    fn squares(&self, passage: Passage) -> impl Iterator<Item = Square> {
        let key = |s: &Square| {
            let saddle = self.field.face_saddle(s.corner, s.axis as usize);
            saddle.expect("one inside").order_key()
        };
        passage.of(&self.squares, key).iter().copied()
    }

    /// The blocks that isosurfaces of a passage meet, its ends among them.
    pub(super) fn blocks(&self, grid: Grid, passage: Passage) -> BTreeSet<u32> {
        let field = self.field;
        let n = field.n_vertices() as u32;
        let cells = (0..n).into_par_iter().with_min_len(4096).filter_map(|cell| {
            let block = grid.block_of_cell(cell)?;
            let keys = field.cell_offsets().map(|o| field.key(cell + o));
            let (low, high) =
                keys.iter().fold((i128::MAX, i128::MIN), |(l, h), &k| (l.min(k), h.max(k)));
            passage.meets(low, high).then_some(block)
        });
        cells.collect::<Vec<u32>>().into_iter().collect()
    }

    /// Whether a sample is regular for the field on the seam, which runs around it as a cycle.
    fn is_regular(&self, v: u32, grid: Grid, cycle: &[u8]) -> bool {
        let key = self.field.key(v);
        let is_above = |d: u8| self.field.key(grid.beside(v, d)) > key;
        let n = cycle.len();
        (0..n).filter(|&i| is_above(cycle[i]) != is_above(cycle[(i + 1) % n])).count() == 2
    }

    /// Makes more blocks exact until the seam is a surface on which only regular samples are passed.
    pub(super) fn close(&self, region: &mut Region, passage: Passage) {
        let mut suspects: Vec<u32> = self.samples(passage).to_vec();
        suspects.extend(region.blocks().iter().flat_map(|&b| region.grid.samples_around(b)));
        let squares: Vec<Square> = self.squares(passage).collect();
        self.close_near(region, passage, suspects, &squares);
    }

    /// The same for a region that needed no more blocks before some were added.
    pub(super) fn close_around(&self, region: &mut Region, passage: Passage, added: &[u32]) {
        let grid = region.grid;
        let suspects = added.iter().flat_map(|&b| grid.samples_around(b)).collect();
        self.close_near(region, passage, suspects, &self.squares_around(grid, passage, added));
    }

    /// The squares beside cells of some blocks whose saddles are passed.
    fn squares_around(&self, grid: Grid, passage: Passage, blocks: &[u32]) -> Vec<Square> {
        let passed = |s: &Square| {
            let saddle = self.field.face_saddle(s.corner, s.axis as usize);
            saddle.is_some_and(|saddle| passage.holds(saddle.order_key()))
        };
        let cells = blocks.iter().flat_map(|&b| grid.cells_of(b));
        cells.flat_map(|c| grid.squares_of(c)).map(|s| s.0).filter(passed).collect()
    }

    fn close_near(
        &self,
        region: &mut Region,
        passage: Passage,
        mut suspects: Vec<u32>,
        squares: &[Square],
    ) {
        let grid = region.grid;
        let is_bad = |v: u32, octants: u8| match link(octants) {
            Link::Away => false,
            Link::Pinched => true,
            Link::Cycle(cycle, n) => {
                passage.holds(self.field.order_key(v))
                    && !self.is_regular(v, grid, &cycle[..n as usize])
            }
        };
        let mut squares = squares.to_vec();
        loop {
            suspects.par_sort_unstable();
            suspects.dedup();
            let bad: Vec<u32> =
                suspects.par_iter().copied().filter(|&v| is_bad(v, region.octants(v))).collect();
            let open: Vec<Square> = squares.into_iter().filter(|&s| region.is_seam(s)).collect();
            let mut added: Vec<u32> = Vec::new();
            for v in bad {
                added.extend(region.mend(v, |octants| is_bad(v, octants)));
            }
            for s in open {
                let beside = grid.cells_beside(s).into_iter().filter_map(|c| grid.block_of_cell(c));
                added.extend(beside.filter(|&b| region.add(b)));
            }
            if added.is_empty() {
                return;
            }
            squares = self.squares_around(grid, passage, &added);
            suspects = added.into_iter().flat_map(|b| grid.samples_around(b)).collect();
        }
    }
}
