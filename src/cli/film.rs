//! A film of pictures, which `ffmpeg` makes.
//!
//! The pictures lie in a folder beside the film until it is complete. Whoever has no ffmpeg writes numbered pictures.

use std::fs::File;
use std::io::{self, BufWriter, Write as _};
use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus, Stdio};
use std::time::Duration;

use isospectrum::file::TemporaryFolder;
use isospectrum::render::{Background, Image};
use isospectrum::{Error, Result};

use super::interrupt;
use super::output::Output;
use super::render::Size;

/// How often it is looked whether ffmpeg has ended.
const LOOK: Duration = Duration::from_millis(20);

/// A film that is to be made.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Film {
    path: PathBuf,
    kind: Kind,
    /// Pictures per second.
    rate: u32,
}

/// What films are made in; by the end of their name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    /// H.264, which every player and every slide program shows.
    Mp4,
    /// VP9, which browsers show, and which can be transparent.
    WebM,
}

impl Kind {
    fn extension(self) -> &'static str {
        match self {
            Kind::Mp4 => "mp4",
            Kind::WebM => "webm",
        }
    }
}

impl Film {
    /// The film that a path is; none where its name ends otherwise.
    pub(super) fn of(path: &Path, rate: u32) -> Option<Film> {
        let extension = path.extension()?.to_str()?;
        let kind = [Kind::Mp4, Kind::WebM]
            .into_iter()
            .find(|kind| extension.eq_ignore_ascii_case(kind.extension()))?;
        Some(Film { path: path.to_owned(), kind, rate })
    }

    /// Whether it can be made, as far as that is known before there are pictures.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`] where there is no ffmpeg, or what is asked for is no film of this kind.
    pub(super) fn check(&self, size: Size, background: Background) -> Result<()> {
        let shown = self.path.display();
        let wrong = |what: String| Err(Error::Usage(format!("{shown}: {what}")));
        let Size { width, height } = size;
        if width % 2 != 0 || height % 2 != 0 {
            return wrong(format!("a film of {width}x{height} pixels, expected even numbers"));
        }
        if self.kind == Kind::Mp4 && background == Background::Transparent {
            return wrong(
                "an mp4 cannot be transparent, expected a name that ends in .webm".into(),
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
                "a film needs ffmpeg, which is not on the PATH; frames/%04d.png writes pictures"
                    .into(),
            ),
            Err(error) => wrong(format!("ffmpeg does not run: {error}")),
            Ok(status) => wrong(format!("ffmpeg does not run: {}", ended(status))),
        }
    }

    /// Checks that it can be written and is none of the inputs, and makes the folder of its pictures.
    ///
    /// # Errors
    ///
    /// [`Error::Io`] where it cannot, [`Error::Usage`] where it is an input.
    pub(super) fn open(self, inputs: &[&Path]) -> Result<Reel> {
        Output::open(&self.path, inputs)?;
        let folder = TemporaryFolder::next_to(&self.path)?;
        Ok(Reel { film: self, folder, n: 0 })
    }

    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// What ffmpeg is told, in the folder of the pictures.
    fn arguments(&self, is_transparent: bool) -> Vec<String> {
        let words = |text: &str| text.split(' ').map(str::to_owned).collect::<Vec<_>>();
        let mut all = words("-hide_banner -loglevel error -nostdin -y -framerate");
        all.push(self.rate.to_string());
        all.extend(words("-i %06d.png"));
        let pixels = if is_transparent { "yuva420p" } else { "yuv420p" };
        // Colours as they are in the pictures: players take a film that tells nothing for one or another.
        all.extend(words(&format!(
            "-vf scale=out_color_matrix=bt709:out_range=tv,format={pixels}"
        )));
        all.extend(words("-colorspace bt709 -color_primaries bt709 -color_trc iec61966-2-1"));
        all.extend(words(match self.kind {
            Kind::Mp4 => "-c:v libx264 -preset slow -crf 18 -movflags +faststart",
            Kind::WebM => "-c:v libvpx-vp9 -crf 24 -b:v 0 -row-mt 1",
        }));
        all.push(self.made());
        all
    }

    /// Its name in the folder of the pictures.
    fn made(&self) -> String {
        format!("film.{}", self.kind.extension())
    }
}

/// The pictures of a film that are there so far.
#[derive(Debug)]
pub(super) struct Reel {
    film: Film,
    folder: TemporaryFolder,
    n: u32,
}

impl Reel {
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

    /// Makes the film and puts it in its place.
    ///
    /// # Errors
    ///
    /// [`Error::Io`] with what ffmpeg says, [`Error::Interrupted`].
    pub(super) fn finish(self, is_transparent: bool) -> Result<()> {
        let Reel { film, folder, .. } = self;
        let failed = |error| Error::io(film.path(), error);
        let said = folder.path().join("said.txt");
        // A file takes all that it says; a pipe that nobody reads would stop it.
        let log = File::create(&said).map_err(failed)?;
        let mut child = Command::new("ffmpeg")
            .args(film.arguments(is_transparent))
            .current_dir(folder.path())
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(log)
            .spawn()
            .map_err(|error| failed(io::Error::other(format!("ffmpeg does not run: {error}"))))?;
        let status = loop {
            if let Some(status) = child.try_wait().map_err(failed)? {
                break status;
            }
            if interrupt::requested() {
                // It may have ended by itself: the signal went to it, too.
                let _ = child.kill();
                let _ = child.wait();
                return Err(Error::Interrupted);
            }
            std::thread::sleep(LOOK);
        };
        if !status.success() && interrupt::requested() {
            return Err(Error::Interrupted);
        }
        if !status.success() {
            let text = std::fs::read(&said).unwrap_or_default();
            let text = String::from_utf8_lossy(&text).into_owned();
            let last = text.lines().map(str::trim).rfind(|line| !line.is_empty());
            let why = last.map_or_else(|| ended(status), str::to_owned);
            return Err(failed(io::Error::other(format!("ffmpeg made no film: {why}"))));
        }
        folder.move_file(&film.made(), film.path())
    }
}

/// How a program ended.
fn ended(status: ExitStatus) -> String {
    match status.code() {
        Some(code) => format!("exit code {code}"),
        None => "it was stopped".to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_name_says_what_film_it_is() {
        let kind = |name: &str| Film::of(Path::new(name), 30).map(|film| film.kind);
        assert_eq!(kind("a/b.mp4"), Some(Kind::Mp4));
        assert_eq!(kind("B.WebM"), Some(Kind::WebM));
        for other in ["b.png", "mp4", "%04d.png", "-", "b.mp4.png"] {
            assert_eq!(kind(other), None, "{other}");
        }
    }
}
