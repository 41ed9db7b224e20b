//! The files of a plan's parts in a folder.

use std::fs::File;
use std::path::{Path, PathBuf};

use super::part::{Part, PartBorder};
use super::plan::Plan;
use crate::error::{Error, Result};
use crate::input;

/// Most parts that an error message lists.
const MAX_LISTED: usize = 8;

/// The part files of a plan in a folder.
#[derive(Clone, Debug)]
pub struct Parts<'a> {
    plan: &'a Plan,
    folder: PathBuf,
}

impl<'a> Parts<'a> {
    /// The part files of `plan` in `folder`, which need not exist yet.
    pub fn new(plan: &'a Plan, folder: impl Into<PathBuf>) -> Self {
        Parts { plan, folder: folder.into() }
    }

    /// The plan.
    pub fn plan(&self) -> &'a Plan {
        self.plan
    }

    /// Number of parts of the plan.
    pub fn n(&self) -> usize {
        self.plan.recipe.bricks.len()
    }

    /// Path of the file of a part.
    pub fn file(&self, number: usize) -> PathBuf {
        self.folder.join(format!("{number:06}.part"))
    }

    /// Paths of the files of all parts.
    pub fn files(&self) -> Vec<PathBuf> {
        (0..self.n()).map(|number| self.file(number)).collect()
    }

    /// True if the file of a part exists and is undamaged.
    ///
    /// # Errors
    ///
    /// Those of reading a file that exists: [`Error::Io`], [`Error::Input`].
    pub fn is_complete(&self, number: usize) -> Result<bool> {
        let file = self.file(number);
        if !file.exists() {
            return Ok(false);
        }
        Part::head(&input::read(&file)?, self.plan, number).map(|_| true)
    }

    /// Checks that the files of all parts exist.
    ///
    /// # Errors
    ///
    /// [`Error::Input`] with the numbers of those that are missing.
    pub fn check_complete(&self) -> Result<()> {
        let missing = (0..self.n()).filter(|&i| !self.file(i).exists());
        let missing: Vec<String> = missing.map(|i| i.to_string()).collect();
        if missing.is_empty() {
            return Ok(());
        }
        let more = if missing.len() > MAX_LISTED { ", ..." } else { "" };
        Err(Error::input(format!(
            "{} of {} parts are missing: {}{more}, expected them in {}",
            missing.len(),
            self.n(),
            missing[..missing.len().min(MAX_LISTED)].join(", "),
            self.folder.display()
        )))
    }

    /// Reads a part.
    ///
    /// # Errors
    ///
    /// [`Error::Io`]; [`Error::Input`] as [`Part::from_bytes`], with the path of the file.
    pub fn part(&self, number: usize) -> Result<Part> {
        let file = self.file(number);
        Part::from_bytes(&input::read(&file)?, self.plan, number).map_err(|e| with_path(&file, e))
    }

    /// Reads the border of a part, and nothing else of it.
    ///
    /// # Errors
    ///
    /// As [`Parts::part`].
    pub fn border(&self, number: usize) -> Result<PartBorder> {
        let path = self.file(number);
        let (mut file, _): (File, u64) = input::open(&path)?;
        PartBorder::read(&mut file, self.plan, number).map_err(|e| with_path(&path, e))
    }
}

/// Adds the path of a file to an error.
fn with_path(path: &Path, error: Error) -> Error {
    match error {
        Error::Io { source, .. } => Error::io(path, source),
        other => other.of_file(path),
    }
}
