//! The window as people use it: a real one on a virtual X server, driven by its mouse and keys.
//!
//! `scripts/test-viewer` runs it. It needs Xvfb and xdotool and fails, never skips, without them.
//! The contents of the window are read from the server's frame buffer and from its title.

#[path = "../common/mod.rs"]
mod common;

mod files;
mod folder;
mod hand;
mod panel;
mod pointing;
mod server;
mod shows;
mod window;
