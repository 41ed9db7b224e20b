//! A film of pictures, encoded by `ffmpeg`.
//!
//! The pictures are in a temporary folder next to the film until it is complete. Without ffmpeg there can be numbered
//! pictures instead.

use std::fs::File;
use std::io::{self, BufWriter, Write as _};
use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus, Stdio};
use std::time::Duration;

use crate::atomic_folder::TemporaryFolder;
use crate::error::{Error, Result};
use crate::output::Output;
use crate::progress::Progress;
use crate::render::{Background, Image};

/// Interval at which the end of ffmpeg is checked.
const POLL_INTERVAL: Duration = Duration::from_millis(20);

/// A film to make.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Film {
    path: PathBuf,
    format: FilmFormat,
    /// Pictures per second.
    rate: u32,
}

/// The format of a film, by its extension.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum FilmFormat {
    /// H.264: all players and presentation programs show it.
    Mp4,
    /// VP9: browsers show it, and it can be transparent.
    WebM,
}

impl FilmFormat {
    fn extension(self) -> &'static str {
        match self {
            FilmFormat::Mp4 => "mp4",
            FilmFormat::WebM => "webm",
        }
    }
}

impl Film {
    /// Returns the film for a path; none for any other extension.
    pub(super) fn of(path: &Path, rate: u32) -> Option<Film> {
        let extension = path.extension()?.to_str()?;
        let format = [FilmFormat::Mp4, FilmFormat::WebM]
            .into_iter()
            .find(|format| extension.eq_ignore_ascii_case(format.extension()))?;
        Some(Film { path: path.to_owned(), format, rate })
    }

    /// Checks what can be checked before any picture is rendered.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`] if ffmpeg is missing, or the format does not support the size or the background.
    pub(super) fn check(&self, [width, height]: [u32; 2], background: Background) -> Result<()> {
        let shown = self.path.display();
        let wrong = |what: String| Err(Error::Usage(format!("{shown}: {what}")));
        if width % 2 != 0 || height % 2 != 0 {
            return wrong(format!(
                "a film cannot have {width}x{height} pixels, expected even numbers"
            ));
        }
        if self.format == FilmFormat::Mp4 && background == Background::Transparent {
            return wrong(
                "an .mp4 cannot be transparent, expected a name that ends in .webm".into(),
            );
        }
        let version = Command::new("ffmpeg")
            .arg("-version")
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .status();
        match version {
            Ok(status) if status.success() => Ok(()),
            Err(error) if error.kind() == io::ErrorKind::NotFound => wrong(
                "a film needs ffmpeg, which is not on the PATH; write pictures with -o frames/%04d.png"
                    .into(),
            ),
            Err(error) => wrong(format!("ffmpeg cannot be started: {error}")),
            Ok(status) => wrong(format!("ffmpeg -version fails: {}", ended(status))),
        }
    }

    /// Checks that the film can be written and replaces no input, and makes the folder of its pictures.
    ///
    /// # Errors
    ///
    /// [`Error::Io`] if it cannot be written, [`Error::Usage`] if it is an input.
    pub(super) fn open(self, inputs: &[&Path]) -> Result<FilmWriter> {
        Output::open(&self.path, inputs)?;
        let folder = TemporaryFolder::next_to(&self.path)?;
        Ok(FilmWriter { film: self, folder, n: 0 })
    }

    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// Returns the arguments of ffmpeg, which runs in the folder of the pictures.
    fn arguments(&self, is_transparent: bool) -> Vec<String> {
        let words = |text: &str| text.split(' ').map(str::to_owned).collect::<Vec<_>>();
        let mut all = words("-hide_banner -loglevel error -nostdin -y -framerate");
        all.push(self.rate.to_string());
        all.extend(words("-i %06d.png"));
        let pixels = if is_transparent { "yuva420p" } else { "yuv420p" };
        // Players guess the colour space of a film that does not specify it.
        all.extend(words(&format!(
            "-vf scale=out_color_matrix=bt709:out_range=tv,format={pixels}"
        )));
        all.extend(words("-colorspace bt709 -color_primaries bt709 -color_trc iec61966-2-1"));
        all.extend(words(match self.format {
            FilmFormat::Mp4 => "-c:v libx264 -preset slow -crf 18 -movflags +faststart",
            FilmFormat::WebM => "-c:v libvpx-vp9 -crf 24 -b:v 0 -row-mt 1",
        }));
        all.push(self.temporary_name());
        all
    }

    /// Returns the name of the film in the folder of the pictures.
    fn temporary_name(&self) -> String {
        format!("film.{}", self.format.extension())
    }
}

/// A film and the pictures written so far.
#[derive(Debug)]
pub(super) struct FilmWriter {
    film: Film,
    folder: TemporaryFolder,
    n: u32,
}

impl FilmWriter {
    /// Adds a picture.
    pub(super) fn add(&mut self, image: &Image) -> Result<()> {
        let path = self.folder.path().join(format!("{:06}.png", self.n));
        let written = File::create(&path).and_then(|file| {
            let mut writer = BufWriter::new(file);
            image.encode_png(&mut writer)?;
            writer.flush()
        });
        self.n += 1;
        written.map_err(|error| Error::io(&path, error))
    }

    /// Encodes the film and moves it to its destination.
    ///
    /// # Errors
    ///
    /// [`Error::Io`] with the message of ffmpeg, [`Error::Interrupted`].
    pub(super) fn finish(self, is_transparent: bool, progress: &dyn Progress) -> Result<()> {
        let FilmWriter { film, folder, .. } = self;
        let failed = |error| Error::io(film.path(), error);
        let log_path = folder.path().join("ffmpeg.log");
        // A file takes all messages; ffmpeg would block on a full pipe.
        let log = File::create(&log_path).map_err(failed)?;
        let mut child = Command::new("ffmpeg")
            .args(film.arguments(is_transparent))
            .current_dir(folder.path())
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(log)
            .spawn()
            .map_err(|error| {
                failed(io::Error::other(format!("ffmpeg cannot be started: {error}")))
            })?;
        let status = loop {
            if let Some(status) = child.try_wait().map_err(failed)? {
                break status;
            }
            if progress.cancelled() {
                // The terminal sends the signal to ffmpeg as well, so it can have ended already.
                let _ = child.kill();
                let _ = child.wait();
                return Err(Error::Interrupted);
            }
            std::thread::sleep(POLL_INTERVAL);
        };
        if !status.success() && progress.cancelled() {
            return Err(Error::Interrupted);
        }
        if !status.success() {
            let text = std::fs::read(&log_path).unwrap_or_default();
            let text = String::from_utf8_lossy(&text).into_owned();
            let last = text.lines().map(str::trim).rfind(|line| !line.is_empty());
            let reason = last.map_or_else(|| ended(status), str::to_owned);
            return Err(failed(io::Error::other(format!("ffmpeg fails: {reason}"))));
        }
        folder.move_file(&film.temporary_name(), film.path())
    }
}

/// Describes how a program ended.
fn ended(status: ExitStatus) -> String {
    match status.code() {
        Some(code) => format!("exit code {code}"),
        None => "ended by a signal".to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_extension_selects_the_format() {
        let format = |name: &str| Film::of(Path::new(name), 30).map(|film| film.format);
        assert_eq!(format("a/b.mp4"), Some(FilmFormat::Mp4));
        assert_eq!(format("B.WebM"), Some(FilmFormat::WebM));
        for other in ["b.png", "mp4", "%04d.png", "-", "b.mp4.png"] {
            assert_eq!(format(other), None, "{other}");
        }
    }
}
