//! Plans which blocks are exact in a step.

use rayon::prelude::*;

use super::state::{MIN_EXACT_STEPS, March, State};
use crate::sweep::calendar::Passage;
use crate::sweep::region::Region;

/// A box of this many blocks along each side becomes exact as a whole if more than [`CROWDED_SHARE`] of its blocks with surface
/// are exact.
const BOX_BLOCKS: usize = 8;
const CROWDED_SHARE: f64 = 0.6;

/// An exact block stays exact if a critical point follows within this many step lengths, or if the next sample value
/// follows within twice as many and the block has flat squares of it, over which the isosurface jumps.
const LOOK_AHEAD_STEPS: f64 = 2.0;

impl March<'_, '_> {
    /// The region of a step: blocks near critical points, blocks that must stay exact, and those that the seam needs.
    pub(super) fn plan(&mut self, state: &mut State, [from, to]: [f64; 2]) -> Region {
        let margin = to - from;
        let passage = Passage::between(self.exact(), from - 0.1 * margin, to + 0.1 * margin);
        let busy = self.busy(passage);
        let ahead = |steps: f64| Passage::between(self.exact(), from, to + steps * margin);
        let now = Passage::between(self.exact(), from, to);
        let mut soon = self.busy(ahead(LOOK_AHEAD_STEPS));
        let next_value = self.calendar.up_to_next_value(now, ahead(2.0 * LOOK_AHEAD_STEPS));
        let flats = self.calendar.flats(next_value).filter(|&cell| state.region.is_exact(cell));
        soon.extend(flats.filter_map(|cell| self.grid.block_of_cell(cell)));
        for &b in &busy {
            let entry = state.back_offs.entry(b).or_default();
            entry.until = entry.until.max(self.step + MIN_EXACT_STEPS);
        }
        let mut region = Region::layer_exact(self.grid);
        for &b in soon.iter().filter(|b| state.region.holds(**b)) {
            region.add(b);
        }
        let held = state.back_offs.iter().filter(|(_, back_off)| back_off.until >= self.step);
        held.for_each(|(&b, _)| {
            region.add(b);
        });
        let n_held = region.blocks().len();
        self.calendar.grow(&mut region, now);
        let crowded = self.crowded(state, &region);
        for &b in &crowded {
            region.add(b);
        }
        self.calendar.grow_around(&mut region, now, &crowded);
        log::debug!(
            "{from} to {to}: {} blocks busy, {n_held} held exact, {} crowded, {} exact; {} faces tracked",
            busy.len(),
            crowded.len(),
            region.blocks().len(),
            state.tracked.mesh.n_faces()
        );
        region
    }

    /// Blocks that become exact because most blocks around them are: tracked mesh there would be mostly seam, which costs
    /// much and saves few triangles.
    pub(super) fn crowded(&self, state: &State, region: &Region) -> Vec<u32> {
        // Blocks that are exact now may be released: they contain surface, but only vertices of the seam.
        let mut others = self.tracked_blocks(state);
        others.extend(state.region.blocks());
        others.sort_unstable();
        others.dedup();
        others.retain(|&b| !region.holds(b));
        let sides = self.grid.blocks().map(|n| n.div_ceil(BOX_BLOCKS));
        let box_of = |b: u32| {
            let [x, y, z] = self.grid.block_position(b).map(|x| x / BOX_BLOCKS);
            x + sides[0] * (y + sides[1] * z)
        };
        // By box: how many blocks are exact, and in how many others the surface is, or was.
        let mut boxes = vec![[0u32; 2]; sides.iter().product()];
        region.blocks().iter().for_each(|&b| boxes[box_of(b)][0] += 1);
        others.iter().for_each(|&b| boxes[box_of(b)][1] += 1);
        let is_crowded = |b: &u32| {
            let [exact, other] = boxes[box_of(*b)].map(f64::from);
            exact > CROWDED_SHARE * (exact + other)
        };
        others.retain(is_crowded);
        others
    }

    /// The blocks with vertices of the mesh, ascending.
    pub(super) fn tracked_blocks(&self, state: &State) -> Vec<u32> {
        let vertices = state.tracked.mesh.vertices();
        let marked = self.grid.marked(vertices.map(|v| state.places.block(v)), 0);
        (0..).zip(marked).filter(|b| b.1).map(|b| b.0).collect()
    }

    /// The blocks near critical points of a passage, ascending.
    pub(super) fn busy(&self, passage: Passage) -> Vec<u32> {
        let places = self.calendar.critical(passage);
        let cells = places.par_iter().flat_map_iter(|&(_, place)| self.grid.cells_at(place));
        let mut blocks: Vec<u32> = cells.filter_map(|cell| self.grid.block_of_cell(cell)).collect();
        blocks.par_sort_unstable();
        blocks.dedup();
        blocks
    }
}
