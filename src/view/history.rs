//! Views that one can go back to: where one came to rest, not every step of the hand.

use crate::render::{Camera, View};

/// How long a view stays the same, seconds, before it is one to come back to.
pub(super) const REST: f64 = 0.35;

/// Most views that are kept.
const MOST: usize = 200;

/// From where and at what one looks.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Sight {
    camera: Camera,
    look_at: Option<[f64; 3]>,
}

impl Sight {
    fn of(view: &View) -> Self {
        Sight { camera: view.camera, look_at: view.look_at }
    }

    fn show(self, view: &mut View) {
        (view.camera, view.look_at) = (self.camera, self.look_at);
    }
}

/// Views before and after the present one.
#[derive(Clone, Debug, Default)]
pub(super) struct History {
    past: Vec<Sight>,
    future: Vec<Sight>,
    /// The last view that rested.
    rested: Option<Sight>,
    /// The view of the last frame, and since when it is that, seconds.
    seen: Option<(Sight, f64)>,
}

impl History {
    /// Looks at the view of a frame; `is_held` while the hand has hold of it. Whether it is yet to rest.
    pub(super) fn watch(&mut self, view: &View, time: f64, is_held: bool) -> bool {
        let now = Sight::of(view);
        let since = match self.seen {
            Some((seen, since)) if seen == now && !is_held => since,
            _ => time,
        };
        self.seen = Some((now, since));
        let rested = *self.rested.get_or_insert(now);
        if rested == now {
            return false;
        }
        if time - since < REST {
            return true;
        }
        self.keep(rested);
        self.future.clear();
        self.rested = Some(now);
        false
    }

    /// Takes whatever is seen next for a view that rests: what was seen before it is nothing to come back to.
    pub(super) fn settle(&mut self) {
        self.rested = None;
    }

    fn keep(&mut self, sight: Sight) {
        if self.past.len() == MOST {
            self.past.remove(0);
        }
        self.past.push(sight);
    }

    /// Goes back to the view before; whether there is one.
    pub(super) fn undo(&mut self, view: &mut View) -> bool {
        let now = Sight::of(view);
        // On the way to another view one goes back to where that began.
        let before = self.rested.filter(|&rested| rested != now).or_else(|| self.past.pop());
        self.go(before, view, |history| history.future.push(now))
    }

    /// Goes on to the view that was gone back from; whether there is one.
    pub(super) fn redo(&mut self, view: &mut View) -> bool {
        let now = Sight::of(view);
        let after = self.future.pop();
        self.go(after, view, |history| history.keep(now))
    }

    fn go(&mut self, to: Option<Sight>, view: &mut View, leave: impl FnOnce(&mut Self)) -> bool {
        let Some(to) = to else { return false };
        leave(self);
        to.show(view);
        self.rested = Some(to);
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn turn(view: &mut View, azimuth: f64) {
        view.camera.azimuth = azimuth;
    }

    #[test]
    fn one_goes_back_to_where_one_rested_and_on_again() {
        let (mut history, mut view) = (History::default(), View::default());
        turn(&mut view, 0.0);
        assert!(!history.watch(&view, 0.0, false));
        // A drag of many steps is one view; while the hand holds it, it does not rest.
        for step in 1..10 {
            turn(&mut view, f64::from(step));
            assert!(history.watch(&view, 0.1 * f64::from(step), true));
        }
        assert!(history.watch(&view, 5.0, true) && history.watch(&view, 5.2, false));
        assert!(!history.watch(&view, 5.0 + 2.0 * REST, false));
        turn(&mut view, 50.0);
        assert!(history.watch(&view, 10.0, false));
        // Before it rests one is still on the way.
        assert!(history.undo(&mut view) && view.camera.azimuth == 9.0);
        assert!(history.undo(&mut view) && view.camera.azimuth == 0.0);
        assert!(!history.undo(&mut view));
        assert!(history.redo(&mut view) && view.camera.azimuth == 9.0);
        assert!(history.redo(&mut view) && view.camera.azimuth == 50.0);
        assert!(!history.redo(&mut view));
        // What is done anew ends what was undone.
        assert!(history.undo(&mut view));
        turn(&mut view, 70.0);
        history.watch(&view, 20.0, false);
        assert!(!history.watch(&view, 20.0 + REST, false));
        assert!(!history.redo(&mut view));
        assert!(history.undo(&mut view) && view.camera.azimuth == 9.0);
    }
}
