//! The destination of a series of pictures: numbered files, or a film.

use std::path::Path;

use isospectrum::render::{Background, Image};
use isospectrum::{Error, Result};

use super::film::{Film, FilmWriter};
use super::frames::Pattern;
use super::output::{Output, no_path};
use super::size_argument::PictureSize;

/// Default number of pictures per second.
const DEFAULT_FPS: u32 = 30;

/// The destination of a series of pictures.
#[derive(Clone, Debug)]
pub(super) enum Series {
    Files(Pattern),
    Film(Film),
}

impl Series {
    /// Returns the destination for a path; `fps` is given for a film only.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`] if the path is neither a pattern nor a film, or a film that cannot be made.
    pub(super) fn of(
        path: &Path,
        fps: Option<u32>,
        size: PictureSize,
        background: Background,
    ) -> Result<Self> {
        if let Some(film) = Film::of(path, fps.unwrap_or(DEFAULT_FPS)) {
            film.check(size, background)?;
            return Ok(Series::Film(film));
        }
        let pattern = Pattern::of(path)?;
        match fps {
            None => Ok(Series::Files(pattern)),
            Some(_) => {
                let shown = path.display();
                Err(Error::Usage(format!("{shown}: --fps needs a film (.mp4, .webm)")))
            }
        }
    }

    /// Checks that all files can be written and replace no input, before any picture is rendered.
    ///
    /// # Errors
    ///
    /// [`Error::Io`] if one cannot be written, [`Error::Usage`] if one is an input.
    pub(super) fn open(&self, n: u32, inputs: &[&Path]) -> Result<OpenSeries> {
        Ok(match self {
            Series::Files(pattern) => OpenSeries::Files(pattern.open(n, inputs)?.into_iter()),
            Series::Film(film) => OpenSeries::Film(film.clone().open(inputs)?),
        })
    }

    /// Describes the names of `n` pictures for a message.
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

/// A series whose pictures are written one by one.
#[derive(Debug)]
pub(super) enum OpenSeries {
    Files(std::vec::IntoIter<Output>),
    Film(FilmWriter),
}

impl OpenSeries {
    /// Writes the next picture.
    pub(super) fn add(&mut self, image: &Image) -> Result<()> {
        match self {
            OpenSeries::Files(files) => {
                let output = files.next().ok_or_else(|| Error::internal("one picture too many"))?;
                output.write(|file| image.encode_png(file).map_err(no_path))?;
                Ok(())
            }
            OpenSeries::Film(film) => film.add(image),
        }
    }

    /// Encodes the film, if it is one.
    pub(super) fn finish(self, background: Background) -> Result<()> {
        match self {
            OpenSeries::Files(_) => Ok(()),
            OpenSeries::Film(film) => film.finish(background == Background::Transparent),
        }
    }
}
