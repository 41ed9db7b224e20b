//! Chooses the reader of a volume by the name of its file.

use std::fs::File;
use std::path::{Path, PathBuf};

use crate::error::{Error, Result};
use crate::input;
use crate::volume::{
    Grid, Samples, Volume, cube, dicom, metaimage, mrc, nifti, npy, npz, nrrd, raw, tiff, vti, vtk,
};

/// What the command line may say about a volume beside its file name.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ReadOptions {
    /// Dimensions of a RAW file whose name does not tell.
    pub dims: Option<[usize; 3]>,
    /// Sample type of a RAW file whose name does not tell: `uint8`, `float32`, ...
    pub sample_type: Option<String>,
    /// Whether a RAW file is big endian.
    pub big_endian: bool,
    /// Which volume in time, from 0, of a file that holds several.
    pub frame: Option<usize>,
    /// Which number of each sample, from 0, where there are several: a colour, a part of a vector, an orbital.
    pub channel: Option<usize>,
    /// Which array, by its name, of a file that holds several.
    pub array: Option<String>,
    /// Which series of a folder of DICOM files: its number, from 0, or its identifier.
    pub series: Option<String>,
    /// Replaces the file's spacing.
    pub spacing: Option<[f64; 3]>,
    /// Replaces the file's origin.
    pub origin: Option<[f64; 3]>,
    /// Value in place of NaN and infinities.
    pub nan_as: Option<f64>,
}

/// What is read, for messages.
const READ: &str =
    ".nrrd, .nhdr, .nii, .mha, .mhd, .vti, .vtk, .tif, .mrc, .map, .cube, .dcm, .npy, .npz or .raw";

/// A kind of file that holds volumes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
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
    Tiff,
    /// A file, or a folder of files.
    Dicom,
    /// A folder.
    Slices,
}

impl Kind {
    /// The kind of a file or a folder: DICOM files often have no extension, but tell by their first bytes.
    fn of(path: &Path) -> Option<Kind> {
        match Kind::of_name(path) {
            Some(Kind::Slices) if dicom::is_folder(path) => Some(Kind::Dicom),
            None if dicom::is_dicom(path) => Some(Kind::Dicom),
            kind => kind,
        }
    }

    /// The kind of the name of a file, by its extension in any case.
    pub(super) fn of_name(path: &Path) -> Option<Kind> {
        if path.is_dir() {
            return Some(Kind::Slices);
        }
        let name = path.file_name()?.to_string_lossy().to_ascii_lowercase();
        let is_gzip = name.ends_with(".gz");
        let (_, extension) = name.trim_end_matches(".gz").rsplit_once('.')?;
        Some(match extension {
            "raw" => Kind::Raw,
            "nii" | "hdr" | "img" => Kind::Nifti,
            "mrc" | "map" | "ccp4" | "rec" => Kind::Mrc,
            _ if is_gzip => return None,
            "nrrd" | "nhdr" => Kind::Nrrd,
            "npy" => Kind::Npy,
            "npz" => Kind::Npz,
            "mha" | "mhd" => Kind::MetaImage,
            "vti" => Kind::Vti,
            "vtk" => Kind::Vtk,
            "cube" | "cub" => Kind::Cube,
            "tif" | "tiff" => Kind::Tiff,
            "dcm" | "dicom" | "ima" => Kind::Dicom,
            _ => return None,
        })
    }

    /// The reader.
    fn read(self, path: &Path, opened: (File, u64), options: &ReadOptions) -> Result<Grid> {
        match self {
            Kind::Raw => raw::read(path, opened, options),
            Kind::Nrrd => nrrd::read(path, opened.0),
            Kind::Npy => npy::read(path, opened),
            Kind::Npz => npz::read(path, opened, options),
            Kind::Nifti => nifti::read(path, opened, options),
            Kind::MetaImage => metaimage::read(path, opened, options),
            Kind::Vti => vti::read(path, opened, options),
            Kind::Vtk => vtk::read(path, opened, options),
            Kind::Mrc => mrc::read(path, opened, options),
            Kind::Cube => cube::read(path, opened, options),
            Kind::Tiff => tiff::read(path, opened, options),
            Kind::Dicom => dicom::read(path, options),
            Kind::Slices => tiff::slices::read(path, options),
        }
    }

    /// Files of the volume beside the one that is named.
    fn others(self, path: &Path) -> Vec<PathBuf> {
        match self {
            Kind::Nrrd => nrrd::data_files(path),
            Kind::Nifti => nifti::others(path),
            Kind::MetaImage => metaimage::others(path),
            Kind::Raw => raw::header_beside(path).into_iter().collect(),
            Kind::Dicom => dicom::others(path),
            Kind::Slices => tiff::slices::files(path).unwrap_or_default(),
            Kind::Tiff | Kind::Npy | Kind::Npz | Kind::Vti | Kind::Vtk | Kind::Mrc | Kind::Cube => {
                Vec::new()
            }
        }
    }

