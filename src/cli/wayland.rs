//! Keeps a line that is not ours off the user's terminal.
//!
//! A layer of Mesa's Vulkan driver looks for a Wayland display whenever adapters are listed, to prefer
//! the one that drives it. Where `XDG_RUNTIME_DIR` is not set, as in containers and over ssh, Wayland's
//! library says so on stderr by itself, with `-q` too. An absolute path in `WAYLAND_DISPLAY` needs no
//! such folder, and one that leads nowhere is no display, which is the truth: without the folder none
//! can be found. The environment of a running program cannot be changed safely, so the program starts
//! itself again in the one it needs; this happens once, since the path is there then.

/// A path where no display is.
#[cfg(all(unix, not(target_vendor = "apple")))]
const NO_DISPLAY: &str = "/dev/null/no-wayland-display";

/// Starts the program again in an environment that Wayland's library finds nothing wrong with, where
/// this one is not; else, and where that cannot be done, does nothing.
#[cfg(all(unix, not(target_vendor = "apple")))]
pub(crate) fn settle() {
    use std::env::{args_os, current_exe, var_os};
    use std::os::unix::ffi::OsStrExt as _;
    use std::os::unix::process::CommandExt as _;

    let is_absolute =
        |name: &str| var_os(name).is_some_and(|path| path.as_bytes().starts_with(b"/"));
    if ["XDG_RUNTIME_DIR", "WAYLAND_DISPLAY"].into_iter().any(is_absolute)
        || var_os("WAYLAND_SOCKET").is_some()
    {
        return;
    }
    let Ok(program) = current_exe() else { return };
    let mut arguments = args_os();
    let mut command = std::process::Command::new(program);
    if let Some(name) = arguments.next() {
        command.arg0(name);
    }
    // Comes back only if it fails; the work can be done all the same.
    let _ = command.args(arguments).env("WAYLAND_DISPLAY", NO_DISPLAY).exec();
}

/// Elsewhere there is no Wayland.
#[cfg(not(all(unix, not(target_vendor = "apple"))))]
pub(crate) fn settle() {}
