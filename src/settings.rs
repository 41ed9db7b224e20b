//! Settings of a computation as users write them, and their meaning for a given volume.
//!
//! Lengths, percentages and isovalues such as `p99` become numbers only once the volume is known. The program and the Python
//! package both parse them here, so that equal settings give equal spectra.

mod byte_size;
mod isovalue_range;
mod length;
mod noise;
mod preparation;
mod region;
mod short_number;
mod sweep;
mod threads;

pub use byte_size::ByteSize;
pub use isovalue_range::{IsovalueRange, split_at_colons};
pub use length::Length;
pub use noise::{NoiseSettings, Persistence};
pub use preparation::PreparationSettings;
pub use region::{AxisRange, Region};
pub use short_number::short_number;
pub use sweep::SweepSettings;
pub use threads::{startable_threads, useful_threads};
