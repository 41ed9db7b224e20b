//! Progress on stderr: a bar with the time it took so far, on a terminal only.
//!
//! It tells no time that is left: where events crowd, a hundredth of the range takes as long as all the
//! rest, and nobody knows before.

use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use isospectrum::Progress;

use super::interrupt;

/// What is seen.
const TEMPLATE: &str = "{bar:30} {percent:>3} % {msg} ({elapsed})";

/// Steps of the bar.
const STEPS: u64 = 1000;

/// The bar that is shown.
static SHOWN: Mutex<Option<ProgressBar>> = Mutex::new(None);

fn shown() -> MutexGuard<'static, Option<ProgressBar>> {
    SHOWN.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Clears the bar away that is shown, if there is one.
pub(super) fn clear() {
    if let Some(bar) = shown().take() {
        bar.finish_and_clear();
    }
}

/// A bar from the start of a piece of work to its end; it clears itself away.
pub(super) struct Bar(ProgressBar);

impl Bar {
    /// A bar on stderr; none if that is no terminal or the user wants quiet.
    pub(super) fn new(quiet: bool) -> Self {
        let target =
            if quiet { ProgressDrawTarget::hidden() } else { ProgressDrawTarget::stderr() };
        let bar = ProgressBar::with_draw_target(Some(STEPS), target);
        if let Ok(style) = ProgressStyle::with_template(TEMPLATE) {
            bar.set_style(style);
        }
        if !bar.is_hidden() {
            // The clock runs where a step takes long, too.
            bar.enable_steady_tick(Duration::from_secs(1));
        }
        *shown() = Some(bar.clone());
        Bar(bar)
    }
}

impl Drop for Bar {
    fn drop(&mut self) {
        self.0.finish_and_clear();
        *shown() = None;
    }
}

impl Progress for Bar {
    fn report(&self, done: f64, message: &str) {
        if self.0.is_hidden() {
            return;
        }
        if self.0.message() != message {
            self.0.set_message(message.to_owned());
        }
        self.0.set_position((done.clamp(0.0, 1.0) * STEPS as f64) as u64);
    }

    fn cancelled(&self) -> bool {
        interrupt::requested()
    }
}
