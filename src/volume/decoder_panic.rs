//! Panics of decoders of other crates become errors of the file.
//!
//! Our readers do not panic. Decoders of pictures are large, and some panic on files that are damaged or unusual.

use std::io;

use super::data_error::invalid;
use crate::caught_panic::catch;

/// Runs a decoder of `format`.
///
/// # Errors
///
/// Its own, and `InvalidData` if it panics.
pub(super) fn catch_panic<T>(
    format: &str,
    decode: impl FnOnce() -> io::Result<T>,
) -> io::Result<T> {
    catch(decode).unwrap_or_else(|| {
        Err(invalid(format!("damaged or unsupported {format}: its decoder failed on it")))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_is_an_error_of_the_file() {
        let result: io::Result<()> = catch_panic("JPEG", || {
            // As a panic without a message on the screen.
            std::panic::resume_unwind(Box::new("out of bounds"))
        });
        let error = result.expect_err("it panicked");
        assert_eq!(error.kind(), io::ErrorKind::InvalidData);
        assert!(error.to_string().contains("JPEG"), "{error}");
        assert_eq!(catch_panic("JPEG", || Ok(3)).expect("no panic"), 3);
    }
}
