//! A volume in a file of uncompressed samples, of which any block can be read without the rest.
//!
//! # Invariants
//!
//! The size in the header was checked against the length of the file, so a block needs no more memory than the file.

use std::fs::File;
use std::io::{Read as _, Seek as _, SeekFrom};
use std::path::Path;

use super::data_error::read_error;
use super::decode::read_samples;
use super::format::VolumeFormat;
use super::grid::{check_grid, check_range, not_finite};
use super::placement::Placement;
use super::plain::PlainSamples;
use super::read_options::ReadOptions;
use super::samples::{Samples, range_of, replace_not_finite, with_samples};
use super::statistics::{Statistics, Tally};
use super::{metaimage, npy, raw};
use crate::error::{Error, Result};
use crate::input;

/// Bytes per read where all samples are read in order: disks are fastest from a megabyte on.
const SLAB_BYTES: usize = 1 << 24;

/// A volume in a file, read in blocks.
#[derive(Clone, Debug)]
pub struct Slabs {
    plain: PlainSamples,
    name: String,
    nan_as: Option<f64>,
}

impl Slabs {
    /// The samples of a volume that [`read_volume`](super::read_volume) reads; none if they are compressed or in another order,
    /// so that the volume must be read as a whole.
    ///
    /// # Errors
    ///
    /// [`Error::Io`] and [`Error::Input`] for files that cannot be read or are too short.
    pub fn of(path: &Path, options: &ReadOptions) -> Result<Option<Slabs>> {
        if path.is_dir() || options.frame.is_some() || options.channel.is_some() {
            return Ok(None);
        }
        let format = match VolumeFormat::from_name(path) {
            None if options.describes_raw() => VolumeFormat::Raw,
            Some(format) => format,
            None => return Ok(None),
        };
        format.check_options(path, options)?;
        let plain = match format {
            VolumeFormat::Raw => raw::plain(path, options)?,
            VolumeFormat::Npy => npy::plain(path)?,
            VolumeFormat::MetaImage => metaimage::plain(path)?,
            _ => None,
        };
        let Some(mut plain) = plain else { return Ok(None) };
        let length = input::open(&plain.path)?.1;
        if plain.end().is_none_or(|end| end > length) {
            return Err(plain.wrong_length(length));
        }
        options.replace_placement(&mut plain.placement);
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        check_grid(&name, plain.dims, &plain.placement)?;
        Ok(Some(Slabs { plain, name, nan_as: options.nan_as }))
    }

    /// Name of the volume.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The type of the samples: `uint8`, `float32`, ...
    pub fn type_name(&self) -> String {
        self.plain.sample_type.to_string()
    }

    /// The placement of the samples in the world.
    pub fn placement(&self) -> &Placement {
        &self.plain.placement
    }

    /// Calls `visit` for all samples, some planes at a time, with the index of the first plane along z.
    ///
    /// # Errors
    ///
    /// As [`Slabs::read`], and those of `visit`.
    pub fn for_each(&self, mut visit: impl FnMut(usize, &Samples) -> Result<()>) -> Result<()> {
        let PlainSamples { dims: [nx, ny, nz], sample_type, .. } = self.plain;
        let n = (SLAB_BYTES / (nx * ny * sample_type.n_bytes())).max(1);
        for first in (0..nz).step_by(n) {
            visit(first, &self.read([0, 0, first], [nx, ny, nz.min(first + n)])?)?;
        }
        Ok(())
    }

    /// Smallest and largest sample.
    ///
    /// # Errors
    ///
    /// As [`Slabs::read`], and [`Error::Input`] if [`Volume::new`](super::Volume::new) rejects the samples.
    pub fn range(&self) -> Result<(f64, f64)> {
        let PlainSamples { dims, .. } = self.plain;
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        self.for_each(|first, samples| {
            let before = dims[0] * dims[1] * first;
            let range = with_samples!(samples, s => range_of(s));
            let range =
                range.map_err(|i| not_finite(&self.name, dims, before + i, samples.get(i)))?;
            (low, high) = (low.min(range.0), high.max(range.1));
            Ok(())
        })?;
        check_range(&self.name, (low, high)).map(|()| (low, high))
    }

    /// Statistics of the samples in the given range.
    ///
    /// # Errors
    ///
    /// As [`Slabs::read`].
    pub fn statistics(&self, range: (f64, f64)) -> Result<Statistics> {
        let mut tally = Tally::new(range);
        self.for_each(|_, samples| {
            tally.add_all(samples);
            Ok(())
        })?;
        Ok(tally.statistics())
    }

    /// Samples along x, y, z.
    pub fn dims(&self) -> [usize; 3] {
        self.plain.dims
    }

