//! One function per reader for the fuzz targets, with limits of memory and time.
//!
//! A reader may return an error of one line, or a value that satisfies the invariants of its type. A panic, or more memory or time
//! than the length of the file justifies, is a fault.

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

/// Memory that any reader may use, bytes.
const BASE_BYTES: usize = 4 << 20;

/// Additional memory per byte of a file: an event of a spectrum, compressed as far as the format allows, takes 580.
const BYTES_PER_BYTE: usize = 600;

/// Time that any reader may take; generous, because machines are shared.
const BASE_TIME: Duration = Duration::from_secs(5);

/// Additional time per kilobyte of a file.
const TIME_PER_KB: Duration = Duration::from_millis(100);

/// Runs a reader on a file of `n` bytes.
fn within_limits(n: usize, read: impl FnOnce()) {
    let before = BYTES.current_usage();
    BYTES.reset_peak_usage();
    let start = Instant::now();
    read();
    let (elapsed, peak) = (start.elapsed(), BYTES.peak_usage().saturating_sub(before));
    assert!(peak <= BASE_BYTES + BYTES_PER_BYTE * n, "{peak} bytes for a file of {n}");
    let limit = BASE_TIME + TIME_PER_KB * (n / 1024) as u32;
    assert!(elapsed <= limit, "{elapsed:?} for a file of {n} bytes");
}

/// The value that was read; `None` for an error, whose message must be one line.
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

/// A spectrum file. The first byte selects how the rest becomes one.
pub fn spectrum(input: &[u8]) {
    let Some((&kind, rest)) = input.split_first() else { return };
    let file = if kind & 1 == 0 { from_contents(rest) } else { repaired(rest.to_vec()) };
    within_limits(file.len(), || {
        let summary = Summary::from_reader(&mut Cursor::new(&file), file.len() as u64);
        let summary = read_or_one_line(summary);
        if let Some(spectrum) = read_or_one_line(from_bytes(&file)) {
            let summary = summary.expect("a file that can be read has a summary");
            assert_eq!((summary.size, summary.spectrum.about()), (Size::of(&spectrum), spectrum.about()));
            check_sound(&spectrum);
            let again = to_bytes(&spectrum).expect("a spectrum that was read can be written");
            let read = from_bytes(&again).expect("a file that was written can be read");
            assert_eq!(to_bytes(&read).expect("written again"), again);
        }
    });
}

/// Takes a number of 16 bits off the input; 0 at its end.
fn number(rest: &mut &[u8]) -> usize {
    let Some((n, after)) = rest.split_first_chunk() else { return 0 };
    *rest = after;
    usize::from(u16::from_le_bytes(*n))
}

/// Takes a section off the input: its length, for coded columns how many numbers they have, and the bytes.
fn take_section(file: &mut Vec<u8>, rest: &mut &[u8], tag: &[u8; 4]) {
    let n = number(rest);
    let n_numbers = matches!(tag, b"VERT" | b"TRIA" | b"POSN").then(|| number(rest));
    let (content, after) = rest.split_at(n.min(rest.len()));
    *rest = after;
    match n_numbers {
        Some(n_numbers) => section(file, tag, 2, content, n_numbers),
        None => section(file, tag, 0, content, content.len()),
    }
}

/// A file of chunks and tables with these contents. A chunk is described by its pivot, vertices, knots, triangles and, if there are several trees, repeated
/// vertices. There are one or three chunks in one tree, or two trees of one chunk.
fn from_contents(mut rest: &[u8]) -> Vec<u8> {
    let mut file = isospectrum::file::MAGIC.to_vec();
    file.extend(isospectrum::file::VERSION.to_le_bytes());
    file.extend(crc32fast::hash(&file).to_le_bytes());
    let n_chunks = [1, 3, 2][number(&mut rest) % 3];
    let (n_counts, tags): (usize, &[&[u8; 4]]) =
        if n_chunks == 2 { (5, &[b"VERT", b"TRIA", b"POSN", b"SEAM"]) } else { (4, &[b"VERT", b"TRIA", b"POSN"]) };
    // Pivots, vertices, knots, triangles, repeated vertices; bytes and checksums.
    let mut counts = [const { Vec::new() }; 5];
    let mut places = [const { Vec::new() }; 2];
    for _ in 0..n_chunks {
        let start = file.len();
        counts[..n_counts].iter_mut().for_each(|column| column.push(number(&mut rest) as u64));
        for tag in tags {
            take_section(&mut file, &mut rest, tag);
        }
        places[0].push((file.len() - start) as u64);
        places[1].push(crc32fast::hash(&file[start..]).into());
    }
    let tables = file.len();
    for tag in [b"INFO", b"EVNT", b"ISOV", b"COLL"] {
        take_section(&mut file, &mut rest, tag);
    }
    let mut content = (n_chunks as u64).to_le_bytes().to_vec();
    let (of_all, repeated) = counts.split_at(4);
    for column in of_all.iter().chain(&places).chain(&repeated[..n_counts - 4]) {
        content.push(8);
        content.extend((0..8).flat_map(|plane| column.iter().map(move |x| (x >> (8 * plane)) as u8).collect::<Vec<u8>>()));
    }
    section(&mut file, b"INDX", 0, &content, content.len());
    footer(&mut file, tables);
    file
}

