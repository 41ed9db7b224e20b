//! Where pictures one after the other go: to numbered files, or into a film.

use std::path::Path;

use isospectrum::render::{Background, Image};
use isospectrum::{Error, Result};

use super::film::{Film, Reel};
use super::frames::Pattern;
use super::output::{Output, no_path};
use super::render::Size;

/// Pictures per second where nobody says.
const RATE: u32 = 30;

/// What a path says of pictures one after the other.
#[derive(Clone, Debug)]
pub(super) enum Series {
    Files(Pattern),
    Film(Film),
}

impl Series {
    /// The series that a path is; `rate` is that of a film, where it is told.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`] where it is neither a pattern nor a film, or a film that cannot be made.
    pub(super) fn of(
        path: &Path,
        rate: Option<u32>,
        size: Size,
        background: Background,
    ) -> Result<Self> {
        if let Some(film) = Film::of(path, rate.unwrap_or(RATE)) {
            film.check(size, background)?;
            return Ok(Series::Film(film));
        }
        let pattern = Pattern::of(path)?;
        match rate {
            None => Ok(Series::Files(pattern)),
            Some(_) => {
                let shown = path.display();
                Err(Error::Usage(format!(
                    "{shown}: files have no --fps, expected a film (.mp4, .webm)"
                )))
            }
        }
    }

    /// Checks that all can be written, before any is rendered, and that none is one of the inputs.
    ///
    /// # Errors
    ///
    /// [`Error::Io`] where one cannot, [`Error::Usage`] where one is an input.
    pub(super) fn open(&self, n: u32, inputs: &[&Path]) -> Result<OpenSeries> {
        Ok(match self {
            Series::Files(pattern) => OpenSeries::Files(pattern.open(n, inputs)?.into_iter()),
            Series::Film(film) => OpenSeries::Film(film.clone().open(inputs)?),
        })
    }

    /// The names of `n` pictures, to be told.
    pub(super) fn names(&self, n: u32) -> String {
        match self {
            Series::Files(pattern) => {
                let [first, last] = [0, n - 1].map(|frame| pattern.path(frame));
                format!("{} to {}", first.display(), last.display())
            }
            Series::Film(film) => film.path().display().to_string(),
        }
    }
}

/// A series that is being written.
#[derive(Debug)]
pub(super) enum OpenSeries {
    Files(std::vec::IntoIter<Output>),
    Film(Reel),
}

impl OpenSeries {
    /// Writes the next picture, of no more than there were to be.
    pub(super) fn add(&mut self, image: &Image) -> Result<()> {
        match self {
            OpenSeries::Files(files) => {
                let output = files.next().ok_or_else(|| Error::internal("one picture too many"))?;
                output.write(|file| image.encode_png(file).map_err(no_path))?;
                Ok(())
            }
            OpenSeries::Film(reel) => reel.add(image),
        }
    }

    /// Completes what is complete only as a whole.
    pub(super) fn finish(self, background: Background) -> Result<()> {
        match self {
            OpenSeries::Files(_) => Ok(()),
            OpenSeries::Film(reel) => reel.finish(background == Background::Transparent),
        }
    }
}
