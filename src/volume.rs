//! A scalar field on a regular grid, trilinear between samples.
//!
//! # Frames
//!
//! | frame | unit | position of sample (i, j, k) |
//! |---|---|---|
//! | index | cells | (i, j, k) |
//! | voxel | the smallest spacing | (i, j, k) * [`Volume::voxel_size`], at most 1.5 along an axis |
//! | world | the file's | origin + direction * (spacing * (i, j, k)) |
//!
//! All geometry inside the library is in the voxel frame. Lengths there are metric where no spacing is more than 1.5 times
//! the smallest; a longer one is shortened to that, so that the cost follows the samples. Exports are in the
//! world frame, whose axes need not be perpendicular ([`Placement`]).

mod bits;
mod block;
mod cube;
mod data_error;
mod decode;
#[cfg(any(feature = "dicom", feature = "tiff"))]
mod decoder_panic;
#[cfg(feature = "dicom")]
mod dicom;
mod dx;
mod format;
mod grid;
mod histogram;
mod info;
mod isovalue;
mod layout;
#[cfg(not(feature = "formats"))]
mod left_out;
mod mask;
mod memory;
mod metaimage;
mod mrc;
mod nifti;
mod npy;
#[cfg(feature = "zip")]
mod npz;
mod nrrd;
pub mod phantom;
mod placement;
mod plain;
mod prepare;
mod raw;
mod read;
mod read_options;
mod resample;
pub(crate) mod samples;
mod select;
mod slabs;
mod statistics;
mod stream;
mod text;
mod text_grid;
#[cfg(feature = "tiff")]
mod tiff;
#[cfg(feature = "xml")]
mod vti;
mod vtk;

pub use block::WholeVolume;
pub(crate) use block::crop_samples;
#[cfg(any(feature = "dicom", feature = "tiff"))]
pub use format::is_volume_name;
pub use grid::{BlockPosition, Outside, Volume};
pub(crate) use grid::{check_grid, check_range};
pub use histogram::Histogram;
pub use info::VolumeInfo;
pub use isovalue::Isovalue;
pub(crate) use isovalue::between;
#[cfg(not(feature = "dicom"))]
use left_out::dicom;
#[cfg(not(feature = "zip"))]
use left_out::npz;
#[cfg(not(feature = "tiff"))]
use left_out::tiff;
#[cfg(not(feature = "xml"))]
use left_out::vti;
pub use mask::Mask;
pub use mask::record::MaskRecord;
pub use phantom::{phantom, phantom_names};
pub use placement::{Placement, Space, Unit};
pub use prepare::Preparation;
pub use raw::parse_raw_name;
pub use read::{files_of, read_volume};
pub use read_options::{ReadOptions, SliceAxis};
pub(crate) use samples::with_samples;
pub use samples::{Samples, replace_not_finite};
pub use slabs::Slabs;
pub use statistics::{Statistics, Tally};
pub(crate) use stream::DEFLATE_RATIO;