    /// The samples from `first` up to, not including, `end`, x fastest.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`] for a block outside; [`Error::Io`], [`Error::Input`] if it cannot be read.
    pub fn read(&self, first: [usize; 3], end: [usize; 3]) -> Result<Samples> {
        let PlainSamples { path, dims, .. } = &self.plain;
        if (0..3).any(|a| first[a] >= end[a] || end[a] > dims[a]) {
            return Err(Error::Usage(format!(
                "samples {first:?} to {end:?}, expected a block of {dims:?}"
            )));
        }
        let mut samples =
            self.rows(&mut input::open(path)?.0, first, end).map_err(|e| read_error(path, e))?;
        if let Some(value) = self.nan_as {
            replace_not_finite(&mut samples, value)?;
        }
        Ok(samples)
    }

    fn rows(
        &self,
        file: &mut File,
        first: [usize; 3],
        end: [usize; 3],
    ) -> std::io::Result<Samples> {
        let PlainSamples { start, dims, sample_type, big_endian, .. } = self.plain;
        let size = sample_type.n_bytes();
        let n = end[0] - first[0];
        // The bytes of the block, for `read_samples`.
        let mut bytes: Vec<u8> = Vec::new();
        let mut rows = vec![0; dims[0] * (end[1] - first[1]) * size];
        for z in first[2]..end[2] {
            let at = dims[0] * (first[1] + dims[1] * z) * size;
            file.seek(SeekFrom::Start(start + at as u64))?;
            file.read_exact(&mut rows)?;
            let own = first[0] * size..end[0] * size;
            rows.chunks_exact(dims[0] * size).for_each(|row| bytes.extend(&row[own.clone()]));
        }
        let n = n * (end[1] - first[1]) * (end[2] - first[2]);
        read_samples(&mut &bytes[..], sample_type, big_endian, n, n)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::PathBuf;

    use crate::volume::{phantom, read_volume};

    /// A file of every format that can be read in blocks.
    fn files(folder: &Path) -> Vec<PathBuf> {
        let volume = phantom("noise:9:2").expect("a phantom");
        let crop = crate::volume::Preparation {
            crop: Some([[0, 9], [0, 7], [0, 5]]),
            ..Default::default()
        };
        let volume = crop.apply(volume).expect("inside");
        let bytes = volume.samples().to_le_bytes();
        let name = volume.samples().type_name();
        let numpy = if name == "float32" { "<f4" } else { "<f8" };
        let header =
            format!("{{'descr': '{numpy}', 'fortran_order': False, 'shape': (5, 7, 9), }}\n");
        let mut npy = b"\x93NUMPY\x01\x00".to_vec();
        npy.extend((header.len() as u16).to_le_bytes());
        npy.extend(header.as_bytes());
        npy.extend(&bytes);
        let met = if name == "float32" { "MET_FLOAT" } else { "MET_DOUBLE" };
        let fields = format!(
            "ObjectType = Image\nNDims = 3\nDimSize = 9 7 5\nElementType = {met}\nElementByteOrderMSB = False\n"
        );
        let mut mha = format!("{fields}ElementDataFile = LOCAL\n").into_bytes();
        mha.extend(&bytes);
        let raw = format!("a_9x7x5_{name}.raw");
        let mhd = format!("{fields}ElementDataFile = {raw}\n").into_bytes();
        let all =
            [(raw, bytes), ("a.npy".into(), npy), ("a.mha".into(), mha), ("b.mhd".into(), mhd)];
        let write = |(name, bytes): (String, Vec<u8>)| {
            let path = folder.join(name);
            std::fs::write(&path, bytes).expect("written");
            path
        };
        all.map(write).into()
    }

    #[test]
    fn blocks_of_files_are_those_of_the_volume_read_as_a_whole() {
        let folder = tempfile::tempdir().expect("a folder");
        for path in files(folder.path()) {
            let options = ReadOptions::default();
            let whole = read_volume(&path, &options).expect("a volume");
            let slabs = Slabs::of(&path, &options).expect("readable").expect("plain samples");
            assert_eq!(slabs.dims(), whole.dims());
            for (first, end) in
                [([0; 3], [9, 7, 5]), ([2, 3, 1], [8, 7, 3]), ([8, 0, 4], [9, 2, 5])]
            {
                let read = slabs.read(first, end).expect("inside");
                let at = |i: usize| {
                    let n = [end[0] - first[0], end[1] - first[1]];
                    whole.sample(
                        first[0] + i % n[0],
                        first[1] + i / n[0] % n[1],
                        first[2] + i / n[0] / n[1],
                    )
                };
                assert!((0..read.len()).all(|i| read.get(i) == at(i)), "{}", path.display());
                assert_eq!(read.type_name(), whole.samples().type_name());
            }
            assert!(slabs.read([0; 3], [10, 7, 5]).is_err());
        }
    }

    #[test]
    fn a_file_that_became_shorter_is_rejected() {
        let folder = tempfile::tempdir().expect("a folder");
        for path in files(folder.path()).into_iter().take(3) {
            let bytes = std::fs::read(&path).expect("there");
            std::fs::write(&path, &bytes[..bytes.len() - 9]).expect("written");
            let error = Slabs::of(&path, &ReadOptions::default()).expect_err("too short");
            assert!(error.to_string().contains("bytes"), "{error}");
        }
    }
}
