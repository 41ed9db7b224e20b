//! What a spectrum tells besides its triangles.

use std::fmt;

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::{Event, VolumeInfo};
use crate::error::{Error, Result};

/// What a spectrum tells besides its triangles.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct About {
    /// Where it comes from.
    pub volume: VolumeInfo,
    /// Lowest and highest isovalue.
    pub range: (f64, f64),
    /// Tolerance in voxels the mesh was computed for.
    pub tolerance: f64,
    /// How it was computed.
    pub parameters: Told,
    /// Every change of topology inside the range, by isovalue.
    pub events: Vec<Event>,
}

impl About {
    /// Of a spectrum without events that does not tell how it was computed.
    pub fn new(volume: VolumeInfo, range: (f64, f64), tolerance: f64) -> About {
        About { volume, range, tolerance, parameters: Told::default(), events: Vec::new() }
    }
}

/// How a spectrum was computed: every flag, the backend, counts of what was repaired, what was done to the volume before.
///
/// A tree of JSON, of which versions may tell more or less; what has a type is asked for by it
/// ([`Counts::of`](crate::Counts::of), [`Spectrum::statistics`](super::Spectrum::statistics)).
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Told(Value);

impl Told {
    /// What a text in JSON tells.
    ///
    /// # Errors
    ///
    /// [`Error::Input`] if it is not JSON.
    pub fn of_json(text: &str) -> Result<Told> {
        serde_json::from_str(text).map(Told).map_err(|e| Error::input(format!("parameters: {e}")))
    }

    pub(crate) fn of_value(value: Value) -> Told {
        Told(value)
    }

    /// The number at a JSON pointer, such as `/flags/error`.
    pub fn number(&self, pointer: &str) -> Option<f64> {
        self.0.pointer(pointer)?.as_f64()
    }

    /// The text at a JSON pointer, such as `/backend`.
    pub fn text(&self, pointer: &str) -> Option<&str> {
        self.0.pointer(pointer)?.as_str()
    }

    /// Whether something is told at a JSON pointer.
    pub fn has(&self, pointer: &str) -> bool {
        self.0.pointer(pointer).is_some()
    }

    /// What is told under a name.
    pub(crate) fn get(&self, name: &str) -> Option<&Value> {
        self.0.get(name)
    }

    /// Tells something under a name.
    pub(crate) fn tell(&mut self, name: &str, what: Value) {
        self.0[name] = what;
    }
}

impl fmt::Display for Told {
    /// As JSON in one line.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_told_is_found_by_its_place_and_written_as_it_was_read() {
        let text = r#"{"backend":"cpu","flags":{"error":0.1}}"#;
        let told = Told::of_json(text).expect("JSON");
        assert_eq!(told.number("/flags/error"), Some(0.1));
        assert_eq!(told.text("/backend"), Some("cpu"));
        assert!(told.has("/flags") && !told.has("/counts"));
        assert_eq!(told.to_string(), text);
        assert!(Told::of_json("{").is_err_and(|e| e.exit_code() == 3));
    }
}
