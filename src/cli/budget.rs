//! Limits of triangles and memory: a warning or an error before the work begins.

use clap::Args;
use isospectrum::Forecast;
use isospectrum::settings::ByteSize;
use isospectrum::volume::Volume;
use isospectrum::{Error, Result};

use super::machine::{self, Allowed};
use super::{heading, report};

/// Number of expected triangles that causes a warning without a flag.
const WARN_TRIANGLES: f64 = 20e6;

/// Expected memory that causes a warning without a flag.
const WARN_MEMORY: ByteSize = ByteSize::new(16.0 * 1024.0 * 1024.0 * 1024.0);

/// Factor by which a forecast can be too high: a volume that exceeds the memory by more will not fit.
const FORECAST_ERROR: f64 = 2.0;

/// Flags that limit triangles and memory.
#[derive(Args, Debug)]
#[command(next_help_heading = heading::MACHINE)]
pub(super) struct BudgetArguments {
    /// Memory limit, e.g. 8GB [default: all free]
    ///
    /// A volume that is expected to need more is computed in bricks, or refused if those need more too.
    #[arg(long, value_name = "SIZE")]
    max_memory: Option<ByteSize>,
    /// Refuse to start if more triangles are expected
    ///
    /// A computation in bricks stops when it exceeds them. Without the flag, more than 20 million cause a warning.
    #[arg(long, value_name = "N", value_parser = super::number_argument::positive)]
    max_triangles: Option<f64>,
}

/// A limit of memory and its origin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Limit {
    pub(super) bytes: f64,
    by: &'static str,
}

impl Limit {
    /// Describes expected memory that exceeds the limit; none if it does not.
    pub(super) fn beyond(self, expected: f64) -> Option<String> {
        (expected > self.bytes).then(|| {
            let [expected, left] = [expected, self.bytes].map(|x| report::bytes(x as u64));
            format!("about {expected} of memory expected as a whole, {} leaves {left}", self.by)
        })
    }
}

impl BudgetArguments {
    /// Returns the limit of memory: that of the flag, or of the system; none if unknown.
    pub(super) fn limit(&self) -> Option<Limit> {
        match self.max_memory {
            Some(size) => Some(Limit { bytes: size.bytes(), by: "--max-memory" }),
            None => machine::allowed().map(|Allowed { bytes, by, .. }| Limit { bytes, by }),
        }
    }

    /// Returns the limit of triangles, if given.
    pub(super) fn max_triangles(&self) -> Option<f64> {
        self.max_triangles
    }

    /// Refuses a volume whose samples alone exceed the memory.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`] if `--max-memory` is not given and the volume exceeds the memory of the system.
    pub(super) fn check_least(&self, volume: &Volume) -> Result<()> {
        // With --max-memory, the user knows the machine better.
        let allowed = machine::allowed().filter(|_| self.max_memory.is_none());
        let least = Forecast::least_memory(volume.dims());
        match allowed.and_then(|allowed| beyond_machine(least, allowed, 1.0)) {
            None => Ok(()),
            Some(refused) => {
                let name = volume.name();
                Err(Error::Usage(format!("{name}: {refused}; --range does not help")))
            }
        }
    }

    /// Warns if a whole volume exceeds the limits, or the memory of the system.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`] if it exceeds a limit given as a flag, or, without `--max-memory`, clearly exceeds the memory of the
    /// system.
    pub(super) fn check(&self, name: &str, forecast: &Forecast) -> Result<()> {
        // With --max-memory, the user knows the machine better.
        let allowed = machine::allowed().filter(|_| self.max_memory.is_none());
        let advice = advice(forecast);
        let refused = allowed.and_then(|allowed| {
            let times = if allowed.is_strict { 1.0 } else { FORECAST_ERROR };
            beyond_machine(forecast.memory, allowed, times)
        });
        if let Some(refused) = refused {
            return Err(Error::Usage(format!("{name}: {refused}; {advice}")));
        }
        if let Some(beyond) = self.beyond(forecast, |is_given| is_given) {
            return Err(Error::Usage(format!("{name}: {beyond}; {advice}")));
        }
        if let Some(beyond) = self.beyond(forecast, |_| true) {
            log::warn!("{name}: {beyond}; {advice}");
        } else if let Some(beyond) =
            allowed.and_then(|allowed| beyond_machine(forecast.memory, allowed, 1.0))
        {
            log::warn!("{name}: {beyond}; {advice}");
        }
        Ok(())
    }

