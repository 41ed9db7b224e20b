//! Volumes of other programs: the same samples and the same world positions of the eight corners as those programs read. `tests/oracle/make.py` wrote the files and `values.json`, and `real.json` from real volumes, which are
//! not in the repository.

mod filters;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use isospectrum::volume::{ReadOptions, SliceAxis, Space, Unit, Volume, read_volume};
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

/// Largest difference between decoders of lossy compression, in grey levels: the rounding that they are allowed (ITU-T T.83).
const MAX_ROUNDING: f64 = 1.0;

/// As [`MAX_ROUNDING`] for colours of half the resolution: a weighted mean of two that are off by up to 1, rounded up or down.
const MAX_SUBSAMPLED_ROUNDING: f64 = 2.0;

/// As [`MAX_ROUNDING`] for colours that are converted to RGB: blue is the luminance plus 1.772 times a difference, both off by up
/// to 1, and rounded.
const MAX_CONVERTED_ROUNDING: f64 = 3.0;

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
    assert!(n >= 100, "{n} files");
}

#[test]
fn lossy_jpeg_is_unpacked_to_within_a_grey_level() {
    let text = std::fs::read_to_string(here().join("lossy.json")).expect("checked in");
    let expected: Vec<f64> = serde_json::from_str(&text).expect("JSON");
    let volume = read_volume(&here().join("dicom_lossy"), &ReadOptions::default()).expect("read");
    assert_eq!(volume.samples().len(), expected.len());
    for (i, wanted) in expected.into_iter().enumerate() {
        let found = volume.samples().get(i);
        assert!((found - wanted).abs() <= MAX_ROUNDING, "sample {i} is {found}, expected {wanted}");
    }
}

#[test]
fn colours_of_lossy_dicom_are_those_of_its_photometric_interpretation_and_values_are_clipped() {
    let text = std::fs::read_to_string(here().join("lossy_colours.json")).expect("checked in");
    let expected: BTreeMap<String, Vec<Vec<f64>>> = serde_json::from_str(&text).expect("JSON");
    assert_eq!(expected.len(), 7);
    for (name, channels) in expected {
        let most = match name.as_str() {
            "dicom_rgb_converted" => MAX_CONVERTED_ROUNDING,
            "dicom_ybr_422" | "dicom_ybr_420" => MAX_SUBSAMPLED_ROUNDING,
            _ => MAX_ROUNDING,
        };
        for (channel, slice) in channels.iter().enumerate() {
            let channel = (channels.len() > 1).then_some(channel);
            let options = ReadOptions { channel, ..ReadOptions::default() };
            let volume = read_volume(&here().join(&name), &options).expect("read");
            assert_eq!(volume.dims(), [19, 11, 2], "{name}");
            for i in 0..volume.samples().len() {
                let (found, wanted) = (volume.samples().get(i), slice[i % slice.len()]);
                let is_near = (found - wanted).abs() <= most;
                assert!(
                    is_near,
                    "{name}, channel {channel:?}: sample {i} is {found}, expected {wanted}"
                );
            }
        }
    }
}

#[test]
fn channels_of_a_tiff_are_read_as_slices_on_request() {
    let path = here().join("tiff_imagej_channels.tif");
    let message = read_volume(&path, &ReadOptions::default()).expect_err("one slice").to_string();
    assert!(message.contains("--slices channels"), "{message}");
    let options = |slices| ReadOptions { slices: Some(slices), ..ReadOptions::default() };
    let volume = read_volume(&path, &options(SliceAxis::Channels)).expect("slices");
    let pages = read_volume(&here().join("tiff_pages.tif"), &ReadOptions::default());
    assert_eq!(volume.samples(), pages.expect("slices").samples());
    let message = read_volume(&path, &options(SliceAxis::Frames)).expect_err("one frame");
    assert!(message.to_string().contains("--channel 0 to 2"), "{message}");
    let message = read_volume(&here().join("tiff_pages.tif"), &options(SliceAxis::Frames));
    assert!(message.expect_err("three slices").to_string().contains("3 slices"));
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
