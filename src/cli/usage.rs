//! Wrong usage, in the form of every other error: one line, exit code 2.

use std::process::ExitCode;

use clap::error::ErrorKind;

/// Prints help or the version where that was asked for, otherwise the error on one line.
pub(crate) fn report(error: &clap::Error) -> ExitCode {
    match error.kind() {
        ErrorKind::DisplayHelp | ErrorKind::DisplayVersion => {
            // Whoever closed the pipe has read enough.
            let _ = error.print();
            ExitCode::SUCCESS
        }
        ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand => {
            let _ = error.print();
            ExitCode::from(2)
        }
        _ => {
            eprintln!("isospectrum: {} (--help tells more)", first_sentence(&error.to_string()));
            ExitCode::from(2)
        }
    }
}

/// Of clap's text, a paragraph on what is wrong, then tips and usage: the paragraph.
fn first_sentence(text: &str) -> String {
    let paragraph = text.split("\n\n").next().unwrap_or_default();
    let words: Vec<&str> = paragraph.split_whitespace().collect();
    words.join(" ").trim_start_matches("error: ").to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_paragraph_becomes_one_line() {
        let text = "error: these were not provided:\n  --output <FILE>\n\nUsage: x\n";
        assert_eq!(first_sentence(text), "these were not provided: --output <FILE>");
    }
}
