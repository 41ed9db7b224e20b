//! Reading a file, and computing the spectrum of a volume, in a thread with progress.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, TryRecvError, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;

use eframe::egui;

use super::file_chunks::{FileChunks, MAX_TRIANGLES};
use crate::error::{Error, Result};
use crate::file::{PartialSpectrum, SpectrumFile, thesis};
use crate::kernels::{Backend, Choice};
use crate::progress::Progress;
use crate::spectrum::Spectrum;
use crate::sweep::{self, Parameters};
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

    /// Reads a file; of a large one the chunks at the first isovalue.
    pub(super) fn of_file(
        name: String,
        file: Arc<SpectrumFile>,
        volume: Option<Arc<Volume>>,
        isovalue: Option<f64>,
    ) -> Result<Loaded> {
        if file.size().triangles <= MAX_TRIANGLES {
            return Ok(Loaded::new(name, file.read()?, volume));
        }
        let isovalue = isovalue.unwrap_or_else(|| file.shown_first());
        let mut chunks = PartialSpectrum::new(file, MAX_TRIANGLES);
        chunks.read_at(&[isovalue])?;
        let spectrum = chunks.spectrum().clone();
        let chunks = Some(FileChunks::new(chunks));
        Ok(Loaded { chunks, ..Loaded::with_isovalue(name, spectrum, volume, isovalue) })
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
            chunks: None,
            samples,
            statistics,
            volume,
            isovalue,
        }
    }
}

/// The source of a spectrum.
#[derive(Debug)]
pub(super) enum LoadSource {
    /// A spectrum, or a volume whose spectrum is computed.
    File(PathBuf),
    /// A volume whose spectrum is computed.
    Volume(Box<Volume>),
}

/// A loading thread. Dropping this cancels it.
#[derive(Debug)]
pub(super) struct Loading {
    result: Receiver<Result<Loaded>>,
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
    pub(super) fn start(
        source: LoadSource,
        parameters: Parameters,
        window: &egui::Context,
    ) -> Self {
        let progress = Arc::new(LoadProgress {
            state: Mutex::new((0.0, "reading".into())),
            cancelled: AtomicBool::new(false),
            window: window.clone(),
        });
        let (sender, result) = channel();
        let thread_progress = progress.clone();
        thread::spawn(move || {
            let run = || load(source, &parameters, &thread_progress);
            let loaded = catch_unwind(AssertUnwindSafe(run))
                .unwrap_or_else(|_| Err(Error::internal("loading panicked")));
            // The receiver is gone if loading was cancelled.
            let _ = sender.send(loaded);
            thread_progress.window.request_repaint();
        });
        Loading { result, progress }
    }

    /// The result, once the thread has finished.
    pub(super) fn poll(&self) -> Option<Result<Loaded>> {
        match self.result.try_recv() {
            Ok(result) => Some(result),
            Err(TryRecvError::Empty) => None,
            Err(TryRecvError::Disconnected) => Some(Err(Error::input("loading ended early"))),
        }
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

fn load(source: LoadSource, parameters: &Parameters, progress: &LoadProgress) -> Result<Loaded> {
    let volume = match source {
        LoadSource::File(path) => {
            let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
            let extension = path.extension().unwrap_or_default().to_string_lossy();
            match extension.to_ascii_lowercase().as_str() {
                "isp" => {
                    return Loaded::of_file(name, Arc::new(SpectrumFile::open(&path)?), None, None);
                }
                "thesis" => return Ok(Loaded::new(name, thesis::read(&path)?, None)),
                _ => read_volume(&path, &ReadOptions::default())?,
            }
        }
        LoadSource::Volume(volume) => *volume,
    };
    let name = volume.name().to_owned();
    let volume = Arc::new(volume);
    let backend = Backend::choose(Choice::Auto, None)?;
    let spectrum = sweep::compute(&volume, parameters, &backend, progress)?;
    Ok(Loaded { is_computed: true, ..Loaded::new(name, spectrum, Some(volume)) })
}
