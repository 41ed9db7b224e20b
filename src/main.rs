//! The program `isospectrum`: parse the command line, run the command, print the error, exit.
//!
//! Everything else is in [`cli`], one file per command, and in the library.

mod cli;

use std::panic::catch_unwind;
use std::process::ExitCode;

use clap::Parser as _;

fn main() -> ExitCode {
    cli::wayland::settle();
    std::panic::set_hook(Box::new(|panic| {
        let panic = cli::terminal::line(&panic.to_string());
        cli::terminal::say(&format!("internal error, please report it: {panic}"));
    }));
    let arguments = match cli::Cli::try_parse() {
        Ok(arguments) => arguments,
        Err(error) => return cli::usage::report(&error),
    };
    match catch_unwind(|| cli::run(&arguments)) {
        Ok(Ok(())) => ExitCode::SUCCESS,
        Ok(Err(error)) if cli::is_broken_pipe(&error) => ExitCode::SUCCESS,
        Ok(Err(error)) => {
            // Nobody else says something from here on.
            std::mem::forget(cli::interrupt::last_word());
            cli::terminal::say(&cli::one_line(&error));
            ExitCode::from(cli::exit_code(&error))
        }
        // The hook has said what happened.
        Err(_) => ExitCode::FAILURE,
    }
}
