//! A list of the window's controls with their places, in a file: tests of the window find controls by their names.

use std::collections::HashMap;
use std::fs;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};

use eframe::egui::accesskit::{Node, NodeId, Role, TreeUpdate};
use eframe::egui::{Context, FullOutput, Plugin, ViewportCommand};

use crate::error::Error;

/// Writes the list after each frame that changes it: a line for each control, with its role, left, top, width and height
/// in pixels of the window, and its name or else its value, separated by tabs.
pub(super) struct ControlList {
    path: PathBuf,
    written: String,
    /// The error that closes the window.
    failure: Arc<Mutex<Option<Error>>>,
}

impl ControlList {
    /// Starts the list of a window.
    pub(super) fn start(path: PathBuf, failure: Arc<Mutex<Option<Error>>>, window: &Context) {
        window.enable_accesskit();
        window.add_plugin(ControlList { path, written: String::new(), failure });
    }
}

impl Plugin for ControlList {
    fn debug_name(&self) -> &'static str {
        "controls"
    }

    fn output_hook(&mut self, window: &Context, output: &mut FullOutput) {
        let Some(update) = output.platform_output.accesskit_update.take() else { return };
        let list = listed(&update, f64::from(window.pixels_per_point()));
        if list == self.written {
            return;
        }
        // Renamed, so that a reader sees a whole list.
        let new = self.path.with_extension("new");
        match fs::write(&new, &list).and_then(|()| fs::rename(&new, &self.path)) {
            Ok(()) => self.written = list,
            Err(error) => {
                let error = Error::io(&self.path, error);
                *self.failure.lock().unwrap_or_else(PoisonError::into_inner) = Some(error);
                window.send_viewport_cmd(ViewportCommand::Close);
            }
        }
    }
}

fn listed(update: &TreeUpdate, pixels_per_point: f64) -> String {
    let nodes: HashMap<NodeId, &Node> = update.nodes.iter().map(|(id, node)| (*id, node)).collect();
    let name = |node: &Node| {
        let labels = node.labelled_by().iter().filter_map(|id| nodes.get(id));
        let labels: Vec<&str> =
            labels.filter_map(|label| label.label().or(label.value())).collect();
        let own = node.label().map(str::to_owned);
        own.or((!labels.is_empty()).then(|| labels.join(" "))).or(node.value().map(str::to_owned))
    };
    let is_control = |node: &Node| !matches!(node.role(), Role::TextRun | Role::GenericContainer);
    let line = |node: &Node| {
        let (bounds, name) = (node.bounds()?, name(node)?);
        let [left, top, width, height] = [bounds.x0, bounds.y0, bounds.width(), bounds.height()]
            .map(|points| (points * pixels_per_point).round() as i64);
        let name = name.replace(['\n', '\t'], " ");
        let text = format!("{:?}\t{left}\t{top}\t{width}\t{height}\t{name}\n", node.role());
        Some(([top, left], text))
    };
    let nodes = update.nodes.iter().map(|(_, node)| node).filter(|node| is_control(node));
    let mut lines: Vec<([i64; 2], String)> = nodes.filter_map(line).collect();
    lines.sort();
    lines.into_iter().map(|(_, text)| text).collect()
}
