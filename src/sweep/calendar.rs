//! The samples, saddles of lattice squares and critical points that the isovalue passes, ordered by key.
//!
//! # Theory
//!
//! Between two isovalues the seam changes only where the isovalue passes a sample on it. If that sample is *regular* for the
//! field on the seam (its neighbours below it, in the cycle of the seam around it, are consecutive), the polyline of
//! the exact extraction crosses it without a change of its topology. All other events on a seam
//! (an extremum or a saddle of the field on it, a saddle inside one of its squares) are avoided: the cells around
//! become exact before the isovalue passes them (`grow`).

use std::collections::BTreeSet;

use rayon::prelude::*;

use super::region::{Link, PaddedGrid, Region, Square, link};
use crate::topology::Topology;
use crate::topology::critical::GridElement;
use crate::topology::exact::{ExactField, ORDER_BITS};

/// Everything that the isovalues of a range pass, sorted by order key. Keys are computed when needed, to save memory.
pub(super) struct Calendar<'a> {
    pub(super) field: &'a ExactField<'a>,
    samples: Vec<u32>,
    /// Squares with a saddle inside, by its key.
    squares: Vec<Square>,
    /// Squares whose four samples are equal, by the key of their corner.
    flats: Vec<Square>,
    /// Critical points of the whole volume.
    critical: Vec<(i128, GridElement)>,
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
    /// The share of a range's work between two isovalues: the mean of the shares of the range and of the samples passed.
    pub(super) fn work(&self, (low, high): (f64, f64), [from, to]: [f64; 2]) -> f64 {
        let n = |a: f64, b: f64| self.samples(Passage::between(self.field, a, b)).len() as f64;
        // Halves do not overflow.
        let share = (0.5 * to - 0.5 * from).abs() / (0.5 * high - 0.5 * low);
        0.5 * (share + n(from, to) / n(low, high).max(1.0))
    }

    /// The calendar of a range of isovalues.
    pub(super) fn new(
        field: &'a ExactField<'a>,
        topology: &Topology,
        (low, high): (f64, f64),
    ) -> Calendar<'a> {
        // Includes the next sample values beyond both ends of the range.
        let [below, above] = [f64::NEG_INFINITY, f64::INFINITY];
        let values = inner_samples(field).map(|v| field.sample(v));
        let (below, above) = values
            .map(|x| (if x <= low { x } else { below }, if x > high { x } else { above }))
            .reduce(|| (below, above), |a, b| (a.0.max(b.0), a.1.min(b.1)));
        let is_near = |v: &u32| (below..=above).contains(&field.sample(*v));
        let mut samples: Vec<u32> = inner_samples(field).filter(is_near).collect();
        // Levels are found faster than keys, and decide most comparisons.
        samples.par_sort_unstable_by(|&a, &b| {
            let by_key = || (field.key(a), a).cmp(&(field.key(b), b));
            field.level(a).cmp(&field.level(b)).then_with(by_key)
        });
        let is_flat = |s: &Square| {
            let corners = PaddedGrid::of(field).corners(*s);
            corners.iter().all(|&c| field.sample(c) == field.sample(s.corner))
        };
        let flats = samples.par_iter();
        let flats = flats.flat_map_iter(|&v| squares_from(field, v).filter(is_flat)).collect();
        let range = Passage::between(field, low, high);
        let saddle = |s: Square| {
            let key = field.face_saddle(s.corner, s.axis as usize)?.order_key();
            range.holds(key).then_some((key, s))
        };
        // Of all samples: the corner of a square whose saddle is in the range need not be.
        let squares = inner_samples(field);
        let squares = squares.flat_map_iter(|v| squares_from(field, v).filter_map(saddle));
        let mut squares: Vec<(i128, Square)> = squares.collect();
        squares.par_sort_unstable();
        let squares = squares.into_iter().map(|s| s.1).collect();
        let critical = topology.events.iter().map(|e| (e.key, e.element)).collect();
        Calendar { field, samples, squares, flats, critical }
    }

    /// The samples passed, ascending.
    pub(super) fn samples(&self, passage: Passage) -> &[u32] {
        passage.of(&self.samples, |&v| self.field.order_key(v))
    }

    /// The critical points passed, ascending.
    pub(super) fn critical(&self, passage: Passage) -> &[(i128, GridElement)] {
        passage.of(&self.critical, |c| c.0)
    }

    /// The cells with flat squares over which an isosurface of the passage jumps.
    pub(super) fn flats(&self, passage: Passage) -> impl Iterator<Item = u32> {
        let grid = PaddedGrid::of(self.field);
        let flats = passage.of(&self.flats, |s| self.field.order_key(s.corner)).iter();
        flats.flat_map(move |&s| grid.adjacent_cells(s))
    }

    /// A passage extended towards `longer`, but not beyond the next sample value.
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
    pub(super) fn blocks(&self, grid: PaddedGrid, passage: Passage) -> BTreeSet<u32> {
        let field = self.field;
        let offsets = field.cell_offsets();
        let [least, most] =
            [passage.low, passage.high].map(|key| field.level_of_key(key >> ORDER_BITS));
        let cells = inner_samples(field).filter_map(|cell| {
            // Levels are found faster than keys, and exclude most cells.
            let levels = field.levels_at(cell, offsets);
            if levels.iter().all(|&l| l < least) || levels.iter().all(|&l| l > most) {
                return None;
            }
            let block = grid.block_of_cell(cell)?;
            let keys = offsets.map(|o| field.key(cell + o));
            let (low, high) =
                keys.iter().fold((i128::MAX, i128::MIN), |(l, h), &k| (l.min(k), h.max(k)));
            passage.meets(low, high).then_some(block)
        });
        cells.collect::<Vec<u32>>().into_iter().collect()
    }

    /// Whether a sample is regular for the field on the seam, which runs around it as a cycle.
    fn is_regular(&self, v: u32, grid: PaddedGrid, cycle: &[u8]) -> bool {
        let key = self.field.key(v);
        let is_above = |d: u8| self.field.key(grid.neighbour(v, d)) > key;
        let n = cycle.len();
        (0..n).filter(|&i| is_above(cycle[i]) != is_above(cycle[(i + 1) % n])).count() == 2
    }

    /// Makes more blocks exact until the seam is a surface on which only regular samples are passed.
    pub(super) fn grow(&self, region: &mut Region, passage: Passage) {
        let mut suspects: Vec<u32> = self.samples(passage).to_vec();
        suspects.extend(region.blocks().iter().flat_map(|&b| region.grid.samples_around(b)));
        let squares: Vec<Square> = self.squares(passage).collect();
        self.grow_near(region, passage, suspects, &squares);
    }

    /// As `grow`, for a region that was complete before some blocks were added.
    pub(super) fn grow_around(&self, region: &mut Region, passage: Passage, added: &[u32]) {
        let grid = region.grid;
        let suspects = added.iter().flat_map(|&b| grid.samples_around(b)).collect();
        self.grow_near(region, passage, suspects, &self.squares_around(grid, passage, added));
    }

    /// The squares of the cells of some blocks whose saddles are passed.
    fn squares_around(&self, grid: PaddedGrid, passage: Passage, blocks: &[u32]) -> Vec<Square> {
        let passed = |s: &Square| {
            let saddle = self.field.face_saddle(s.corner, s.axis as usize);
            saddle.is_some_and(|saddle| passage.holds(saddle.order_key()))
        };
        let cells = blocks.iter().flat_map(|&b| grid.cells_of(b));
        cells.flat_map(|c| grid.squares_of(c)).map(|s| s.0).filter(passed).collect()
    }

    fn grow_near(
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
            let mut bad: Vec<u32> =
                suspects.into_par_iter().filter(|&v| is_bad(v, region.octants(v))).collect();
            bad.par_sort_unstable();
            bad.dedup();
            let open: Vec<Square> = squares.into_iter().filter(|&s| region.is_seam(s)).collect();
            let mut added: Vec<u32> = Vec::new();
            for v in bad {
                added.extend(region.add_fewest(v, |octants| is_bad(v, octants)));
            }
            for s in open {
                let adjacent =
                    grid.adjacent_cells(s).into_iter().filter_map(|c| grid.block_of_cell(c));
                added.extend(adjacent.filter(|&b| region.add(b)));
            }
            if added.is_empty() {
                return;
            }
            squares = self.squares_around(grid, passage, &added);
            suspects = added.into_iter().flat_map(|b| grid.samples_around(b)).collect();
        }
    }
}

/// The samples of the volume itself, in their order.
pub(super) fn inner_samples<'f>(field: &'f ExactField) -> impl ParallelIterator<Item = u32> + 'f {
    let [nx, ny, nz] = field.dims().map(|n| n as u32);
    let [_, sy, sz] = field.strides();
    let rows = (1..nz - 1).into_par_iter();
    let rows = rows.flat_map_iter(move |k| (1..ny - 1).map(move |j| j * sy + k * sz));
    rows.flat_map_iter(move |row| row + 1..row + nx - 1)
}

/// The squares of which a sample is the lowest corner.
fn squares_from<'f>(field: &'f ExactField, v: u32) -> impl Iterator<Item = Square> + 'f {
    let last = move |axis: usize| field.position(v)[axis] + 3 == field.dims()[axis] as i64;
    (0..3u8).map(move |axis| Square { corner: v, axis }).filter(move |s| {
        let [i, j] = [1, 2].map(|n| (s.axis as usize + n) % 3);
        !last(i) && !last(j)
    })
}
