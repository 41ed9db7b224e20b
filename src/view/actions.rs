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
    /// Move by steps of [`KEY_PIXELS`], right and down.
    Move([f64; 2]),
    /// Go to the first or the last isovalue of the range.
    End { is_high: bool },
    /// Fit the shown surfaces.
    Fit,
    /// Fit the surfaces of all isovalues.
    FitAll,
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
        Key::ArrowRight if modifiers.shift => return Some(Action::Move([1.0, 0.0])),
        Key::ArrowLeft if modifiers.shift => return Some(Action::Move([-1.0, 0.0])),
        Key::ArrowUp if modifiers.shift => return Some(Action::Move([0.0, -1.0])),
        Key::ArrowDown if modifiers.shift => return Some(Action::Move([0.0, 1.0])),
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
        Key::V => Some(Action::FitAll),
        Key::Home => Some(Action::End { is_high: false }),
        Key::End => Some(Action::End { is_high: true }),
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

/// Pixels that a key press moves, the same as in the page.
pub(super) const KEY_PIXELS: f64 = 24.0;

/// Zoom factor of a key press, the same as in the page.
const KEY_ZOOM: f64 = 1.15;

/// Points of scrolling per notch.
const POINTS_PER_NOTCH: f64 = 40.0;

/// The logarithm of the zoom factor of a notch, the same as in the page.
const NOTCH_ZOOM: f64 = 0.25;

/// The action of the wheel: it zooms, or with Shift steps through isovalues. `None` if it did not move, or if Ctrl is held, with
/// which egui zooms.
pub(super) fn wheel(input: &InputState) -> Option<Action> {
    let mut notches = 0.0;
    let mut is_step = false;
    for event in &input.events {
        let Event::MouseWheel { unit, delta, modifiers, .. } = *event else { continue };
        if modifiers.ctrl || modifiers.command {
            continue;
        }
        is_step = modifiers.shift;
        // Some systems scroll sideways while Shift is held.
        let delta = f64::from(if delta.y == 0.0 { delta.x } else { delta.y });
        notches += match unit {
            MouseWheelUnit::Line => delta,
            MouseWheelUnit::Point => delta / POINTS_PER_NOTCH,
            MouseWheelUnit::Page => 10.0 * delta,
        };
    }
    (notches != 0.0).then_some(match is_step {
        true => Action::Step { steps: notches, is_fine: false },
        false => Action::Zoom((NOTCH_ZOOM * notches).exp()),
    })
}

#[cfg(test)]
mod tests {
    use eframe::egui::Modifiers;

    use super::*;
    use crate::keys::{KEYS, Place, keys_of};

    #[test]
    fn every_key_of_the_help_has_an_action() {
        for key in KEYS.iter().filter(|key| key.place != Place::Page) {
            for name in keys_of(key.input).chain(keys_of(key.meaning)) {
                if name == "Shift" {
                    continue;
                }
                let letter = name.strip_prefix("Ctrl+").unwrap_or(name);
                let modifiers = match letter == name {
                    true => Modifiers::NONE,
                    false => Modifiers::CTRL,
                };
                let key = Key::from_name(&letter.replace(' ', "")).expect(name);
                let event =
                    Event::Key { key, physical_key: None, pressed: true, repeat: false, modifiers };
                assert!(of_key(&event).is_some(), "{name}");
            }
        }
    }
}
