//! Copies a spectrum file chunk by chunk.

use std::io::Write;
use std::sync::Arc;

use super::file_walk::FileWalk;
use super::spectrum_file::SpectrumFile;
use crate::error::{Error, Result};

/// Bytes that are copied at once.
const BLOCK: u64 = 1 << 20;

/// Writes the bytes of a file, after all of its chunks were read and checked, as by [`SpectrumFile::read`], one after the other: only those at one isovalue are
/// in memory.
///
/// # Errors
///
/// [`Error::Input`] if a chunk is damaged, or the spectrum does not pass [`Spectrum::check`](crate::Spectrum::check); [`Error::Io`] without a path.
pub fn copy(file: &Arc<SpectrumFile>, out: &mut dyn Write) -> Result<()> {
    FileWalk::counting(file.clone()).finish(&mut |_, _| {})?;
    let mut from = 0;
    while from < file.n_bytes() {
        let n = BLOCK.min(file.n_bytes() - from);
        out.write_all(&file.bytes(from, n)?).map_err(|e| Error::io("", e))?;
        from += n;
    }
    Ok(())
}
