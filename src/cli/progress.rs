//! Progress on stderr, on a terminal only: a bar with the elapsed time and an estimate of the time left.
//!
//! The estimate assumes that the rest runs as fast as the work so far. The library weighs its stages by the time they took
//! when they were measured, but where events crowd a sweep is slower, so the estimate is coarse.

use std::fmt::Write;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressState, ProgressStyle};
use isospectrum::Progress;

use super::interrupt;

/// The layout of the bar.
const TEMPLATE: &str = "{bar:30} {percent:>3} % {msg} ({elapsed}{left})";

/// Resolution of the bar.
const STEPS: u64 = 1000;

/// Share of the work and time below which no time left is estimated.
const MIN_DONE: f64 = 0.03;
const MIN_ELAPSED: Duration = Duration::from_secs(3);

/// The visible bar.
static VISIBLE: Mutex<Option<ProgressBar>> = Mutex::new(None);

fn visible() -> MutexGuard<'static, Option<ProgressBar>> {
    VISIBLE.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Removes the visible bar, if there is one.
pub(super) fn clear() {
    if let Some(bar) = visible().take() {
        bar.finish_and_clear();
    }
}

/// A bar that is removed when it is dropped.
pub(super) struct Bar(ProgressBar);

impl Bar {
    /// Shows a bar on stderr; hidden if stderr is no terminal or `quiet` is set.
    pub(super) fn new(quiet: bool) -> Self {
        let target =
            if quiet { ProgressDrawTarget::hidden() } else { ProgressDrawTarget::stderr() };
        let bar = ProgressBar::with_draw_target(Some(STEPS), target);
        if let Ok(style) = ProgressStyle::with_template(TEMPLATE) {
            bar.set_style(style.with_key("left", write_time_left));
        }
        if !bar.is_hidden() {
            // The clock also runs during a long step.
            bar.enable_steady_tick(Duration::from_secs(1));
        }
        *visible() = Some(bar.clone());
        Bar(bar)
    }
}

impl Drop for Bar {
    fn drop(&mut self) {
        self.0.finish_and_clear();
        *visible() = None;
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

fn write_time_left(state: &ProgressState, text: &mut dyn Write) {
    if let Some(left) = time_left(state.elapsed(), f64::from(state.fraction())) {
        // A failure leaves the text out.
        let _ = write!(text, ", about {left} left");
    }
}

/// Estimates the time left from the elapsed time and the share of the work that is done.
fn time_left(elapsed: Duration, done: f64) -> Option<String> {
    if !(MIN_DONE..1.0).contains(&done) || elapsed < MIN_ELAPSED {
        return None;
    }
    let seconds = elapsed.as_secs_f64() * (1.0 - done) / done;
    Some(match seconds {
        ..55.0 => format!("{:.0} s", (seconds / 5.0).ceil() * 5.0),
        ..5400.0 => format!("{:.0} min", (seconds / 60.0).ceil()),
        _ => format!("{:.1} h", seconds / 3600.0),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_time_left_is_estimated_once_there_is_something_to_go_by() {
        let left = |elapsed, done| time_left(Duration::from_secs(elapsed), done);
        assert_eq!([left(2, 0.5), left(60, 0.01), left(60, 1.0)], [None, None, None]);
        assert_eq!(left(30, 0.75).as_deref(), Some("10 s"));
        assert_eq!(left(60, 0.25).as_deref(), Some("3 min"));
        assert_eq!(left(3600, 0.5).as_deref(), Some("60 min"));
        assert_eq!(left(3600, 0.25).as_deref(), Some("3.0 h"));
    }
}
