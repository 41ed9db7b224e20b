//! The program as users run it: arguments, files, messages and exit codes.

#[path = "../common/mod.rs"]
mod common;

mod bad_input;
mod bricks;
mod cli;
mod colors;
mod extremes;
#[cfg(unix)]
mod films;
mod frames;
mod guide;
mod isovalues;
#[cfg(unix)]
mod memory_limits;
mod messages;
mod outputs;
mod readers;
mod snapshots;
mod world;
