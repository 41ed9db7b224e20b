//! The dialog to open or save a file. It is drawn by egui, because native dialogs need the libraries of the desktop.

use std::path::{Path, PathBuf};

use eframe::egui::{self, Align2, Key, RichText, ScrollArea, TextEdit, Ui, vec2};

use super::save;

/// Extensions of files that can be opened, in lower case.
const READABLE: [&str; 23] = [
    "isp", "thesis", "nrrd", "nhdr", "nii", "gz", "hdr", "mha", "mhd", "vti", "vtk", "tif", "tiff",
    "dcm", "mrc", "map", "ccp4", "rec", "cube", "npy", "npz", "raw", "ima",
];

/// Maximum width of the dialog and height of its list, points.
const MAX_SIZE: [f32; 2] = [440.0, 260.0];

/// The purpose of a dialog.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Purpose {
    Open,
    Save,
}

/// The result of a frame of the dialog.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Outcome {
    /// The dialog is still open.
    Open,
    /// Closed without a choice.
    Cancelled,
    /// A file, or a folder that is opened as a whole.
    Chosen(PathBuf),
}

/// An entry of the list.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Entry {
    name: String,
    is_folder: bool,
}

/// The dialog.
#[derive(Clone, Debug)]
pub(super) struct FileDialog {
    purpose: Purpose,
    folder: PathBuf,
    entries: Vec<Entry>,
    /// The text in the field: a typed name or path, or the clicked name.
    name: String,
    /// An error or a question.
    message: Option<String>,
    /// The existing file that is replaced if the user confirms.
    to_replace: Option<PathBuf>,
    needs_focus: bool,
}

impl FileDialog {
    /// A dialog that shows a folder, with a default name.
    pub(super) fn new(purpose: Purpose, folder: &Path, name: String) -> Self {
        let mut dialog = FileDialog {
            purpose,
            folder: PathBuf::new(),
            entries: Vec::new(),
            name,
            message: None,
            to_replace: None,
            needs_focus: true,
        };
        // If the folder does not exist any more, show the root.
        dialog.enter(folder.canonicalize().unwrap_or_else(|_| PathBuf::from("/")));
        dialog
    }

    pub(super) fn purpose(&self) -> Purpose {
        self.purpose
    }

    /// Lists a folder.
    fn enter(&mut self, folder: PathBuf) {
        match entries(&folder, self.purpose) {
            Ok(entries) => {
                (self.entries, self.folder) = (entries, folder);
                self.message = None;
            }
            Err(error) => self.message = Some(format!("{}: {error}", folder.display())),
        }
    }

    /// Accepts the text in the field: enters a folder, or chooses a file.
    fn accept(&mut self) -> Outcome {
        let path = self.folder.join(self.name.trim());
        if self.name.trim().is_empty() {
            return Outcome::Open;
        }
        if self.purpose == Purpose::Open {
            if path.exists() && !(path.is_dir() && is_to_be_entered(&path)) {
                return Outcome::Chosen(path);
            }
            match path.is_dir() {
                true => self.enter_typed(path),
                false => self.message = Some(format!("{}: no such file", path.display())),
            }
            return Outcome::Open;
        }
        if path.is_dir() {
            self.enter_typed(path);
            return Outcome::Open;
        }
        let extension =
            path.extension().and_then(|e| e.to_str()).unwrap_or("").to_ascii_lowercase();
        if !save::EXTENSIONS.contains(&extension.as_str()) {
            let expected = save::EXTENSIONS.join(", .");
            self.message = Some(format!("expected a name that ends in .{expected}"));
            return Outcome::Open;
        }
        if path.exists() && self.to_replace.as_ref() != Some(&path) {
            self.message = Some("the file exists; save again to replace it".into());
            self.to_replace = Some(path);
            return Outcome::Open;
        }
        Outcome::Chosen(path)
    }

    /// Enters a folder that was typed into the field.
    fn enter_typed(&mut self, folder: PathBuf) {
        self.enter(folder);
        if self.message.is_none() && self.purpose == Purpose::Open {
            self.name.clear();
        }
    }

    /// Shows the dialog.
    pub(super) fn show(&mut self, context: &egui::Context) -> Outcome {
        let (title, verb) = match self.purpose {
            Purpose::Open => ("open a spectrum or a volume", "open"),
            Purpose::Save => ("save as a picture or a mesh", "save"),
        };
        let available = context.content_rect().size() - vec2(40.0, 190.0);
        let size = vec2(MAX_SIZE[0].min(available.x), MAX_SIZE[1].min(available.y.max(40.0)));
        let mut outcome = Outcome::Open;
        let dialog = egui::Window::new(title).collapsible(false).resizable(false);
        dialog.anchor(Align2::CENTER_CENTER, vec2(0.0, 0.0)).show(context, |ui| {
            ui.set_width(size.x);
            ui.horizontal(|ui| {
                let parent = self.folder.parent().map(Path::to_path_buf);
                if ui.add_enabled(parent.is_some(), egui::Button::new("up")).clicked()
                    && let Some(parent) = parent
                {
                    self.enter(parent);
                }
                ui.add(egui::Label::new(self.folder.display().to_string()).truncate());
            });
            if let Some(chosen) = self.list(ui, size.y) {
                outcome = chosen;
            }
            let field = ui.add(
                TextEdit::singleline(&mut self.name)
                    .hint_text("name, or a path")
                    .desired_width(size.x),
            );
            if std::mem::take(&mut self.needs_focus) {
                field.request_focus();
            }
            let is_entered = field.lost_focus() && ui.input(|input| input.key_pressed(Key::Enter));
            if let Some(message) = &self.message {
                ui.label(message);
            }
            ui.horizontal(|ui| {
                if ui.button(verb).clicked() || is_entered {
                    outcome = self.accept();
                    if is_entered {
                        self.needs_focus = true;
                    }
                }
                if ui.button("cancel").clicked() {
                    outcome = Outcome::Cancelled;
                }
            });
        });
        if context.input(|input| input.key_pressed(Key::Escape)) {
            outcome = Outcome::Cancelled;
        }
        outcome
    }

