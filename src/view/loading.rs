//! Reading a file, and computing the spectrum of a volume, in a thread with progress.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, TryRecvError, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use eframe::egui;

use super::compute_dialog::Ready;
use super::file_chunks::FileChunks;
use super::preview::preview;
use crate::error::{Error, Result};
use crate::file::{PartialSpectrum, SpectrumFile, thesis};
use crate::kernels::{Backend, Choice};
use crate::progress::Progress;
use crate::spectrum::Spectrum;
use crate::volume::{Histogram, ReadOptions, Statistics, Volume, read_volume};

/// A loaded spectrum.
#[derive(Debug)]
pub(super) struct Loaded {
    pub(super) name: String,
    pub(super) spectrum: Arc<Spectrum>,
    /// Whether it was computed here, and not read from a file.
    pub(super) is_computed: bool,
    /// Of a large file, the loader of its chunks; `spectrum` then has only those at the isovalue.
    pub(super) chunks: Option<FileChunks>,
    pub(super) samples: Option<Histogram>,
    pub(super) statistics: Option<Statistics>,
    /// Whether this is shown only until the spectrum of the volume is there.
    pub(super) is_preview: bool,
    /// The volume, for colours that need it.
    pub(super) volume: Option<Arc<Volume>>,
    /// The isovalue shown first.
    pub(super) isovalue: f64,
}

impl Loaded {
    /// Chooses the first isovalue, which takes as long as about thirty meshes. Without the volume, percentiles of its samples
    /// come from the spectrum, if it has them.
    pub(super) fn new(name: String, spectrum: Spectrum, volume: Option<Arc<Volume>>) -> Loaded {
        let isovalue = spectrum.shown_first();
        Loaded::with_isovalue(name, Arc::new(spectrum), volume, isovalue)
    }

    /// Reads a file; of one with more triangles the chunks at the first isovalue.
    pub(super) fn of_file(
        name: String,
        file: Arc<SpectrumFile>,
        volume: Option<Arc<Volume>>,
        isovalue: Option<f64>,
        max_triangles: u64,
    ) -> Result<Loaded> {
        if file.size().triangles <= max_triangles {
            return Ok(Loaded::new(name, file.read()?, volume));
        }
        let isovalue = isovalue.unwrap_or_else(|| file.shown_first());
        let mut chunks = PartialSpectrum::new(file, max_triangles);
        chunks.read_at(&[isovalue])?;
        let spectrum = chunks.spectrum().clone();
        let chunks = Some(FileChunks::new(chunks));
        Ok(Loaded { chunks, ..Loaded::with_isovalue(name, spectrum, volume, isovalue) })
    }

    /// The only isovalue of a spectrum, shown until the one of the whole volume is there.
    pub(super) fn preview(name: String, spectrum: Spectrum) -> Loaded {
        let (isovalue, _) = spectrum.range();
        let loaded = Loaded::with_isovalue(name, Arc::new(spectrum), None, isovalue);
        Loaded { is_preview: true, ..loaded }
    }

    fn with_isovalue(
        name: String,
        spectrum: Arc<Spectrum>,
        volume: Option<Arc<Volume>>,
        isovalue: f64,
    ) -> Loaded {
        let samples = volume.as_deref().map(Histogram::of);
        let statistics = volume.as_deref().map(Statistics::of).or_else(|| spectrum.statistics());
        Loaded {
            name,
            spectrum,
            is_computed: false,
            is_preview: false,
            chunks: None,
            samples,
            statistics,
            volume,
            isovalue,
        }
    }
}

/// What is loaded.
#[derive(Debug)]
pub(super) enum LoadSource {
    /// A file with a spectrum or a volume.
    File(PathBuf),
    /// A volume that was read.
    Volume(Box<Volume>),
    /// A volume whose spectrum is computed.
    Ready(Box<Ready>),
}

impl LoadSource {
    fn name(&self) -> String {
        match self {
            LoadSource::File(path) => {
                path.file_name().unwrap_or_default().to_string_lossy().into_owned()
            }
            LoadSource::Volume(volume) => volume.name().to_owned(),
            LoadSource::Ready(ready) => ready.prepared.volume().name().to_owned(),
        }
    }
}

/// The content of a source.
#[derive(Debug)]
pub(super) enum LoadedContent {
    Spectrum(Box<Loaded>),
    /// A volume and, unless it is too large, the spectrum of one isovalue.
    Volume(Box<Volume>, Option<Box<Spectrum>>),
}

