//! Folders of DICOM files: the choice of series and slices, and the errors where slices are missing.

use std::path::{Path, PathBuf};

use isospectrum::Error;
use isospectrum::volume::{ReadOptions, files_of, read_volume};
use tempfile::TempDir;

use crate::volumes::{assert_mentions, folder, message, message_with, nrrd_header, read_ok, write};

/// A copy of a folder of `tests/oracle`.
fn copy(name: &str) -> TempDir {
    let folder = folder();
    let from = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/oracle").join(name);
    for entry in std::fs::read_dir(from).expect("checked in") {
        let path = entry.expect("readable").path();
        let to = folder.path().join(path.file_name().expect("a name"));
        std::fs::copy(path, to).expect("room");
    }
    folder
}

/// Changes a text in a file for one of the same length.
fn replace(path: &PathBuf, from: &[u8], to: &[u8]) {
    let mut bytes = std::fs::read(path).expect("readable");
    let at = bytes.windows(from.len()).position(|part| part == from).expect("it is there");
    bytes[at..at + to.len()].copy_from_slice(to);
    std::fs::write(path, bytes).expect("room");
}

#[test]
fn one_of_several_series_is_chosen_by_number_or_identifier() {
    let folder = copy("dicom_two");
    let printed = message(folder.path());
    let expected = [
        "2 series, expected one chosen by --series",
        "0 ('made by pydicom', 3 slices of 8x7, 1.2.3.4.8)",
        "1 ('made by pydicom', 4 slices of 8x7, 1.2.3.4.9)",
    ];
    assert_mentions(&printed, &expected);
    for (series, n) in [("0", 3), ("1", 4), ("1.2.3.4.8", 3), ("1.2.3.4.9", 4)] {
        let options = ReadOptions { series: Some(series.into()), ..ReadOptions::default() };
        let volume = read_volume(folder.path(), &options).expect("a series");
        assert_eq!(volume.dims(), [8, 7, n], "{series}");
    }
    let options = ReadOptions { series: Some("2".into()), ..ReadOptions::default() };
    assert_mentions(&message_with(folder.path(), &options), &["no series '2' of 2", "1.2.3.4.8"]);
    let header = nrrd_header("uchar", "encoding: raw\n");
    let other = write(&folder, "a.nrrd", &[&header[..], &[1; 24]].concat());
    let printed = read_volume(&other, &options).expect_err("no series there");
    assert!(matches!(printed, Error::Usage(_)), "{printed}");
}

#[test]
fn one_slice_selects_its_series() {
    let folder = copy("dicom_two");
    let slice = folder.path().join("two_1_8.dcm");
    assert_eq!(read_ok(&slice).dims(), [8, 7, 3]);
    assert_eq!(files_of(&slice).len(), 3);
    assert_eq!(files_of(folder.path()).len(), 1 + 7);
}

#[test]
fn slices_that_are_missing_duplicate_or_of_another_size_are_named() {
    let folder = copy("dicom_tilted");
    let (second, third) = (folder.path().join("tilted_1_2.dcm"), folder.path().join("tilted_0_2"));
    let copied = folder.path().join("again");
    std::fs::copy(&third, &copied).expect("room");
    assert_mentions(&message(folder.path()), &["again (at 11.000 mm)", "same position"]);
    std::fs::remove_file(&copied).expect("there");
    replace(&second, b"\\9", b"\\8");
    assert_mentions(&message(folder.path()), &["tilted_2_2 (at 7.000 mm)", "are 1.000 mm apart"]);
    std::fs::remove_file(&second).expect("there");
    let expected = ["tilted_2_2 (at 7.000 mm) and tilted_0_2 are 4.000 mm apart", "1 missing"];
    assert_mentions(&message(folder.path()), &expected);
    replace(&third, b"US\x02\0\x08\0", b"US\x02\0\x07\0");
    assert_mentions(&message(folder.path()), &["tilted_2_2: a slice of 8x7", "expected 7x7"]);
}

#[test]
fn unsupported_compression_is_named_with_the_way_to_decompress_it() {
    let folder = copy("dicom_tilted");
    let slice = folder.path().join("tilted_0_2");
    for (syntax, name) in [
        ("1.2.840.10008.1.2.9\0", "'1.2.840.10008.1.2.9'"),
        ("1.2.840.10008.1.2.4\0", "1.2.840.10008.1.2.4"),
    ] {
        let path = folder.path().join("compressed");
        std::fs::copy(&slice, &path).expect("room");
        replace(&path, b"1.2.840.10008.1.2.1\0", syntax.as_bytes());
        assert_mentions(&message(&path), &[name, "gdcmconv --raw", "dcm2niix"]);
    }
}
