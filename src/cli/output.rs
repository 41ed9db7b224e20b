//! Outputs of commands: the library's, which stop after a signal.

use isospectrum::Result;
use isospectrum::file::Output;

use super::interrupt::Signals;

/// Prints a report on stdout.
pub(super) fn print(text: &str) -> Result<()> {
    let end = if text.ends_with('\n') { "" } else { "\n" };
    Output::Stdout.write_bytes(&Signals, format!("{text}{end}").as_bytes())?;
    Ok(())
}
