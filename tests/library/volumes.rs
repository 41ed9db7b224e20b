//! The readers of volumes and the built-in volumes: `readers` against bytes written here,
//! `damaged` against files that must be refused, `real` against measured data, `phantoms` against
//! their formulas.

mod damaged;
mod dicom;
mod kinds;
mod phantoms;
mod readers;
mod real_volumes;
mod text_kinds;
mod tiff;

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

use flate2::Compression;
use flate2::write::GzEncoder;
use isospectrum::Error;
use isospectrum::volume::{ReadOptions, Volume, read_volume};

/// Dimensions of the small volumes of these tests: all different, to detect swapped axes.
pub(crate) const DIMS: [usize; 3] = [2, 3, 4];

/// Number of samples of a small volume.
pub(crate) const N: usize = 24;

/// A folder for one test's files.
pub(crate) fn folder() -> tempfile::TempDir {
    tempfile::tempdir().expect("a temporary folder")
}

pub(crate) fn write(folder: &tempfile::TempDir, name: &str, bytes: &[u8]) -> PathBuf {
    let path = folder.path().join(name);
    fs::write(&path, bytes).expect("a writable temporary folder");
    path
}

pub(crate) fn read(path: &Path) -> Result<Volume, Error> {
    read_volume(path, &ReadOptions::default())
}

pub(crate) fn read_ok(path: &Path) -> Volume {
    read(path).unwrap_or_else(|e| panic!("{e}"))
}

/// The message for a file that must not be read: one line, with the file's name in it.
pub(crate) fn message(path: &Path) -> String {
    message_with(path, &ReadOptions::default())
}

pub(crate) fn message_with(path: &Path, options: &ReadOptions) -> String {
    let error = read_volume(path, options).expect_err(&path.display().to_string());
    let text = error.to_string();
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    assert!(!text.contains('\n') && !text.ends_with('.'), "{text}");
    assert!(text.contains(name.as_ref()) || matches!(error, Error::Usage(_)), "{text}");
    text
}

pub(crate) fn assert_mentions(text: &str, parts: &[&str]) {
    for part in parts {
        assert!(text.contains(part), "'{part}' is missing in: {text}");
    }
}

pub(crate) fn nrrd_header(nrrd_type: &str, rest: &str) -> Vec<u8> {
    let [x, y, z] = DIMS;
    format!("NRRD0004\ntype: {nrrd_type}\ndimension: 3\nsizes: {x} {y} {z}\n{rest}\n").into_bytes()
}

pub(crate) fn npy_bytes(descr: &str, fortran_order: &str, shape: &str, data: &[u8]) -> Vec<u8> {
    let mut text =
        format!("{{'descr': '{descr}', 'fortran_order': {fortran_order}, 'shape': {shape}, }}");
    while (10 + text.len() + 1) % 64 != 0 {
        text.push(' ');
    }
    text.push('\n');
    let length = u16::try_from(text.len()).expect("a short header").to_le_bytes();
    [b"\x93NUMPY\x01\x00", &length[..], text.as_bytes(), data].concat()
}

pub(crate) fn gzipped(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::default());
    encoder.write_all(bytes).expect("memory takes all");
    encoder.finish().expect("memory takes all")
}
