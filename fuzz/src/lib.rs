//! What the fuzz targets share: one function per reader, within limits of memory and time.
//!
//! A reader may refuse a file with an error of one line, or read it; what it reads must hold what its type promises. A
//! panic, more memory than the file's length has earned, or more time is a fault.

use std::io::Cursor;
use std::path::Path;
use std::sync::OnceLock;
use std::time::{Duration, Instant};

use isospectrum::Error;
use isospectrum::export::parse_ply;
use isospectrum::file::{Summary, from_bytes, thesis, to_bytes};
use isospectrum::spectrum::{Size, Spectrum};
use isospectrum::volume::{ReadOptions, read_volume};
use peak_alloc::PeakAlloc;
use tempfile::TempDir;

#[global_allocator]
static BYTES: PeakAlloc = PeakAlloc;

/// What any reader may take of memory.
const FREE_BYTES: usize = 4 << 20;

/// The most per byte of a file: an event of a spectrum, deflated as far as the format lets it, takes 580.
const BYTES_PER_BYTE: usize = 600;

/// What any reader may take of time, generous as machines are shared; and per kilobyte.
const FREE_TIME: Duration = Duration::from_secs(5);
const TIME_PER_KB: Duration = Duration::from_millis(100);

/// Runs a reader on a file of `n` bytes.
fn within_limits(n: usize, read: impl FnOnce()) {
    let before = BYTES.current_usage();
    BYTES.reset_peak_usage();
    let start = Instant::now();
    read();
    let (took, peak) = (start.elapsed(), BYTES.peak_usage().saturating_sub(before));
    assert!(peak <= FREE_BYTES + BYTES_PER_BYTE * n, "{peak} bytes for a file of {n}");
    let most = FREE_TIME + TIME_PER_KB * (n / 1024) as u32;
    assert!(took <= most, "{took:?} for a file of {n} bytes");
}

/// An error of one line, or what was read.
fn read_or_one_line<T>(result: isospectrum::Result<T>) -> Option<T> {
    match result {
        Ok(read) => Some(read),
        Err(error @ (Error::Input(_) | Error::Io { .. } | Error::Usage(_))) => {
            let line = error.to_string();
            assert!(!line.is_empty() && !line.contains('\n'), "{line}");
            None
        }
        Err(error) => panic!("another kind of error: {error:?}"),
    }
}

/// A spectrum file: the first byte tells how the rest becomes one.
pub fn spectrum(input: &[u8]) {
    let Some((&kind, rest)) = input.split_first() else { return };
    let file = if kind & 1 == 0 { of_contents(kind, rest) } else { repaired(rest.to_vec()) };
    within_limits(file.len(), || {
        let told = Summary::from_reader(&mut Cursor::new(&file), file.len() as u64);
        let told = read_or_one_line(told);
        if let Some(spectrum) = read_or_one_line(from_bytes(&file)) {
            let told = told.expect("what can be read tells what it is");
            assert_eq!((told.size, told.told.about()), (Size::of(&spectrum), spectrum.about()));
            sound(&spectrum);
            let again = to_bytes(&spectrum).expect("what was read can be written");
            let read = from_bytes(&again).expect("what was written can be read");
            assert_eq!(to_bytes(&read).expect("written once more"), again);
        }
    });
}

/// A file whose sections have these contents, each a length (u16) and that many bytes; the last takes what is left.
fn of_contents(kind: u8, mut rest: &[u8]) -> Vec<u8> {
    let version = 1 + u32::from(kind >> 1) % 5;
    let mut file = head(version);
    let tags: [&[u8; 4]; 8] =
        [b"INFO", b"EVNT", b"ISOV", b"VERT", b"TRIA", b"POSN", b"NRML", b"COLL"];
    for tag in tags.into_iter().filter(|tag| version < 3 || *tag != b"NRML") {
        let n = rest.split_first_chunk().map_or(0, |(n, after)| {
            rest = after;
            usize::from(u16::from_le_bytes(*n))
        });
        let content;
        (content, rest) = rest.split_at(n.min(rest.len()));
        section(&mut file, tag, 0, content, content.len());
    }
    file
}

fn head(version: u32) -> Vec<u8> {
    let mut file = isospectrum::file::MAGIC.to_vec();
    file.extend(version.to_le_bytes());
    file.extend(crc32fast::hash(&file).to_le_bytes());
    file
}

fn section(file: &mut Vec<u8>, tag: &[u8; 4], method: u32, stored: &[u8], length: usize) {
    let start = file.len();
    file.extend(tag);
    file.extend(method.to_le_bytes());
    file.extend((stored.len() as u64).to_le_bytes());
    file.extend((length as u64).to_le_bytes());
    let crc = crc32fast::hash(&[&file[start..], stored].concat());
    file.extend(crc.to_le_bytes());
    file.extend(stored);
}

