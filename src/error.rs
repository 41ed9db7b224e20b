//! The error type of the library.

use std::path::{Path, PathBuf};

use crate::numbers::distinct;

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
    #[error("{}", range_message(*isovalue, *low, *high))]
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
}

fn range_message(isovalue: f64, low: f64, high: f64) -> String {
    let [isovalue, low, high] = distinct([isovalue, low, high]);
    format!("isovalue {isovalue} is outside the range {low} to {high}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_a_range_have_as_many_digits_as_tell_them_apart() {
        let message = |isovalue, low, high| Error::Range { isovalue, low, high }.to_string();
        assert_eq!(
            message(1e9, 2.316_274e-16, 0.987_654_321),
            "isovalue 1000000000 is outside the range 2.3163e-16 to 0.98765"
        );
        assert_eq!(message(-5.0, 0.0, 255.0), "isovalue -5 is outside the range 0 to 255");
        assert_eq!(
            message(1.000_000_1, 0.0, 1.0),
            "isovalue 1.0000001 is outside the range 0 to 1"
        );
        assert_eq!(message(f64::NAN, 0.0, 1.0), "isovalue NaN is outside the range 0 to 1");
    }

    #[test]
    fn an_internal_error_asks_for_a_report() {
        let error = Error::internal("two arcs are one");
        assert_eq!(error.to_string(), "internal error, please report it: two arcs are one");
    }
}
