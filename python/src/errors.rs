//! The library's errors as Python exceptions, all of them subclasses of `isospectrum.Error`.

use pyo3::exceptions::PyKeyboardInterrupt;
use pyo3::prelude::*;

mod exceptions {
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
    let text = in_words_of_python(&error.to_string());
    match error {
        // The arguments of Python's OSError: errno, message, file name.
        Error::Io { path, source } => match code_of(&source) {
            Some(code) => {
                let message = source.to_string();
                let message = message.split(" (os error").next().unwrap_or_default().to_owned();
                exceptions::FileError::new_err((code, message, path.display().to_string()))
            }
            None => exceptions::FileError::new_err(text),
        },
        Error::Input(_) => exceptions::InputError::new_err(text),
        Error::Range { .. } => exceptions::RangeError::new_err(text),
        Error::Usage(_) => exceptions::UsageError::new_err(text),
        Error::Gpu(_) => exceptions::GpuError::new_err(text),
        Error::Interrupted => PyKeyboardInterrupt::new_err(()),
        Error::Verification(_) => exceptions::VerificationError::new_err(text),
        _ => exceptions::InternalError::new_err(text),
    }
}

/// Flags of the program in messages, and the arguments that they are here; longer ones come first.
const ARGUMENTS: [(&str, &str); 21] = [
    ("--nan-as VALUE", "nan_as=VALUE"),
    ("--spacing X,Y,Z", "spacing=(X, Y, Z)"),
    ("--dims 128x128x128", "dims=(128, 128, 128)"),
    ("--type uint8", "type=\"uint8\""),
    ("--backend cpu", "backend=\"cpu\""),
    ("--slices channels", "slices=\"channels\""),
    ("--slices frames", "slices=\"frames\""),
    ("--min-component", "min_component="),
    ("--persistence", "persistence="),
    ("--channel", "channel="),
    ("--series", "series="),
    ("--slices", "slices="),
    ("--frame", "frame="),
    ("--array", "array="),
    ("--fps", "fps="),
    ("--start", "start="),
    ("--brick", "brick="),
    ("--range", "range="),
    ("--crop", "crop="),
    ("--dims", "dims="),
    ("--type", "type="),
];

/// A message of the library, with arguments in place of flags.
pub(crate) fn in_words_of_python(text: &str) -> String {
    ARGUMENTS.iter().fold(text.to_owned(), |text, (flag, argument)| text.replace(flag, argument))
}

/// The errno of an error; derived from its kind if the error has lost it.
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

/// The exception for invalid arguments.
pub(crate) fn usage(text: impl Into<String>) -> PyErr {
    raised(isospectrum::Error::Usage(text.into()))
}
