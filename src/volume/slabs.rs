//! A volume in a file of plain samples, of which any block is read without the rest.
//!
//! # Invariants
//!
//! What a header claims was held against the length of the file, so a block takes no more memory than the file has bytes.

use std::fs::File;
use std::io::{Read as _, Seek as _, SeekFrom};
use std::path::{Path, PathBuf};

use super::decode::{SampleType, read_error, read_samples, size_of_grid};
use super::{
    Kind, Placement, ReadOptions, Samples, Statistics, Tally, check_grid, check_range, metaimage,
    not_finite, npy, range_of, raw, replace_not_finite,
};
use crate::error::{Error, Result};
use crate::input;
use crate::volume::with_samples;

/// Bytes of samples that are read at a time where all of a volume is looked at: disks and vectors are at their best from a
/// megabyte on.
const SLAB: usize = 1 << 24;

/// Plain samples, x fastest, in a file.
#[derive(Clone, Debug)]
pub(crate) struct Plain {
    pub(crate) path: PathBuf,
    /// Where the first one is, bytes.
    pub(crate) start: u64,
    pub(crate) dims: [usize; 3],
    pub(crate) sample_type: SampleType,
    pub(crate) big_endian: bool,
    /// Where they lie in the world.
    pub(crate) placement: Placement,
}

impl Plain {
    /// Where they end, bytes; none where that is more than memory can hold.
    pub(super) fn end(&self) -> Option<u64> {
        let (_, bytes) = size_of_grid(self.dims, self.sample_type)?;
        self.start.checked_add(bytes as u64)
    }
}

/// A file has other bytes than expected; those may be more than memory can hold.
pub(super) fn wrong_length(
    path: &Path,
    (found, expected): (u64, Option<u64>),
    ([x, y, z], sample_type): ([usize; 3], SampleType),
) -> Error {
    let expected =
        expected.map_or("more than memory can hold".to_owned(), |bytes| bytes.to_string());
    Error::input(format!(
        "{}: {found} bytes, expected {expected} for {x}x{y}x{z} {sample_type}",
        path.display()
    ))
}

/// See the module.
#[derive(Clone, Debug)]
pub struct Slabs {
    plain: Plain,
    name: String,
    nan_as: Option<f64>,
}

impl Slabs {
    /// The samples of a volume that [`read_volume`](super::read_volume) reads; none where they are packed or ordered otherwise: the
    /// volume must be read as a whole then.
    ///
    /// # Errors
    ///
    /// [`Error::Io`] and [`Error::Input`] for files that cannot be read or are too short.
    pub fn of(path: &Path, options: &ReadOptions) -> Result<Option<Slabs>> {
        if path.is_dir() || options.frame.is_some() || options.channel.is_some() {
            return Ok(None);
        }
        let kind = match Kind::of_name(path) {
            None if options.dims.is_some() && options.sample_type.is_some() => Kind::Raw,
            Some(kind) => kind,
            None => return Ok(None),
        };
        kind.check(path, options)?;
        let plain = match kind {
            Kind::Raw => raw::plain(path, options)?,
            Kind::Npy => npy::plain(path)?,
            Kind::MetaImage => metaimage::plain(path)?,
            _ => None,
        };
        let Some(mut plain) = plain else { return Ok(None) };
        let length = input::open(&plain.path)?.1;
        if plain.end().is_none_or(|end| end > length) {
            let kind = (plain.dims, plain.sample_type);
            return Err(wrong_length(&plain.path, (length, plain.end()), kind));
        }
        plain.placement.spacing = options.spacing.unwrap_or(plain.placement.spacing);
        plain.placement.origin = options.origin.unwrap_or(plain.placement.origin);
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        check_grid(&name, plain.dims, &plain.placement)?;
        Ok(Some(Slabs { plain, name, nan_as: options.nan_as }))
    }

    /// What the volume is called.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The type of the samples, as flags spell it.
    pub fn type_name(&self) -> String {
        self.plain.sample_type.to_string()
    }

    /// Where the samples lie in the world.
    pub fn placement(&self) -> &Placement {
        &self.plain.placement
    }

    /// Shows all samples, some planes at a time: the first one's number along z, and the samples.
    ///
    /// # Errors
    ///
    /// As [`Slabs::read`], and those of `show`.
    pub fn each(&self, mut show: impl FnMut(usize, &Samples) -> Result<()>) -> Result<()> {
        let Plain { dims: [nx, ny, nz], sample_type, .. } = self.plain;
        let n = (SLAB / (nx * ny * sample_type.n_bytes())).max(1);
        for first in (0..nz).step_by(n) {
            show(first, &self.read([0, 0, first], [nx, ny, nz.min(first + n)])?)?;
        }
        Ok(())
    }

    /// Smallest and largest sample.
    ///
    /// # Errors
    ///
    /// As [`Slabs::read`], and [`Error::Input`] where [`Volume::new`](super::Volume::new) refuses the samples.
    pub fn range(&self) -> Result<(f64, f64)> {
        let Plain { dims, .. } = self.plain;
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        self.each(|first, samples| {
            let before = dims[0] * dims[1] * first;
            let range = with_samples!(samples, s => range_of(s));
            let range =
                range.map_err(|i| not_finite(&self.name, dims, before + i, samples.get(i)))?;
            (low, high) = (low.min(range.0), high.max(range.1));
            Ok(())
        })?;
        check_range(&self.name, (low, high)).map(|()| (low, high))
    }

    /// What is known of the samples, whose range is given.
    ///
    /// # Errors
    ///
    /// As [`Slabs::read`].
    pub fn statistics(&self, range: (f64, f64)) -> Result<Statistics> {
        let mut tally = Tally::new(range);
        self.each(|_, samples| {
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
    /// [`Error::Usage`] for a block outside; [`Error::Io`], [`Error::Input`] where it cannot be read.
    pub fn read(&self, first: [usize; 3], end: [usize; 3]) -> Result<Samples> {
        let Plain { path, dims, .. } = &self.plain;
        if (0..3).any(|a| first[a] >= end[a] || end[a] > dims[a]) {
            return Err(Error::Usage(format!(
                "samples {first:?} to {end:?}, expected some of {dims:?}"
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
        let Plain { start, dims, sample_type, big_endian, .. } = self.plain;
        let size = sample_type.n_bytes();
        let n = end[0] - first[0];
        // The block's bytes as if it were a file: then one reader makes samples of them.
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
    use crate::volume::{phantom, read_volume};

    /// A file of every kind that is read by blocks.
    fn files(folder: &Path) -> Vec<PathBuf> {
        let volume = phantom("noise:9:2").expect("a phantom");
        let crop = super::super::Preparation {
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
    fn a_file_that_became_shorter_is_refused_in_one_line() {
        let folder = tempfile::tempdir().expect("a folder");
        for path in files(folder.path()).into_iter().take(3) {
            let bytes = std::fs::read(&path).expect("there");
            std::fs::write(&path, &bytes[..bytes.len() - 9]).expect("written");
            let refused = Slabs::of(&path, &ReadOptions::default()).expect_err("too short");
            assert!(refused.to_string().contains("bytes"), "{refused}");
        }
    }
}
