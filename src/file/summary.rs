//! The description of a spectrum file, from its tables: it takes milliseconds, whatever the size of the file.

use std::io::{Read, Seek};
use std::path::Path;

use super::container::FileTables;
use super::source::{Seeking, Source};
use crate::error::Result;
use crate::input;
use crate::spectrum::{Patch, Size, Spectrum};

/// The description of the spectrum in a file, without its geometry.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Summary {
    /// The description as a spectrum without triangles.
    pub spectrum: Spectrum,
    /// The size of the spectrum in the file.
    pub size: Size,
    /// Bytes of the file.
    pub bytes: u64,
    /// The number of trees of chunks: one for each brick with triangles.
    pub n_trees: usize,
}

impl Summary {
    /// The summary of a spectrum that was read completely from a file of so many bytes.
    pub fn of(spectrum: Spectrum, bytes: u64) -> Summary {
        Summary { size: Size::of(&spectrum), spectrum, bytes, n_trees: 1 }
    }

    /// Reads the tables of a file. The checksums of chunks are not checked.
    ///
    /// # Errors
    ///
    /// [`Error::Io`](crate::Error::Io); [`Error::Input`](crate::Error::Input) if it is not a spectrum file, or its tables are damaged.
    pub fn read(path: &Path) -> Result<Summary> {
        let (mut file, length) = input::open(path)?;
        Summary::from_reader(&mut file, length).map_err(|e| e.of_file(path))
    }

    /// As [`Summary::read`], from a reader with the length of the file.
    ///
    /// # Errors
    ///
    /// [`Error::Input`](crate::Error::Input), also if reading fails.
    pub fn from_reader(file: &mut (impl Read + Seek + Send), length: u64) -> Result<Summary> {
        let source = Seeking::new(file, length);
        let FileTables { about, size, index, .. } = FileTables::read(&source)?;
        Ok(Summary {
            spectrum: Spectrum::new(about, Patch::empty())?,
            size,
            bytes: source.n_bytes(),
            n_trees: index.n_trees(),
        })
    }
}
