//! The panel next to the picture: appearance, components, saving.

use eframe::egui::{
    Button, Color32, ComboBox, DragValue, Rect, RichText, Sense, Slider, TextEdit, Ui, vec2,
};

use super::actions::Action;
use super::numbers::{format_number, format_short};
use super::pointer::Tool;
use super::scene::Scene;
use super::{pinned, save};
use crate::color::{Map, Scale, ScaleEnds, to_srgb};
use crate::render::{Background, Clip, Color, Light, Style, View, plain_color};
use crate::spectrum::VolumeInfo;

/// The command of a button.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Command {
    /// Save the picture.
    Picture,
    /// Save the mesh, by the extension of its format.
    Mesh(&'static str),
    /// Save a sweep of this number of pictures.
    Sweep(u32),
    /// Show this isovalue.
    GoTo(f64),
    /// Perform an action that also has a key.
    Perform(Action),
}

/// The state of the panel that is not part of the view.
#[derive(Clone, Debug)]
pub(super) struct Options {
    clip_axis: usize,
    clip_fraction: f64,
    clip_is_flipped: bool,
    clip: bool,
    /// Number of pictures of a saved sweep.
    n_frames: u32,
    /// The text in the field of the scale.
    scale: String,
}

impl Default for Options {
    fn default() -> Self {
        Options {
            clip_axis: 0,
            clip_fraction: 0.5,
            clip_is_flipped: false,
            clip: false,
            n_frames: 100,
            scale: String::new(),
        }
    }
}

impl Options {
    /// The state for an initial clip plane: perpendicular to the axis that is closest to its normal.
    pub(super) fn with_clip(clip: Option<Clip>, volume: &VolumeInfo) -> Self {
        let default = Options::default();
        let Some(Clip { normal, offset }) = clip else { return default };
        let component = |&axis: &usize| normal[axis].abs();
        let axis = (0..3).max_by(|a, b| component(a).total_cmp(&component(b))).unwrap_or(0);
        Options {
            clip: true,
            clip_axis: axis,
            clip_fraction: (offset / normal[axis] / length(volume, axis)).clamp(0.0, 1.0),
            clip_is_flipped: normal[axis] < 0.0,
            ..default
        }
    }
}

/// The length of a volume along an axis, voxels.
fn length(volume: &VolumeInfo, axis: usize) -> f64 {
    (volume.dims[axis] as f64 - 1.0) * volume.placement.cell_size()[axis]
}

/// Shows the panel; returns the command of a clicked button.
pub(super) fn show(
    ui: &mut Ui,
    scene: &mut Scene,
    view: &mut View,
    tool: &mut Option<Tool>,
    options: &mut Options,
) -> Option<Command> {
    appearance(ui, scene, view, options);
    ui.separator();
    clip_plane(ui, scene, view, options);
    ui.separator();
    let mut command = offered_isovalues(ui, scene);
    let (isovalue, range) = (scene.isovalue, scene.spectrum.range());
    pinned::show(ui, &mut scene.pinned, isovalue, range);
    ui.separator();
    command = components(ui, scene, view, tool).or(command);
    ui.separator();
    command = save_buttons(ui, options).or(command);
    ui.separator();
    statistics(ui, scene);
    command
}