/// The end of a file whose tables begin at a position.
fn footer(file: &mut Vec<u8>, tables: usize) {
    let position = (tables as u64).to_le_bytes();
    file.extend(position);
    file.extend(crc32fast::hash(&position).to_le_bytes());
    file.extend(b"ISPE");
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

/// A file with all checksums that can be found repaired, but those of chunks in a deflated index.
fn repaired(mut file: Vec<u8>) -> Vec<u8> {
    if file.len() >= 16 {
        let crc = crc32fast::hash(&file[..12]);
        file[12..16].copy_from_slice(&crc.to_le_bytes());
    }
    let end = file.len().saturating_sub(16);
    let (mut at, mut tables) = (16, None);
    while at + 28 <= end {
        let length = u64::from_le_bytes(file[at + 8..at + 16].try_into().expect("eight bytes"));
        let left = end - at - 28;
        let length = usize::try_from(length).map_or(left, |n| n.min(left));
        if &file[at..at + 4] == b"INFO" {
            tables = Some(at);
        }
        if let (b"INDX", Some(tables)) = (&file[at..at + 4], tables) {
            // Of one chunk: the last column is the checksum.
            let crc = crc32fast::hash(&file[16..tables]).to_le_bytes();
            if length > 4 {
                file[at + 28 + length - 4..at + 28 + length].copy_from_slice(&crc);
            }
        }
        let mut crc = crc32fast::Hasher::new();
        crc.update(&file[at..at + 24]);
        crc.update(&file[at + 28..at + 28 + length]);
        let crc = crc.finalize();
        file[at + 24..at + 28].copy_from_slice(&crc.to_le_bytes());
        at += 28 + length;
    }
    if let Some(tables) = tables {
        file.truncate(end);
        footer(&mut file, tables);
    }
    file
}

/// A file in the layout of the thesis.
pub fn thesis_layout(input: &[u8]) {
    within_limits(input.len(), || {
        if let Some(spectrum) = read_or_one_line(thesis::from_bytes(input)) {
            check_sound(&spectrum);
            let again = thesis::to_bytes(&spectrum).expect("a spectrum that was read can be written");
            thesis::from_bytes(&again).expect("a file that was written can be read");
        }
    });
}

/// Checks that a spectrum passes its own check and has finite meshes with valid indices.
fn check_sound(spectrum: &Spectrum) {
    spectrum.check().expect("a spectrum that was read passes the check");
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

/// A volume in another format, selected by the first byte.
pub fn volumes(input: &[u8]) {
    const ENDINGS: [&str; 13] = [
        "nii", "nii.gz", "mha", "vti", "vtk", "mrc", "map.gz", "cube", "tif", "dcm", "npz", "dx", "cube.gz",
    ];
    let Some((&kind, rest)) = input.split_first() else { return };
    volume(&format!("fuzz.{}", ENDINGS[usize::from(kind) % ENDINGS.len()]), rest);
}

/// A RAW file; its name, up to the first line end, describes its layout.
pub fn raw_name(input: &[u8]) {
    let end = input.iter().position(|&b| b == b'\n').unwrap_or(input.len());
    let (name, samples) = input.split_at(end);
    // A valid file name.
    let name: String = String::from_utf8_lossy(name).replace(['/', '\0'], "_");
    let short: String = name.chars().take(60).collect();
    volume(&format!("{short}.raw"), samples.get(1..).unwrap_or_default());
}

/// Writes a file and reads it as a volume.
fn volume(name: &str, bytes: &[u8]) {
    // One folder for all inputs, because creating one takes longer than most readers. The caller sets TMPDIR and removes it.
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
