//! `--sweep A:B:N` and the names of its files, `frames/%04d.png`.

use std::path::{Path, PathBuf};
use std::str::FromStr;

use isospectrum::file::parent_folder;
use isospectrum::spectrum::Spectrum;
use isospectrum::volume::Statistics;
use isospectrum::{Error, Result};

use super::isovalue::Isovalue;
use super::output::Output;

/// Maximum number of frames of a sweep or a turntable: an hour of film.
pub(super) const MAX_FRAMES: u32 = 100_000;

/// `A:B:N`: N evenly spaced isovalues from A to B, both included; A can be above B.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct SweepArgument {
    from: Isovalue,
    to: Isovalue,
    n: u32,
}

impl SweepArgument {
    /// Returns the number of frames.
    pub(super) fn n_frames(&self) -> u32 {
        self.n
    }

    /// Returns the isovalues for a spectrum.
    ///
    /// # Errors
    ///
    /// [`Error::Range`] if an end is outside the range, [`Error::Usage`] if an end needs statistics of the samples that are
    /// unknown.
    pub(super) fn in_spectrum(&self, spectrum: &Spectrum) -> Result<Vec<f64>> {
        self.resolve(spectrum.range(), spectrum.statistics().as_ref())
    }

    fn resolve(&self, range: (f64, f64), samples: Option<&Statistics>) -> Result<Vec<f64>> {
        let from = self.from.resolve(range, samples)?;
        let to = self.to.resolve(range, samples)?;
        for isovalue in [from, to] {
            if !(range.0..=range.1).contains(&isovalue) {
                return Err(Error::Range { isovalue, low: range.0, high: range.1 });
            }
        }
        let last = f64::from(self.n - 1);
        // A weighted mean meets both ends exactly.
        let at = |i: u32| {
            let t = f64::from(i) / last;
            (from * (1.0 - t) + to * t).clamp(from.min(to), from.max(to))
        };
        Ok((0..self.n).map(at).collect())
    }
}

impl FromStr for SweepArgument {
    type Err = String;

    fn from_str(text: &str) -> std::result::Result<Self, String> {
        let expected = || "expected FROM:TO:N such as 10%:90%:120".to_owned();
        let parts = isospectrum::settings::split_at_colons(text);
        let [from, to, n] = parts[..] else { return Err(expected()) };
        let n = n.trim().parse().map_err(|_| expected())?;
        if !(2..=MAX_FRAMES).contains(&n) {
            return Err(format!("expected from 2 to {MAX_FRAMES} frames"));
        }
        let parse = |end: &str| end.parse().map_err(|error: Error| error.to_string());
        Ok(SweepArgument { from: parse(from)?, to: parse(to)?, n })
    }
}

/// A file name with a placeholder for the number of the frame as in `printf`: `%d` or `%04d`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Pattern {
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
    pub(super) fn of(path: &Path) -> Result<Self> {
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
    pub(super) fn of_any(path: &Path) -> Result<Self> {
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
    pub(super) fn listed_by(list: &Path, extension: &str) -> Result<Self> {
        let stem = list.with_extension("");
        let Some(stem) = stem.to_str() else {
            let shown = list.display();
            return Err(Error::Usage(format!("{shown}: expected a name in UTF-8")));
        };
        Ok(Pattern { before: format!("{stem}-"), width: 4, after: format!(".{extension}") })
    }

    /// Returns the path of a frame; the first is 0.
    pub(super) fn path(&self, frame: u32) -> PathBuf {
        PathBuf::from(format!("{}{frame:0width$}{}", self.before, self.after, width = self.width))
    }

    /// Checks that every frame can be written and replaces no input, before any is rendered. Makes the folder if it does not
    /// exist.
    pub(super) fn open(&self, n_frames: u32, inputs: &[&Path]) -> Result<Vec<Output>> {
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
    fn a_sweep_meets_both_ends_in_either_direction() {
        let values =
            |text: &str| text.parse::<SweepArgument>().map(|s| s.resolve((0.0, 10.0), None).ok());
        assert_eq!(values("1:3:3"), Ok(Some(vec![1.0, 2.0, 3.0])));
        assert_eq!(values("100%:0%:2"), Ok(Some(vec![10.0, 0.0])));
        assert_eq!(values("1:11:3"), Ok(None));
        for wrong in ["", "1:2", "1:2:1", "1:2:x", "1:2:3:4", "a:2:3", "1:2:100001"] {
            assert!(wrong.parse::<SweepArgument>().is_err(), "{wrong}");
        }
    }

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
