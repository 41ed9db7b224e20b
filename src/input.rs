//! Opens input files, for all readers.
//!
//! Only regular files are read. A read from a pipe without a writer never returns, a device may have no end, and neither
//! has a length to check the sizes in a header against.

use std::fs::File;
use std::io::Read as _;
use std::path::{Path, PathBuf};

use crate::error::{Error, Result};

/// Opens a regular file and returns it with its length in bytes.
///
/// # Errors
///
/// [`Error::Io`] if there is no such file or it cannot be opened; [`Error::Input`] if it is a folder, a pipe, a socket or a
/// device.
pub fn open(path: &Path) -> Result<(File, u64)> {
    let fail = |e| Error::io(path, e);
    // Before the file is opened: opening a pipe waits for a writer.
    if !path.metadata().map_err(fail)?.is_file() {
        return Err(Error::input(format!("{}: not a regular file", path.display())));
    }
    let file = File::open(path).map_err(fail)?;
    let length = file.metadata().map_err(fail)?.len();
    Ok((file, length))
}

/// All bytes of a regular file.
///
/// # Errors
///
/// As [`open`]; also [`Error::Input`] if memory cannot hold the file.
pub fn read(path: &Path) -> Result<Vec<u8>> {
    let (mut file, length) = open(path)?;
    let mut bytes = Vec::new();
    let reserved = usize::try_from(length).map(|n| bytes.try_reserve_exact(n));
    if !matches!(reserved, Ok(Ok(()))) {
        return Err(Error::input(format!(
            "{}: {length} bytes, more than memory can hold",
            path.display()
        )));
    }
    file.read_to_end(&mut bytes).map_err(|e| Error::io(path, e))?;
    Ok(bytes)
}

/// The path of a file whose name a header gives, relative to the header's folder.
pub(crate) fn sibling(header: &Path, name: &str) -> PathBuf {
    header.parent().unwrap_or(Path::new("")).join(name)
}