fn appearance(ui: &mut Ui, scene: &mut Scene, view: &mut View, options: &mut Options) {
    let sources = scene.painter.sources();
    ComboBox::from_label("colour").selected_text(label(view.color)).show_ui(ui, |ui| {
        for color in Color::ALL.into_iter().filter(|&color| sources.support(color)) {
            ui.selectable_value(&mut view.color, color, label(color));
        }
    });
    if view.color == Color::None {
        ui.horizontal(|ui| {
            let default = view.front.unwrap_or(plain_color(0)).map(to_srgb);
            let mut color = scene.color.unwrap_or(default);
            if ui.color_edit_button_srgb(&mut color).changed() {
                scene.color = Some(color);
            }
            ui.label("surface");
            style(ui, scene, view);
        });
    } else {
        style(ui, scene, view);
    }
    legend(ui, scene, view, options);
    ui.horizontal(|ui| {
        let mut wireframe = view.wireframe.is_some();
        if ui.checkbox(&mut wireframe, "wireframe (W)").changed() {
            view.wireframe = wireframe.then_some(1.0);
        }
        if ui.checkbox(&mut view.axes, "axes (G)").changed() {
            view.scale_bar = view.axes;
        }
    });
    ui.horizontal(|ui| {
        let mut caps = !view.open;
        if ui.checkbox(&mut caps, "caps (B)").changed() {
            view.open = !caps;
        }
        ui.checkbox(&mut view.occlusion, "dark hollows (D)");
    });
    ui.checkbox(&mut view.silhouette, "silhouette");
    ui.add(Slider::new(&mut view.opacity, 0.05..=1.0).text("opacity"));
    let mut is_parallel = view.camera.orthographic;
    if ui.checkbox(&mut is_parallel, "parallel projection (O)").changed() {
        view.set_orthographic(scene.spectrum.volume(), is_parallel);
    }
    ComboBox::from_label("background").selected_text(view.background.name()).show_ui(ui, |ui| {
        for background in [Background::White, Background::Light, Background::Dark] {
            ui.selectable_value(&mut view.background, background, background.name());
        }
    });
    ComboBox::from_label("light").selected_text(view.light.name()).show_ui(ui, |ui| {
        for light in Light::ALL {
            ui.selectable_value(&mut view.light, light, light.name());
        }
    });
}

/// Sets background, light, colour and occlusion to those of a style.
fn style(ui: &mut Ui, scene: &mut Scene, view: &mut View) {
    ui.menu_button("style", |ui| {
        for style in Style::ALL {
            if ui.button(style.name()).clicked() {
                *view = view.clone().with_style(style);
                scene.color = None;
                ui.close();
            }
        }
    });
}

/// The colour map with the values at its ends, and controls to change both.
fn legend(ui: &mut Ui, scene: &Scene, view: &mut View, options: &mut Options) {
    let attribute = scene.painter.attribute().filter(|_| view.color != Color::None);
    let Some(attribute) = attribute else { return };
    let Some(Scale { low, high }) = attribute.scale else { return };
    let map = scene.painter.map(view);
    ComboBox::from_label("map").selected_text(map.name()).show_ui(ui, |ui| {
        for map in Map::ALL {
            ui.selectable_value(&mut view.map, Some(map), map.name());
        }
    });
    ui.label(RichText::new(&attribute.name).small());
    let size = vec2(ui.available_width().min(LEGEND_SIZE[0]), LEGEND_SIZE[1]);
    let (bar, _) = ui.allocate_exact_size(size, Sense::hover());
    let n = bar.width().max(1.0) as u32;
    for column in 0..n {
        let [r, g, b] = map.at((column as f32 + 0.5) / n as f32).map(to_srgb);
        let left = bar.min + vec2(column as f32, 0.0);
        let column = Rect::from_min_size(left, vec2(1.0, bar.height()));
        ui.painter().rect_filled(column, 0.0, Color32::from_rgb(r, g, b));
    }
    let ends = format!("{} to {}", format_number(low), format_number(high));
    ui.label(RichText::new(ends).small());
    ui.horizontal(|ui| {
        ui.label("scale");
        let text = options.scale.trim();
        let is_invalid = !text.is_empty() && text.parse::<ScaleEnds>().is_err();
        let color = is_invalid.then(|| ui.visuals().error_fg_color);
        let field = TextEdit::singleline(&mut options.scale).hint_text("usual, or p5:p95");
        let field = ui.add(field.text_color_opt(color).desired_width(110.0));
        if field.changed() {
            let ends: Option<ScaleEnds> = options.scale.parse().ok();
            view.ends = ScaleEnds { center: view.ends.center, ..ends.unwrap_or_default() };
        }
    });
}

/// Width and height of the legend, points.
const LEGEND_SIZE: [f32; 2] = [200.0, 10.0];

fn label(color: Color) -> &'static str {
    match color {
        Color::None => "plain",
        Color::Quality => "quality (radius ratio)",
        other => other.name(),
    }
}

