//! The names of numbered files, `frames/%04d.png`.

use std::path::{Path, PathBuf};

use crate::atomic_file::parent_folder;
use crate::error::{Error, Result};
use crate::output::Output;

/// A file name with a placeholder for the number of the frame as in `printf`: `%d` or `%04d`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Pattern {
    before: String,
    width: usize,
    after: String,
}

impl Pattern {
    /// Parses the path of numbered pictures.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`] unless the file name has exactly one placeholder and ends in .png.
    pub fn of(path: &Path) -> Result<Self> {
        if path.to_str().is_some()
            && !path.extension().is_some_and(|e| e.eq_ignore_ascii_case("png"))
        {
            let shown = path.display();
            return Err(Error::Usage(format!(
                "{shown}: expected a name that ends in .png, .mp4 or .webm"
            )));
        }
        Self::of_any(path)
    }

    /// Parses the path of numbered files of any format.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`] unless the file name has exactly one placeholder.
    pub fn of_any(path: &Path) -> Result<Self> {
        let shown = path.display();
        let wrong = |expected: &str| Err(Error::Usage(format!("{shown}: expected {expected}")));
        let Some(text) = path.to_str() else { return wrong("a name in UTF-8") };
        let mut parts = text.split('%');
        let (Some(before), Some(number), None) = (parts.next(), parts.next(), parts.next()) else {
            return wrong("one placeholder for the number of the file, such as frames/%04d.png");
        };
        let Some((width, after)) = number.split_once('d') else {
            return wrong("%d or %04d for the number of the frame");
        };
        let width = match width {
            "" => Some(1),
            digits => digits.strip_prefix('0').and_then(|d| d.parse().ok()).filter(|&w| w <= 20),
        };
        let Some(width) = width else {
            return wrong("%d or %04d for the number of the frame");
        };
        if after.contains('/') {
            return wrong("the number of the frame in the name of the file, not of a folder");
        }
        Ok(Pattern { before: before.to_owned(), width, after: after.to_owned() })
    }

    /// Numbered files that are listed by another one: `a.pvd` lists `a-0000.vtp` and so on. A `%` in its name is no placeholder.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`] for a name that is not UTF-8.
    pub fn listed_by(list: &Path, extension: &str) -> Result<Self> {
        let stem = list.with_extension("");
        let Some(stem) = stem.to_str() else {
            let shown = list.display();
            return Err(Error::Usage(format!("{shown}: expected a name in UTF-8")));
        };
        Ok(Pattern { before: format!("{stem}-"), width: 4, after: format!(".{extension}") })
    }

    /// Returns the path of a frame; the first is 0.
    pub fn path(&self, frame: u32) -> PathBuf {
        PathBuf::from(format!("{}{frame:0width$}{}", self.before, self.after, width = self.width))
    }

    /// Checks that every frame can be written and replaces no input, before any is rendered. Makes the folder if it does not
    /// exist.
    ///
    /// # Errors
    ///
    /// [`Error::Io`] if one cannot be written, [`Error::Usage`] if one is an input.
    pub fn open(&self, n_frames: u32, inputs: &[&Path]) -> Result<Vec<Output>> {
        let first = self.path(0);
        let folder = parent_folder(&first);
        std::fs::create_dir_all(folder).map_err(|source| Error::io(folder, source))?;
        // All files are in one folder, so the first is enough to check it; existing files are checked one by one.
        let first = Output::open(&first, inputs)?;
        let others = (1..n_frames).map(|frame| {
            let path = self.path(frame);
            if path.exists() { Output::open(&path, inputs) } else { Ok(Output::File(path)) }
        });
        std::iter::once(Ok(first)).chain(others).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pattern_has_one_number_in_its_file_name() {
        let path = |text: &str, frame| Pattern::of(Path::new(text)).ok().map(|p| p.path(frame));
        assert_eq!(path("f/%04d.png", 7), Some(PathBuf::from("f/0007.png")));
        assert_eq!(path("f-%d.PNG", 12), Some(PathBuf::from("f-12.PNG")));
        for wrong in
            ["f.png", "%d%d.png", "%04d.jpg", "%4d.png", "%s.png", "%0999d.png", "%d/f.png", "-"]
        {
            assert_eq!(path(wrong, 0), None, "{wrong}");
        }
    }
}
