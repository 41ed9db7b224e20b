//! The library's errors as exceptions: one family, `isospectrum.Error`, with the messages of the command line.

use pyo3::exceptions::PyKeyboardInterrupt;
use pyo3::prelude::*;

mod family {
    pyo3::import_exception!(isospectrum._errors, FileError);
    pyo3::import_exception!(isospectrum._errors, GpuError);
    pyo3::import_exception!(isospectrum._errors, InputError);
    pyo3::import_exception!(isospectrum._errors, InternalError);
    pyo3::import_exception!(isospectrum._errors, RangeError);
    pyo3::import_exception!(isospectrum._errors, UsageError);
    pyo3::import_exception!(isospectrum._errors, VerificationError);
}

/// The exception for an error of the library.
pub(crate) fn raised(error: isospectrum::Error) -> PyErr {
    use isospectrum::Error;
    let text = error.to_string();
    match error {
        // As Python has it: errno, what the system says, the file.
        Error::Io { path, source } => match code_of(&source) {
            Some(code) => {
                let said = source.to_string();
                let said = said.split(" (os error").next().unwrap_or_default().to_owned();
                family::FileError::new_err((code, said, path.display().to_string()))
            }
            None => family::FileError::new_err(text),
        },
        Error::Input(_) => family::InputError::new_err(text),
        Error::Range { .. } => family::RangeError::new_err(text),
        Error::Usage(_) => family::UsageError::new_err(text),
        Error::Gpu(_) => family::GpuError::new_err(text),
        Error::Interrupted => PyKeyboardInterrupt::new_err(()),
        Error::Verification(_) => family::VerificationError::new_err(text),
        _ => family::InternalError::new_err(text),
    }
}

/// The system's number for what is wrong with a file; by its kind, where the error has been given a path and lost it.
fn code_of(error: &std::io::Error) -> Option<i32> {
    use std::io::ErrorKind;
    error.raw_os_error().or(match error.kind() {
        ErrorKind::NotFound => Some(2),
        ErrorKind::PermissionDenied => Some(13),
        ErrorKind::NotADirectory => Some(20),
        ErrorKind::IsADirectory => Some(21),
        ErrorKind::StorageFull => Some(28),
        ErrorKind::ReadOnlyFilesystem => Some(30),
        _ => None,
    })
}

/// The exception for arguments that make no sense.
pub(crate) fn usage(text: impl Into<String>) -> PyErr {
    raised(isospectrum::Error::Usage(text.into()))
}
