//! Saving spectra, pictures, meshes and sweeps. Only [`save_as`] replaces files.

use std::path::{Path, PathBuf};

use super::numbers::format_number;
use super::scene::Scene;
use crate::error::{Error, Result};
use crate::export::{self, Border};
use crate::file;
use crate::render::View;
use crate::spectrum::{Mesh, Picked, Query};
use crate::volume::between;

/// Extensions of the files that can be saved.
pub(super) const EXTENSIONS: [&str; 8] = ["isp", "png", "ply", "stl", "obj", "glb", "vtp", "3mf"];

/// The beginning of file names of a scene: the folder, and the name of the scene without its extension.
fn stem(folder: &Path, scene: &Scene) -> PathBuf {
    let name = Path::new(&scene.name).file_stem().unwrap_or_default().to_string_lossy();
    // The name of a volume may come from a file and have any characters and length.
    let plain: String = (name.chars())
        .map(|c| if c.is_alphanumeric() || "-_.".contains(c) { c } else { '_' })
        .take(100)
        .collect();
    folder.join(if plain.is_empty() { "spectrum".into() } else { plain })
}

/// The default file name: that of a computed spectrum until it is saved, then that of a picture.
pub(super) fn default_name(scene: &Scene) -> String {
    if scene.is_unsaved {
        return stem(Path::new(""), scene).with_extension("isp").to_string_lossy().into_owned();
    }
    let path = free_path(Path::new(""), scene, "png");
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

/// Writes a spectrum, a picture or a mesh, by the extension, and replaces an existing file. Returns a message.
///
/// # Errors
///
/// [`Error::Usage`] for an unknown extension, [`Error::Io`], and those of the painter.
pub(super) fn save_as(path: &Path, scene: &mut Scene, view: &View) -> Result<String> {
    if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("png")) {
        scene.picture(view)?.write_png(path)?;
        return Ok(format!("saved {}", path.display()));
    }
    if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("isp")) {
        match scene.file() {
            // Only some of its chunks are in memory.
            Some(whole) => file::write(&whole.read()?, path)?,
            None => file::write(&scene.spectrum, path)?,
        }
        scene.is_unsaved = false;
        return Ok(format!("saved {}", path.display()));
    }
    let n_triangles = write_mesh(path, scene, view)?;
    Ok(mesh_message(path, n_triangles))
}

/// `stem-37.2.png`, or `stem-37.2-2.png` if that exists.
fn free_path(folder: &Path, scene: &Scene, extension: &str) -> PathBuf {
    let stem = stem(folder, scene).display().to_string();
    let isovalue = format_number(scene.isovalue);
    let numbered = |n: u32| match n {
        1 => PathBuf::from(format!("{stem}-{isovalue}.{extension}")),
        n => PathBuf::from(format!("{stem}-{isovalue}-{n}.{extension}")),
    };
    (1..).map(numbered).find(|path| !path.exists()).unwrap_or_else(|| numbered(0))
}

/// Writes the picture as PNG, under a new name. Returns a message.
///
/// # Errors
///
/// As [`save_as`].
pub(super) fn picture(folder: &Path, scene: &mut Scene, view: &View) -> Result<String> {
    save_as(&free_path(folder, scene, "png"), scene, view)
}

/// Writes the mesh in the format of the extension, under a new name. Returns a message.
///
/// # Errors
///
/// As [`save_as`].
pub(super) fn mesh(
    folder: &Path,
    scene: &mut Scene,
    view: &View,
    extension: &str,
) -> Result<String> {
    save_as(&free_path(folder, scene, extension), scene, view)
}

