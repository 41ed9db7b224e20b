//! The program: its commands, and what all of them share.
//!
//! A command is a struct of flags with a method `run`, one file each. It parses, validates, then works: a fault that the
//! flags alone reveal is reported before any file is read. Data and reports go to stdout, messages and progress to stderr.

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
mod cutaway_arguments;
mod demo;
mod driver_warning;
mod empty;
mod exit_code;
mod extract;
mod failed_allocation;
mod gpu;
mod heading;
mod html;
mod info;
mod interrupt;
mod isovalue;
mod keep_arguments;
mod kind;
mod machine;
mod mark_argument;
mod merge;
mod number_argument;
mod output;
mod parameter_arguments;
mod parts;
mod plan;
mod preparation_arguments;
mod progress;
mod render;
mod report;
mod simplify_arguments;
mod size_argument;
mod spectrum_file;
mod style_arguments;
mod surface_argument;
mod sweep_argument;
mod target;
mod terminal;
mod threads;
mod usage;
mod verify;
#[cfg(feature = "viewer")]
mod view;
#[cfg(not(feature = "viewer"))]
#[path = "cli/view_missing.rs"]
mod view;
mod volume_arguments;

use std::ffi::OsString;
use std::io;
use std::panic::catch_unwind;

use clap::{ArgAction, CommandFactory as _, FromArgMatches as _, Parser, Subcommand};

/// Precompute every isosurface of a volume as one tracked triangle mesh
///
/// A spectrum file holds the meshes of all isovalues of a volume. Compute it once, then extract, render, publish and verify
/// any isovalue at once.
#[derive(Debug, Parser)]
#[command(name = "isospectrum", version, disable_help_flag = true, disable_version_flag = true)]
#[command(after_help = EXIT_CODES, after_long_help = LONG_EXIT_CODES)]
struct Cli {
    #[command(subcommand)]
    command: Command,
    /// Suppress everything but errors
    #[arg(short, long, global = true, conflicts_with = "verbose", help_heading = heading::GENERAL)]
    quiet: bool,
    /// Print details; -vv: also GPU messages
    #[arg(short, long, global = true, action = ArgAction::Count, help_heading = heading::GENERAL)]
    verbose: u8,
    /// Print help; --help shows all and examples
    #[arg(id = "help", short = 'h', long = "help", global = true, action = ArgAction::Help, help_heading = heading::GENERAL)]
    _help: Option<bool>,
    /// Print the version
    #[arg(id = "version", short = 'V', long = "version", action = ArgAction::Version, help_heading = heading::GENERAL)]
    _version: Option<bool>,
}

const EXIT_CODES: &str = "Exit codes: 0 success, 1 internal error or no GPU, 2 usage, 3 file, 4 isovalue outside the range, 5 verification failed, 130 interrupted";

const LONG_EXIT_CODES: &str = "\
Examples:
  isospectrum compute --phantom blobs:64 -o blobs.isp
  isospectrum extract blobs.isp -c 50% -o half.ply
  isospectrum render blobs.isp -c 50% -o half.png
  isospectrum verify blobs.isp --phantom blobs:64

Exit codes:
  0    success
  1    internal error, or no GPU
  2    wrong usage
  3    a file cannot be read or written, is damaged or unsupported, or memory does not suffice
  4    the isovalue is outside the range
  5    verification failed
  130  interrupted (129 by a hangup, 143 by a request to terminate)";

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

/// Returns the definition of the whole command line.
fn definition() -> clap::Command {
    // A negative number is a value, so that the check of its flag can name the range.
    let numbers = |arg: clap::Arg| {
        let takes_value = arg.get_action().takes_values() && !arg.is_positional();
        if takes_value { arg.allow_negative_numbers(true) } else { arg }
    };
    // The help flag of the root is global: it stays last in the help of each command.
    Cli::command().mut_subcommands(|command| command.disable_help_flag(true).mut_args(numbers))
}

/// Runs the program: parses the command line, which begins with the name of the program, runs the command, prints the error. Returns
/// the exit code.
pub fn main(arguments: Vec<OsString>) -> u8 {
    std::panic::set_hook(Box::new(|panic| {
        // Such a panic becomes an error of a file or a driver.
        if isospectrum::unstable::caught_panic::is_catching() {
            return;
        }
        let panic = terminal::line(&panic.to_string());
        terminal::print_message(&format!("internal error, please report it: {panic}"));
    }));
    let matches = definition().try_get_matches_from(&arguments);
    let parsed = match matches.and_then(|matches| Cli::from_arg_matches(&matches)) {
        Ok(parsed) => parsed,
        Err(error) => return usage::report(&error, &definition(), &arguments),
    };
    match catch_unwind(|| run(&parsed)) {
        Ok(Ok(())) => exit_code::SUCCESS,
        Ok(Err(error)) if is_broken_pipe(&error) => exit_code::SUCCESS,
        Ok(Err(error)) => {
            // Kept to the end, so that no signal prints a second message.
            std::mem::forget(interrupt::lock_final_message());
            terminal::print_message(&one_line(&error));
            exit_code::of(&error)
        }
        // The hook has printed the panic.
        Err(_) => exit_code::OTHER,
    }
}

/// Runs the command.
fn run(arguments: &Cli) -> anyhow::Result<()> {
    start_log(arguments);
    failed_allocation::install();
    interrupt::install(progress::clear);
    threads::start_granted()?;
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
        Command::Completions(command) => command.run(&mut definition()),
    }
}

/// Starts logging: messages are plain lines on stderr; those of other libraries appear with `-vv` only.
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
            // A record is one line, whatever a name in it contains.
            writeln!(line, "{}", terminal::plain(&record.args().to_string()))
        })
        .init();
}

/// True if the reader of our output has closed the pipe, as `head` does: no error.
fn is_broken_pipe(error: &anyhow::Error) -> bool {
    error.chain().any(|e| {
        let of_system = e.downcast_ref::<io::Error>();
        of_system.is_some_and(|e| e.kind() == io::ErrorKind::BrokenPipe)
    })
}

/// Returns the error and its causes on one line for a terminal, each cause once.
fn one_line(error: &anyhow::Error) -> String {
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

    #[test]
    fn the_command_line_is_consistent() {
        definition().debug_assert();
    }

    #[test]
    fn the_summary_of_each_command_fits_a_terminal() {
        // Of 80 columns and some 45 lines, with one line for each flag.
        let mut definition = definition().term_width(80);
        definition.build();
        let commands = definition.get_subcommands_mut();
        for command in commands.filter(|command| command.get_name() != "help") {
            let name = command.get_name().to_owned();
            let help = command.render_help().to_string();
            assert!(help.lines().count() <= 46, "{name}: {} lines\n{help}", help.lines().count());
            let is_continued = |line: &str| line.starts_with("            ");
            assert!(!help.lines().any(is_continued), "{name}:\n{help}");
            assert!(help.contains("Print help"), "{name}:\n{help}");
        }
    }

    #[test]
    fn an_error_is_one_line_with_each_cause_once() {
        let source = io::Error::other("disk\nfull");
        let error = anyhow::Error::from(isospectrum::Error::io("a.isp", source)).context("saving");
        assert_eq!(one_line(&error), "saving: a.isp: disk full");
    }
}
