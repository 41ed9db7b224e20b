//! The program `isospectrum`: parses the command line, runs the command, prints the error, exits.
//!
//! Everything else is in [`cli`], one file per command, and in the library.

mod cli;

use std::panic::catch_unwind;
use std::process::ExitCode;

fn main() -> ExitCode {
    std::panic::set_hook(Box::new(|panic| {
        // Such a panic becomes an error of a file or a driver.
        if isospectrum::unstable::caught_panic::is_catching() {
            return;
        }
        let panic = cli::terminal::line(&panic.to_string());
        cli::terminal::print_message(&format!("internal error, please report it: {panic}"));
    }));
    let arguments = match cli::parse() {
        Ok(arguments) => arguments,
        Err(error) => return cli::usage::report(&error, &cli::definition()),
    };
    match catch_unwind(|| cli::run(&arguments)) {
        Ok(Ok(())) => ExitCode::SUCCESS,
        Ok(Err(error)) if cli::is_broken_pipe(&error) => ExitCode::SUCCESS,
        Ok(Err(error)) => {
            // Kept to the end, so that no signal prints a second message.
            std::mem::forget(cli::interrupt::lock_final_message());
            cli::terminal::print_message(&cli::one_line(&error));
            ExitCode::from(cli::exit_code::of(&error))
        }
        // The hook has printed the panic.
        Err(_) => ExitCode::FAILURE,
    }
}
