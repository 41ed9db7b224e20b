//! Undo and redo of views: one entry per view that came to rest, not per frame of a drag.

use crate::render::{Camera, View};

/// Seconds without a change after which a view becomes an entry of the history.
pub(super) const REST_SECONDS: f64 = 0.35;

/// Maximum number of entries.
const MAX_ENTRIES: usize = 200;

/// The part of a view that the history restores.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Viewpoint {
    camera: Camera,
    look_at: Option<[f64; 3]>,
}

impl Viewpoint {
    fn of(view: &View) -> Self {
        Viewpoint { camera: view.camera, look_at: view.look_at }
    }
}

/// Previous and undone views.
#[derive(Clone, Debug, Default)]
pub(super) struct History {
    undo: Vec<Viewpoint>,
    redo: Vec<Viewpoint>,
    /// The last view that came to rest.
    rested: Option<Viewpoint>,
    /// The view of the last frame, and the time, seconds, since which it has not changed.
    last: Option<(Viewpoint, f64)>,
}

impl History {
    /// Observes the view of a frame; a view does not rest during a drag. Returns whether it has yet to come to rest.
    pub(super) fn observe(&mut self, view: &View, time: f64, is_dragging: bool) -> bool {
        let now = Viewpoint::of(view);
        let since = match self.last {
            Some((last, since)) if last == now && !is_dragging => since,
            _ => time,
        };
        self.last = Some((now, since));
        let rested = *self.rested.get_or_insert(now);
        if rested == now {
            return false;
        }
        if time - since < REST_SECONDS {
            return true;
        }
        self.push_undo(rested);
        self.redo.clear();
        self.rested = Some(now);
        false
    }

    /// Lets the next view replace the current one without an entry.
    pub(super) fn ignore_next_change(&mut self) {
        self.rested = None;
    }

    fn push_undo(&mut self, viewpoint: Viewpoint) {
        if self.undo.len() == MAX_ENTRIES {
            self.undo.remove(0);
        }
        self.undo.push(viewpoint);
    }

    /// Returns to the previous view; `false` if there is none.
    pub(super) fn undo(&mut self, view: &mut View) -> bool {
        let now = Viewpoint::of(view);
        // A change that has not come to rest is undone alone.
        let moving = self.rested.filter(|&rested| rested != now);
        let Some(previous) = moving.or_else(|| self.undo.pop()) else { return false };
        self.redo.push(now);
        self.restore(previous, view);
        true
    }

    /// Returns to the last undone view; `false` if there is none.
    pub(super) fn redo(&mut self, view: &mut View) -> bool {
        let Some(next) = self.redo.pop() else { return false };
        self.push_undo(Viewpoint::of(view));
        self.restore(next, view);
        true
    }

    fn restore(&mut self, viewpoint: Viewpoint, view: &mut View) {
        (view.camera, view.look_at) = (viewpoint.camera, viewpoint.look_at);
        self.rested = Some(viewpoint);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn turn(view: &mut View, azimuth: f64) {
        view.camera.azimuth = azimuth;
    }

    #[test]
    fn undo_and_redo_go_through_the_views_that_came_to_rest() {
        let (mut history, mut view) = (History::default(), View::default());
        turn(&mut view, 0.0);
        assert!(!history.observe(&view, 0.0, false));
        // A drag of many frames is one entry; the view does not rest during the drag.
        for step in 1..10 {
            turn(&mut view, f64::from(step));
            assert!(history.observe(&view, 0.1 * f64::from(step), true));
        }
        assert!(history.observe(&view, 5.0, true) && history.observe(&view, 5.2, false));
        assert!(!history.observe(&view, 5.0 + 2.0 * REST_SECONDS, false));
        turn(&mut view, 50.0);
        assert!(history.observe(&view, 10.0, false));
        // This change has not come to rest.
        assert!(history.undo(&mut view) && view.camera.azimuth == 9.0);
        assert!(history.undo(&mut view) && view.camera.azimuth == 0.0);
        assert!(!history.undo(&mut view));
        assert!(history.redo(&mut view) && view.camera.azimuth == 9.0);
        assert!(history.redo(&mut view) && view.camera.azimuth == 50.0);
        assert!(!history.redo(&mut view));
        // A new change clears the redo stack.
        assert!(history.undo(&mut view));
        turn(&mut view, 70.0);
        history.observe(&view, 20.0, false);
        assert!(!history.observe(&view, 20.0 + REST_SECONDS, false));
        assert!(!history.redo(&mut view));
        assert!(history.undo(&mut view) && view.camera.azimuth == 9.0);
    }
}
