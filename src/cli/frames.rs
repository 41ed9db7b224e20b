//! `--sweep A:B:N` and the names of its pictures, `frames/%04d.png`.

use std::path::{Path, PathBuf};
use std::str::FromStr;

use isospectrum::file::parent_folder;
use isospectrum::spectrum::Spectrum;
use isospectrum::volume::Statistics;
use isospectrum::{Error, Result};

use super::isovalue::Isovalue;
use super::output::Output;

/// Most frames of one sweep, and of one turntable.
pub(super) const MOST: u32 = 100_000;

/// `A:B:N`: N isovalues from A to B, both included, evenly spaced; B may be the lower one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Sweep {
    from: Isovalue,
    to: Isovalue,
    n: u32,
}

impl Sweep {
    /// How many frames there are.
    pub(super) fn n_frames(&self) -> u32 {
        self.n
    }

    /// The isovalues in a spectrum's range.
    ///
    /// # Errors
    ///
    /// [`Error::Range`] where an end lies outside, [`Error::Usage`] where the samples are needed and not known.
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
        // Weighted, so that both ends are met exactly.
        let at = |i: u32| {
            let t = f64::from(i) / last;
            (from * (1.0 - t) + to * t).clamp(from.min(to), from.max(to))
        };
        Ok((0..self.n).map(at).collect())
    }
}

impl FromStr for Sweep {
    type Err = String;

    fn from_str(text: &str) -> std::result::Result<Self, String> {
        let expected = || format!("'{text}', expected FROM:TO:N such as 10%:90%:120");
        let parts = isospectrum::settings::split_at_colons(text);
        let [from, to, n] = parts[..] else { return Err(expected()) };
        let n = n.trim().parse().map_err(|_| expected())?;
        if !(2..=MOST).contains(&n) {
            return Err(format!("'{text}', expected from 2 to {MOST} frames"));
        }
        let parse = |end: &str| end.parse().map_err(|error: Error| error.to_string());
        Ok(Sweep { from: parse(from)?, to: parse(to)?, n })
    }
}

/// A file name with the number of the frame in it, as `printf` writes it: `%d` or `%04d`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Pattern {
    before: String,
    width: usize,
    after: String,
}

impl Pattern {
    /// The pattern that a path of pictures is.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`] where it has not exactly one number, in the file's name, or the name does
    /// not end in .png.
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

    /// The pattern that a path of files of any kind is.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`] where it has not exactly one number, in the file's name.
    pub(super) fn of_any(path: &Path) -> Result<Self> {
        let shown = path.display();
        let wrong = |expected: &str| Err(Error::Usage(format!("{shown}: expected {expected}")));
        let Some(text) = path.to_str() else { return wrong("a name in UTF-8") };
        let mut parts = text.split('%');
        let (Some(before), Some(number), None) = (parts.next(), parts.next(), parts.next()) else {
            return wrong("one place for the number of the file, such as frames/%04d.png");
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
            return wrong("the number of the frame in the file's name, not in a folder's");
        }
        Ok(Pattern { before: before.to_owned(), width, after: after.to_owned() })
    }

    /// The path of a frame; the first is 0.
    pub(super) fn path(&self, frame: u32) -> PathBuf {
        PathBuf::from(format!("{}{frame:0width$}{}", self.before, self.after, width = self.width))
    }

    /// Checks that every frame can be written, before any is rendered, and that none is one of the
    /// inputs. Makes the folder where it is not there.
    pub(super) fn open(&self, n_frames: u32, inputs: &[&Path]) -> Result<Vec<Output>> {
        let first = self.path(0);
        let folder = parent_folder(&first);
        std::fs::create_dir_all(folder).map_err(|source| Error::io(folder, source))?;
        // All lie in one folder, so the first tells of it; the others may still be in the way.
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
        let values = |text: &str| text.parse::<Sweep>().map(|s| s.resolve((0.0, 10.0), None).ok());
        assert_eq!(values("1:3:3"), Ok(Some(vec![1.0, 2.0, 3.0])));
        assert_eq!(values("100%:0%:2"), Ok(Some(vec![10.0, 0.0])));
        assert_eq!(values("1:11:3"), Ok(None));
        for wrong in ["", "1:2", "1:2:1", "1:2:x", "1:2:3:4", "a:2:3", "1:2:100001"] {
            assert!(wrong.parse::<Sweep>().is_err(), "{wrong}");
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
