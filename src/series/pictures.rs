//! The destination of a series of pictures: numbered files, or a film.

use std::path::Path;

use super::film::{Film, FilmWriter};
use super::pattern::Pattern;
use crate::error::{Error, Result};
use crate::output::{Output, no_path};
use crate::progress::Progress;
use crate::render::{Background, Image};

/// Default number of pictures per second.
const DEFAULT_FPS: u32 = 30;

/// The destination of a series of pictures.
#[derive(Clone, Debug)]
pub struct Series {
    to: To,
    is_transparent: bool,
}

#[derive(Clone, Debug)]
enum To {
    Files(Pattern),
    Film(Film),
}

impl Series {
    /// The destination for a path, with the width and height of the pictures; `fps` is given for a film only.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`] if the path is neither a pattern nor a film, or a film that cannot be made.
    pub fn of(
        path: &Path,
        fps: Option<u32>,
        size: [u32; 2],
        background: Background,
    ) -> Result<Self> {
        let is_transparent = background == Background::Transparent;
        let to = |to| Ok(Series { to, is_transparent });
        if let Some(film) = Film::of(path, fps.unwrap_or(DEFAULT_FPS)) {
            film.check(size, background)?;
            return to(To::Film(film));
        }
        let pattern = Pattern::of(path)?;
        match fps {
            None => to(To::Files(pattern)),
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
        Ok(match &self.to {
            To::Files(pattern) => OpenSeries::Files(pattern.open(n, inputs)?.into_iter()),
            To::Film(film) => {
                OpenSeries::Film(Box::new(film.clone().open(inputs)?), self.is_transparent)
            }
        })
    }

    /// Describes the names of `n` pictures for a message.
    pub fn names(&self, n: u32) -> String {
        match &self.to {
            To::Files(pattern) => {
                let [first, last] = [0, n - 1].map(|frame| pattern.path(frame));
                format!("{} to {}", first.display(), last.display())
            }
            To::Film(film) => film.path().display().to_string(),
        }
    }
}

/// A series whose pictures are written one by one.
#[derive(Debug)]
pub(super) enum OpenSeries {
    Files(std::vec::IntoIter<Output>),
    /// A film, and whether it is transparent.
    Film(Box<FilmWriter>, bool),
}

impl OpenSeries {
    /// Writes the next picture.
    pub(super) fn add(&mut self, image: &Image, progress: &dyn Progress) -> Result<()> {
        match self {
            OpenSeries::Files(files) => {
                let output = files.next().ok_or_else(|| Error::internal("one picture too many"))?;
                output.write(progress, |file| image.encode_png(file).map_err(no_path))?;
                Ok(())
            }
            OpenSeries::Film(film, _) => film.add(image),
        }
    }

    /// Encodes the film, if it is one.
    pub(super) fn finish(self, progress: &dyn Progress) -> Result<()> {
        match self {
            OpenSeries::Files(_) => Ok(()),
            OpenSeries::Film(film, is_transparent) => film.finish(is_transparent, progress),
        }
    }
}
