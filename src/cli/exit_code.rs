//! The exit code of the program for each kind of error.

use isospectrum::Error;

use super::interrupt;

/// Without an error.
pub(super) const SUCCESS: u8 = 0;

/// For errors of the program itself, and for a missing GPU.
pub(super) const OTHER: u8 = 1;

/// For wrong usage of the command line.
pub(super) const USAGE: u8 = 2;

/// For files that cannot be read or written, are damaged or unsupported, and for a lack of memory.
pub(super) const FILE: u8 = 3;

/// For an isovalue outside the range of the spectrum.
const RANGE: u8 = 4;

/// For a spectrum that does not pass verification.
const VERIFICATION: u8 = 5;

/// Returns the exit code for the error of the library in the chain; for an interruption, that of the signal.
pub(super) fn of(error: &anyhow::Error) -> u8 {
    match error.chain().find_map(|e| e.downcast_ref::<Error>()) {
        Some(Error::Usage(_)) => USAGE,
        Some(Error::Io { .. } | Error::Input(_)) => FILE,
        Some(Error::Range { .. }) => RANGE,
        Some(Error::Verification(_)) => VERIFICATION,
        Some(Error::Interrupted) => interrupt::exit_code(),
        _ => OTHER,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_kind_of_error_has_its_exit_code() {
        let io = Error::io("a.isp", std::io::Error::other("disk full"));
        let range = Error::Range { isovalue: 2.0, low: 0.0, high: 1.0 };
        for (error, code) in [
            (Error::Usage("--a and --b".to_owned()), 2),
            (io, 3),
            (Error::input("damaged"), 3),
            (range, 4),
            (Error::Verification("failed".to_owned()), 5),
            (Error::Interrupted, 130),
            (Error::Gpu("no adapter".to_owned()), 1),
            (Error::internal("two arcs are one"), 1),
        ] {
            let error = anyhow::Error::from(error).context("saving");
            assert_eq!(of(&error), code, "{error:#}");
        }
        assert_eq!(of(&anyhow::anyhow!("another error")), 1);
    }
}
