//! Every reader of volumes on files that are damaged: bytes of the small files of `tests/oracle` changed, and their prefixes; all of
//! them in the long test, a seventh otherwise. They are refused with one line or read; no panic, and memory in proportion to the file.

use std::fs::OpenOptions;
use std::io::{Seek as _, SeekFrom, Write as _};
use std::path::{Path, PathBuf};

use isospectrum::Error;
use isospectrum::volume::{ReadOptions, SliceAxis, is_volume_name, read_volume};

use crate::{peak, turn};

/// Maximum memory of a reader, bytes. The files have at most 4 KiB and unpack to up to a thousand times that.
const MAX_MEMORY: usize = 8 << 20;

/// Options for files with several arrays, frames or channels; the first that read an undamaged file are its own.
fn all_options() -> [ReadOptions; 6] {
    [
        ReadOptions::default(),
        ReadOptions { frame: Some(1), ..ReadOptions::default() },
        ReadOptions { channel: Some(1), ..ReadOptions::default() },
        ReadOptions { channel: Some(1), frame: Some(1), ..ReadOptions::default() },
        ReadOptions { array: Some("density".into()), ..ReadOptions::default() },
        ReadOptions { slices: Some(SliceAxis::Channels), ..ReadOptions::default() },
    ]
}

/// Reads a file with each of some options. Returns whether one of them succeeds.
fn read(path: &Path, options: &[ReadOptions], what: &dyn Fn() -> String) -> bool {
    let attempt = |options: &ReadOptions| match read_volume(path, options) {
        Ok(volume) => {
            let [x, y, z] = volume.dims();
            assert_eq!(volume.samples().len(), x * y * z, "{}", what());
            true
        }
        Err(error @ (Error::Input(_) | Error::Io { .. } | Error::Usage(_))) => {
            let line = error.to_string();
            assert!(!line.contains('\n') && line.len() < 600, "{}: {line}", what());
            false
        }
        Err(error) => panic!("{}: {error:?}", what()),
    };
    let (read, peak) = peak(|| options.iter().any(attempt));
    assert!(peak < MAX_MEMORY, "{}: {peak} bytes of memory", what());
    read
}

/// One file of each series of DICOM files.
fn series() -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/oracle");
    let entries = std::fs::read_dir(folder).expect("checked in");
    let folders = entries.map(|entry| entry.expect("readable").path());
    let folders =
        folders.filter(|path| path.is_dir() && path.to_string_lossy().contains("oracle/dicom_"));
    let first = |folder: PathBuf| {
        let files = std::fs::read_dir(folder).expect("readable");
        files.map(|entry| entry.expect("readable").path()).min().expect("slices")
    };
    let files: Vec<PathBuf> = folders.map(first).collect();
    assert!(files.len() >= 8, "{} series", files.len());
    files
}

fn files() -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/oracle");
    let entries = std::fs::read_dir(folder).expect("checked in");
    let mut files: Vec<PathBuf> = entries.map(|entry| entry.expect("readable").path()).collect();
    files.retain(|path| path.is_file() && is_volume_name(path));
    files.retain(|path| path.extension().is_some_and(|e| e != "raw"));
    files.extend(series());
    files.sort();
    files
}

/// A temporary folder, in memory where that is possible: files are written half a million times.
fn in_memory() -> tempfile::TempDir {
    tempfile::tempdir_in("/dev/shm").or_else(|_| tempfile::tempdir()).expect("a folder")
}

#[test]
fn damaged_volumes_are_refused_with_a_line_or_read() {
    check_damaged_volumes(7);
}

mod long {
    #[test]
    #[ignore = "long: run by scripts/test --long"]
    fn volumes_damaged_at_any_byte_are_refused_with_a_line_or_read() {
        super::check_damaged_volumes(1);
    }
}

/// Reads each file with one byte changed, and cut at a byte: at every `stride`-th byte.
fn check_damaged_volumes(stride: usize) {
    let _turn = turn();
    let files = files();
    assert!(files.len() >= 40, "{} files", files.len());
    for file in &files {
        // Each in a folder of its own: a series takes all files of a folder.
        let folder = in_memory();
        let bytes = std::fs::read(file).expect("checked in");
        assert!(bytes.len() <= 4096, "{}: {} bytes", file.display(), bytes.len());
        // Sample files of a header are copied unchanged.
        for other in isospectrum::volume::files_of(file).into_iter().skip(1) {
            let name = other.file_name().expect("a name");
            std::fs::copy(&other, folder.path().join(name)).expect("room");
        }
        let name = file.file_name().expect("a name");
        let path = folder.path().join(name);
        let shown = name.to_string_lossy().into_owned();
        std::fs::write(&path, &bytes).expect("room");
        // Damaged files are read with the default options and with those that the file needs.
        let mut options = all_options().to_vec();
        let own =
            options.iter().position(|o| read(&path, std::slice::from_ref(o), &|| shown.clone()));
        let own = own.unwrap_or_else(|| panic!("{shown} as it is"));
        options.swap(1, own.max(1));
        options.truncate(if own == 0 { 1 } else { 2 });
        let mut open = OpenOptions::new().write(true).open(&path).expect("writable");
        let mut put = |at: usize, byte: u8| {
            open.seek(SeekFrom::Start(at as u64)).expect("a place");
            open.write_all(&[byte]).expect("room");
        };
        for (at, &kept) in bytes.iter().enumerate().step_by(stride) {
            for byte in [b'9', kept ^ 1, 0xff] {
                put(at, byte);
                read(&path, &options, &|| format!("byte {at} of {shown} as {byte}"));
            }
            put(at, kept);
        }
        // Bytes that may be missing: tags and checksums behind the samples, and a part of the last number of a text.
        let has_end = ["nii", "mrc", "map"].iter().any(|e| shown.ends_with(e));
        // A file without a later frame or array can still have an earlier one.
        let is_series =
            ["series", "stack", "vti_raw", "appended", "vtk_", "ome", "imagej.tif", "planar"]
                .iter()
                .any(|what| shown.contains(what));
        let n_spare = if is_series {
            bytes.len()
        } else if has_end {
            0
        } else {
            64
        };
        for at in (0..bytes.len()).rev().step_by(stride) {
            open.set_len(at as u64).expect("shorter");
            let is_read = read(&path, &options, &|| format!("{at} bytes of {shown}"));
            assert!(!is_read || at + n_spare > bytes.len(), "{at} bytes of {shown} are read");
        }
    }
}
