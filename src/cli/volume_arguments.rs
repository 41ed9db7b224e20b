//! Flags that name a volume: a file, with properties that its name does not contain, or a built-in phantom.

use std::path::{Path, PathBuf};
use std::str::FromStr;

use clap::{Args, ValueEnum};
use isospectrum::bricks::VolumeSource;
use isospectrum::unstable::numbers::exact;
use isospectrum::volume::{
    Outside, ReadOptions, SliceAxis, Volume, files_of, phantom, read_volume,
};
use isospectrum::{Error, Result};

use super::heading;
use super::kind::{self, Kind};

/// The flags of every command that reads a volume.
#[derive(Args, Debug)]
#[command(next_help_heading = heading::INPUT)]
pub(super) struct VolumeArguments {
    /// Volume file, or folder of DICOM or slices
    ///
    /// Formats: .nrrd, .nii, .mha, .mhd, .vti, .vtk, .tif, .mrc, .map, .cube, .dx, .npy, .dcm; a folder of DICOM files, or of
    /// numbered .tif or .png slices; .raw with dimensions and sample type in its name (name_128x128x128_uint8.raw), in
    /// flags, or in a header next to it.
    #[arg(required_unless_present = "phantom", conflicts_with = "phantom")]
    volume: Option<PathBuf>,
    /// Use a built-in volume, e.g. hydrogen:64
    #[arg(long, value_name = "NAME[:SIZE]", conflicts_with_all = ["dims", "sample_type", "endian", "frame", "channel", "array", "series", "slices", "spacing", "origin", "nan_as"])]
    phantom: Option<String>,
    /// Number of samples along x, y, z of a RAW file
    #[arg(long, value_name = "NXxNYxNZ")]
    dims: Option<Dims>,
    /// Sample type of a RAW file, e.g. uint8, int16
    ///
    /// One of uint8, int8, uint16, int16, uint32, int32, float32, float64.
    #[arg(long = "type", value_name = "TYPE")]
    sample_type: Option<String>,
    /// Byte order of a RAW file
    #[arg(long, value_name = "ORDER", hide_short_help = true)]
    endian: Option<Endian>,
    /// Read time step N, from 0, of a file with several
    #[arg(long, value_name = "N", hide_short_help = true)]
    frame: Option<usize>,
    /// Read number N, from 0, of each sample (colours, vectors, orbitals)
    #[arg(long, value_name = "N", hide_short_help = true)]
    channel: Option<usize>,
    /// Read the array of this name from a VTK file
    #[arg(long, value_name = "NAME", hide_short_help = true)]
    array: Option<String>,
    /// Read this series of a folder of DICOM files: its number, from 0, or its identifier
    #[arg(long, value_name = "N|UID", hide_short_help = true)]
    series: Option<String>,
    /// Read the channels or the frames of a TIFF file as its slices
    #[arg(long, value_name = "AXIS", hide_short_help = true)]
    slices: Option<Slices>,
    /// Distance between samples along x, y, z
    #[arg(long, value_name = "X,Y,Z")]
    spacing: Option<Triple>,
    /// World position of the first sample
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true, hide_short_help = true)]
    origin: Option<Triple>,
    /// Replace samples that are not finite by this value
    #[arg(long, value_name = "VALUE", hide_short_help = true)]
    nan_as: Option<f64>,
    /// Side of the isosurface that surrounds the volume
    ///
    /// Surfaces close around the other side, and normals point out of it. `high` is for fields that are low inside, such as
    /// distances.
    #[arg(long, value_name = "SIDE", default_value = "low", hide_short_help = true)]
    outside: Side,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Endian {
    Little,
    Big,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Side {
    Low,
    High,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Slices {
    Channels,
    Frames,
}

impl VolumeArguments {
    /// Checks that the named file is a volume.
    pub(super) fn check_kind(&self) -> Result<()> {
        // With the layout in flags, any file is a RAW file.
        let has_layout = self.dims.is_some() && self.sample_type.is_some();
        let path = self.volume.as_ref().filter(|_| !has_layout);
        path.map_or(Ok(()), |path| kind::check(path, Kind::Volume))
    }

    /// Reads or makes the volume.
    pub(super) fn read(&self) -> Result<Volume> {
        let volume = match (&self.volume, &self.phantom) {
            (Some(path), _) => {
                self.check_kind()?;
                read_volume(path, &self.options())?
            }
            (None, Some(name)) => phantom(name)?,
            (None, None) => return Err(no_volume()),
        };
        let [nx, ny, nz] = volume.dims();
        let (low, high) = (exact(volume.range().0), exact(volume.range().1));
        log::debug!(
            "{}: {nx}x{ny}x{nz} {}, {low} to {high}",
            volume.name(),
            volume.samples().type_name()
        );
        Ok(volume.with_outside(self.outside()))
    }

    /// Returns how to read the volume again, independent of the current folder.
    pub(super) fn source(&self) -> Result<VolumeSource> {
        let outside = self.outside();
        match (&self.volume, &self.phantom) {
            (Some(path), _) => {
                let path = path.canonicalize().map_err(|source| Error::io(path, source))?;
                let options = Box::new(self.options());
                Ok(VolumeSource::File { path, options, outside })
            }
            (None, Some(name)) => Ok(VolumeSource::Phantom { name: name.clone(), outside }),
            (None, None) => Err(no_volume()),
        }
    }

    fn outside(&self) -> Outside {
        match self.outside {
            Side::Low => Outside::Low,
            Side::High => Outside::High,
        }
    }

    /// Returns the path of the volume if it is a file.
    pub(super) fn path(&self) -> Option<&Path> {
        self.volume.as_deref()
    }

    /// Returns the files that are read, which no output may replace.
    pub(super) fn files(&self) -> Vec<PathBuf> {
        self.volume.as_deref().map_or_else(Vec::new, files_of)
    }

    fn options(&self) -> ReadOptions {
        ReadOptions {
            dims: self.dims.map(|Dims(dims)| dims),
            sample_type: self.sample_type.clone(),
            big_endian: self.endian == Some(Endian::Big),
            frame: self.frame,
            channel: self.channel,
            array: self.array.clone(),
            series: self.series.clone(),
            slices: self.slices.map(|slices| match slices {
                Slices::Channels => SliceAxis::Channels,
                Slices::Frames => SliceAxis::Frames,
            }),
            spacing: self.spacing.map(|Triple(spacing)| spacing),
            origin: self.origin.map(|Triple(origin)| origin),
            nan_as: self.nan_as,
        }
    }
}

fn no_volume() -> Error {
    Error::Usage("no volume, expected a file or --phantom".to_owned())
}

/// `128x128x64`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Dims([usize; 3]);

impl FromStr for Dims {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let numbers: Result<Vec<usize>, _> = text.split(['x', 'X']).map(str::parse).collect();
        let dims = numbers.ok().and_then(|numbers| <[usize; 3]>::try_from(numbers).ok());
        dims.map(Dims).ok_or_else(|| "expected three numbers such as 128x128x64".to_owned())
    }
}

/// `0.5,0.5,2`.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Triple([f64; 3]);

impl FromStr for Triple {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let numbers: Result<Vec<f64>, _> = text.split(',').map(|n| n.trim().parse()).collect();
        let triple = numbers.ok().and_then(|numbers| <[f64; 3]>::try_from(numbers).ok());
        triple
            .filter(|triple| triple.iter().all(|x| x.is_finite()))
            .map(Triple)
            .ok_or_else(|| "expected three numbers such as 0.5,0.5,2".to_owned())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dimensions_and_triples_have_three_numbers() {
        assert_eq!("2x3x4".parse(), Ok(Dims([2, 3, 4])));
        assert_eq!("-1, 0.5,2".parse(), Ok(Triple([-1.0, 0.5, 2.0])));
        for wrong in ["", "2x3", "2x3x4x5", "2x-3x4", "2x3xz"] {
            assert!(wrong.parse::<Dims>().is_err(), "{wrong}");
        }
        for wrong in ["", "1,2", "1,2,3,4", "1,2,nan"] {
            assert!(wrong.parse::<Triple>().is_err(), "{wrong}");
        }
    }
}
