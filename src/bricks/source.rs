//! Where the samples of a plan's volume come from.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use crate::error::Result;
use crate::volume::{Outside, ReadOptions, Volume, phantom, read_volume};

/// How to read a volume again.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum Source {
    /// A file, or a folder of slices.
    File {
        /// Where it is.
        path: PathBuf,
        /// What is said about it.
        options: ReadOptions,
        /// Side of the layer around it.
        outside: Outside,
    },
    /// A built-in volume.
    Phantom {
        /// Its name, as `--phantom` has it.
        name: String,
        /// Side of the layer around it.
        outside: Outside,
    },
}

impl Source {
    /// The volume.
    ///
    /// # Errors
    ///
    /// Those of [`read_volume`] and [`phantom`].
    pub fn read(&self) -> Result<Volume> {
        match self {
            Source::File { path, options, outside } => {
                Ok(read_volume(path, options)?.with_outside(*outside))
            }
            Source::Phantom { name, outside } => Ok(phantom(name)?.with_outside(*outside)),
        }
    }

    /// The file, where it is one.
    pub fn path(&self) -> Option<&Path> {
        match self {
            Source::File { path, .. } => Some(path),
            Source::Phantom { .. } => None,
        }
    }
}
