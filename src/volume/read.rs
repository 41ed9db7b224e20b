//! Reads volumes, each with the reader of its format.

use std::fs::File;
use std::path::{Path, PathBuf};

use super::data_error::read_error;
use super::format::VolumeFormat;
use super::grid::Volume;
use super::layout::Compression;
use super::read_options::ReadOptions;
use super::samples::{SampleGrid, replace_not_finite};
use super::{cube, dicom, dx, metaimage, mrc, nifti, npy, npz, nrrd, raw, tiff, vti, vtk};
use crate::error::{Error, Result};
use crate::input;

/// Extensions that are read, for messages.
const EXTENSIONS: &str = ".nrrd, .nhdr, .nii, .mha, .mhd, .vti, .vtk, .tif, .mrc, .map, .cube, .dx, .dcm, .npy, .npz or .raw";

/// The files of a volume: the given one, then separate ones with its samples or its header.
pub fn files_of(path: &Path) -> Vec<PathBuf> {
    let others = format_of(path).map_or_else(Vec::new, |format| companion_files(format, path));
    std::iter::once(path.to_path_buf()).chain(others).collect()
}

/// Reads a volume by the extension of its file, in any case. A file of any other name is read as RAW if the options give
/// both dimensions and sample type, and as DICOM if it starts like one.
///
/// # Errors
///
/// [`Error::Io`] if the file cannot be read; [`Error::Input`] if its format is unknown, it is damaged, or [`Volume::new`]
/// rejects its samples; [`Error::Usage`] for options that do not fit the file.
pub fn read_volume(path: &Path, options: &ReadOptions) -> Result<Volume> {
    let grid = if path.is_dir() {
        let format =
            if dicom::is_folder(path) { VolumeFormat::Dicom } else { VolumeFormat::Slices };
        format.check_options(path, options)?;
        match format {
            VolumeFormat::Dicom => dicom::read(path, options)?,
            _ => tiff::slices::read(path, options)?,
        }
    } else {
        // A missing file is reported before its extension.
        let (file, length) = input::open(path)?;
        let format = match VolumeFormat::from_name(path) {
            Some(format) => format,
            None if options.describes_raw() => VolumeFormat::Raw,
            None if dicom::is_dicom(path) => VolumeFormat::Dicom,
            None => return Err(unknown_format(path)),
        };
        format.check_options(path, options)?;
        read_file(format, path, file, length, options)?
    };
    let SampleGrid { dims, mut samples, mut placement } = grid;
    options.replace_placement(&mut placement);
    if let Some(value) = options.nan_as {
        replace_not_finite(&mut samples, value)?;
    }
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    Volume::new(name, dims, samples, placement)
}

impl Volume {
    /// Reads a volume with default options.
    ///
    /// # Errors
    ///
    /// Those of [`read_volume`].
    pub fn read(path: impl AsRef<Path>) -> Result<Volume> {
        read_volume(path.as_ref(), &ReadOptions::default())
    }
}

/// The format of a file or a folder. DICOM files often have no extension, so their first bytes decide.
fn format_of(path: &Path) -> Option<VolumeFormat> {
    match VolumeFormat::from_name(path) {
        Some(VolumeFormat::Slices) if dicom::is_folder(path) => Some(VolumeFormat::Dicom),
        None if dicom::is_dicom(path) => Some(VolumeFormat::Dicom),
        format => format,
    }
}

fn read_file(
    format: VolumeFormat,
    path: &Path,
    file: File,
    length: u64,
    options: &ReadOptions,
) -> Result<SampleGrid> {
    let grid = match format {
        VolumeFormat::Raw => return raw::read(path, file, length, options),
        VolumeFormat::Nrrd => return nrrd::read(path, file, options),
        VolumeFormat::Nifti => return nifti::read(path, file, length, options),
        VolumeFormat::MetaImage => return metaimage::read(path, file, options),
        VolumeFormat::Mrc => return mrc::read(path, file, length, options),
        VolumeFormat::Dicom => return dicom::read(path, options),
        VolumeFormat::Slices => return tiff::slices::read(path, options),
        VolumeFormat::Npy => npy::read(file, length),
        VolumeFormat::Npz => npz::read(file, length, options),
        VolumeFormat::Vti => vti::read(file, options),
        VolumeFormat::Vtk => vtk::read(file, length, options),
        VolumeFormat::Cube => cube::read(file, length, Compression::of_name(path), options),
        VolumeFormat::Dx => dx::read(file, length, Compression::of_name(path)),
        VolumeFormat::Tiff => tiff::read(file, length, options),
    };
    grid.map_err(|e| read_error(path, e))
}

/// Files that hold parts of the volume besides the given one.
fn companion_files(format: VolumeFormat, path: &Path) -> Vec<PathBuf> {
    match format {
        VolumeFormat::Nrrd => nrrd::data_files(path),
        VolumeFormat::Nifti => nifti::companion_files(path),
        VolumeFormat::MetaImage => metaimage::data_files(path),
        VolumeFormat::Raw => raw::companion_header(path).into_iter().collect(),
        VolumeFormat::Dicom => dicom::companion_files(path),
        VolumeFormat::Slices => tiff::slices::files(path).unwrap_or_default(),
        _ => Vec::new(),
    }
}

/// The error for a file of unknown format, with a way to convert it.
fn unknown_format(path: &Path) -> Error {
    let extension = path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
    let advice = match extension.as_str() {
        "h5" | "hdf5" | "nc" | "zarr" => {
            "h5py, netCDF4 or zarr in Python read it, and numpy.save writes .npy"
        }
        "vdb" | "fits" | "xsf" => "Python reads it, and numpy.save writes .npy",
        _ => "--dims and --type read any file as raw",
    };
    Error::input(format!(
        "{}: unknown extension '{extension}', expected {EXTENSIONS} ({advice})",
        path.display()
    ))
}
