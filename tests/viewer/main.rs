//! The window on a virtual X server, controlled with mouse and keys.
//!
//! `scripts/test-viewer` runs these tests. They need Xvfb and xdotool and fail without them.
//! The contents of the window are read from the server's frame buffer and from its title.

#[path = "../common/mod.rs"]
mod common;

mod files;
mod input;
mod large_file;
mod panel;
mod pictures;
mod pointing;
mod server;
mod window;
