//! The loaded chunks of a spectrum file. A thread reads chunks when the shown isovalues need them.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, TryRecvError, channel};
use std::thread;

use eframe::egui;

use crate::error::{Error, Result};
use crate::file::{PartialSpectrum, SpectrumFile};
use crate::spectrum::Spectrum;

/// Usual maximum number of triangles of a file that is read as a whole: they are uploaded within a frame, about a tenth of a second for
/// this number.
pub const MAX_TRIANGLES: u64 = 2_000_000;

/// The chunks after reading, and the result of reading.
type ReadResult = (Box<PartialSpectrum>, Result<()>);

/// The loaded chunks of a spectrum file.
#[derive(Debug)]
pub(super) struct FileChunks {
    file: Arc<SpectrumFile>,
    state: State,
    /// The isovalues of the last request.
    requested: Vec<f64>,
    has_failed: bool,
}

#[derive(Debug)]
enum State {
    Idle(Box<PartialSpectrum>),
    /// A thread reads, and owns the chunks meanwhile.
    Reading(Receiver<ReadResult>),
}

impl FileChunks {
    pub(super) fn new(chunks: PartialSpectrum) -> FileChunks {
        let file = chunks.file().clone();
        let state = State::Idle(Box::new(chunks));
        FileChunks { file, state, requested: Vec::new(), has_failed: false }
    }

    /// The file.
    pub(super) fn file(&self) -> &Arc<SpectrumFile> {
        &self.file
    }

    /// Whether the chunks of some isovalues are loaded.
    pub(super) fn has(&self, isovalues: &[f64]) -> bool {
        matches!(&self.state, State::Idle(chunks) if chunks.has(isovalues))
    }

    /// Whether a thread is reading.
    pub(super) fn is_reading(&self) -> bool {
        matches!(self.state, State::Reading(_))
    }

    /// Starts a thread that reads the missing chunks, unless one is running or the same request has just failed.
    pub(super) fn request(&mut self, isovalues: &[f64], window: &egui::Context) {
        let has_failed = self.has_failed && self.requested == isovalues;
        let (sender, receiver) = channel();
        match std::mem::replace(&mut self.state, State::Reading(receiver)) {
            State::Idle(mut chunks) if !has_failed && !chunks.has(isovalues) => {
                self.requested = isovalues.to_vec();
                let (requested, window) = (self.requested.clone(), window.clone());
                thread::spawn(move || {
                    let run = || chunks.read_at(&requested);
                    let result = catch_unwind(AssertUnwindSafe(run))
                        .unwrap_or_else(|_| Err(Error::internal("reading panicked")));
                    // The receiver is gone if the scene was closed.
                    let _ = sender.send((chunks, result));
                    window.request_repaint();
                });
            }
            state => self.state = state,
        }
    }

    /// The spectrum of the loaded chunks if the thread has just finished.
    ///
    /// # Errors
    ///
    /// As [`PartialSpectrum::read_at`].
    pub(super) fn poll(&mut self) -> Result<Option<Arc<Spectrum>>> {
        let State::Reading(receiver) = &self.state else { return Ok(None) };
        match receiver.try_recv() {
            Ok(result) => self.finish_reading(result).map(Some),
            Err(TryRecvError::Empty) => Ok(None),
            Err(TryRecvError::Disconnected) => self.reset().map(Some),
        }
    }

    /// Reads the chunks of some isovalues and waits for them; returns the spectrum of the loaded chunks if it has changed.
    ///
    /// # Errors
    ///
    /// As [`PartialSpectrum::read_at`].
    pub(super) fn read_at(&mut self, isovalues: &[f64]) -> Result<Option<Arc<Spectrum>>> {
        let mut spectrum = None;
        if let State::Reading(receiver) = &self.state {
            spectrum = Some(match receiver.recv() {
                Ok(result) => self.finish_reading(result)?,
                Err(_) => self.reset()?,
            });
        }
        if let State::Idle(chunks) = &mut self.state
            && !chunks.has(isovalues)
        {
            chunks.read_at(isovalues)?;
            spectrum = Some(chunks.spectrum().clone());
        }
        Ok(spectrum)
    }

    fn finish_reading(&mut self, (chunks, result): ReadResult) -> Result<Arc<Spectrum>> {
        let spectrum = chunks.spectrum().clone();
        self.state = State::Idle(chunks);
        self.has_failed = result.is_err();
        result.map(|()| spectrum)
    }

    /// Starts without chunks after the thread has lost them.
    fn reset(&mut self) -> Result<Arc<Spectrum>> {
        let chunks = PartialSpectrum::new(self.file.clone(), MAX_TRIANGLES);
        self.finish_reading((Box::new(chunks), Ok(())))
    }
}
