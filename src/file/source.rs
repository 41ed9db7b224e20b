//! Bytes that are read by position: of a file, or in memory.

use std::borrow::Cow;
use std::io::{Read, Seek, SeekFrom};
use std::sync::{Mutex, PoisonError};

use crate::error::{Error, Result};

/// Bytes that are read by position.
pub(super) trait Source: Send + Sync {
    fn n_bytes(&self) -> u64;

    /// `n` bytes from a position, which must exist.
    ///
    /// # Errors
    ///
    /// [`Error::Input`] if reading fails or memory cannot hold them.
    fn bytes(&self, from: u64, n: u64) -> Result<Cow<'_, [u8]>>;
}

impl Source for &[u8] {
    fn n_bytes(&self) -> u64 {
        self.len() as u64
    }

    fn bytes(&self, from: u64, n: u64) -> Result<Cow<'_, [u8]>> {
        Ok(Cow::Borrowed(&self[from as usize..(from + n) as usize]))
    }
}

/// A reader of known length.
#[derive(Debug)]
pub(super) struct Seeking<F> {
    reader: Mutex<F>,
    n_bytes: u64,
}

impl<F> Seeking<F> {
    pub(super) fn new(reader: F, n_bytes: u64) -> Self {
        Seeking { reader: Mutex::new(reader), n_bytes }
    }
}

impl<F: Read + Seek + Send> Source for Seeking<F> {
    fn n_bytes(&self) -> u64 {
        self.n_bytes
    }

    fn bytes(&self, from: u64, n: u64) -> Result<Cow<'_, [u8]>> {
        let unread = |what: String| Error::input(format!("{n} bytes cannot be read: {what}"));
        let mut bytes = Vec::new();
        let length = usize::try_from(n).map_err(|e| unread(e.to_string()))?;
        bytes.try_reserve_exact(length).map_err(|e| unread(e.to_string()))?;
        let mut reader = self.reader.lock().unwrap_or_else(PoisonError::into_inner);
        reader.seek(SeekFrom::Start(from)).map_err(|e| unread(e.to_string()))?;
        let read = reader.by_ref().take(n).read_to_end(&mut bytes);
        if read.map_err(|e| unread(e.to_string()))? < length {
            return Err(unread("the file has become shorter".to_owned()));
        }
        Ok(Cow::Owned(bytes))
    }
}
