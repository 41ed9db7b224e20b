//! What computing a spectrum costs: time, memory, bytes of the file.

use std::thread::available_parallelism;
use std::time::Duration;

use crate::forecast::Forecast;

/// Time on two threads, seconds for each triangle of the spectrum: between 25 and 100 microseconds for volumes of 24 to 64 samples along
/// a side, on machines that do other work, too.
const SECONDS_PER_TRIANGLE: f64 = 50e-6;

/// Power of the number of threads by which the time falls (decision 0009).
const THREADS_POWER: f64 = 0.6;

/// Bytes of the file for each triangle: 1.9 to 2.6 for the same volumes.
const BYTES_PER_TRIANGLE: f64 = 2.1;

/// What computing a spectrum costs, each number within a factor of about three.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Cost {
    triangles: f64,
    bytes: f64,
    memory: f64,
    time: Duration,
}

impl Cost {
    /// The cost on this machine.
    pub(super) fn of(forecast: &Forecast) -> Cost {
        let threads = available_parallelism().map_or(2.0, |n| n.get() as f64);
        Cost::with_threads(forecast, threads)
    }

    fn with_threads(&Forecast { triangles, memory, .. }: &Forecast, threads: f64) -> Cost {
        let seconds = SECONDS_PER_TRIANGLE * triangles * (2.0 / threads).powf(THREADS_POWER);
        Cost {
            triangles,
            bytes: BYTES_PER_TRIANGLE * triangles,
            memory,
            time: Duration::from_secs_f64(seconds.clamp(0.0, 1e9)),
        }
    }

    pub(super) fn in_words(&self) -> String {
        let Cost { triangles, bytes, memory, time } = *self;
        let [bytes, memory] = [bytes, memory].map(in_bytes);
        let (triangles, time) = (in_large_units(triangles), in_time(time));
        format!("roughly {time}, {memory} of memory; {triangles} triangles, a file of {bytes}")
    }
}

/// A time with one digit or two, such as `40 s` or `3 min`.
pub(super) fn in_time(time: Duration) -> String {
    let seconds = time.as_secs_f64();
    match seconds {
        ..1.5 => "1 s".into(),
        ..90.0 => format!("{} s", two_digits(seconds)),
        ..5400.0 => format!("{} min", two_digits(seconds / 60.0)),
        _ => format!("{} h", two_digits(seconds / 3600.0)),
    }
}

fn in_bytes(bytes: f64) -> String {
    match bytes {
        ..1e6 => format!("{} kB", two_digits(bytes / 1e3)),
        ..1e9 => format!("{} MB", two_digits(bytes / 1e6)),
        _ => format!("{} GB", two_digits(bytes / 1e9)),
    }
}

fn in_large_units(n: f64) -> String {
    match n {
        ..1e6 => two_digits(n),
        _ => format!("{} million", two_digits(n / 1e6)),
    }
}

/// Rounds to two digits; below ten to the tenth.
fn two_digits(x: f64) -> String {
    if x < 9.95 {
        return format!("{:.1}", x).trim_end_matches(".0").to_owned();
    }
    let unit = 10f64.powf(x.log10().floor() - 1.0);
    format!("{}", (x / unit).round() * unit)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn costs_have_two_digits_and_a_unit() {
        let forecast = Forecast {
            events: 7,
            crossings: 1.0,
            intervals: 1,
            triangles: 1_234_567.0,
            memory: 3.21e9,
        };
        let cost = Cost::with_threads(&forecast, 2.0);
        let words = "roughly 62 s, 3.2 GB of memory; 1.2 million triangles, a file of 2.6 MB";
        assert_eq!(cost.in_words(), words);
        assert!(Cost::with_threads(&forecast, 16.0).time < cost.time);
        let small = Forecast { triangles: 12_345.0, memory: 24e6, ..forecast };
        let words = "roughly 1 s, 24 MB of memory; 12000 triangles, a file of 26 kB";
        assert_eq!(Cost::with_threads(&small, 2.0).in_words(), words);
    }

    #[test]
    fn times_are_in_seconds_minutes_or_hours() {
        let of = |seconds: f64| in_time(Duration::from_secs_f64(seconds));
        assert_eq!(
            [0.0, 7.26, 89.0, 91.0, 5300.0, 36e3].map(of),
            ["1 s", "7.3 s", "89 s", "1.5 min", "88 min", "10 h"]
        );
    }
}