    /// Describes which limits a forecast exceeds. `counts` selects limits by whether they are given as flags.
    fn beyond(&self, forecast: &Forecast, counts: impl Fn(bool) -> bool) -> Option<String> {
        let mut parts = Vec::new();
        let limit = self.max_triangles.unwrap_or(WARN_TRIANGLES);
        if forecast.triangles > limit && counts(self.max_triangles.is_some()) {
            let [expected, limit] = [forecast.triangles, limit].map(rounded);
            parts.push(format!("about {expected} triangles (more than {limit})"));
        }
        let limit = self.max_memory.unwrap_or(WARN_MEMORY).bytes();
        if forecast.memory > limit && counts(self.max_memory.is_some()) {
            let [expected, limit] = [forecast.memory, limit].map(|x| report::bytes(x as u64));
            parts.push(format!("about {expected} of memory (more than {limit})"));
        }
        let events = forecast.events;
        (!parts.is_empty()).then(|| format!("{} expected for {events} events", parts.join(" and ")))
    }
}

/// Describes expected memory that exceeds `times` the memory of the system; none if it does not.
fn beyond_machine(expected: f64, allowed: Allowed, times: f64) -> Option<String> {
    (expected > times * allowed.bytes).then(|| {
        let [expected, left] = [expected, allowed.bytes].map(|x| report::bytes(x as u64));
        let by = allowed.by;
        format!("about {expected} of memory expected, {by} leaves {left} (--max-memory overrides)")
    })
}

fn advice(forecast: &Forecast) -> &'static str {
    if forecast.is_mostly_events() {
        "--persistence 5% takes noise out, --range takes a part"
    } else {
        "--error 0.2 makes larger triangles, --range takes a part"
    }
}

/// Rounds to two significant digits, the precision of a forecast.
fn rounded(x: f64) -> String {
    let unit = 10f64.powf((x.max(1.0).log10().floor() - 1.0).max(0.0));
    format!("{}", (x / unit).round() * unit)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_exceeded_limits_are_described() {
        let budget = |max_triangles, max_memory: Option<f64>| BudgetArguments {
            max_triangles,
            max_memory: max_memory.map(ByteSize::new),
        };
        let forecast = Forecast {
            events: 7,
            crossings: 1.0,
            intervals: 1,
            triangles: 22e6,
            memory: 7.77 * 1024f64.powi(3),
        };
        let all = |budget: BudgetArguments| budget.beyond(&forecast, |_| true);
        let given = |budget: BudgetArguments| budget.beyond(&forecast, |is_given| is_given);
        let triangles = "about 22000000 triangles (more than 20000000) expected for 7 events";
        assert_eq!(all(budget(None, None)).as_deref(), Some(triangles));
        assert_eq!(given(budget(None, None)), None);
        let memory = "about 7.77 GiB of memory (more than 4.00 GiB) expected for 7 events";
        assert_eq!(given(budget(None, Some(4.0 * 1024f64.powi(3)))).as_deref(), Some(memory));
        assert_eq!(all(budget(Some(1e9), Some(1e12))), None);
        let allowed = Allowed { bytes: 1e9, by: "the limit", is_strict: false };
        assert!(beyond_machine(1.5e9, allowed, 1.0).is_some_and(|text| text.contains("the limit")));
        assert_eq!(beyond_machine(1.5e9, allowed, FORECAST_ERROR), None);
    }

    #[test]
    fn forecasts_have_two_digits() {
        assert_eq!(rounded(123_456_789.0), "120000000");
        assert_eq!(rounded(7.0), "7");
    }
}
