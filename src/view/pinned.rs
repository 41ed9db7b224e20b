//! Pinned isosurfaces: they stay visible while the slider moves, each with its own colour and opacity.

use eframe::egui::{Button, DragValue, Ui};

use crate::color::{linear, to_srgb};
use crate::render::Surface;

/// Maximum number of pinned surfaces, and their default colours (sRGB), the same as in the page.
const MAX_PINNED: usize = 6;
const COLORS: [u32; MAX_PINNED] =
    [0xd9_a46c, 0x5f_ae84, 0xd1_84b4, 0xe0_c95a, 0xc8_503c, 0x8c_7ac2];

/// Default opacity of a surface pinned in the window.
const OPACITY: f32 = 0.4;

/// A pinned isosurface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct PinnedSurface {
    pub(super) isovalue: f64,
    /// sRGB.
    color: [u8; 3],
    opacity: f32,
}

impl PinnedSurface {
    /// The `i`-th pinned surface; an unspecified colour is the default one, an unspecified opacity is 1.
    pub(super) fn new(i: usize, surface: &Surface) -> Self {
        let color = surface.color.map_or_else(|| default_color(i), |color| color.map(to_srgb));
        PinnedSurface { isovalue: surface.isovalue, color, opacity: surface.opacity.unwrap_or(1.0) }
    }

    /// The surface for the painter.
    pub(super) fn surface(&self) -> Surface {
        Surface {
            isovalue: self.isovalue,
            color: Some(linear_of(self.color)),
            opacity: Some(self.opacity),
        }
    }
}

/// Linear light of an sRGB colour.
pub(super) fn linear_of([r, g, b]: [u8; 3]) -> [f32; 3] {
    linear(u32::from_be_bytes([0, r, g, b]))
}

fn default_color(i: usize) -> [u8; 3] {
    let [_, r, g, b] = COLORS[i % MAX_PINNED].to_be_bytes();
    [r, g, b]
}

/// Shows the controls of all pinned surfaces, and a button that pins `isovalue`.
pub(super) fn show(
    ui: &mut Ui,
    pinned: &mut Vec<PinnedSurface>,
    isovalue: f64,
    (low, high): (f64, f64),
) {
    let can_pin = pinned.len() < MAX_PINNED;
    if ui.add_enabled(can_pin, Button::new("keep this isovalue")).clicked() {
        let color = default_color(pinned.len());
        pinned.push(PinnedSurface { isovalue, color, opacity: OPACITY });
    }
    let mut removed = None;
    for (i, surface) in pinned.iter_mut().enumerate() {
        ui.horizontal(|ui| {
            let speed = (high - low) / 500.0;
            ui.add(DragValue::new(&mut surface.isovalue).range(low..=high).speed(speed));
            ui.color_edit_button_srgb(&mut surface.color);
            let opacity = DragValue::new(&mut surface.opacity).range(0.05..=1.0).speed(0.01);
            ui.add(opacity.fixed_decimals(2)).on_hover_text("opacity");
            if ui.button("remove").clicked() {
                removed = Some(i);
            }
        });
    }
    if let Some(i) = removed {
        pinned.remove(i);
    }
}
