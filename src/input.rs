//! Opens input files: the one way in which every reader gets at a path.
//!
//! Only regular files are read. A pipe that nobody writes to would be waited for without an end, a device may have none,
//! and neither has a length that a header's claims could be held against.

use std::fs::File;
use std::io::Read as _;
use std::path::Path;

use crate::error::{Error, Result};

/// Opens a regular file; also how many bytes it has.
///
/// # Errors
///
/// [`Error::Io`] if there is no such file or it cannot be opened; [`Error::Input`] if it is a folder, a pipe, a socket or a
/// device.
pub fn open(path: &Path) -> Result<(File, u64)> {
    let fail = |e| Error::io(path, e);
    // Before it is opened: opening a pipe waits for who writes to it.
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
/// As [`open`]; [`Error::Input`] also where memory cannot hold it.
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
