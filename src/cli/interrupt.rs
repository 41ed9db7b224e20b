//! Ctrl-C, and the signals that ask a program to end: the first asks the work to stop, so that no part
//! of a file stays behind; the second ends the program at once.
//!
//! Work that looks whether it was asked stops by itself. Not all does: the topology of a large volume, a spectrum that is
//! read or packed into a page, a window. What has not stopped after [`GRACE`] is not waited for: as soon as no file is
//! there in part, the program ends under it.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};
use std::time::Duration;

use isospectrum::Error;
use isospectrum::file::block_writes;
use signal_hook::consts::signal::{SIGINT, SIGTERM};
use signal_hook::flag;

use super::{progress, terminal};

/// How long the work may take to stop by itself.
const GRACE: Duration = Duration::from_millis(500);

/// How often it is looked whether a signal came.
const LOOK: Duration = Duration::from_millis(50);

/// The number of the signal that came, or 0.
static CAME: OnceLock<Arc<AtomicUsize>> = OnceLock::new();

/// Starts listening.
pub(super) fn install() {
    let came = CAME.get_or_init(Arc::default);
    let again = Arc::new(AtomicBool::new(false));
    for signal in signals() {
        let listen = || -> std::io::Result<()> {
            // In this order: the first signal finds the flag still down.
            flag::register_conditional_shutdown(signal, code_of(signal), again.clone())?;
            flag::register(signal, again.clone())?;
            flag::register_usize(signal, came.clone(), signal as usize)?;
            Ok(())
        };
        if let Err(error) = listen() {
            log::debug!("signal {signal} will end the program at once: {error}");
        }
    }
    let watch = std::thread::Builder::new().name("signals".to_owned());
    if let Err(error) = watch.spawn(end_when_asked) {
        log::debug!("a signal is heeded by the work alone: {error}");
    }
}

/// Waits for a signal and ends the program if that does not do so itself.
fn end_when_asked() {
    while !requested() {
        std::thread::sleep(LOOK);
    }
    std::thread::sleep(GRACE);
    let _no_unfinished_file = block_writes();
    let _last_word = last_word();
    progress::clear();
    terminal::say(&Error::Interrupted.to_string());
    // The work goes on, so nothing of what it uses may be taken down.
    signal_hook::low_level::exit(i32::from(exit_code()));
}

/// For whoever ends the program, until it has ended: one of two says why.
pub(crate) fn last_word() -> MutexGuard<'static, ()> {
    static LAST_WORD: Mutex<()> = Mutex::new(());
    LAST_WORD.lock().unwrap_or_else(PoisonError::into_inner)
}

/// What is listened to.
fn signals() -> Vec<i32> {
    let mut signals = vec![SIGINT, SIGTERM];
    #[cfg(unix)]
    if !is_ignored(signal_hook::consts::signal::SIGHUP) {
        signals.push(signal_hook::consts::signal::SIGHUP);
    }
    signals
}

/// Whether whoever started us wants a signal ignored, as `nohup` does with the hangup; where that
/// cannot be known it is left alone.
#[cfg(unix)]
fn is_ignored(signal: i32) -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let mask = mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok());
    mask.is_none_or(|mask| mask & (1 << (signal - 1)) != 0)
}

/// Whether one of the signals came.
pub(super) fn requested() -> bool {
    CAME.get().is_some_and(|came| came.load(Ordering::Relaxed) != 0)
}

/// The exit code of a program that a signal stopped: 130 for Ctrl-C.
pub(super) fn exit_code() -> u8 {
    let came = CAME.get().map_or(0, |came| came.load(Ordering::Relaxed));
    code_of(if came == 0 { SIGINT } else { came as i32 }) as u8
}

/// As shells count: 128 and the signal.
fn code_of(signal: i32) -> i32 {
    128 + signal
}
