//! Pictures, meshes and sweeps of what is seen, as files that never replace others.

use std::path::{Path, PathBuf};

use super::scene::Scene;
use super::typed;
use crate::error::{Error, Result};
use crate::export::{self, Border};
use crate::render::View;
use crate::spectrum::{Picked, Query, SurfaceMesh};

/// Where files of a scene go: the folder, and the name of the scene without its extension.
fn stem(folder: &Path, scene: &Scene) -> PathBuf {
    let name = Path::new(&scene.name).file_stem().unwrap_or_default().to_string_lossy();
    // The name of a volume may come from a file, and be anything.
    let plain: String = (name.chars())
        .map(|c| if c.is_alphanumeric() || "-_.".contains(c) { c } else { '_' })
        .take(100)
        .collect();
    folder.join(if plain.is_empty() { "spectrum".into() } else { plain })
}

/// The name that a picture has where nobody says another.
pub(super) fn usual_name(scene: &Scene) -> String {
    let path = free_path(Path::new(""), scene, "png");
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

/// Writes what is seen to a path, which is replaced: a picture or a mesh, by its extension; what there is to say.
///
/// # Errors
///
/// As [`picture`] and [`mesh`].
pub(super) fn save_as(path: &Path, scene: &mut Scene, view: &View) -> Result<String> {
    if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("png")) {
        write_picture(path, scene, view)?;
        return Ok(format!("saved {}", path.display()));
    }
    let n_triangles = write_mesh(path, scene, view)?;
    Ok(mesh_saved(path, n_triangles))
}

/// `stem-37.2.png`, or `stem-37.2-2.png` where that exists.
fn free_path(folder: &Path, scene: &Scene, extension: &str) -> PathBuf {
    let stem = stem(folder, scene).display().to_string();
    let isovalue = typed::shown(scene.isovalue);
    let numbered = |n: u32| match n {
        1 => PathBuf::from(format!("{stem}-{isovalue}.{extension}")),
        n => PathBuf::from(format!("{stem}-{isovalue}-{n}.{extension}")),
    };
    (1..).map(numbered).find(|path| !path.exists()).unwrap_or_else(|| numbered(0))
}

/// Writes the picture that is seen as PNG; where.
///
/// # Errors
///
/// As the painter's, and [`Error::Io`].
pub(super) fn picture(folder: &Path, scene: &mut Scene, view: &View) -> Result<PathBuf> {
    let path = free_path(folder, scene, "png");
    write_picture(&path, scene, view)?;
    Ok(path)
}

fn write_picture(path: &Path, scene: &mut Scene, view: &View) -> Result<()> {
    scene.picture(view)?.write_png(path)
}

/// Writes the mesh that is seen, all surfaces as one if there are several, uncut, in the format of the
/// extension; where, and how many triangles.
///
/// # Errors
///
/// [`Error::Usage`] for an unknown extension, [`Error::Io`].
pub(super) fn mesh(
    folder: &Path,
    scene: &Scene,
    view: &View,
    extension: &str,
) -> Result<(PathBuf, usize)> {
    let path = free_path(folder, scene, extension);
    let n_triangles = write_mesh(&path, scene, view)?;
    Ok((path, n_triangles))
}

/// Writes the mesh; how many triangles.
fn write_mesh(path: &Path, scene: &Scene, view: &View) -> Result<usize> {
    let around;
    let spectrum = match scene.folder() {
        // Anew, so that the file does not depend on what was seen before.
        Some(folder) => {
            around = folder.read_around(&scene.isovalues())?;
            &around
        }
        None => &*scene.spectrum,
    };
    let mut query = Query::new(spectrum);
    let mut mesh = SurfaceMesh::default();
    for (i, surface) in scene.surfaces().into_iter().enumerate() {
        // What is picked are components of the first.
        let picked = if i == 0 { view.picked.clone() } else { Picked::default() };
        let one = query.mesh_at(surface.isovalue)?.with_shown(&view.keep, &picked);
        let first = mesh.positions.len() as u32;
        mesh.triangles.extend(one.triangles.iter().map(|t| t.map(|v| v + first)));
        mesh.positions.extend(one.positions);
        mesh.normals.extend(one.normals);
        mesh.caps.extend(one.caps);
    }
    let border = if view.open { Border::Open } else { Border::Closed };
    export::write(&mesh, &scene.spectrum.volume().placement, border, path)?;
    Ok(mesh.caps.iter().filter(|&&is_cap| !(view.open && is_cap)).count())
}

/// What to say of a mesh that was saved: an empty file alone is a riddle.
pub(super) fn mesh_saved(path: &Path, n_triangles: usize) -> String {
    let path = path.display();
    match n_triangles {
        0 => format!("saved {path}, which is empty: there is no surface at this isovalue"),
        _ => format!("saved {path}"),
    }
}

/// A sweep being written, one picture at a time.
#[derive(Debug)]
pub(super) struct Sweep {
    folder: PathBuf,
    prefix: String,
    next: u32,
    n_frames: u32,
    /// Where the surface was before.
    isovalue: f64,
}

impl Sweep {
    /// Starts a sweep of `n_frames` pictures in a new folder, `stem-sweep`.
    ///
    /// # Errors
    ///
    /// [`Error::Io`] if the folder cannot be made.
    pub(super) fn start(folder: &Path, scene: &Scene, n_frames: u32) -> Result<Self> {
        let stem = stem(folder, scene);
        let named = |n: u32| match n {
            1 => PathBuf::from(format!("{}-sweep", stem.display())),
            n => PathBuf::from(format!("{}-sweep-{n}", stem.display())),
        };
        let folder = (1..).map(named).find(|path| !path.exists()).unwrap_or_else(|| named(0));
        std::fs::create_dir(&folder).map_err(|error| Error::io(&folder, error))?;
        Ok(Sweep {
            prefix: stem.file_name().unwrap_or_default().to_string_lossy().into_owned(),
            folder,
            next: 0,
            n_frames: n_frames.max(2),
            isovalue: scene.isovalue,
        })
    }

    /// The share that is done.
    pub(super) fn share(&self) -> f64 {
        f64::from(self.next) / f64::from(self.n_frames)
    }

    /// Writes the next picture.
    ///
    /// # Errors
    ///
    /// As [`picture`].
    pub(super) fn step(&mut self, scene: &mut Scene, view: &mut View) -> Result<()> {
        let (low, high) = scene.spectrum.range();
        let share = f64::from(self.next) / f64::from(self.n_frames - 1);
        scene.isovalue = (low * (1.0 - share) + high * share).clamp(low, high);
        scene.follow(view)?;
        let name = format!("{}-{:05}.png", self.prefix, self.next + 1);
        write_picture(&self.folder.join(name), scene, view)?;
        self.next += 1;
        Ok(())
    }

    /// Whether all pictures are written.
    pub(super) fn is_done(&self) -> bool {
        self.next >= self.n_frames
    }

    /// The surface goes back to where it was; what there is to say.
    pub(super) fn finish(self, scene: &mut Scene) -> String {
        scene.isovalue = self.isovalue;
        format!("{} pictures in {}", self.next, self.folder.display())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mesh_without_triangles_is_told() {
        assert_eq!(mesh_saved(Path::new("a.ply"), 3), "saved a.ply");
        assert!(mesh_saved(Path::new("a.ply"), 0).starts_with("saved a.ply, which is empty"));
    }
}
