//! Reading a file and, where it is a volume, computing its spectrum: in a thread, with progress.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, TryRecvError, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;

use eframe::egui;

use super::held::{Held, MOST_TRIANGLES};
use crate::error::{Error, Result};
use crate::file::{self, FolderSpectrum, SpectrumFolder, is_folder, thesis};
use crate::kernels::{Backend, Choice};
use crate::progress::Progress;
use crate::spectrum::Spectrum;
use crate::sweep::{self, Parameters};
use crate::volume::{Histogram, ReadOptions, Statistics, Volume, read_volume};

/// What comes out.
#[derive(Debug)]
pub(super) struct Loaded {
    pub(super) name: String,
    pub(super) spectrum: Arc<Spectrum>,
    /// Where the spectrum is no more than a folder has at the isovalue.
    pub(super) held: Option<Held>,
    pub(super) samples: Option<Histogram>,
    pub(super) statistics: Option<Statistics>,
    /// The volume, for colours that need it.
    pub(super) volume: Option<Arc<Volume>>,
    /// The isovalue shown first.
    pub(super) isovalue: f64,
}

impl Loaded {
    /// Chooses the isovalue, which takes as long as some thirty meshes. Without the volume the spectrum may tell what
    /// isovalues are written by.
    pub(super) fn new(name: String, spectrum: Spectrum, volume: Option<Arc<Volume>>) -> Loaded {
        let isovalue = spectrum.shown_first();
        Loaded::with(name, Arc::new(spectrum), volume, isovalue)
    }

    /// Reads what a folder has at the first isovalue.
    pub(super) fn of_folder(
        name: String,
        folder: SpectrumFolder,
        volume: Option<Arc<Volume>>,
        isovalue: Option<f64>,
    ) -> Result<Loaded> {
        let isovalue = isovalue.unwrap_or_else(|| folder.shown_first());
        let mut read = FolderSpectrum::within(folder, MOST_TRIANGLES)?;
        read.read_at(&[isovalue])?;
        let spectrum = read.spectrum().clone();
        let held = Some(Held::new(read));
        Ok(Loaded { held, ..Loaded::with(name, spectrum, volume, isovalue) })
    }

    fn with(
        name: String,
        spectrum: Arc<Spectrum>,
        volume: Option<Arc<Volume>>,
        isovalue: f64,
    ) -> Loaded {
        let samples = volume.as_deref().map(Histogram::of);
        let statistics = volume.as_deref().map(Statistics::of).or_else(|| spectrum.statistics());
        Loaded { name, spectrum, held: None, samples, statistics, volume, isovalue }
    }
}

/// What is to be loaded.
#[derive(Debug)]
pub(super) enum Source {
    /// A spectrum, or a volume whose spectrum is computed.
    File(PathBuf),
    /// A volume whose spectrum is computed.
    Volume(Box<Volume>),
}

/// A thread at work. It stops soon after this goes.
#[derive(Debug)]
pub(super) struct Loading {
    result: Receiver<Result<Loaded>>,
    report: Arc<Report>,
}

/// How far the thread is.
#[derive(Debug)]
struct Report {
    state: Mutex<(f64, String)>,
    cancelled: AtomicBool,
    window: egui::Context,
}

impl Progress for Report {
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
    pub(super) fn start(source: Source, parameters: Parameters, window: &egui::Context) -> Self {
        let report = Arc::new(Report {
            state: Mutex::new((0.0, "reading".into())),
            cancelled: AtomicBool::new(false),
            window: window.clone(),
        });
        let (sender, result) = channel();
        let at_work = report.clone();
        thread::spawn(move || {
            let run = || load(source, &parameters, &at_work);
            let loaded = catch_unwind(AssertUnwindSafe(run))
                .unwrap_or_else(|_| Err(Error::internal("loading panicked")));
            // Nobody waits any more once it is cancelled.
            let _ = sender.send(loaded);
            at_work.window.request_repaint();
        });
        Loading { result, report }
    }

    /// The result, once there is one.
    pub(super) fn poll(&self) -> Option<Result<Loaded>> {
        match self.result.try_recv() {
            Ok(result) => Some(result),
            Err(TryRecvError::Empty) => None,
            Err(TryRecvError::Disconnected) => Some(Err(Error::input("loading ended early"))),
        }
    }

    /// From 0 to 1, and what is being done.
    pub(super) fn progress(&self) -> (f64, String) {
        self.report.state.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}

impl Drop for Loading {
    fn drop(&mut self) {
        self.report.cancelled.store(true, Ordering::Relaxed);
    }
}

fn load(source: Source, parameters: &Parameters, report: &Report) -> Result<Loaded> {
    let volume = match source {
        Source::File(path) => {
            let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
            if is_folder(&path) {
                return Loaded::of_folder(name, SpectrumFolder::open(&path)?, None, None);
            }
            match read_spectrum(&path)? {
                Some(spectrum) => return Ok(Loaded::new(name, spectrum, None)),
                None => read_volume(&path, &ReadOptions::default())?,
            }
        }
        Source::Volume(volume) => *volume,
    };
    let name = volume.name().to_owned();
    let volume = Arc::new(volume);
    let backend = Backend::choose(Choice::Auto, None)?;
    let spectrum = sweep::compute(&volume, parameters, &backend, report)?;
    Ok(Loaded::new(name, spectrum, Some(volume)))
}

/// The spectrum in a file; none if its name is not that of a spectrum.
fn read_spectrum(path: &Path) -> Result<Option<Spectrum>> {
    let extension = path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
    match extension.as_str() {
        "isp" => file::read(path).map(Some),
        "thesis" => thesis::read(path).map(Some),
        _ => Ok(None),
    }
}
