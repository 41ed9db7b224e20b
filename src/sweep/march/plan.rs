//! Which blocks are exact in a step.

use rayon::prelude::*;

use super::state::{HOLD, March, State, sorted};
use crate::mesh::Vertex;
use crate::sweep::calendar::Passage;
use crate::sweep::region::Region;

/// Boxes of so many blocks along a side are exact as a whole where more than this share of the blocks in them is that the
/// surface is in.
const BOX: usize = 8;
const CROWDED: f64 = 0.6;

/// Blocks that are exact stay so where something critical comes within so many steps; and where the sample value that
/// comes next does within twice as many, and they have flat squares of it: there the isosurface jumps.
const LOOK_AHEAD: f64 = 2.0;

impl March<'_, '_> {
    /// Which blocks are exact in a step: those with something critical in or near it, those for which there was a reason
    /// shortly before, and what the seam asks for.
    pub(super) fn plan(&mut self, state: &mut State, [from, to]: [f64; 2]) -> Region {
        let margin = to - from;
        let passage = Passage::between(self.exact(), from - 0.1 * margin, to + 0.1 * margin);
        let busy = self.busy(passage);
        let ahead = |steps: f64| Passage::between(self.exact(), from, to + steps * margin);
        let now = Passage::between(self.exact(), from, to);
        let mut soon = self.busy(ahead(LOOK_AHEAD));
        let next_value = self.calendar.up_to_next_value(now, ahead(2.0 * LOOK_AHEAD));
        soon.extend(self.calendar.flats(next_value));
        for &b in &busy {
            let reason = state.reasons.entry(b).or_default();
            reason.until = reason.until.max(self.step + HOLD);
        }
        let mut region = Region::open(self.grid);
        for &b in soon.iter().filter(|b| state.region.holds(**b)) {
            region.add(b);
        }
        for (b, _) in sorted(state.reasons.clone()).into_iter().filter(|r| r.1.until >= self.step) {
            region.add(b);
        }
        let n_reasons = region.blocks().len();
        self.calendar.close(&mut region, now);
        let crowded = self.crowded(state, &region);
        for &b in &crowded {
            region.add(b);
        }
        self.calendar.close_around(&mut region, now, &crowded);
        log::debug!(
            "{from} to {to}: {} blocks busy, {n_reasons} with reasons, {} crowded, {} exact; {} faces tracked",
            busy.len(),
            crowded.len(),
            region.blocks().len(),
            state.tracked.mesh.n_faces()
        );
        region
    }

    /// The blocks that are to be exact because most around them are: what is tracked there would be seam all over, which
    /// costs most and gains least.
    pub(super) fn crowded(&self, state: &State, region: &Region) -> Vec<u32> {
        // What is exact now may be tracked next: its blocks hold no vertices but those of the seam.
        let mut others = self.tracked_blocks(state);
        others.extend(state.region.blocks());
        others.sort_unstable();
        others.dedup();
        others.retain(|&b| !region.holds(b));
        let sides = self.grid.blocks().map(|n| n.div_ceil(BOX));
        let box_of = |b: u32| {
            let [x, y, z] = self.grid.block_position(b).map(|x| x / BOX);
            x + sides[0] * (y + sides[1] * z)
        };
        // By box: how many blocks are exact, and in how many others the surface is, or was.
        let mut boxes = vec![[0u32; 2]; sides.iter().product()];
        region.blocks().iter().for_each(|&b| boxes[box_of(b)][0] += 1);
        others.iter().for_each(|&b| boxes[box_of(b)][1] += 1);
        let is_crowded = |b: &u32| {
            let [exact, other] = boxes[box_of(*b)].map(f64::from);
            exact > CROWDED * (exact + other)
        };
        others.retain(is_crowded);
        others
    }

    /// The blocks that hold vertices of the mesh, ascending.
    pub(super) fn tracked_blocks(&self, state: &State) -> Vec<u32> {
        let mesh = &state.tracked.mesh;
        let vertices = (0..mesh.vertex_slots() as u32).into_par_iter().map(Vertex);
        let mut blocks: Vec<u32> = vertices
            .filter(|&v| mesh.has_vertex(v))
            .map(|v| self.block_at(mesh.position(v)))
            .collect();
        blocks.par_sort_unstable();
        blocks.dedup();
        blocks
    }

    /// The blocks near something critical in a passage, ascending.
    pub(super) fn busy(&self, passage: Passage) -> Vec<u32> {
        let places = self.calendar.critical(passage);
        let cells = places.par_iter().flat_map_iter(|&(_, place)| self.grid.cells_at(place));
        let mut blocks: Vec<u32> = cells.filter_map(|cell| self.grid.block_of_cell(cell)).collect();
        blocks.par_sort_unstable();
        blocks.dedup();
        blocks
    }
}
