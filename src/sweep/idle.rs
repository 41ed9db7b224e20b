//! How long components go without a mesh.

use super::start::FRESH_MOTION;
use super::toil::Toil;

/// How long a component has gone without a mesh. Where events follow each other closely no arc is worth a
/// mesh of its own; but once the isosurface has moved far enough through all of them, it is time for one
/// that goes on through the next.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Idle {
    /// How far the isosurface has moved meanwhile, at the typical slope, voxels.
    moved: f64,
    /// How far it is to move before a mesh is begun again.
    wanted: f64,
}

impl Idle {
    /// From where nothing came before.
    pub(super) const NONE: Idle = Idle { moved: 0.0, wanted: FRESH_MOTION };

    /// From where a mesh ended.
    pub(super) fn after(toil: Toil) -> Idle {
        Idle { moved: 0.0, wanted: f64::from(toil.next_wait()) }
    }

    /// What a mesh begins with that is made then.
    pub(super) fn toil(self) -> Toil {
        Toil::after_waiting(if self.is_over() { self.wanted as f32 } else { 0.0 })
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

/// Of what is known of several components that meet: that of the one that has gone longest without a mesh.
pub(super) fn longest(idle: impl Iterator<Item = Idle>) -> Idle {
    idle.max_by(|a, b| a.moved.total_cmp(&b.moved)).unwrap_or(Idle::NONE)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mesh_that_came_far_is_followed_by_another_at_once_and_others_ever_later() {
        let mut toil = Idle::NONE.toil();
        let mut waits = Vec::new();
        for _ in 0..4 {
            let idle = Idle::after(toil);
            assert!(!idle.is_over());
            waits.push(idle.wanted);
            toil = idle.go_on(idle.wanted).toil();
        }
        assert!(waits.windows(2).all(|w| w[1] == 2.0 * w[0]), "{waits:?}");
        toil.add_step(1.0);
        assert!(Idle::after(toil).is_over());
    }

    #[test]
    fn of_components_that_meet_the_longest_wait_counts() {
        let waits = [0.1, 0.3, 0.2].map(|moved| Idle::NONE.go_on(moved));
        assert_eq!(longest(waits.into_iter()), waits[1]);
        assert_eq!(longest(std::iter::empty()), Idle::NONE);
    }
}