/// The least fraction that tells how long the rest takes.
const LEAST_DONE: f64 = 0.03;

/// A loading thread. Dropping this cancels it.
#[derive(Debug)]
pub(super) struct Loading {
    /// The name of the file or the volume.
    pub(super) name: String,
    started: Instant,
    result: Receiver<Result<LoadedContent>>,
    progress: Arc<LoadProgress>,
}

/// The progress of the thread.
#[derive(Debug)]
struct LoadProgress {
    /// Fraction done and message.
    state: Mutex<(f64, String)>,
    cancelled: AtomicBool,
    window: egui::Context,
}

impl Progress for LoadProgress {
    fn report(&self, done: f64, message: &str) {
        *self.state.lock().unwrap_or_else(PoisonError::into_inner) = (done, message.to_owned());
        self.window.request_repaint();
    }

    fn cancelled(&self) -> bool {
        self.cancelled.load(Ordering::Relaxed)
    }
}

impl Loading {
    /// Starts the thread.
    pub(super) fn start(source: LoadSource, max_triangles: u64, window: &egui::Context) -> Self {
        let first_task = match source {
            LoadSource::Ready(_) => "starting",
            LoadSource::File(_) | LoadSource::Volume(_) => "reading",
        };
        let progress = Arc::new(LoadProgress {
            state: Mutex::new((0.0, first_task.to_owned())),
            cancelled: AtomicBool::new(false),
            window: window.clone(),
        });
        let (name, started) = (source.name(), Instant::now());
        let (sender, result) = channel();
        let thread_progress = progress.clone();
        thread::spawn(move || {
            let run = || load(source, max_triangles, &thread_progress);
            let loaded = catch_unwind(AssertUnwindSafe(run))
                .unwrap_or_else(|_| Err(Error::internal("loading panicked")));
            // The receiver is gone if loading was cancelled.
            let _ = sender.send(loaded);
            thread_progress.window.request_repaint();
        });
        Loading { name, started, result, progress }
    }

    /// The result, once the thread has finished.
    pub(super) fn poll(&self) -> Option<Result<LoadedContent>> {
        match self.result.try_recv() {
            Ok(result) => Some(result),
            Err(TryRecvError::Empty) => None,
            Err(TryRecvError::Disconnected) => Some(Err(Error::input("loading ended early"))),
        }
    }

    /// The time left, if it can be told from the time passed.
    pub(super) fn time_left(&self) -> Option<Duration> {
        let (done, _) = self.progress();
        (done > LEAST_DONE).then(|| self.started.elapsed().mul_f64((1.0 - done).max(0.0) / done))
    }

    /// Fraction done, 0 to 1, and the current task.
    pub(super) fn progress(&self) -> (f64, String) {
        self.progress.state.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}

impl Drop for Loading {
    fn drop(&mut self) {
        self.progress.cancelled.store(true, Ordering::Relaxed);
    }
}

fn load(source: LoadSource, max_triangles: u64, progress: &LoadProgress) -> Result<LoadedContent> {
    let name = source.name();
    let spectrum = |loaded| Ok(LoadedContent::Spectrum(Box::new(loaded)));
    match source {
        LoadSource::File(path) => {
            let extension = path.extension().unwrap_or_default().to_string_lossy();
            match extension.to_ascii_lowercase().as_str() {
                "isp" => {
                    let file = Arc::new(SpectrumFile::open(&path)?);
                    spectrum(Loaded::of_file(name, file, None, None, max_triangles)?)
                }
                "thesis" => spectrum(Loaded::new(name, thesis::read(&path)?, None)),
                _ => {
                    let volume = read_volume(&path, &ReadOptions::default())?;
                    with_preview(Box::new(volume))
                }
            }
        }
        LoadSource::Volume(volume) => with_preview(volume),
        LoadSource::Ready(ready) => {
            let Ready { prepared, parameters } = *ready;
            let backend = Backend::choose(Choice::Auto, None)?;
            let computed = prepared.compute(&parameters, &backend, progress)?;
            let loaded = Loaded::new(name, computed, Some(prepared.volume().clone()));
            spectrum(Loaded { is_computed: true, ..loaded })
        }
    }
}

fn with_preview(volume: Box<Volume>) -> Result<LoadedContent> {
    let spectrum = preview(&volume)?;
    Ok(LoadedContent::Volume(volume, spectrum.map(Box::new)))
}
