//! The files of a plan's parts in a folder.

use std::fs::File;
use std::path::{Path, PathBuf};

use super::{Border, Part, Plan};
use crate::error::{Error, Result};
use crate::input;

/// Parts that a message names.
const NAMED: usize = 8;

/// See the module.
#[derive(Clone, Debug)]
pub struct Parts<'a> {
    plan: &'a Plan,
    folder: PathBuf,
}

impl<'a> Parts<'a> {
    /// Of a plan in a folder, which need not be there yet.
    pub fn new(plan: &'a Plan, folder: impl Into<PathBuf>) -> Self {
        Parts { plan, folder: folder.into() }
    }

    /// The plan.
    pub fn plan(&self) -> &'a Plan {
        self.plan
    }

    /// How many there are when all are there.
    pub fn n(&self) -> usize {
        self.plan.recipe.bricks.len()
    }

    /// The file of a part.
    pub fn file(&self, number: usize) -> PathBuf {
        self.folder.join(format!("{number:06}.part"))
    }

    /// The files of all parts.
    pub fn files(&self) -> Vec<PathBuf> {
        (0..self.n()).map(|number| self.file(number)).collect()
    }

    /// Whether a part is there and whole.
    ///
    /// # Errors
    ///
    /// What is wrong with a file that is there.
    pub fn is_there(&self, number: usize) -> Result<bool> {
        let file = self.file(number);
        if !file.exists() {
            return Ok(false);
        }
        Part::head(&input::read(&file)?, self.plan, number).map(|_| true)
    }

    /// Checks that there is a file of every part.
    ///
    /// # Errors
    ///
    /// [`Error::Input`] that says which are missing.
    pub fn check_all_there(&self) -> Result<()> {
        let missing = (0..self.n()).filter(|&i| !self.file(i).exists());
        let missing: Vec<String> = missing.map(|i| i.to_string()).collect();
        if missing.is_empty() {
            return Ok(());
        }
        let more = if missing.len() > NAMED { ", ..." } else { "" };
        Err(Error::input(format!(
            "{} of {} parts are missing: {}{more}, expected them in {}",
            missing.len(),
            self.n(),
            missing[..missing.len().min(NAMED)].join(", "),
            self.folder.display()
        )))
    }

    /// A part.
    ///
    /// # Errors
    ///
    /// [`Error::Io`]; [`Error::Input`] as [`Part::from_bytes`], with the name of its file.
    pub fn part(&self, number: usize) -> Result<Part> {
        let file = self.file(number);
        Part::from_bytes(&input::read(&file)?, self.plan, number).map_err(|e| named(&file, e))
    }

    /// The border of a part, which is all that is read of it.
    ///
    /// # Errors
    ///
    /// As [`Parts::part`].
    pub fn border(&self, number: usize) -> Result<Border> {
        let path = self.file(number);
        let (mut file, _): (File, u64) = input::open(&path)?;
        Border::read(&mut file, self.plan, number).map_err(|e| named(&path, e))
    }
}

/// Says of which file something is wrong.
fn named(path: &Path, error: Error) -> Error {
    match error {
        Error::Io { source, .. } => Error::io(path, source),
        other => other.of_file(path),
    }
}
