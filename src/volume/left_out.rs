//! Stand-ins for the readers whose features are disabled: each fails with the name of its feature.

use std::fs::File;
use std::path::{Path, PathBuf};

use super::{Grid, ReadOptions};
use crate::error::{Error, Result};

fn left_out(path: &Path, feature: &str) -> Result<Grid> {
    let path = path.display();
    Err(Error::Input(format!(
        "{path}: this build cannot read it: built without the feature `{feature}`"
    )))
}

/// In place of the reader of DICOM files, which are then recognised by their names only.
#[cfg(not(feature = "dicom"))]
pub(super) mod dicom {
    use super::{Grid, Path, PathBuf, ReadOptions, Result};

    pub(crate) fn is_folder(_path: &Path) -> bool {
        false
    }

    pub(crate) fn is_dicom(_path: &Path) -> bool {
        false
    }

    pub(crate) fn others(_path: &Path) -> Vec<PathBuf> {
        Vec::new()
    }

    pub(crate) fn read(path: &Path, _options: &ReadOptions) -> Result<Grid> {
        super::left_out(path, "dicom")
    }
}

/// In place of the readers of TIFF files and of folders of slices.
#[cfg(not(feature = "tiff"))]
pub(super) mod tiff {
    use super::{File, Grid, Path, ReadOptions, Result};

    pub(crate) fn read(path: &Path, _opened: (File, u64), _options: &ReadOptions) -> Result<Grid> {
        super::left_out(path, "tiff")
    }

    pub(crate) mod slices {
        use super::{Grid, Path, ReadOptions, Result};
        use std::path::PathBuf;

        pub(crate) fn files(_folder: &Path) -> Result<Vec<PathBuf>> {
            Ok(Vec::new())
        }

        pub(crate) fn read(folder: &Path, _options: &ReadOptions) -> Result<Grid> {
            super::super::left_out(folder, "tiff")
        }
    }
}

/// In place of the reader of VTI files.
#[cfg(not(feature = "xml"))]
pub(super) mod vti {
    use super::{File, Grid, Path, ReadOptions, Result};

    pub(crate) fn read(path: &Path, _opened: (File, u64), _options: &ReadOptions) -> Result<Grid> {
        super::left_out(path, "xml")
    }
}

/// In place of the reader of NPZ files.
#[cfg(not(feature = "zip"))]
pub(super) mod npz {
    use super::{File, Grid, Path, ReadOptions, Result};

    pub(crate) fn read(path: &Path, _opened: (File, u64), _options: &ReadOptions) -> Result<Grid> {
        super::left_out(path, "zip")
    }
}