    /// The list of folders and files: a click selects, a double click accepts.
    fn list(&mut self, ui: &mut Ui, height: f32) -> Option<Outcome> {
        let mut clicked = None;
        let area = ScrollArea::vertical().max_height(height).min_scrolled_height(height);
        area.auto_shrink([false, false]).show(ui, |ui| {
            if self.entries.is_empty() {
                ui.label(RichText::new("no files that can be read").weak());
            }
            for entry in &self.entries {
                let label =
                    if entry.is_folder { format!("{}/", entry.name) } else { entry.name.clone() };
                let response = ui.selectable_label(self.name == entry.name, label);
                if response.clicked() || response.double_clicked() {
                    clicked = Some((entry.clone(), response.double_clicked()));
                }
            }
        });
        let (entry, is_double) = clicked?;
        if entry.is_folder && self.purpose == Purpose::Save {
            self.enter(self.folder.join(entry.name));
            return None;
        }
        self.name = entry.name;
        (is_double || (entry.is_folder && is_to_be_entered(&self.folder.join(&self.name))))
            .then(|| self.accept())
    }
}

/// Whether the dialog enters a folder. Otherwise it is a series of slices, and is opened as a whole.
fn is_to_be_entered(folder: &Path) -> bool {
    let is_slice = |entry: &Entry| {
        let extension = entry.name.rsplit_once('.').map_or("", |(_, extension)| extension);
        let extension = extension.to_lowercase();
        !entry.is_folder && ["dcm", "ima", "tif", "tiff", "png"].contains(&&*extension)
    };
    let has_no_slices = |entries: Vec<Entry>| !entries.iter().any(is_slice);
    entries(folder, Purpose::Open).is_ok_and(has_no_slices)
}

/// Folders, then files with a suitable extension, by name; without hidden ones.
fn entries(folder: &Path, purpose: Purpose) -> std::io::Result<Vec<Entry>> {
    let extensions = match purpose {
        Purpose::Open => &READABLE[..],
        Purpose::Save => &save::EXTENSIONS[..],
    };
    let mut entries = Vec::new();
    for entry in std::fs::read_dir(folder)? {
        let entry = entry?;
        let name = entry.file_name().to_string_lossy().into_owned();
        // Follows symbolic links.
        let is_folder = entry.path().is_dir();
        let extension = name.rsplit_once('.').map_or("", |(_, extension)| extension);
        let is_suitable = extensions.contains(&&*extension.to_ascii_lowercase());
        if !name.starts_with('.') && (is_folder || is_suitable) {
            entries.push(Entry { name, is_folder });
        }
    }
    entries.sort_by_key(|entry| (!entry.is_folder, entry.name.to_lowercase()));
    Ok(entries)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn folder() -> tempfile::TempDir {
        let folder = tempfile::tempdir().expect("a folder");
        for name in ["b.isp", "a.NRRD", "notes.txt", ".hidden.isp", "old.png"] {
            std::fs::write(folder.path().join(name), "x").expect("a file");
        }
        std::fs::create_dir(folder.path().join("slices")).expect("a folder");
        std::fs::write(folder.path().join("slices/1.dcm"), "x").expect("a file");
        std::fs::create_dir(folder.path().join("more")).expect("a folder");
        folder
    }

    #[test]
    fn readable_files_are_listed_after_folders() {
        let folder = folder();
        let dialog = FileDialog::new(Purpose::Open, folder.path(), String::new());
        let names: Vec<&str> = dialog.entries.iter().map(|entry| &*entry.name).collect();
        assert_eq!(names, ["more", "slices", "a.NRRD", "b.isp"]);
    }

    #[test]
    fn names_are_accepted_or_a_message_says_why_not() {
        let folder = folder();
        let at = |name: &str| folder.path().canonicalize().expect("a folder").join(name);
        let mut open = FileDialog::new(Purpose::Open, folder.path(), "b.isp".into());
        assert_eq!(open.accept(), Outcome::Chosen(at("b.isp")));
        open.name = "none.isp".into();
        assert_eq!(open.accept(), Outcome::Open);
        let message = |dialog: &FileDialog| dialog.message.clone().unwrap_or_default();
        assert!(message(&open).ends_with("none.isp: no such file"));
        // A folder of slices is a volume; any other is entered.
        open.name = "slices".into();
        assert_eq!(open.accept(), Outcome::Chosen(at("slices")));
        open.name = "more".into();
        assert_eq!((open.accept(), &*open.folder), (Outcome::Open, &*at("more")));

        let mut save = FileDialog::new(Purpose::Save, folder.path(), "old".into());
        assert_eq!(save.accept(), Outcome::Open);
        assert!(message(&save).starts_with("expected a name"));
        save.name = "old.png".into();
        assert_eq!(save.accept(), Outcome::Open, "nothing is replaced without confirmation");
        assert_eq!(save.accept(), Outcome::Chosen(at("old.png")));
        save.name = "new.3mf".into();
        assert_eq!(save.accept(), Outcome::Chosen(at("new.3mf")));
    }
}
