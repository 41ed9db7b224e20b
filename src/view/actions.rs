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
    /// Box, axes and scale bar on or off.
    Axes,
    /// Dark hollows on or off.
    Occlusion,
    /// Parallel projection on or off.
    Orthographic,
    /// Caps on or off.
    Caps,
    /// Look from a side of the world: 0 to 5 are +x, -x, +y and so on.
    Side(usize),
    /// To the next isovalue with events, up or down.
    Event { is_up: bool },
    /// Larger by a factor.
    Zoom(f64),
    /// Back to the view before.
    Undo,
    /// On to the view that was gone back from.
    Redo,
    /// Choose a file to open.
    Open,
    /// Choose a name to save under.
    SaveAs,
    /// Keep the component under the pointer alone, or hide it.
    Pick { is_hiding: bool },
    /// Show all components again.
    ShowAll,
    /// Colour each component, or none.
    Components,
    /// Measure with the next clicks, or no longer.
    Measure,
    /// The whole screen, or the window again.
    Fullscreen,
    /// Help on or off.
    Help,
}

/// The keys, and what they do, as the help shows them.
pub(super) const HELP: [(&str, &str); 27] = [
    ("left drag", "turn"),
    ("middle or right drag", "move"),
    ("both buttons, Ctrl + wheel, pinch", "zoom"),
    ("wheel, arrow keys", "step through isovalues"),
    ("Shift with them", "fine steps"),
    ("double click", "put that point in the middle"),
    ("Space", "play the sweep"),
    ("N, P", "next and previous isovalue with events"),
    ("+, -", "zoom"),
    ("R", "reset the view"),
    ("1 to 6", "look from +x, -x, +y, -y, +z, -z"),
    ("Ctrl + Z, Ctrl + Y", "the view before, and on again"),
    ("K, X", "keep the component pointed at alone, hide it"),
    ("A", "show all components again"),
    ("C", "colour each component"),
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

/// What the keys ask for, unless someone is typing.
pub(super) fn pressed(window: &Context) -> Vec<Action> {
    if window.text_edit_focused() {
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
    let step = |notches| Some(Action::Step { notches, is_fine: modifiers.shift });
    match key {
        Key::ArrowRight | Key::ArrowUp => return step(1.0),
        Key::ArrowLeft | Key::ArrowDown => return step(-1.0),
        Key::PageUp => return step(10.0),
        Key::PageDown => return step(-10.0),
        Key::Plus | Key::Equals => return Some(Action::Zoom(KEY_ZOOM)),
        Key::Minus => return Some(Action::Zoom(1.0 / KEY_ZOOM)),
        Key::N => return Some(Action::Event { is_up: true }),
        Key::P => return Some(Action::Event { is_up: false }),
        _ => {}
    }
    // A key held down steps on, but does nothing else twice.
    match key {
        _ if repeat => None,
        Key::Space => Some(Action::Play),
        Key::R => Some(Action::Reset),
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

/// What a key zooms by; as in the page.
const KEY_ZOOM: f64 = 1.15;

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
