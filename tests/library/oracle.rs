//! Volumes of other programs: the same samples and the same world positions of the eight corners as those programs read. `tests/oracle/make.py` wrote the files and `values.json`, and `real.json` from real volumes, which are
//! not in the repository.

mod filters;

use std::path::{Path, PathBuf};

use isospectrum::volume::{ReadOptions, Space, Unit, Volume, read_volume};
use serde::Deserialize;

/// A volume as another program read it.
#[derive(Deserialize)]
struct Expected {
    file: String,
    oracle: String,
    options: Options,
    dims: [usize; 3],
    /// Of all samples as little-endian float64, x fastest.
    crc32: u32,
    first: Vec<f64>,
    /// x fastest.
    corners: [[f64; 3]; 8],
    space: Space,
    unit: Unit,
}

#[derive(Deserialize)]
struct Options {
    frame: Option<usize>,
    channel: Option<usize>,
    array: Option<String>,
    series: Option<String>,
}

/// Maximum distance of corners, relative to the diagonal and the distance from the origin: oracles hold matrices and origins in
/// float32 or compute in another order.
const ROUNDING: f64 = 3e-7;

fn expected(name: &str) -> Vec<Expected> {
    let path = here().join(name);
    let text = std::fs::read_to_string(&path).expect("checked in");
    serde_json::from_str(&text).expect("JSON")
}

pub(crate) fn here() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/oracle")
}

fn read(folder: &Path, expected: &Expected) -> Result<Volume, String> {
    let Options { frame, channel, array, series } = &expected.options;
    let options = ReadOptions {
        frame: *frame,
        channel: *channel,
        array: array.clone(),
        series: series.clone(),
        ..ReadOptions::default()
    };
    read_volume(&folder.join(&expected.file), &options).map_err(|e| e.to_string())
}

/// The first difference between a volume and the expected one.
fn difference(volume: &Volume, expected: &Expected) -> Option<String> {
    if volume.dims() != expected.dims {
        return Some(format!("dimensions {:?}, expected {:?}", volume.dims(), expected.dims));
    }
    let samples = volume.samples();
    let mut crc = crc32fast::Hasher::new();
    (0..samples.len()).for_each(|i| crc.update(&samples.get(i).to_le_bytes()));
    if crc.finalize() != expected.crc32 {
        let first: Vec<f64> = (0..4).map(|i| samples.get(i)).collect();
        return Some(format!("samples {first:?} ..., expected {:?} ...", expected.first));
    }
    let placement = volume.placement();
    if (placement.space, placement.unit) != (expected.space, expected.unit) {
        return Some(format!("{:?}, {:?}", placement.space, placement.unit));
    }
    let distance =
        |a: [f64; 3], b: [f64; 3]| (0..3).map(|i| (a[i] - b[i]).powi(2)).sum::<f64>().sqrt();
    let [first, .., last] = expected.corners;
    let size = distance(first, last) + distance(first, [0.0; 3]);
    for (found, wanted) in volume.corners().into_iter().zip(expected.corners) {
        if distance(found, wanted) > ROUNDING * size {
            return Some(format!("a corner at {found:?}, expected {wanted:?}"));
        }
    }
    None
}

/// Compares all files of a folder. Returns their number.
fn compare(folder: &Path, all: &[Expected]) -> usize {
    let mut wrong = Vec::new();
    for expected in all {
        let found = match read(folder, expected) {
            Ok(volume) => difference(&volume, expected),
            Err(message) => Some(message),
        };
        if let Some(found) = found {
            wrong.push(format!("{} ({}): {found}", expected.file, expected.oracle));
        }
    }
    assert!(wrong.is_empty(), "{} of {}:\n{}", wrong.len(), all.len(), wrong.join("\n"));
    all.len()
}

#[test]
fn files_of_other_programs_have_the_samples_and_the_corners_that_these_programs_read() {
    let n = compare(&here(), &expected("values.json"));
    assert!(n >= 81, "{n} files");
}

#[test]
fn lossy_jpeg_is_unpacked_to_within_a_grey_level() {
    let text = std::fs::read_to_string(here().join("lossy.json")).expect("checked in");
    let expected: Vec<f64> = serde_json::from_str(&text).expect("JSON");
    let volume = read_volume(&here().join("dicom_lossy"), &ReadOptions::default()).expect("read");
    assert_eq!(volume.samples().len(), expected.len());
    // The rounding that decoders are allowed (ITU-T T.83).
    for (i, wanted) in expected.into_iter().enumerate() {
        let found = volume.samples().get(i);
        assert!((found - wanted).abs() <= 1.0, "sample {i} is {found}, expected {wanted}");
    }
}

mod real_volumes {
    use super::*;
    use crate::common::data;

    #[test]
    #[ignore = "needs $ISOSPECTRUM_DATA: run by scripts/test"]
    fn real_volumes_have_the_samples_and_the_corners_that_other_programs_read() {
        let folder = data::folder();
        assert_eq!(compare(&folder, &expected("real.json")), 8);
    }
}