/// The clip plane: perpendicular to an axis of the volume, at a fraction of its length.
fn clip_plane(ui: &mut Ui, scene: &Scene, view: &mut View, options: &mut Options) {
    ui.horizontal(|ui| {
        ui.checkbox(&mut options.clip, "clip across");
        for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
            if ui.add(Button::new(name).selected(options.clip_axis == axis)).clicked() {
                options.clip_axis = axis;
            }
        }
        ui.checkbox(&mut options.clip_is_flipped, "other side");
    });
    ui.add_enabled(options.clip, Slider::new(&mut options.clip_fraction, 0.0..=1.0).text("at"));
    view.clip = options.clip.then(|| {
        let size = length(scene.spectrum.volume(), options.clip_axis);
        let sign = if options.clip_is_flipped { -1.0 } else { 1.0 };
        let mut normal = [0.0; 3];
        normal[options.clip_axis] = sign;
        Clip { normal, offset: sign * options.clip_fraction * size }
    });
}

/// Buttons for the offered isovalues.
fn offered_isovalues(ui: &mut Ui, scene: &mut Scene) -> Option<Command> {
    let mut command = None;
    ui.horizontal_wrapped(|ui| {
        for (isovalue, name) in scene.offered_isovalues() {
            let text = format_short(*isovalue);
            let text = if *name == text { text } else { format!("{name} ({text})") };
            if ui.button(text).clicked() {
                command = Some(Command::GoTo(*isovalue));
            }
        }
    });
    command
}

/// The choice of components.
fn components(
    ui: &mut Ui,
    scene: &Scene,
    view: &mut View,
    tool: &mut Option<Tool>,
) -> Option<Command> {
    ui.horizontal(|ui| {
        let mut are_few = view.keep.largest.is_some();
        if ui.checkbox(&mut are_few, "largest components").changed() {
            view.keep.largest = are_few.then_some(1);
        }
        if let Some(n) = &mut view.keep.largest {
            ui.add(DragValue::new(n).range(1..=1_000_000).speed(0.1));
        }
    });
    ui.horizontal(|ui| {
        let unit = scene.spectrum.volume().placement.voxel_volume();
        let mut volume = view.keep.min_volume * unit;
        ui.label("of a volume from");
        let field = DragValue::new(&mut volume).range(0.0..=f64::MAX).speed(0.5 * unit);
        if ui.add(field).changed() {
            view.keep.min_volume = volume / unit;
        }
    });
    let mut command = None;
    ui.horizontal_wrapped(|ui| {
        ui.label("click to");
        for (choice, name) in [(Tool::Keep, "keep one"), (Tool::Hide, "hide one")] {
            let is_selected = *tool == Some(choice);
            if ui.add(Button::new(name).selected(is_selected)).clicked() {
                *tool = (!is_selected).then_some(choice);
            }
        }
        let is_measuring = *tool == Some(Tool::Measure);
        if ui.add(Button::new("measure (M)").selected(is_measuring)).clicked() {
            command = Some(Command::Perform(Action::Measure));
        }
        let are_all_shown = view.keep.is_all() && scene.picks.is_empty();
        if ui.add_enabled(!are_all_shown, Button::new("show all (A)")).clicked() {
            command = Some(Command::Perform(Action::ShowAll));
        }
    });
    command
}

fn save_buttons(ui: &mut Ui, options: &mut Options) -> Option<Command> {
    let mut command = None;
    ui.horizontal_wrapped(|ui| {
        ui.label("save");
        if ui.button("picture (S)").clicked() {
            command = Some(Command::Picture);
        }
        for extension in save::EXTENSIONS.into_iter().filter(|&extension| extension != "png") {
            if ui.button(extension).clicked() {
                command = Some(Command::Mesh(extension));
            }
        }
    });
    ui.horizontal(|ui| {
        if ui.button("sweep").clicked() {
            command = Some(Command::Sweep(options.n_frames));
        }
        ui.add(DragValue::new(&mut options.n_frames).range(2..=10_000).suffix(" pictures"));
    });
    command
}

fn statistics(ui: &mut Ui, scene: &Scene) {
    let (low, high) = scene.spectrum.range();
    let milliseconds = 1e3 * scene.gpu_time().as_secs_f64();
    for line in [
        format!("{} triangles", scene.n_triangles()),
        format!("{milliseconds:.1} ms for the last picture"),
        format!("range {} to {}", format_number(low), format_number(high)),
        format!("{} events at {} isovalues", scene.spectrum.events().len(), scene.events.len()),
    ] {
        ui.label(RichText::new(line).small());
    }
}
