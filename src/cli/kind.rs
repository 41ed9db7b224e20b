//! The kind of an input file, for errors about swapped files.

use std::fs::File;
use std::io::Read as _;
use std::path::Path;

use isospectrum::file::MAGIC;
use isospectrum::volume::is_volume_name;
use isospectrum::{Error, Result};

/// A kind of input file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Spectrum,
    Volume,
    Mesh,
}

impl Kind {
    fn name(self) -> &'static str {
        match self {
            Kind::Spectrum => "a spectrum",
            Kind::Volume => "a volume",
            Kind::Mesh => "a mesh",
        }
    }
}

/// Returns the kind of a regular file by its first bytes, else by its name.
pub(super) fn of(path: &Path) -> Option<Kind> {
    if !std::fs::metadata(path).ok()?.is_file() {
        return None;
    }
    let mut head = [0; MAGIC.len()];
    let n = File::open(path).and_then(|mut file| file.read(&mut head)).unwrap_or(0);
    let extension = path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
    match (&head[..n], extension.as_str()) {
        (head, _) if *head == MAGIC => Some(Kind::Spectrum),
        (_, "isp" | "thesis") => Some(Kind::Spectrum),
        _ if is_volume_name(path) => Some(Kind::Volume),
        (_, "ply" | "stl" | "obj" | "glb") => Some(Kind::Mesh),
        _ => None,
    }
}

/// Checks that a file is not of another kind than the expected one.
///
/// # Errors
///
/// [`Error::Usage`] that names both kinds.
pub(super) fn check(path: &Path, expected: Kind) -> Result<()> {
    let Some(found) = of(path).filter(|&found| found != expected) else { return Ok(()) };
    let expected = match expected {
        Kind::Spectrum if found == Kind::Volume => "a spectrum (.isp), see `isospectrum compute`",
        Kind::Spectrum => "a spectrum (.isp)",
        Kind::Volume => "a volume (.nrrd, .nii, .mha, .vti, .mrc, .cube, .npy, .raw, ...)",
        Kind::Mesh => "a mesh",
    };
    let shown = path.display();
    Err(Error::Usage(format!("{shown}: {}, expected {expected}", found.name())))
}
