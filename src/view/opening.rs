//! The initial state of a window.

use std::path::PathBuf;
use std::sync::Arc;

use crate::file::SpectrumFile;
use crate::render::{Surface, View};
use crate::spectrum::Spectrum;
use crate::sweep::Parameters;
use crate::volume::Volume;

/// The initial content of a window.
#[derive(Debug, Default)]
pub enum Content {
    /// Nothing: the user opens files.
    #[default]
    Nothing,
    /// A spectrum and its displayed name.
    Spectrum(String, Box<Spectrum>),
    /// A spectrum file and its displayed name. Of a large one only the chunks that the shown isovalues need are read.
    File(String, Arc<SpectrumFile>),
    /// A volume, whose spectrum is computed in the window after its user has chosen how.
    Volume(Box<Volume>),
    /// A volume, whose spectrum is computed in the window at once.
    Phantom(Box<Volume>),
}

/// The initial state of a window.
#[derive(Debug, Default)]
pub struct Opening {
    /// The content.
    pub content: Content,
    /// The volume of the spectrum: for a histogram of its samples behind the curves, and for isovalues such as `p99`.
    pub volume: Option<Volume>,
    /// A second field for colours.
    pub field: Option<Volume>,
    /// The first isosurface and further pinned ones; if empty, that of [`Spectrum::shown_first`], or of the file.
    pub surfaces: Vec<Surface>,
    /// Isovalues that are offered by name; if empty, suggested ones.
    pub marks: Vec<(f64, String)>,
    /// The view; width and height are those of the window, points.
    pub view: View,
    /// Parameters of spectra computed in the window.
    pub parameters: Parameters,
    /// Files of more triangles are read in parts, and so many triangles of them are kept.
    pub max_triangles: u64,
    /// A part of the name of the adapter.
    pub adapter: Option<String>,
    /// The folder for saved pictures and meshes.
    pub folder: PathBuf,
    /// A file for the names and places of the window's controls, for tests.
    pub controls: Option<PathBuf>,
}
