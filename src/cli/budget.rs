//! How large a spectrum may become: a warning before the work begins, or a refusal.

use clap::Args;
use isospectrum::Forecast;
use isospectrum::settings::ByteSize;
use isospectrum::volume::Volume;
use isospectrum::{Error, Result};

use super::machine::{self, Allowed};
use super::report;

/// Triangles above which a warning is given where no flag says otherwise.
const TRIANGLES: f64 = 20e6;

/// Memory above which a warning is given where no flag says otherwise.
const MEMORY: ByteSize = ByteSize::new(16.0 * 1024.0 * 1024.0 * 1024.0);

/// By which factor a forecast may be off; what is beyond that will not fit.
const OFF_BY: f64 = 2.0;

/// The flags of the budget.
#[derive(Args, Debug)]
pub(super) struct BudgetArguments {
    /// Refuse to begin where more triangles are expected, stop where bricks have more [default: warn above 20 million]
    #[arg(long, value_name = "N", value_parser = super::compute::positive, allow_negative_numbers = true)]
    max_triangles: Option<f64>,
    /// Work within this memory, e.g. 8GB: in bricks where more is expected of the whole; refuse where those do not help
    /// [default: what the system leaves]
    #[arg(long, value_name = "SIZE")]
    max_memory: Option<ByteSize>,
}

/// How much memory there is, and who says so.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Limit {
    pub(super) bytes: f64,
    by: &'static str,
}

impl Limit {
    /// What to say of memory that is expected and is more.
    pub(super) fn beyond(self, expected: f64) -> Option<String> {
        (expected > self.bytes).then(|| {
            let [expected, left] = [expected, self.bytes].map(|x| report::bytes(x as u64));
            format!("about {expected} of memory expected as a whole, {} leaves {left}", self.by)
        })
    }
}

impl BudgetArguments {
    /// The memory that may be used: what was asked for, or what the system leaves; none where that cannot be known.
    pub(super) fn limit(&self) -> Option<Limit> {
        match self.max_memory {
            Some(size) => Some(Limit { bytes: size.bytes(), by: "--max-memory" }),
            None => machine::allowed().map(|Allowed { bytes, by }| Limit { bytes, by }),
        }
    }

    /// Most triangles, where it was said.
    pub(super) fn max_triangles(&self) -> Option<f64> {
        self.max_triangles
    }

    /// Refuses a volume that does not fit as it is, before it is looked at further.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`] where no memory was given and it is beyond what there is.
    pub(super) fn check_least(&self, volume: &Volume) -> Result<()> {
        // A memory that was given is what the user knows of the machine.
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

    /// Warns where a volume as a whole is beyond the budget, or beyond what the machine has.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`] where it is beyond a budget that was given as a flag, or where no memory was
    /// given and it is clearly beyond what there is.
    pub(super) fn check(&self, name: &str, forecast: &Forecast) -> Result<()> {
        // A memory that was given is what the user knows of the machine.
        let allowed = machine::allowed().filter(|_| self.max_memory.is_none());
        let advice = advice(forecast);
        let refused = allowed.and_then(|allowed| beyond_machine(forecast.memory, allowed, OFF_BY));
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

    /// What of a forecast is beyond the limits that count, by whether they are given as flags.
    fn beyond(&self, forecast: &Forecast, counts: impl Fn(bool) -> bool) -> Option<String> {
        let mut parts = Vec::new();
        let most = self.max_triangles.unwrap_or(TRIANGLES);
        if forecast.triangles > most && counts(self.max_triangles.is_some()) {
            let [expected, most] = [forecast.triangles, most].map(rounded);
            parts.push(format!("about {expected} triangles (more than {most})"));
        }
        let most = self.max_memory.unwrap_or(MEMORY).bytes();
        if forecast.memory > most && counts(self.max_memory.is_some()) {
            let [expected, most] = [forecast.memory, most].map(|x| report::bytes(x as u64));
            parts.push(format!("about {expected} of memory (more than {most})"));
        }
        let events = forecast.events;
        (!parts.is_empty()).then(|| format!("{} expected for {events} events", parts.join(" and ")))
    }
}

/// What to say of memory that is more than `times` what the machine allows.
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

/// Two significant digits: more would claim what nobody knows.
fn rounded(x: f64) -> String {
    let unit = 10f64.powf((x.max(1.0).log10().floor() - 1.0).max(0.0));
    format!("{}", (x / unit).round() * unit)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_is_too_much_is_told() {
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
        let allowed = Allowed { bytes: 1e9, by: "the limit" };
        assert!(beyond_machine(1.5e9, allowed, 1.0).is_some_and(|said| said.contains("the limit")));
        assert_eq!(beyond_machine(1.5e9, allowed, OFF_BY), None);
    }

    #[test]
    fn two_digits_are_told() {
        assert_eq!(rounded(123_456_789.0), "120000000");
        assert_eq!(rounded(7.0), "7");
    }
}
