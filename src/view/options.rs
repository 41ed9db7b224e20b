//! The panel beside the picture: how the surface looks, and what can be saved.

use eframe::egui::{
    Button, Color32, ComboBox, DragValue, Rect, RichText, Sense, Slider, TextEdit, Ui, vec2,
};

use super::actions::Action;
use super::pointing::Tool;
use super::scene::Scene;
use super::typed;
use super::{chooser, layers};
use crate::color::{Ends, Map, Scale, to_srgb};
use crate::render::{Background, Clip, Color, Light, View, plain_color};
use crate::spectrum::VolumeInfo;

/// What a button asks for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Command {
    /// Save the picture.
    Picture,
    /// Save the mesh, by the extension of its format.
    Mesh(&'static str),
    /// Save so many pictures of a sweep.
    Sweep(u32),
    /// Show this isovalue.
    GoTo(f64),
    /// What a key does, too.
    Act(Action),
}

/// What the panel remembers beside the view.
#[derive(Clone, Debug)]
pub(super) struct Options {
    clip_axis: usize,
    clip_share: f64,
    clip_is_turned: bool,
    clip: bool,
    /// Pictures of a sweep.
    n_frames: u32,
    /// What is typed as the ends of the colours' scale.
    scale: String,
}

impl Default for Options {
    fn default() -> Self {
        Options {
            clip_axis: 0,
            clip_share: 0.5,
            clip_is_turned: false,
            clip: false,
            n_frames: 100,
            scale: String::new(),
        }
    }
}

impl Options {
    /// With a plane that cuts from the beginning, as the panel knows it: across the axis that it is nearest to be across.
    pub(super) fn with_clip(clip: Option<Clip>, volume: &VolumeInfo) -> Self {
        let usual = Options::default();
        let Some(Clip { normal, offset }) = clip else { return usual };
        let steepness = |&axis: &usize| normal[axis].abs();
        let axis = (0..3).max_by(|a, b| steepness(a).total_cmp(&steepness(b))).unwrap_or(0);
        Options {
            clip: true,
            clip_axis: axis,
            clip_share: (offset / normal[axis] / length(volume, axis)).clamp(0.0, 1.0),
            clip_is_turned: normal[axis] < 0.0,
            ..usual
        }
    }
}

/// How long a volume is along an axis, voxels.
fn length(volume: &VolumeInfo, axis: usize) -> f64 {
    let placement = &volume.placement;
    (volume.dims[axis] as f64 - 1.0) * placement.spacing[axis] / placement.voxel()
}

/// Draws the panel.
pub(super) fn show(
    ui: &mut Ui,
    scene: &mut Scene,
    (view, tool): (&mut View, &mut Option<Tool>),
    options: &mut Options,
) -> Option<Command> {
    looks(ui, scene, view, options);
    ui.separator();
    plane(ui, scene, view, options);
    ui.separator();
    let mut command = offered(ui, scene);
    layers::show(ui, scene);
    ui.separator();
    command = components(ui, scene, view, tool).or(command);
    ui.separator();
    command = saves(ui, options).or(command);
    ui.separator();
    facts(ui, scene);
    command
}

