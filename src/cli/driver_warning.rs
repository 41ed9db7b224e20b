//! Hides a warning of the Wayland library while a GPU is opened.
//!
//! wgpu enables the Vulkan extension `VK_KHR_wayland_surface` even if no window is wanted. With it, a layer of Mesa
//! (`VK_LAYER_MESA_device_select`) connects to a Wayland display whenever adapters are listed. If `XDG_RUNTIME_DIR` is not
//! set, as in containers and over ssh, the Wayland library then prints an error to stderr, with `-q` too. wgpu has no option
//! against the extension, the layer obeys environment variables only, and those of a running process cannot be changed
//! safely. So stderr is a file while a GPU is opened; all other lines of it are printed afterwards.

#[cfg(all(unix, not(target_vendor = "apple")))]
pub(super) use filter::hidden;

/// Opens a GPU; other systems have no Wayland.
#[cfg(not(all(unix, not(target_vendor = "apple"))))]
pub(super) fn hidden<T>(open: impl FnOnce() -> T) -> T {
    open()
}

#[cfg(all(unix, not(target_vendor = "apple")))]
mod filter {
    use std::fs::File;
    use std::io::{Read as _, Seek as _, Write as _, stderr};
    use std::os::fd::OwnedFd;

    /// The variable that the warning names.
    const VARIABLE: &str = "XDG_RUNTIME_DIR";

    /// Opens a GPU, without the warning on stderr.
    pub(in crate::cli) fn hidden<T>(open: impl FnOnce() -> T) -> T {
        let is_set = std::env::var_os(VARIABLE)
            .is_some_and(|path| std::path::Path::new(&path).is_absolute());
        // If stderr cannot be redirected, the warning is printed.
        let _redirected = if is_set { None } else { Redirected::new().ok() };
        open()
    }

    /// Redirects stderr to a file until it is dropped.
    struct Redirected {
        stderr: OwnedFd,
        file: File,
    }

    impl Redirected {
        fn new() -> std::io::Result<Self> {
            let redirected =
                Redirected { stderr: rustix::io::dup(stderr())?, file: tempfile::tempfile()? };
            rustix::stdio::dup2_stderr(&redirected.file)?;
            Ok(redirected)
        }
    }

    impl Drop for Redirected {
        fn drop(&mut self) {
            // Nothing can be printed if stderr cannot be restored.
            let restored = rustix::stdio::dup2_stderr(&self.stderr);
            let mut bytes = Vec::new();
            let read = self.file.rewind().and_then(|()| self.file.read_to_end(&mut bytes));
            if restored.is_err() || read.is_err() {
                return;
            }
            let is_other = |line: &&[u8]| !String::from_utf8_lossy(line).contains(VARIABLE);
            for line in bytes.split_inclusive(|&byte| byte == b'\n').filter(is_other) {
                let _ = stderr().write_all(line);
            }
        }
    }
}
