//! The error type of the library.

use std::path::{Path, PathBuf};

/// Result of a function of this library.
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// Error of this library.
///
/// A message is one line in lower case without a full stop, and names the fault, its place and what was expected.
///
/// ```
/// use isospectrum::{Error, Placement, Samples, Volume};
///
/// let samples = Samples::from(vec![0u8; 26]);
/// let error = Volume::new("v", [3; 3], samples, Placement::default()).expect_err("one sample is missing");
/// assert!(matches!(error, Error::Input(_)));
/// assert_eq!(error.exit_code(), 3);
/// assert!(error.to_string().starts_with("v: 26 samples, expected 3x3x3"), "{error}");
/// ```
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A file cannot be opened, read or written.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// The error of the system.
        source: std::io::Error,
    },
    /// A file or a volume is damaged, unsupported, or contradicts its own header.
    #[error("{0}")]
    Input(String),
    /// An isovalue is outside the range of the spectrum.
    #[error("isovalue {isovalue} lies outside the range {low} to {high}")]
    Range {
        /// The isovalue.
        isovalue: f64,
        /// Lowest isovalue of the spectrum.
        low: f64,
        /// Highest isovalue of the spectrum.
        high: f64,
    },
    /// Arguments are invalid or contradict each other.
    #[error("{0}")]
    Usage(String),
    /// There is no GPU adapter, or the device was lost.
    #[error("{0}")]
    Gpu(String),
    /// The caller cancelled the work ([`Progress::cancelled`](crate::Progress::cancelled)).
    #[error("interrupted")]
    Interrupted,
    /// A spectrum fails verification.
    #[error("{0}")]
    Verification(String),
    /// An invariant of this library does not hold: a fault of the library, not of its input.
    #[error("internal error, please report it: {0}")]
    Internal(String),
}

impl Error {
    /// An [`Error::Input`] with a message.
    pub fn input(message: impl Into<String>) -> Self {
        Error::Input(message.into())
    }

    /// An [`Error::Internal`] with a message.
    pub fn internal(message: impl Into<String>) -> Self {
        Error::Internal(message.into())
    }

    /// An [`Error::Io`] for `path`.
    pub fn io(path: impl Into<PathBuf>, source: std::io::Error) -> Self {
        Error::Io { path: path.into(), source }
    }

    /// Adds the path of the file to the message of an [`Error::Input`]; other errors are returned unchanged.
    pub fn of_file(self, path: &Path) -> Self {
        match self {
            Error::Input(message) => Error::Input(format!("{}: {message}", path.display())),
            other => other,
        }
    }

    /// The exit code of the program for this error: 2 usage, 3 input, 4 isovalue outside the
    /// range, 5 verification failed, 130 interrupted, 1 anything else.
    pub fn exit_code(&self) -> u8 {
        match self {
            Error::Usage(_) => 2,
            Error::Io { .. } | Error::Input(_) => 3,
            Error::Range { .. } => 4,
            Error::Verification(_) => 5,
            Error::Interrupted => 130,
            Error::Gpu(_) | Error::Internal(_) => 1,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_internal_error_exits_with_1_and_says_so() {
        let error = Error::internal("two arcs are one");
        assert_eq!(error.exit_code(), 1);
        assert_eq!(error.to_string(), "internal error, please report it: two arcs are one");
    }
}
