//! What there is of a folder of parts: chunks are read by a thread when the isovalue comes to them.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, TryRecvError, channel};
use std::thread;

use eframe::egui;

use crate::error::{Error, Result};
use crate::file::{FolderSpectrum, SpectrumFolder};
use crate::spectrum::Spectrum;

/// Most triangles of a folder that are held, but those that are shown. What is held is taken in by the device anew with every chunk that
/// comes, within a frame: about a tenth of a second for so many.
pub(super) const MOST_TRIANGLES: u64 = 2_000_000;

/// What is read, and whether that went well.
type Answer = (Box<FolderSpectrum>, Result<()>);

/// See the module.
#[derive(Debug)]
pub(super) struct Held {
    folder: SpectrumFolder,
    state: State,
    /// The isovalues that were asked for last.
    asked: Vec<f64>,
    has_failed: bool,
}

#[derive(Debug)]
enum State {
    Here(Box<FolderSpectrum>),
    /// A thread has it.
    Away(Receiver<Answer>),
}

impl Held {
    /// What was read.
    pub(super) fn new(read: FolderSpectrum) -> Held {
        let folder = read.folder().clone();
        Held { folder, state: State::Here(Box::new(read)), asked: Vec::new(), has_failed: false }
    }

    /// The folder.
    pub(super) fn folder(&self) -> &SpectrumFolder {
        &self.folder
    }

    /// Whether all is there that lives at some isovalues.
    pub(super) fn has(&self, isovalues: &[f64]) -> bool {
        matches!(&self.state, State::Here(read) if read.has(isovalues))
    }

    /// Whether a thread reads.
    pub(super) fn is_reading(&self) -> bool {
        matches!(self.state, State::Away(_))
    }

    /// Begins to read what is not there, unless it is being read, or could not be when it was asked for last.
    pub(super) fn ask(&mut self, isovalues: &[f64], window: &egui::Context) {
        let has_failed = self.has_failed && self.asked == isovalues;
        let (sender, answer) = channel();
        match std::mem::replace(&mut self.state, State::Away(answer)) {
            State::Here(mut read) if !has_failed && !read.has(isovalues) => {
                self.asked = isovalues.to_vec();
                let (asked, window) = (self.asked.clone(), window.clone());
                thread::spawn(move || {
                    let run = || read.read_at(&asked);
                    let result = catch_unwind(AssertUnwindSafe(run))
                        .unwrap_or_else(|_| Err(Error::internal("reading panicked")));
                    // Nobody waits any more once the scene is closed.
                    let _ = sender.send((read, result));
                    window.request_repaint();
                });
            }
            before => self.state = before,
        }
    }

    /// What a thread has read, if it is done: the spectrum that is there now.
    ///
    /// # Errors
    ///
    /// As [`FolderSpectrum::read_at`].
    pub(super) fn poll(&mut self) -> Result<Option<Arc<Spectrum>>> {
        let State::Away(answer) = &self.state else { return Ok(None) };
        match answer.try_recv() {
            Ok(answer) => self.take(answer).map(Some),
            Err(TryRecvError::Empty) => Ok(None),
            Err(TryRecvError::Disconnected) => self.begin_anew().map(Some),
        }
    }

    /// Reads what lives at some isovalues, and waits for it; the spectrum that is there now if it is another one.
    ///
    /// # Errors
    ///
    /// As [`FolderSpectrum::read_at`].
    pub(super) fn read_at(&mut self, isovalues: &[f64]) -> Result<Option<Arc<Spectrum>>> {
        let mut found = None;
        if let State::Away(answer) = &self.state {
            found = Some(match answer.recv() {
                Ok(answer) => self.take(answer)?,
                Err(_) => self.begin_anew()?,
            });
        }
        if let State::Here(read) = &mut self.state
            && !read.has(isovalues)
        {
            read.read_at(isovalues)?;
            found = Some(read.spectrum().clone());
        }
        Ok(found)
    }

    fn take(&mut self, (read, result): Answer) -> Result<Arc<Spectrum>> {
        let spectrum = read.spectrum().clone();
        self.state = State::Here(read);
        self.has_failed = result.is_err();
        result.map(|()| spectrum)
    }

    /// Without what a thread has taken with it.
    fn begin_anew(&mut self) -> Result<Arc<Spectrum>> {
        let read = FolderSpectrum::within(self.folder.clone(), MOST_TRIANGLES)?;
        self.take((Box::new(read), Ok(())))
    }
}
