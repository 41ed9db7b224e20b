//! What a spectrum contains besides its geometry: its volume, range, tolerance, parameters and events.

use std::fmt;

use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::error::{Error, Result};
use crate::topology::Event;
use crate::volume::VolumeInfo;

/// What a spectrum contains besides its geometry.
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
    pub parameters: Metadata,
    /// Every change of topology inside the range, by isovalue.
    pub events: Vec<Event>,
}

impl About {
    /// Without events and parameters.
    pub fn new(volume: VolumeInfo, range: (f64, f64), tolerance: f64) -> About {
        About { volume, range, tolerance, parameters: Metadata::default(), events: Vec::new() }
    }
}

/// How a spectrum was computed: every flag, the backend, counts of what was repaired, what was done to the volume before.
///
/// A JSON value; programs of other versions may write other keys. Values with a type have their own readers
/// ([`Counts::of`](crate::Counts::of), [`Spectrum::statistics`](crate::Spectrum::statistics)).
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Metadata(Value);

impl Metadata {
    /// Parses a JSON text.
    ///
    /// # Errors
    ///
    /// [`Error::Input`] if it is not JSON.
    pub fn from_json(text: &str) -> Result<Metadata> {
        serde_json::from_str(text)
            .map(Metadata)
            .map_err(|e| Error::input(format!("parameters: {e}")))
    }

    pub(crate) fn from_value(value: Value) -> Metadata {
        Metadata(value)
    }

    /// The number at a JSON pointer, such as `/flags/error`.
    pub fn number(&self, pointer: &str) -> Option<f64> {
        self.0.pointer(pointer)?.as_f64()
    }

    /// The text at a JSON pointer, such as `/backend`.
    pub fn text(&self, pointer: &str) -> Option<&str> {
        self.0.pointer(pointer)?.as_str()
    }

    /// Whether there is a value at a JSON pointer.
    pub fn has(&self, pointer: &str) -> bool {
        self.0.pointer(pointer).is_some()
    }

    /// The value of a key.
    pub(crate) fn get(&self, name: &str) -> Option<&Value> {
        self.0.get(name)
    }

    /// Sets the value of a key.
    pub(crate) fn insert(&mut self, key: &str, value: Value) {
        self.0[key] = value;
    }
}

impl fmt::Display for Metadata {
    /// As JSON in one line.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_found_by_pointer_and_written_as_they_were_read() {
        let text = r#"{"backend":"cpu","flags":{"error":0.1}}"#;
        let metadata = Metadata::from_json(text).expect("JSON");
        assert_eq!(metadata.number("/flags/error"), Some(0.1));
        assert_eq!(metadata.text("/backend"), Some("cpu"));
        assert!(metadata.has("/flags") && !metadata.has("/counts"));
        assert_eq!(metadata.to_string(), text);
        assert!(Metadata::from_json("{").is_err_and(|e| matches!(e, Error::Input(_))));
    }
}
