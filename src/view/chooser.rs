//! Choosing a file, to open it or to save under its name. The window's own: dialogs of desktops would need their libraries.

use std::path::{Path, PathBuf};

use eframe::egui::{self, Align2, Key, RichText, ScrollArea, TextEdit, Ui, vec2};

use crate::file::is_folder;

/// Endings of what can be opened, in small letters.
const READ: [&str; 23] = [
    "isp", "thesis", "nrrd", "nhdr", "nii", "gz", "hdr", "mha", "mhd", "vti", "vtk", "tif", "tiff",
    "dcm", "mrc", "map", "ccp4", "rec", "cube", "npy", "npz", "raw", "ima",
];

/// Endings of what can be saved.
pub(super) const WRITTEN: [&str; 7] = ["png", "ply", "stl", "obj", "glb", "vtp", "3mf"];

/// Width of the dialog and height of its list, points, where the window has room.
const SIZE: [f32; 2] = [440.0, 260.0];

/// What a file is chosen for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Purpose {
    /// To be read.
    Open,
    /// To be written.
    Save,
}

/// What came of a frame of the dialog.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Outcome {
    /// Still open.
    Open,
    /// Closed without a choice.
    Cancelled,
    /// A file, or a folder of slices.
    Chosen(PathBuf),
}

/// A file or a folder of the list.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Entry {
    name: String,
    is_folder: bool,
}

/// The dialog.
#[derive(Clone, Debug)]
pub(super) struct Chooser {
    purpose: Purpose,
    folder: PathBuf,
    entries: Vec<Entry>,
    /// What is typed, or the name that was clicked.
    name: String,
    /// What is wrong, or asked.
    said: Option<String>,
    /// The file that would be replaced, once that was told.
    replaced: Option<PathBuf>,
    is_new: bool,
}

impl Chooser {
    /// A dialog that begins in a folder, with a name to save under.
    pub(super) fn new(purpose: Purpose, folder: &Path, name: String) -> Self {
        let mut chooser = Chooser {
            purpose,
            folder: PathBuf::new(),
            entries: Vec::new(),
            name,
            said: None,
            replaced: None,
            is_new: true,
        };
        // Where it is no more, at the root.
        let folder = folder.canonicalize().unwrap_or_else(|_| PathBuf::from("/"));
        chooser.enter(folder);
        chooser
    }

    /// What the file is chosen for.
    pub(super) fn purpose(&self) -> Purpose {
        self.purpose
    }

    /// Lists a folder.
    fn enter(&mut self, folder: PathBuf) {
        match entries(&folder, self.purpose) {
            Ok(entries) => {
                (self.entries, self.folder) = (entries, folder);
                self.said = None;
            }
            Err(error) => self.said = Some(format!("{}: {error}", folder.display())),
        }
    }

    /// Takes what is typed: enters a folder, or chooses a file.
    fn take(&mut self) -> Outcome {
        let path = self.folder.join(self.name.trim());
        if self.name.trim().is_empty() {
            return Outcome::Open;
        }
        if self.purpose == Purpose::Open {
            if path.exists() && !(path.is_dir() && holds_folders_or_spectra(&path)) {
                return Outcome::Chosen(path);
            }
            match path.is_dir() {
                true => self.descend(path),
                false => self.said = Some(format!("{}: no such file", path.display())),
            }
            return Outcome::Open;
        }
        if path.is_dir() {
            self.descend(path);
            return Outcome::Open;
        }
        let ending = path.extension().and_then(|e| e.to_str()).unwrap_or("").to_ascii_lowercase();
        if !WRITTEN.contains(&ending.as_str()) {
            self.said = Some(format!("expected a name that ends in .{}", WRITTEN.join(", .")));
            return Outcome::Open;
        }
        if path.exists() && self.replaced.as_ref() != Some(&path) {
            self.said = Some("there is such a file; once more replaces it".into());
            self.replaced = Some(path);
            return Outcome::Open;
        }
        Outcome::Chosen(path)
    }

    fn descend(&mut self, folder: PathBuf) {
        self.enter(folder);
        if self.said.is_none() && self.purpose == Purpose::Open {
            self.name.clear();
        }
    }

