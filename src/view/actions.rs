//! The actions of keys and the mouse wheel.

use eframe::egui::{Context, Event, InputState, Key, MouseWheelUnit, Popup};

/// An action of a key or the wheel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Action {
    /// Move the isovalue by some steps; fine ones are a tenth.
    Step { steps: f64, is_fine: bool },
    /// Start or stop playing the sweep.
    Play,
    /// Return to the first view.
    Reset,
    /// Save the picture.
    Picture,
    /// Edges on or off.
    Wireframe,
    /// Box, axes and scale bar on or off.
    Axes,
    /// Ambient occlusion on or off.
    Occlusion,
    /// Parallel projection on or off.
    Orthographic,
    /// Caps on or off.
    Caps,
    /// Look from a side of the world: 0 to 5 are +x, -x, +y, -y, +z, -z.
    Side(usize),
    /// Go to the next isovalue with events, up or down.
    Event { is_up: bool },
    /// Turn by steps of [`KEY_DEGREES`] of azimuth and elevation.
    Turn([f64; 2]),
    /// Fit the shown surfaces.
    Fit,
    /// Magnify by a factor.
    Zoom(f64),
    /// Undo the last change of the view.
    Undo,
    /// Redo the last undone change of the view.
    Redo,
    /// Show the dialog that opens a file.
    Open,
    /// Show the dialog that saves a file.
    SaveAs,
    /// Keep only the component under the pointer, or hide it.
    Pick { is_hiding: bool },
    /// Show all components again.
    ShowAll,
    /// Colours of components on or off.
    Components,
    /// Measuring by clicks on or off.
    Measure,
    /// Full screen on or off.
    Fullscreen,
    /// Help on or off.
    Help,
}

/// The keys and their actions, for the help.
pub(super) const HELP: [(&str, &str); 29] = [
    ("left drag", "turn"),
    ("middle or right drag", "move"),
    ("both buttons, Ctrl + wheel, pinch", "zoom"),
    ("wheel, comma and period, Page Up and Page Down", "step through isovalues"),
    ("Shift with them", "fine steps"),
    ("arrow keys", "turn"),
    ("Z", "fit the shown surfaces"),
    ("double click", "put that point in the middle"),
    ("Space", "play the sweep"),
    ("N, P", "next and previous isovalue with events"),
    ("+, -", "zoom"),
    ("R", "reset the view"),
    ("1 to 6", "look from +x, -x, +y, -y, +z, -z"),
    ("Ctrl + Z, Ctrl + Y", "undo and redo changes of the view"),
    ("K, X", "keep only the component under the pointer, hide it"),
    ("A", "show all components again"),
    ("C", "colour by component"),
    ("M", "measure between two clicks on the surface"),
    ("F", "full screen"),
    ("S", "save the picture"),
    ("Ctrl + S", "save under a name, as a picture or a mesh"),
    ("Ctrl + O", "open a spectrum or a volume"),
    ("W", "edges of the triangles"),
    ("G", "box, axes and scale bar"),
    ("O", "parallel projection"),
    ("D", "dark hollows"),
    ("B", "close or open at the border of the volume"),
    ("H", "this help"),
    ("drop files", "open spectra or volumes"),
];

/// The actions of the pressed keys; none while a text is edited.
pub(super) fn pressed(window: &Context) -> Vec<Action> {
    // An open list takes the keys, too.
    if window.text_edit_focused() || Popup::is_any_open(window) {
        return Vec::new();
    }
    window.input(|input| input.events.iter().filter_map(of_key).collect())
}

fn of_key(event: &Event) -> Option<Action> {
    let Event::Key { key, pressed: true, repeat, modifiers, .. } = *event else { return None };
    if modifiers.alt {
        return None;
    }
    if modifiers.ctrl || modifiers.command {
        return match key {
            _ if repeat && !matches!(key, Key::Z | Key::Y) => None,
            Key::Z if modifiers.shift => Some(Action::Redo),
            Key::Z => Some(Action::Undo),
            Key::Y => Some(Action::Redo),
            Key::O => Some(Action::Open),
            Key::S => Some(Action::SaveAs),
            _ => None,
        };
    }
    let step = |steps| Some(Action::Step { steps, is_fine: modifiers.shift });
    match key {
        Key::ArrowRight => return Some(Action::Turn([1.0, 0.0])),
        Key::ArrowLeft => return Some(Action::Turn([-1.0, 0.0])),
        Key::ArrowUp => return Some(Action::Turn([0.0, 1.0])),
        Key::ArrowDown => return Some(Action::Turn([0.0, -1.0])),
        Key::Period | Key::CloseBracket => return step(1.0),
        Key::Comma | Key::OpenBracket => return step(-1.0),
        Key::PageUp => return step(10.0),
        Key::PageDown => return step(-10.0),
        Key::Plus | Key::Equals => return Some(Action::Zoom(KEY_ZOOM)),
        Key::Minus => return Some(Action::Zoom(1.0 / KEY_ZOOM)),
        Key::N => return Some(Action::Event { is_up: true }),
        Key::P => return Some(Action::Event { is_up: false }),
        _ => {}
    }
    // The actions above repeat while the key is held down; those below do not.
    match key {
        _ if repeat => None,
        Key::Space => Some(Action::Play),
        Key::R => Some(Action::Reset),
        Key::Z => Some(Action::Fit),
        Key::S => Some(Action::Picture),
        Key::W => Some(Action::Wireframe),
        Key::G => Some(Action::Axes),
        Key::D => Some(Action::Occlusion),
        Key::O => Some(Action::Orthographic),
        Key::B => Some(Action::Caps),
        Key::Num1 => Some(Action::Side(0)),
        Key::Num2 => Some(Action::Side(1)),
        Key::Num3 => Some(Action::Side(2)),
        Key::Num4 => Some(Action::Side(3)),
        Key::Num5 => Some(Action::Side(4)),
        Key::Num6 => Some(Action::Side(5)),
        Key::K => Some(Action::Pick { is_hiding: false }),
        Key::X => Some(Action::Pick { is_hiding: true }),
        Key::A => Some(Action::ShowAll),
        Key::C => Some(Action::Components),
        Key::M => Some(Action::Measure),
        Key::F | Key::F11 => Some(Action::Fullscreen),
        Key::H | Key::Questionmark => Some(Action::Help),
        _ => None,
    }
}

/// Degrees that a key press turns, the same as in the page.
pub(super) const KEY_DEGREES: f64 = 5.0;

/// Zoom factor of a key press, the same as in the page.
const KEY_ZOOM: f64 = 1.15;

/// Points of scrolling per step.
const POINTS_PER_STEP: f64 = 40.0;

/// The steps of the wheel; `None` if it did not move, or zooms.
pub(super) fn wheel(input: &InputState) -> Option<Action> {
    let mut steps = 0.0;
    let mut is_fine = false;
    for event in &input.events {
        let Event::MouseWheel { unit, delta, modifiers, .. } = *event else { continue };
        if modifiers.ctrl || modifiers.command {
            continue;
        }
        is_fine = modifiers.shift;
        // Some systems scroll sideways while Shift is held.
        let delta = f64::from(if delta.y == 0.0 { delta.x } else { delta.y });
        steps += match unit {
            MouseWheelUnit::Line => delta,
            MouseWheelUnit::Point => delta / POINTS_PER_STEP,
            MouseWheelUnit::Page => 10.0 * delta,
        };
    }
    (steps != 0.0).then_some(Action::Step { steps, is_fine })
}
