//! Wrong usage, in the form of every other error: one line, exit code 2.

use std::io::{self, Write as _};
use std::process::ExitCode;

use clap::error::{ContextKind, ContextValue, ErrorKind};

use super::terminal;

/// Prints help or the version where that was asked for, otherwise the error on one line.
pub(crate) fn report(error: &clap::Error) -> ExitCode {
    match error.kind() {
        ErrorKind::DisplayHelp | ErrorKind::DisplayVersion => {
            let printed = error.print().and_then(|()| io::stdout().flush());
            match printed {
                // Whoever closed the pipe has read enough.
                Err(error) if error.kind() != io::ErrorKind::BrokenPipe => {
                    terminal::say(&format!("standard output: {error}"));
                    ExitCode::from(3)
                }
                _ => ExitCode::SUCCESS,
            }
        }
        ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand => {
            let _ = error.print();
            ExitCode::from(2)
        }
        _ => {
            let said = format!("{}{}", first_sentence(&error.to_string()), suggestion(error));
            terminal::say(&format!("{} (--help tells more)", terminal::line(&said)));
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

/// What was probably meant, where clap found something that is written nearly so.
fn suggestion(error: &clap::Error) -> String {
    let kinds =
        [ContextKind::SuggestedSubcommand, ContextKind::SuggestedArg, ContextKind::SuggestedValue];
    let nearest = kinds.iter().find_map(|&kind| match error.get(kind)? {
        ContextValue::String(name) => Some(name.clone()),
        ContextValue::Strings(names) => names.last().cloned(),
        _ => None,
    });
    nearest.map_or_else(String::new, |name| format!(", did you mean '{name}'?"))
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