fn looks(ui: &mut Ui, scene: &mut Scene, view: &mut View, options: &mut Options) {
    let sources = scene.painter.sources();
    ComboBox::from_label("colour").selected_text(label(view.color)).show_ui(ui, |ui| {
        for color in Color::ALL.into_iter().filter(|&color| sources.have(color)) {
            ui.selectable_value(&mut view.color, color, label(color));
        }
    });
    if view.color == Color::None {
        ui.horizontal(|ui| {
            let usual = plain_color(0).map(to_srgb);
            let mut front = scene.front.unwrap_or(usual);
            if ui.color_edit_button_srgb(&mut front).changed() {
                scene.front = Some(front);
            }
            ui.label("surface");
        });
    }
    legend(ui, scene, view, options);
    ui.horizontal(|ui| {
        let mut wireframe = view.wireframe.is_some();
        if ui.checkbox(&mut wireframe, "edges (W)").changed() {
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

/// The map with what its ends stand for, and the choice of another.
fn legend(ui: &mut Ui, scene: &Scene, view: &mut View, options: &mut Options) {
    let Some(shown) = scene.painter.attribute().filter(|_| view.color != Color::None) else {
        return;
    };
    let Some(Scale { low, high }) = shown.scale else { return };
    let map = scene.painter.map(view);
    ComboBox::from_label("map").selected_text(map.name()).show_ui(ui, |ui| {
        for map in Map::ALL {
            ui.selectable_value(&mut view.map, Some(map), map.name());
        }
    });
    ui.label(RichText::new(&shown.name).small());
    let size = vec2(ui.available_width().min(LEGEND[0]), LEGEND[1]);
    let (bar, _) = ui.allocate_exact_size(size, Sense::hover());
    let n = bar.width().max(1.0) as u32;
    for column in 0..n {
        let [r, g, b] = map.at((column as f32 + 0.5) / n as f32).map(to_srgb);
        let left = bar.min + vec2(column as f32, 0.0);
        let column = Rect::from_min_size(left, vec2(1.0, bar.height()));
        ui.painter().rect_filled(column, 0.0, Color32::from_rgb(r, g, b));
    }
    let ends = format!("{} to {}", typed::shown(low), typed::shown(high));
    ui.label(RichText::new(ends).small());
    ui.horizontal(|ui| {
        ui.label("scale");
        let is_wrong = !options.scale.trim().is_empty() && options.scale.parse::<Ends>().is_err();
        let color = is_wrong.then(|| ui.visuals().error_fg_color);
        let field = TextEdit::singleline(&mut options.scale).hint_text("usual, or p5:p95");
        let field = ui.add(field.text_color_opt(color).desired_width(110.0));
        if field.changed() {
            let told: Option<Ends> = options.scale.parse().ok();
            view.ends = Ends { center: view.ends.center, ..told.unwrap_or_default() };
        }
    });
}

/// Width and height of the legend, points.
const LEGEND: [f32; 2] = [200.0, 10.0];

fn label(color: Color) -> &'static str {
    match color {
        Color::None => "plain",
        Color::Quality => "quality (radius ratio)",
        other => other.name(),
    }
}

/// The clip plane: across an axis of the volume, at a share of it.
fn plane(ui: &mut Ui, scene: &Scene, view: &mut View, options: &mut Options) {
    ui.horizontal(|ui| {
        ui.checkbox(&mut options.clip, "clip across");
        for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
            ui.selectable_value(&mut options.clip_axis, axis, name);
        }
        ui.checkbox(&mut options.clip_is_turned, "other side");
    });
    ui.add_enabled(options.clip, Slider::new(&mut options.clip_share, 0.0..=1.0).text("at"));
    view.clip = options.clip.then(|| {
        let size = length(scene.spectrum.volume(), options.clip_axis);
        let sign = if options.clip_is_turned { -1.0 } else { 1.0 };
        let mut normal = [0.0; 3];
        normal[options.clip_axis] = sign;
        Clip { normal, offset: sign * options.clip_share * size }
    });
}

/// Isovalues that are worth a look, by name.
fn offered(ui: &mut Ui, scene: &mut Scene) -> Option<Command> {
    let mut command = None;
    ui.horizontal_wrapped(|ui| {
        for (isovalue, name) in scene.offered() {
            let text = typed::short(*isovalue);
            let text = if *name == text { text } else { format!("{name} ({text})") };
            if ui.button(text).clicked() {
                command = Some(Command::GoTo(*isovalue));
            }
        }
    });
    command
}

/// Which components are shown.
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
        for (one, name) in [(Tool::Keep, "keep one"), (Tool::Hide, "hide one")] {
            let is_in_hand = *tool == Some(one);
            if ui.selectable_label(is_in_hand, name).clicked() {
                *tool = (!is_in_hand).then_some(one);
            }
        }
        if ui.selectable_label(*tool == Some(Tool::Measure), "measure (M)").clicked() {
            command = Some(Command::Act(Action::Measure));
        }
        let is_all = view.keep.is_all() && scene.picks.is_empty();
        if ui.add_enabled(!is_all, Button::new("show all (A)")).clicked() {
            command = Some(Command::Act(Action::ShowAll));
        }
    });
    command
}

fn saves(ui: &mut Ui, options: &mut Options) -> Option<Command> {
    let mut command = None;
    ui.horizontal_wrapped(|ui| {
        ui.label("save");
        if ui.button("picture (S)").clicked() {
            command = Some(Command::Picture);
        }
        for extension in chooser::WRITTEN.into_iter().filter(|&extension| extension != "png") {
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

fn facts(ui: &mut Ui, scene: &Scene) {
    let (low, high) = scene.spectrum.range();
    let milliseconds = 1e3 * scene.cost().as_secs_f64();
    for line in [
        format!("{} triangles", scene.n_triangles()),
        format!("{milliseconds:.1} ms for the last picture"),
        format!("range {} to {}", typed::shown(low), typed::shown(high)),
        format!("{} events at {} isovalues", scene.spectrum.events().len(), scene.events.len()),
    ] {
        ui.label(RichText::new(line).small());
    }
}
