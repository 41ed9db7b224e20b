//! The formats of volume files, by file name.

use std::path::Path;

use super::read_options::ReadOptions;
use crate::error::{Error, Result};

/// A format of volume files.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum VolumeFormat {
    Raw,
    Nrrd,
    Npy,
    Npz,
    Nifti,
    MetaImage,
    Vti,
    Vtk,
    Mrc,
    Cube,
    Dx,
    Tiff,
    /// A file, or a folder of files.
    Dicom,
    /// A folder of numbered images.
    Slices,
}

impl VolumeFormat {
    /// The format by the extension of a file name, in any case; folders are [`VolumeFormat::Slices`].
    pub(super) fn from_name(path: &Path) -> Option<VolumeFormat> {
        if path.is_dir() {
            return Some(VolumeFormat::Slices);
        }
        let name = path.file_name()?.to_string_lossy().to_ascii_lowercase();
        let is_gzip = name.ends_with(".gz");
        let (_, extension) = name.trim_end_matches(".gz").rsplit_once('.')?;
        Some(match extension {
            "raw" => VolumeFormat::Raw,
            "nii" | "hdr" | "img" => VolumeFormat::Nifti,
            "mrc" | "map" | "ccp4" | "rec" => VolumeFormat::Mrc,
            "cube" | "cub" => VolumeFormat::Cube,
            "dx" => VolumeFormat::Dx,
            _ if is_gzip => return None,
            "nrrd" | "nhdr" => VolumeFormat::Nrrd,
            "npy" => VolumeFormat::Npy,
            "npz" => VolumeFormat::Npz,
            "mha" | "mhd" => VolumeFormat::MetaImage,
            "vti" => VolumeFormat::Vti,
            "vtk" => VolumeFormat::Vtk,
            "tif" | "tiff" => VolumeFormat::Tiff,
            "dcm" | "dicom" | "ima" => VolumeFormat::Dicom,
            _ => return None,
        })
    }

    /// Checks that the options fit the format.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`] for an option that the format has no use for.
    pub(super) fn check_options(self, path: &Path, options: &ReadOptions) -> Result<()> {
        use VolumeFormat::{
            Cube, Dicom, MetaImage, Mrc, Nifti, Npz, Nrrd, Raw, Slices, Tiff, Vti, Vtk,
        };
        let shown = path.display();
        if options.describes_layout() && self != Raw {
            return Err(Error::Usage(format!(
                "{shown}: the file has its own dimensions, sample type and byte order; options for them are for raw files only"
            )));
        }
        let has_frames = matches!(self, Nifti | MetaImage | Mrc | Nrrd | Tiff | Dicom);
        let has_channels =
            matches!(self, Nifti | MetaImage | Nrrd | Vti | Vtk | Cube | Tiff | Dicom | Slices);
        let has_arrays = matches!(self, Vti | Vtk | Npz);
        for (flag, is_given, is_supported) in [
            ("--frame", options.frame.is_some(), has_frames),
            ("--channel", options.channel.is_some(), has_channels),
            ("--array", options.array.is_some(), has_arrays),
            ("--series", options.series.is_some(), self == Dicom),
            ("--slices", options.slices.is_some(), self == Tiff),
        ] {
            if is_given && !is_supported {
                return Err(Error::Usage(format!(
                    "{shown}: {flag} does not apply to files of this format"
                )));
            }
        }
        Ok(())
    }
}

/// Whether a file name is that of a volume, or the path a folder, which may hold slices.
pub fn is_volume_name(path: &Path) -> bool {
    VolumeFormat::from_name(path).is_some()
}

/// Whether a file is a slice of a folder of numbered images, by its extension.
#[cfg(any(feature = "dicom", feature = "tiff"))]
pub(super) fn is_slice_image(path: &Path) -> bool {
    let extension = path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
    matches!(extension.as_str(), "tif" | "tiff" | "png")
}