    /// Shows the dialog.
    pub(super) fn show(&mut self, context: &egui::Context) -> Outcome {
        let (title, verb) = match self.purpose {
            Purpose::Open => ("open a spectrum or a volume", "open"),
            Purpose::Save => ("save what is seen as a picture or a mesh", "save"),
        };
        let room = context.content_rect().size() - vec2(40.0, 190.0);
        let size = vec2(SIZE[0].min(room.x), SIZE[1].min(room.y.max(40.0)));
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
            if std::mem::take(&mut self.is_new) {
                field.request_focus();
            }
            let is_entered = field.lost_focus() && ui.input(|input| input.key_pressed(Key::Enter));
            if let Some(said) = &self.said {
                ui.label(said);
            }
            ui.horizontal(|ui| {
                if ui.button(verb).clicked() || is_entered {
                    outcome = self.take();
                    if is_entered {
                        self.is_new = true;
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

    /// The folders and files, of which one can be clicked, or twice to take it at once.
    fn list(&mut self, ui: &mut Ui, height: f32) -> Option<Outcome> {
        let mut clicked = None;
        let area = ScrollArea::vertical().max_height(height).min_scrolled_height(height);
        area.auto_shrink([false, false]).show(ui, |ui| {
            if self.entries.is_empty() {
                ui.label(RichText::new("nothing here that can be read").weak());
            }
            for entry in &self.entries {
                let shown =
                    if entry.is_folder { format!("{}/", entry.name) } else { entry.name.clone() };
                let response = ui.selectable_label(self.name == entry.name, shown);
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
        (is_double || (entry.is_folder && holds_folders_or_spectra(&self.folder.join(&self.name))))
            .then(|| self.take())
    }
}

/// Whether a folder is one to go into; else it may be a series of slices or the parts of a spectrum, and is opened as a whole.
fn holds_folders_or_spectra(folder: &Path) -> bool {
    let is_slice = |entry: &Entry| {
        let ending = entry.name.rsplit_once('.').map_or("", |(_, ending)| ending);
        !entry.is_folder && ["dcm", "ima", "tif", "tiff", "png"].contains(&&*ending.to_lowercase())
    };
    let holds = |entries: Vec<Entry>| !entries.iter().any(is_slice);
    !is_folder(folder) && entries(folder, Purpose::Open).is_ok_and(holds)
}

/// Folders, then files that can be read, by name; hidden ones are left out.
fn entries(folder: &Path, purpose: Purpose) -> std::io::Result<Vec<Entry>> {
    let endings = if purpose == Purpose::Open { &READ[..] } else { &WRITTEN[..] };
    let mut entries = Vec::new();
    for entry in std::fs::read_dir(folder)? {
        let entry = entry?;
        let name = entry.file_name().to_string_lossy().into_owned();
        // Where a link leads is what counts.
        let is_folder = entry.path().is_dir();
        let ending = name.rsplit_once('.').map_or("", |(_, ending)| ending).to_ascii_lowercase();
        if !name.starts_with('.') && (is_folder || endings.contains(&ending.as_str())) {
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
        for name in ["more", "s.ispt"] {
            std::fs::create_dir(folder.path().join(name)).expect("a folder");
        }
        std::fs::write(folder.path().join("s.ispt/index.json"), "x").expect("a file");
        folder
    }

    #[test]
    fn what_can_be_read_is_listed_folders_first() {
        let folder = folder();
        let chooser = Chooser::new(Purpose::Open, folder.path(), String::new());
        let names: Vec<&str> = chooser.entries.iter().map(|entry| &*entry.name).collect();
        assert_eq!(names, ["more", "s.ispt", "slices", "a.NRRD", "b.isp"]);
    }

    #[test]
    fn names_are_taken_or_it_is_said_why_not() {
        let folder = folder();
        let at = |name: &str| folder.path().canonicalize().expect("a folder").join(name);
        let mut open = Chooser::new(Purpose::Open, folder.path(), "b.isp".into());
        assert_eq!(open.take(), Outcome::Chosen(at("b.isp")));
        open.name = "none.isp".into();
        assert_eq!(open.take(), Outcome::Open);
        assert!(open.said.as_ref().is_some_and(|said| said.ends_with("none.isp: no such file")));
        // A folder of slices is a volume, one of parts a spectrum; any other is entered.
        for name in ["slices", "s.ispt"] {
            open.name = name.into();
            assert_eq!(open.take(), Outcome::Chosen(at(name)));
        }
        open.name = "more".into();
        assert_eq!((open.take(), &*open.folder), (Outcome::Open, &*at("more")));

        let mut save = Chooser::new(Purpose::Save, folder.path(), "old".into());
        assert_eq!(save.take(), Outcome::Open);
        assert!(save.said.as_ref().is_some_and(|said| said.starts_with("expected a name")));
        save.name = "old.png".into();
        assert_eq!(save.take(), Outcome::Open, "nothing is replaced unasked");
        assert_eq!(save.take(), Outcome::Chosen(at("old.png")));
        save.name = "new.3mf".into();
        assert_eq!(save.take(), Outcome::Chosen(at("new.3mf")));
    }
}
