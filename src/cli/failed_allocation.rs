//! A failed allocation ends the program with an exit code of its table.
//!
//! The standard library prints the number of bytes and aborts. Where the system limits memory so that allocations fail (`ulimit -v`),
//! the handler of that signal exits with the code for a lack of memory. Elsewhere an abort is a fault of the program.

/// Installs the handler.
pub(super) fn install() {
    #[cfg(unix)]
    {
        use std::sync::Arc;
        use std::sync::atomic::AtomicBool;

        use super::{exit_code, machine};

        if machine::allowed_by_process().is_none() {
            return;
        }
        let code = i32::from(exit_code::FILE);
        let abort = signal_hook::consts::signal::SIGABRT;
        let always = Arc::new(AtomicBool::new(true));
        let handled = signal_hook::flag::register_conditional_shutdown(abort, code, always);
        if let Err(error) = handled {
            log::debug!("a failed allocation aborts the program: {error}");
        }
    }
}