    /// Checks that nothing was said of the file that its kind has no use for.
    pub(super) fn check(self, path: &Path, options: &ReadOptions) -> Result<()> {
        let shown = path.display();
        let tells_layout =
            options.dims.is_some() || options.sample_type.is_some() || options.big_endian;
        if tells_layout && self != Kind::Raw {
            return Err(Error::Usage(format!(
                "{shown}: dimensions, sample type and byte order are in the file, expected them as options for raw files only"
            )));
        }
        let has_frames =
            matches!(self, Kind::Nifti | Kind::MetaImage | Kind::Mrc | Kind::Tiff | Kind::Dicom);
        let has_channels =
            !matches!(self, Kind::Raw | Kind::Nrrd | Kind::Npy | Kind::Npz | Kind::Mrc);
        let has_arrays = matches!(self, Kind::Vti | Kind::Vtk | Kind::Npz);
        for (flag, is_given, is_known) in [
            ("--frame", options.frame.is_some(), has_frames),
            ("--channel", options.channel.is_some(), has_channels),
            ("--array", options.array.is_some(), has_arrays),
            ("--series", options.series.is_some(), self == Kind::Dicom),
        ] {
            if is_given && !is_known {
                return Err(Error::Usage(format!(
                    "{shown}: {flag}, but files of this kind hold one volume"
                )));
            }
        }
        Ok(())
    }
}

/// Whether the name of a file is that of a volume, or of a folder, which may hold slices.
pub fn is_volume_name(path: &Path) -> bool {
    Kind::of_name(path).is_some()
}

/// The files that hold a volume: the one that is named, and those with its samples or its header where they are others.
pub fn files_of(path: &Path) -> Vec<PathBuf> {
    let others = Kind::of(path).map_or_else(Vec::new, |kind| kind.others(path));
    std::iter::once(path.to_path_buf()).chain(others).collect()
}

/// Reads a volume by the extension of its file (in any case); a file of any other name is RAW if the options give both
/// dimensions and sample type.
///
/// # Errors
///
/// [`Error::Io`] if the file cannot be read, [`Error::Input`] if its kind is unknown, it is
/// damaged, or [`Volume::new`] refuses its samples, [`Error::Usage`] for options that do not fit
/// the file or are no numbers.
pub fn read_volume(path: &Path, options: &ReadOptions) -> Result<Volume> {
    if path.is_dir() {
        let is_dicom = dicom::is_folder(path);
        (if is_dicom { Kind::Dicom } else { Kind::Slices }).check(path, options)?;
        let read = if is_dicom { dicom::read } else { tiff::slices::read };
        return made(path, read(path, options)?, options);
    }
    // Before anything is said of its name.
    let opened = input::open(path)?;
    let describes_raw = options.dims.is_some() && options.sample_type.is_some();
    let kind = match Kind::of_name(path) {
        Some(kind) => kind,
        None if describes_raw => Kind::Raw,
        None if dicom::is_dicom(path) => Kind::Dicom,
        None => return Err(unknown(path)),
    };
    kind.check(path, options)?;
    made(path, kind.read(path, opened, options)?, options)
}

/// The volume of what was read, with what the options replace.
fn made(
    path: &Path,
    (dims, mut samples, mut placement): Grid,
    options: &ReadOptions,
) -> Result<Volume> {
    placement.spacing = options.spacing.unwrap_or(placement.spacing);
    placement.origin = options.origin.unwrap_or(placement.origin);
    if let Some(value) = options.nan_as {
        replace_not_finite(&mut samples, value)?;
    }
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    Volume::new(name, dims, samples, placement)
}

/// Says what is read in place of a file of unknown kind, and how to get there.
fn unknown(path: &Path) -> Error {
    let extension = path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
    let way = match extension.as_str() {
        "h5" | "hdf5" | "nc" | "zarr" => {
            "h5py, netCDF4 or zarr in Python read it, and numpy.save writes .npy"
        }
        "vdb" | "fits" | "dx" | "xsf" => "Python reads it, and numpy.save writes .npy",
        _ => "--dims and --type read any file as raw",
    };
    Error::input(format!(
        "{}: unknown extension '{extension}', expected {READ} ({way})",
        path.display()
    ))
}

/// Puts `value` in place of NaN and infinities; integers have none.
///
/// # Errors
///
/// [`Error::Usage`] if the value itself is not finite in the type of the samples.
pub fn replace_not_finite(samples: &mut Samples, value: f64) -> Result<()> {
    let is_usable = match samples {
        Samples::F32(_) => (value as f32).is_finite(),
        _ => value.is_finite(),
    };
    if !is_usable {
        return Err(Error::Usage(format!(
            "{value} in place of not finite samples, expected a finite {}",
            samples.type_name()
        )));
    }
    match samples {
        Samples::F32(s) => s.iter_mut().filter(|v| !v.is_finite()).for_each(|v| *v = value as f32),
        Samples::F64(s) => s.iter_mut().filter(|v| !v.is_finite()).for_each(|v| *v = value),
        _ => {}
    }
    Ok(())
}