/// A file with every checksum put right that can be found.
fn repaired(mut file: Vec<u8>) -> Vec<u8> {
    if file.len() >= 16 {
        let crc = crc32fast::hash(&file[..12]);
        file[12..16].copy_from_slice(&crc.to_le_bytes());
    }
    let mut at = 16;
    while at + 28 <= file.len() {
        let length = u64::from_le_bytes(file[at + 8..at + 16].try_into().expect("eight bytes"));
        let left = file.len() - at - 28;
        let length = usize::try_from(length).map_or(left, |n| n.min(left));
        let mut crc = crc32fast::Hasher::new();
        crc.update(&file[at..at + 24]);
        crc.update(&file[at + 28..at + 28 + length]);
        let crc = crc.finalize();
        file[at + 24..at + 28].copy_from_slice(&crc.to_le_bytes());
        at += 28 + length;
    }
    file
}

/// A file in the layout of the thesis.
pub fn thesis_layout(input: &[u8]) {
    within_limits(input.len(), || {
        if let Some(spectrum) = read_or_one_line(thesis::from_bytes(input)) {
            sound(&spectrum);
            let again = thesis::to_bytes(&spectrum).expect("what was read can be written");
            thesis::from_bytes(&again).expect("what was written can be read");
        }
    });
}

/// A spectrum passes its check and has a mesh of finite numbers everywhere.
fn sound(spectrum: &Spectrum) {
    spectrum.check().expect("what is read passes the check");
    let (low, high) = spectrum.range();
    for isovalue in [low, 0.5 * low + 0.5 * high, high] {
        let mesh = spectrum.mesh_at(isovalue).expect("the isovalue is in the range");
        let n = mesh.positions.len();
        assert!(mesh.positions.as_flattened().iter().all(|x| x.is_finite()));
        assert!(mesh.triangles.as_flattened().iter().all(|&v| (v as usize) < n));
    }
}

/// A PLY file.
pub fn ply(input: &[u8]) {
    within_limits(input.len(), || {
        if let Some(mesh) = read_or_one_line(parse_ply(input)) {
            let n = mesh.positions.len();
            assert!(mesh.positions.as_flattened().iter().all(|x| x.is_finite()));
            assert!(mesh.triangles.as_flattened().iter().all(|&v| (v as usize) < n));
        }
    });
}

/// A NRRD file.
pub fn nrrd(input: &[u8]) {
    volume("fuzz.nrrd", input);
}

/// A NumPy file.
pub fn npy(input: &[u8]) {
    volume("fuzz.npy", input);
}

/// A volume of another program: the first byte tells of which.
pub fn volumes(input: &[u8]) {
    const ENDINGS: [&str; 11] =
        ["nii", "nii.gz", "mha", "vti", "vtk", "mrc", "map.gz", "cube", "tif", "dcm", "npz"];
    let Some((&kind, rest)) = input.split_first() else { return };
    volume(&format!("fuzz.{}", ENDINGS[usize::from(kind) % ENDINGS.len()]), rest);
}

/// A RAW file whose name, up to the first line end, tells what it is.
pub fn raw_name(input: &[u8]) {
    let end = input.iter().position(|&b| b == b'\n').unwrap_or(input.len());
    let (name, samples) = input.split_at(end);
    // What a file system takes as a name.
    let name: String = String::from_utf8_lossy(name).replace(['/', '\0'], "_");
    let short: String = name.chars().take(60).collect();
    volume(&format!("{short}.raw"), samples.get(1..).unwrap_or_default());
}

/// Writes a file and reads it as a volume.
fn volume(name: &str, bytes: &[u8]) {
    // One folder for all: making one takes longer than most readers. Who runs this sets TMPDIR and removes it.
    static FOLDER: OnceLock<TempDir> = OnceLock::new();
    let folder = FOLDER.get_or_init(|| tempfile::tempdir().expect("a temporary folder"));
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).expect("a writable temporary folder");
    within_limits(bytes.len(), || read(&path));
    std::fs::remove_file(&path).expect("the file is there");
}

fn read(path: &Path) {
    if let Some(volume) = read_or_one_line(read_volume(path, &ReadOptions::default())) {
        let [x, y, z] = volume.dims();
        assert_eq!(volume.samples().len(), x * y * z);
        let (low, high) = volume.range();
        assert!(low.is_finite() && high.is_finite() && low < high);
    }
}
