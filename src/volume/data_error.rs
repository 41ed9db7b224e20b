//! Errors of readers.

use std::io;
use std::path::Path;

use crate::error::Error;

/// The error of reading `path`: [`Error::Input`] for invalid contents, else [`Error::Io`].
pub(crate) fn read_error(path: &Path, e: io::Error) -> Error {
    match e.kind() {
        io::ErrorKind::InvalidData | io::ErrorKind::OutOfMemory => {
            Error::input(format!("{}: {e}", path.display()))
        }
        _ => Error::io(path, e),
    }
}

/// An error about the contents of a file.
pub(crate) fn invalid(message: impl Into<String>) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, message.into())
}
