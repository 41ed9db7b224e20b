//! Isosurfaces that stay in sight beside that of the slider, each with its colour and how much of what lies behind it hides.

use eframe::egui::{DragValue, Ui};

use super::scene::Scene;
use crate::color::{linear, to_srgb};
use crate::render::Surface;

/// Most of them, and the colours that they have at first (sRGB); as in the page.
const MOST: usize = 6;
const COLORS: [u32; MOST] = [0xd9_a46c, 0x5f_ae84, 0xd1_84b4, 0xe0_c95a, 0xc8_503c, 0x8c_7ac2];

/// How much of what lies behind one hides that was added.
const OPACITY: f32 = 0.4;

/// One of them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Layer {
    pub(super) isovalue: f64,
    /// sRGB.
    color: [u8; 3],
    opacity: f32,
}

impl Layer {
    /// The `i`-th one as it is told; what is not told is as usual.
    pub(super) fn told(i: usize, surface: &Surface) -> Self {
        let color = surface.color.map_or_else(|| usual_color(i), |color| color.map(to_srgb));
        Layer { isovalue: surface.isovalue, color, opacity: surface.opacity.unwrap_or(1.0) }
    }

    /// As it is drawn.
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

fn usual_color(i: usize) -> [u8; 3] {
    let [_, r, g, b] = COLORS[i % MOST].to_be_bytes();
    [r, g, b]
}

/// Draws the controls of them all.
pub(super) fn show(ui: &mut Ui, scene: &mut Scene) {
    let (low, high) = scene.spectrum.range();
    let isovalue = scene.isovalue;
    let layers = &mut scene.layers;
    if ui
        .add_enabled(layers.len() < MOST, eframe::egui::Button::new("keep this isovalue"))
        .clicked()
    {
        layers.push(Layer { isovalue, color: usual_color(layers.len()), opacity: OPACITY });
    }
    let mut gone = None;
    for (i, layer) in layers.iter_mut().enumerate() {
        ui.horizontal(|ui| {
            let speed = (high - low) / 500.0;
            ui.add(DragValue::new(&mut layer.isovalue).range(low..=high).speed(speed));
            ui.color_edit_button_srgb(&mut layer.color);
            let opacity = DragValue::new(&mut layer.opacity).range(0.05..=1.0).speed(0.01);
            ui.add(opacity.fixed_decimals(2)).on_hover_text("opacity");
            if ui.button("x").on_hover_text("show it no longer").clicked() {
                gone = Some(i);
            }
        });
    }
    if let Some(i) = gone {
        layers.remove(i);
    }
}