/// Writes all shown surfaces as one mesh, without clipping. Returns the number of triangles.
fn write_mesh(path: &Path, scene: &Scene, view: &View) -> Result<usize> {
    let around;
    let spectrum = match scene.file() {
        // Read again, so that the file does not depend on the chunks that happen to be loaded.
        Some(file) => {
            around = file.read_around(&scene.isovalues())?;
            &around
        }
        None => &*scene.spectrum,
    };
    let mut query = Query::new(spectrum);
    let mut mesh = Mesh::default();
    for (i, surface) in scene.surfaces().into_iter().enumerate() {
        // Only components of the first surface are picked.
        let picked = if i == 0 { view.picked.clone() } else { Picked::default() };
        let shown = query.mesh_at(surface.isovalue)?.with_shown(&view.keep, &picked);
        let first = mesh.positions.len() as u32;
        mesh.triangles.extend(shown.triangles.iter().map(|t| t.map(|v| v + first)));
        mesh.positions.extend(shown.positions);
        mesh.normals.extend(shown.normals);
        mesh.caps.extend(shown.caps);
    }
    let border = if view.open { Border::Open } else { Border::Closed };
    export::write(&mesh, &scene.spectrum.volume().placement, border, path)?;
    Ok(mesh.caps.iter().filter(|&&is_cap| !(view.open && is_cap)).count())
}

/// The message about a saved mesh.
fn mesh_message(path: &Path, n_triangles: usize) -> String {
    let path = path.display();
    match n_triangles {
        0 => format!("saved {path}, which is empty: there is no surface at this isovalue"),
        _ => format!("saved {path}"),
    }
}

/// A sweep that is being saved, one picture per frame of the window.
#[derive(Debug)]
pub(super) struct SweepExport {
    folder: PathBuf,
    prefix: String,
    next: u32,
    n_frames: u32,
    /// The isovalue to return to.
    isovalue: f64,
}

impl SweepExport {
    /// Starts a sweep of `n_frames` pictures in a new folder, `stem-sweep`.
    ///
    /// # Errors
    ///
    /// [`Error::Io`] if the folder cannot be created.
    pub(super) fn start(folder: &Path, scene: &Scene, n_frames: u32) -> Result<Self> {
        let stem = stem(folder, scene);
        let numbered = |n: u32| match n {
            1 => PathBuf::from(format!("{}-sweep", stem.display())),
            n => PathBuf::from(format!("{}-sweep-{n}", stem.display())),
        };
        let folder = (1..).map(numbered).find(|path| !path.exists());
        let folder = folder.unwrap_or_else(|| numbered(0));
        std::fs::create_dir(&folder).map_err(|error| Error::io(&folder, error))?;
        Ok(SweepExport {
            prefix: stem.file_name().unwrap_or_default().to_string_lossy().into_owned(),
            folder,
            next: 0,
            n_frames: n_frames.max(2),
            isovalue: scene.isovalue,
        })
    }

    /// Fraction done, 0 to 1.
    pub(super) fn progress(&self) -> f64 {
        f64::from(self.next) / f64::from(self.n_frames)
    }

    /// Writes the next picture.
    ///
    /// # Errors
    ///
    /// As [`save_as`].
    pub(super) fn step(&mut self, scene: &mut Scene, view: &mut View) -> Result<()> {
        let share = f64::from(self.next) / f64::from(self.n_frames - 1);
        scene.isovalue = between(scene.spectrum.range(), share);
        scene.update_picks(view)?;
        let name = format!("{}-{:05}.png", self.prefix, self.next + 1);
        scene.picture(view)?.write_png(&self.folder.join(name))?;
        self.next += 1;
        Ok(())
    }

    /// Whether all pictures are written.
    pub(super) fn is_done(&self) -> bool {
        self.next >= self.n_frames
    }

    /// Returns to the isovalue before the sweep. Returns a message.
    pub(super) fn finish(self, scene: &mut Scene) -> String {
        scene.isovalue = self.isovalue;
        format!("{} pictures in {}", self.next, self.folder.display())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_message_mentions_an_empty_mesh() {
        assert_eq!(mesh_message(Path::new("a.ply"), 3), "saved a.ply");
        assert!(mesh_message(Path::new("a.ply"), 0).starts_with("saved a.ply, which is empty"));
    }
}
