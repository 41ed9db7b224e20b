//! How long components go without a mesh.

use super::toil::{FAR, Toil};

/// How long a component has gone without a mesh. Where events follow each other closely no arc is worth a
/// mesh of its own; but once the isosurface has moved far enough through all of them, it is time for one
/// that goes on through the next.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Idle {
    /// How far the isosurface has moved meanwhile, at the typical slope, voxels.
    moved: f64,
    /// How far it is to move before a mesh is begun again.
    wanted: f64,
    /// Whether it had one.
    had_mesh: bool,
}

impl Idle {
    /// From where nothing came before. Noise has thousands of parts that come and go within a voxel.
    pub(super) const NONE: Idle = Idle { moved: 0.0, wanted: FAR as f64, had_mesh: false };

    /// From where a mesh ended.
    pub(super) fn after(toil: Toil) -> Idle {
        Idle { moved: 0.0, wanted: f64::from(toil.next_wait()), had_mesh: true }
    }

    /// What a mesh begins with that is made then.
    pub(super) fn toil(self) -> Toil {
        Toil::after_waiting(if self.is_over() { self.wanted as f32 } else { 0.0 })
    }

    /// Whether there was a mesh before.
    pub(super) fn had_mesh(self) -> bool {
        self.had_mesh
    }

    /// After the isosurface has moved so far, in voxels, without a mesh.
    pub(super) fn go_on(self, motion: f64) -> Idle {
        Idle { moved: self.moved + motion, ..self }
    }

    /// Whether it is time for a mesh.
    pub(super) fn is_over(self) -> bool {
        self.moved >= self.wanted
    }
}

/// What counts of several components that meet: the longest wait, of those that have had a mesh if there are
/// any. The parts that noise makes and joins to a component know nothing of the meshes it has lost.
pub(super) fn joined(idle: impl Iterator<Item = Idle>) -> Idle {
    let by_wait = |a: &Idle, b: &Idle| {
        let (x, y) = (a.wanted - a.moved, b.wanted - b.moved);
        a.had_mesh.cmp(&b.had_mesh).then(x.total_cmp(&y))
    };
    idle.max_by(by_wait).unwrap_or(Idle::NONE)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mesh_that_came_far_is_followed_by_another_at_once_and_others_ever_later() {
        let mut toil = Idle::NONE.toil();
        let mut waits = Vec::new();
        for _ in 0..3 {
            let idle = Idle::after(toil);
            assert!(!idle.is_over());
            waits.push(idle.wanted);
            toil = idle.go_on(idle.wanted).toil();
        }
        assert!(waits.windows(2).all(|w| w[1] > 2.0 * w[0]), "{waits:?}");
        toil.add_step(1.0);
        assert!(Idle::after(toil).is_over());
    }

    #[test]
    fn parts_that_never_had_a_mesh_do_not_shorten_the_wait_of_those_that_did() {
        let lost = Idle::after(Idle::NONE.go_on(FAR.into()).toil());
        let parts = [0.9, 0.3].map(|moved| Idle::NONE.go_on(moved));
        assert_eq!(joined(parts.into_iter()), parts[1]);
        assert_eq!(joined(parts.into_iter().chain([lost])), lost);
        assert_eq!(joined(std::iter::empty()), Idle::NONE);
    }
}
