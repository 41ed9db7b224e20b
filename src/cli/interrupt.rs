//! Ctrl-C and the other signals that terminate a program: the first cancels the work, so that no incomplete file stays behind;
//! the second ends the program at once.
//!
//! Work that checks for cancellation stops by itself. Some does not: the topology of a large volume, a spectrum that is read
//! or packed into a page, a window. If it has not stopped after [`GRACE`], the program exits as soon as no file is
//! incomplete.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError, mpsc};
use std::time::Duration;

use isospectrum::file::block_writes;
use isospectrum::{Error, Progress};
use signal_hook::consts::signal::{SIGINT, SIGTERM};
use signal_hook::flag;

use super::terminal;

/// Time for the work to stop by itself.
const GRACE: Duration = Duration::from_millis(500);

/// Interval at which signals are checked.
const POLL_INTERVAL: Duration = Duration::from_millis(50);

/// The number of the received signal, or 0.
static RECEIVED: OnceLock<Arc<AtomicUsize>> = OnceLock::new();

/// Installs the handlers. `clear` removes the progress bar before the program exits during its work.
pub(super) fn install(clear: fn()) {
    let received = RECEIVED.get_or_init(Arc::default);
    let again = Arc::new(AtomicBool::new(false));
    for signal in signals() {
        let listen = || -> std::io::Result<()> {
            // Handlers run in this order, so the first signal does not shut down.
            flag::register_conditional_shutdown(signal, code_of(signal), again.clone())?;
            flag::register(signal, again.clone())?;
            flag::register_usize(signal, received.clone(), signal as usize)?;
            Ok(())
        };
        if let Err(error) = listen() {
            log::debug!("signal {signal} ends the program at once: {error}");
        }
    }
    fail_writes_beyond_limit();
    let watch = std::thread::Builder::new().name("signals".to_owned());
    let (started, is_started) = mpsc::channel::<()>();
    let watch = watch.spawn(move || {
        std::hint::black_box(Vec::<u8>::with_capacity(1));
        drop(started);
        exit_after_signal(clear);
    });
    match watch {
        // It has its heap by then, so that a forecast is compared with the address space that is left.
        Ok(_) => drop(is_started.recv_timeout(GRACE)),
        Err(error) => log::debug!("a signal ends only work that checks for it: {error}"),
    }
}

/// Lets a write beyond the limit of file sizes (ulimit -f) fail with an error: by default its signal kills the program, which
/// leaves an incomplete file.
fn fail_writes_beyond_limit() {
    #[cfg(unix)]
    {
        let ignored = Arc::new(AtomicBool::new(false));
        if let Err(error) = flag::register(signal_hook::consts::signal::SIGXFSZ, ignored) {
            log::debug!("a file beyond the limit of file sizes ends the program: {error}");
        }
    }
}

/// Waits for a signal and exits if the work does not stop by itself.
fn exit_after_signal(clear: fn()) {
    while !requested() {
        std::thread::sleep(POLL_INTERVAL);
    }
    std::thread::sleep(GRACE);
    let _no_incomplete_file = block_writes();
    let _final_message = lock_final_message();
    clear();
    terminal::print_message(&Error::Interrupted.to_string());
    // The work still runs in other threads, so nothing it uses is dropped.
    signal_hook::low_level::exit(i32::from(exit_code()));
}

/// Locks the final message: of the main thread and the signal thread, only the first prints the reason of the exit.
pub(super) fn lock_final_message() -> MutexGuard<'static, ()> {
    static FINAL_MESSAGE: Mutex<()> = Mutex::new(());
    FINAL_MESSAGE.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Returns the signals to handle.
fn signals() -> Vec<i32> {
    let mut signals = vec![SIGINT, SIGTERM];
    #[cfg(unix)]
    if !is_ignored(signal_hook::consts::signal::SIGHUP) {
        signals.push(signal_hook::consts::signal::SIGHUP);
    }
    signals
}

/// True if the parent process ignores a signal, as `nohup` does with the hangup, or if that is unknown.
#[cfg(unix)]
fn is_ignored(signal: i32) -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let mask = mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok());
    mask.is_none_or(|mask| mask & (1 << (signal - 1)) != 0)
}

/// Cancels work after a signal, and shows no progress.
#[derive(Clone, Copy, Debug)]
pub(super) struct Signals;

impl Progress for Signals {
    fn report(&self, _done: f64, _message: &str) {}

    fn cancelled(&self) -> bool {
        requested()
    }
}

/// True if a signal was received.
pub(super) fn requested() -> bool {
    RECEIVED.get().is_some_and(|signal| signal.load(Ordering::Relaxed) != 0)
}

/// Returns the exit code for the received signal: 130 for Ctrl-C.
pub(super) fn exit_code() -> u8 {
    let received = RECEIVED.get().map_or(0, |signal| signal.load(Ordering::Relaxed));
    code_of(if received == 0 { SIGINT } else { received as i32 }) as u8
}

/// Returns 128 plus the signal, as shells do.
fn code_of(signal: i32) -> i32 {
    128 + signal
}
