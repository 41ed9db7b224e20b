//! The command line: what can be asked for, and what every command has in common.
//!
//! A command is a struct of its flags with a `run`, one file each. Running goes parse → validate →
//! work: everything that can be known to be wrong from the flags alone is said before a volume is
//! read or a file is opened. Data and reports go to stdout, messages and progress to stderr.

mod analyze;
mod backend_arguments;
mod border_arguments;
mod bricks;
mod budget;
mod camera_arguments;
mod clip_argument;
mod color_arguments;
mod completions;
mod components;
mod compute;
mod convert;
mod demo;
mod empty;
mod extract;
mod film;
mod frames;
mod html;
mod info;
pub(crate) mod interrupt;
mod isovalue;
mod keep_arguments;
mod kind;
mod machine;
mod mark_argument;
mod merge;
mod output;
mod parts;
mod plan;
mod preparation_arguments;
mod progress;
mod render;
mod report;
mod series;
mod sight_arguments;
mod simplify_arguments;
mod spectrum_file;
mod surface_argument;
mod target;
pub(crate) mod terminal;
pub(crate) mod usage;
mod verify;
#[cfg(feature = "viewer")]
mod view;
#[cfg(not(feature = "viewer"))]
#[path = "cli/view_missing.rs"]
mod view;
mod volume_arguments;
pub(crate) mod wayland;

use std::io;

use clap::{ArgAction, Parser, Subcommand};

/// Precompute every isosurface of a volume as one tracked triangle mesh; extract, render and
/// verify any isovalue at once.
#[derive(Debug, Parser)]
#[command(name = "isospectrum", version, after_help = EXIT_CODES)]
pub(crate) struct Cli {
    #[command(subcommand)]
    command: Command,
    /// Say nothing but errors
    #[arg(short, long, global = true, conflicts_with = "verbose")]
    quiet: bool,
    /// Say more; twice: also what the GPU libraries say
    #[arg(short, long, global = true, action = ArgAction::Count)]
    verbose: u8,
}

const EXIT_CODES: &str = "\
Exit codes: 0 all right, 1 internal error or no adapter, 2 usage, 3 a file cannot be read or \
written, is damaged or unsupported, 4 isovalue outside the range, 5 verification failed, \
130 interrupted (129 by a hangup, 143 by a request to terminate).";

#[derive(Debug, Subcommand)]
enum Command {
    Compute(Box<compute::Compute>),
    Plan(Box<plan::Plan>),
    Merge(merge::Merge),
    Extract(extract::Extract),
    Components(components::Components),
    Info(info::Info),
    Analyze(analyze::Analyze),
    Verify(verify::Verify),
    Render(render::Render),
    Html(html::Html),
    View(view::View),
    Convert(convert::Convert),
    Demo(demo::Demo),
    Completions(completions::Completions),
}

/// Runs what the command line asks for.
pub(crate) fn run(arguments: &Cli) -> anyhow::Result<()> {
    start_log(arguments);
    interrupt::install();
    match &arguments.command {
        Command::Compute(command) => command.run(arguments.quiet),
        Command::Plan(command) => command.run(),
        Command::Merge(command) => command.run(arguments.quiet),
        Command::Extract(command) => command.run(),
        Command::Components(command) => command.run(),
        Command::Info(command) => command.run(),
        Command::Analyze(command) => command.run(arguments.quiet),
        Command::Verify(command) => command.run(arguments.quiet),
        Command::Html(command) => command.run(arguments.quiet),
        Command::View(command) => command.run(),
        Command::Render(command) => command.run(arguments.quiet),
        Command::Convert(command) => command.run(),
        Command::Demo(command) => command.run(arguments.quiet),
        Command::Completions(command) => command.run(),
    }
}

/// Messages are plain lines on stderr; those of other libraries show with `-vv` only.
fn start_log(arguments: &Cli) {
    use log::LevelFilter::{Debug, Error, Info, Off, Warn};
    let (program, library, others) = match (arguments.quiet, arguments.verbose) {
        (true, _) => (Error, Error, Off),
        (false, 0) => (Info, Warn, Off),
        (false, 1) => (Debug, Debug, Off),
        (false, _) => (Debug, Debug, Warn),
    };
    env_logger::Builder::new()
        .filter_level(others)
        .filter_module("isospectrum", library)
        .filter_module("isospectrum::cli", program)
        .format(|line, record| {
            use std::io::Write as _;
            // A record is one line: a name in it may hold anything.
            writeln!(line, "{}", terminal::plain(&record.args().to_string()))
        })
        .init();
}

/// The exit code for an error: that of the library's error in its chain, or of the signal that
/// interrupted.
pub(crate) fn exit_code(error: &anyhow::Error) -> u8 {
    match error.chain().find_map(|e| e.downcast_ref::<isospectrum::Error>()) {
        Some(isospectrum::Error::Interrupted) => interrupt::exit_code(),
        Some(error) => error.exit_code(),
        None => 1,
    }
}

/// Whether whoever reads our output has closed it, as `head` does: no error.
pub(crate) fn is_broken_pipe(error: &anyhow::Error) -> bool {
    error.chain().any(|e| {
        let of_system = e.downcast_ref::<io::Error>();
        of_system.is_some_and(|e| e.kind() == io::ErrorKind::BrokenPipe)
    })
}

/// The error and its causes on one line for a terminal, each said once.
pub(crate) fn one_line(error: &anyhow::Error) -> String {
    let mut line = error.to_string();
    for cause in error.chain().skip(1).map(ToString::to_string) {
        if !line.contains(&cause) {
            line = format!("{line}: {cause}");
        }
    }
    terminal::line(&line)
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory as _;

    #[test]
    fn the_command_line_is_consistent() {
        Cli::command().debug_assert();
    }

    #[test]
    fn an_error_is_one_line_that_says_each_cause_once() {
        let source = io::Error::other("disk\nfull");
        let error = anyhow::Error::from(isospectrum::Error::io("a.isp", source)).context("saving");
        assert_eq!(one_line(&error), "saving: a.isp: disk full");
        assert_eq!(exit_code(&error), 3);
    }
}
