//! Samples that a file holds as they are: neither compressed nor as text, x fastest.

use std::path::PathBuf;

use super::layout::{SampleType, size_of_grid};
use super::placement::Placement;
use crate::error::Error;

/// The place of plain samples in a file.
#[derive(Clone, Debug)]
pub(crate) struct PlainSamples {
    pub(crate) path: PathBuf,
    /// Byte of the first sample.
    pub(crate) start: u64,
    pub(crate) dims: [usize; 3],
    pub(crate) sample_type: SampleType,
    pub(crate) big_endian: bool,
    pub(crate) placement: Placement,
}

impl PlainSamples {
    /// The byte after the last sample; none if memory cannot hold the samples.
    pub(super) fn end(&self) -> Option<u64> {
        let (_, bytes) = size_of_grid(self.dims, self.sample_type)?;
        self.start.checked_add(bytes as u64)
    }

    /// The error for a file of `found` bytes, other than [`PlainSamples::end`].
    pub(super) fn wrong_length(&self, found: u64) -> Error {
        let PlainSamples { dims: [x, y, z], sample_type, .. } = self;
        let expected = self.end().map_or("more than memory can hold".to_owned(), |n| n.to_string());
        Error::input(format!(
            "{}: {found} bytes, expected {expected} for {x}x{y}x{z} {sample_type}",
            self.path.display()
        ))
    }
}
