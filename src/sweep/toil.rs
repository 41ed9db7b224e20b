//! How much is done to a mesh for how far it comes.
//!
//! Where noise crowds events, a mesh is operated on all the time, each time at the cost of a look at all of
//! it, and comes no farther. It is given up, and the exact extraction shows until a stretch comes over
//! which another is worth making.

/// Operations that any mesh may take, and those for each voxel that it moves.
const AHEAD: f32 = 12.0;
const PER_VOXEL: f32 = 24.0;

/// A mesh that has moved so far, in voxels, was worth making.
pub(super) const FAR: f32 = 1.0;

/// How far the isosurface moves, in voxels, before there is another mesh after one that was not: at least and at
/// most.
const LEAST_WAIT: f32 = 0.25;
const MOST_WAIT: f32 = 64.0;

/// How much longer each time.
const GROWTH: f32 = 4.0;

/// What has been done to a mesh since it was made.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Toil {
    /// Surgeries, repairs and extractions afresh.
    operations: u32,
    /// How far most of it has moved, voxels.
    moved: f32,
    /// How far the isosurface had moved without a mesh before this one was begun, voxels.
    waited: f32,
}

impl Toil {
    /// Of a mesh that is begun after the isosurface has moved so far without one, voxels.
    pub(super) fn after_waiting(waited: f32) -> Toil {
        Toil { waited, ..Toil::default() }
    }

    /// How far the isosurface is to move without a mesh, in voxels, once this one is given up: not far where
    /// it has come far, else farther each time.
    pub(super) fn next_wait(&self) -> f32 {
        if self.moved >= FAR { 0.0 } else { (GROWTH * self.waited).clamp(LEAST_WAIT, MOST_WAIT) }
    }

    /// After an operation on the meshes of some components.
    pub(super) fn of_operation(before: impl Iterator<Item = Toil>) -> Toil {
        let mut most = before.fold(Toil::default(), |a, b| Toil {
            operations: a.operations.max(b.operations),
            moved: a.moved.max(b.moved),
            waited: a.waited.max(b.waited),
        });
        most.add_operation();
        most
    }

    pub(super) fn add_operation(&mut self) {
        self.operations += 1;
    }

    /// A step in which most of the mesh moved so far, voxels.
    pub(super) fn add_step(&mut self, moved: f32) {
        self.moved += moved;
    }

    /// How far most of the mesh has moved, voxels.
    pub(super) fn moved(&self) -> f32 {
        self.moved
    }

    /// Whether the mesh should be given up.
    pub(super) fn is_too_much(&self) -> bool {
        self.operations as f32 > AHEAD + PER_VOXEL * self.moved
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mesh_that_moves_may_be_operated_on_more_often() {
        let mut toil = Toil::default();
        let mut n = 0;
        while !toil.is_too_much() {
            toil = Toil::of_operation([toil, Toil::default()].into_iter());
            n += 1;
        }
        assert_eq!(n, AHEAD as u32 + 1);
        toil.add_step(1.0);
        assert!(!toil.is_too_much());
        (0..PER_VOXEL as u32).for_each(|_| toil.add_operation());
        assert!(toil.is_too_much());
    }
}
