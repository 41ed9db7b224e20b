//! What keys and the wheel ask for.

use eframe::egui::{Context, Event, InputState, Key, MouseWheelUnit};

/// What can be asked for by a key.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Action {
    /// So many steps of the isovalue; fine ones are a tenth.
    Step { notches: f64, is_fine: bool },
    /// Start or stop the sweep.
    Play,
    /// Back to the first view.
    Reset,
    /// Save the picture.
    Picture,
    /// Edges on or off.
    Wireframe,
    /// Help on or off.
    Help,
}

/// The keys, and what they do, as the help shows them.
pub(super) const HELP: [(&str, &str); 12] = [
    ("left drag", "turn"),
    ("middle or right drag", "move"),
    ("both buttons, Ctrl + wheel, pinch", "zoom"),
    ("wheel, arrow keys", "step through isovalues"),
    ("Shift with them", "fine steps"),
    ("double click", "put that point in the middle"),
    ("Space", "play the sweep"),
    ("R", "reset the view"),
    ("S", "save the picture"),
    ("W", "edges of the triangles"),
    ("H", "this help"),
    ("drop a file", "open a spectrum or a volume"),
];

/// What the keys ask for, unless someone is typing.
pub(super) fn pressed(window: &Context) -> Vec<Action> {
    if window.text_edit_focused() {
        return Vec::new();
    }
    window.input(|input| input.events.iter().filter_map(of_key).collect())
}

fn of_key(event: &Event) -> Option<Action> {
    let Event::Key { key, pressed: true, repeat, modifiers, .. } = *event else { return None };
    if modifiers.ctrl || modifiers.alt || modifiers.command {
        return None;
    }
    let step = |notches| Some(Action::Step { notches, is_fine: modifiers.shift });
    match key {
        Key::ArrowRight | Key::ArrowUp => return step(1.0),
        Key::ArrowLeft | Key::ArrowDown => return step(-1.0),
        Key::PageUp => return step(10.0),
        Key::PageDown => return step(-10.0),
        _ => {}
    }
    // A key held down steps on, but does nothing else twice.
    match key {
        _ if repeat => None,
        Key::Space => Some(Action::Play),
        Key::R => Some(Action::Reset),
        Key::S => Some(Action::Picture),
        Key::W => Some(Action::Wireframe),
        Key::H | Key::Questionmark => Some(Action::Help),
        _ => None,
    }
}

/// Points of scrolling that count as one notch of a wheel.
const POINTS_PER_NOTCH: f64 = 40.0;

/// Notches of the wheel, up and down, unless it zooms.
pub(super) fn wheel(input: &InputState) -> Option<Action> {
    let mut notches = 0.0;
    let mut is_fine = false;
    for event in &input.events {
        let Event::MouseWheel { unit, delta, modifiers, .. } = *event else { continue };
        if modifiers.ctrl || modifiers.command {
            continue;
        }
        is_fine = modifiers.shift;
        // Some systems scroll sideways while Shift is held.
        let turned = f64::from(if delta.y == 0.0 { delta.x } else { delta.y });
        notches += match unit {
            MouseWheelUnit::Line => turned,
            MouseWheelUnit::Point => turned / POINTS_PER_NOTCH,
            MouseWheelUnit::Page => 10.0 * turned,
        };
    }
    (notches != 0.0).then_some(Action::Step { notches, is_fine })
}
