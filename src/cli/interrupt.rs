//! Ctrl-C: the first asks the work to stop, the second ends the program at once.

use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};

static REQUESTED: AtomicBool = AtomicBool::new(false);

/// The file beside the target that would be left behind by a sudden end.
static UNFINISHED: Mutex<Option<PathBuf>> = Mutex::new(None);

/// Starts listening for Ctrl-C.
pub(super) fn install() {
    let listening = ctrlc::set_handler(|| {
        if REQUESTED.swap(true, Ordering::Relaxed) {
            if let Ok(mut unfinished) = UNFINISHED.lock()
                && let Some(path) = unfinished.take()
            {
                // Nothing more can be done for a file that will not go.
                let _ = std::fs::remove_file(path);
            }
            std::process::exit(130);
        }
    });
    if let Err(error) = listening {
        log::debug!("Ctrl-C will end the program at once: {error}");
    }
}

/// Whether Ctrl-C was pressed.
pub(super) fn requested() -> bool {
    REQUESTED.load(Ordering::Relaxed)
}

/// Remembers the file to remove on a sudden end.
pub(super) fn set_unfinished(path: Option<&Path>) {
    if let Ok(mut unfinished) = UNFINISHED.lock() {
        *unfinished = path.map(Path::to_owned);
    }
}
