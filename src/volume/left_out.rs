//! Stand-ins for the readers whose features are disabled: each fails with the name of its feature.

use std::io;

use super::data_error::invalid;

fn missing_feature(feature: &str) -> io::Error {
    invalid(format!("this build cannot read it: built without the feature `{feature}`"))
}

/// In place of the reader of DICOM files, which are then recognised by their names only.
#[cfg(not(feature = "dicom"))]
pub(super) mod dicom {
    use std::path::{Path, PathBuf};

    use crate::error::Result;
    use crate::volume::data_error::read_error;
    use crate::volume::read_options::ReadOptions;
    use crate::volume::samples::SampleGrid;

    pub(crate) fn is_folder(_path: &Path) -> bool {
        false
    }

    pub(crate) fn is_dicom(_path: &Path) -> bool {
        false
    }

    pub(crate) fn companion_files(_path: &Path) -> Vec<PathBuf> {
        Vec::new()
    }

    pub(crate) fn read(path: &Path, _options: &ReadOptions) -> Result<SampleGrid> {
        Err(read_error(path, crate::volume::left_out::missing_feature("dicom")))
    }
}

/// In place of the readers of TIFF files and of folders of slices.
#[cfg(not(feature = "tiff"))]
pub(super) mod tiff {
    use std::fs::File;
    use std::io;

    use crate::volume::read_options::ReadOptions;
    use crate::volume::samples::SampleGrid;

    pub(crate) fn read(_file: File, _length: u64, _: &ReadOptions) -> io::Result<SampleGrid> {
        Err(crate::volume::left_out::missing_feature("tiff"))
    }

    pub(crate) mod slices {
        use std::path::{Path, PathBuf};

        use crate::error::Result;
        use crate::volume::data_error::read_error;
        use crate::volume::read_options::ReadOptions;
        use crate::volume::samples::SampleGrid;

        pub(crate) fn files(_folder: &Path) -> Result<Vec<PathBuf>> {
            Ok(Vec::new())
        }

        pub(crate) fn read(folder: &Path, _options: &ReadOptions) -> Result<SampleGrid> {
            Err(read_error(folder, crate::volume::left_out::missing_feature("tiff")))
        }
    }
}

/// In place of the reader of VTI files.
#[cfg(not(feature = "xml"))]
pub(super) mod vti {
    use std::fs::File;
    use std::io;

    use crate::volume::read_options::ReadOptions;
    use crate::volume::samples::SampleGrid;

    pub(crate) fn read(_file: File, _options: &ReadOptions) -> io::Result<SampleGrid> {
        Err(crate::volume::left_out::missing_feature("xml"))
    }
}

/// In place of the reader of NPZ files.
#[cfg(not(feature = "zip"))]
pub(super) mod npz {
    use std::fs::File;
    use std::io;

    use crate::volume::read_options::ReadOptions;
    use crate::volume::samples::SampleGrid;

    pub(crate) fn read(_file: File, _length: u64, _: &ReadOptions) -> io::Result<SampleGrid> {
        Err(crate::volume::left_out::missing_feature("zip"))
    }
}
