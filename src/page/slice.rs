//! The samples of a volume as a page shows them in slices: rounded to 8 bits and compressed.
//!
//! Code 0 is the smallest sample. Samples of whole numbers with at most 256 different ones are exact; others are divided into 255 equal
//! steps. Each code is stored as its difference from the one before it modulo 256, x fastest, in a raw deflate stream: on `nucleon` and
//! `hydrogen` that is a quarter and an eighth less than codes themselves, and less than differences from planes. `page/slice.js` reads it.

use std::io::Write as _;

use flate2::Compression;
use flate2::write::DeflateEncoder;

use crate::volume::Volume;

/// The largest code.
const MAX_CODE: f64 = 255.0;

/// The samples of a volume, rounded.
pub(super) struct SliceSamples {
    /// A raw deflate stream.
    pub(super) bytes: Vec<u8>,
    low: f64,
    /// The difference between the values of two codes.
    unit: f64,
}

impl SliceSamples {
    /// Rounds and compresses the samples of a volume.
    pub(super) fn of(volume: &Volume) -> Self {
        let (low, high) = volume.range();
        let samples = volume.samples();
        let is_exact = samples.is_integer() && high - low <= MAX_CODE;
        // Halves: the difference of two finite numbers may not be finite.
        let unit = if is_exact { 1.0 } else { 2.0 * ((0.5 * high - 0.5 * low) / MAX_CODE) };
        let mut last = 0u8;
        let codes: Vec<u8> = (0..samples.len())
            .map(|i| {
                let code = ((samples.get(i) - low) / unit).round() as u8;
                let difference = code.wrapping_sub(last);
                last = code;
                difference
            })
            .collect();
        let mut encoder = DeflateEncoder::new(Vec::new(), Compression::best());
        let done = encoder.write_all(&codes);
        let bytes = done.and_then(|()| encoder.finish()).expect("writing to memory succeeds");
        SliceSamples { bytes, low, unit }
    }

    /// What the scripts need to know of them.
    pub(super) fn to_json(&self) -> serde_json::Value {
        serde_json::json!({ "low": self.low, "unit": self.unit })
    }
}

#[cfg(test)]
mod tests {
    use std::io::Read as _;

    use flate2::read::DeflateDecoder;

    use super::*;
    use crate::volume::{Placement, Samples};

    /// The values that a page shows.
    fn shown(samples: Samples) -> Vec<f64> {
        let volume = Volume::new("v", [2, 2, 2], samples, Placement::IDENTITY).expect("a volume");
        let slice = SliceSamples::of(&volume);
        let mut differences = Vec::new();
        DeflateDecoder::new(&*slice.bytes).read_to_end(&mut differences).expect("a stream");
        let mut code = 0u8;
        let value = |difference: u8| {
            code = code.wrapping_add(difference);
            slice.low + f64::from(code) * slice.unit
        };
        differences.into_iter().map(value).collect()
    }

    #[test]
    fn few_whole_numbers_are_exact_and_others_are_rounded_to_half_a_step() {
        let whole = vec![-7i16, 248, 3, 0, 100, 100, 17, -7];
        assert_eq!(
            shown(whole.clone().into()),
            whole.iter().map(|&x| f64::from(x)).collect::<Vec<_>>()
        );
        let wide = vec![0.0f32, 1e-3, 0.5, 1.0, 0.25, 0.75, 0.3, 1.0];
        for (found, wanted) in shown(wide.clone().into()).into_iter().zip(wide) {
            // And the rounding of doubles.
            assert!(
                (found - f64::from(wanted)).abs() <= 0.5 / MAX_CODE + 1e-12,
                "{found}, {wanted}"
            );
        }
    }
}
