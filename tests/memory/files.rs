//! Files with large declared sizes.

use std::io::Write as _;
use std::path::Path;

use crate::common::crafted::{
    Coded, Content, Crafted, isovalues, positions, triangle_again_and_again, walk,
};
use crate::{peak, turn};
use flate2::Compression;
use flate2::write::GzEncoder;
use isospectrum::export::parse_ply;
use isospectrum::file::{from_bytes, thesis, to_bytes};
use isospectrum::volume::{ReadOptions, read_volume};

/// Memory that any reader may use, bytes: buffers, the state of an inflater, messages.
const FREE: usize = 1 << 18;

/// Maximum bytes per byte of a spectrum file that is refused for its declared sizes before its numbers are read. Stored bytes
/// may unpack to 64 times their length; nothing else may be allocated.
const REFUSED: usize = 66;

/// Maximum bytes per byte of a spectrum file that is read. A byte unpacks to 64. Events take the most memory per byte: five bytes
/// unpacked (64 / 5 to a byte), 40 in memory, in addition to the unpacked bytes.
const READ: usize = 64 + 64 * 40 / 5 + 4;

/// Maximum bytes per byte of JSON: an object of one key takes 5 bytes and a node of a tree of 640.
const JSON: usize = 160;

/// Maximum bytes per byte of a volume or mesh in its own types: a vector with twice the needed capacity, while it is moved.
const PLAIN: usize = 4;

#[track_caller]
fn assert_within(what: &str, peak: usize, length: usize, factor: usize) {
    println!(
        "{what}: {peak} bytes at most for a file of {length}, {:.1} per byte",
        peak as f64 / length as f64
    );
    assert!(peak <= FREE + factor * length, "{what}: {peak} bytes for a file of {length}");
}

/// Asserts that a crafted spectrum is refused with these words, with at most `factor` bytes per byte.
#[track_caller]
fn refused(what: &str, file: &Crafted, words: &str, factor: usize) {
    let bytes = file.file();
    let (result, peak) = peak(|| from_bytes(&bytes).err().map(|error| error.to_string()));
    let message = result.unwrap_or_else(|| panic!("{what}: was read"));
    assert!(message.contains(words), "{what}: {message}");
    assert_within(what, peak, bytes.len(), factor);
}

/// Asserts that a crafted spectrum is read, with at most `factor` bytes per byte.
#[track_caller]
fn accepted(what: &str, file: &Crafted, factor: usize) {
    let bytes = file.file();
    let (result, peak) = peak(|| from_bytes(&bytes).map(|spectrum| spectrum.knots().len()));
    result.unwrap_or_else(|error| panic!("{what}: {error}"));
    assert_within(what, peak, bytes.len(), factor);
}

/// So many vertices, each with so many knots at the first ranks; `TRIA` holds one column of `room` codes and no triangle.
fn vertices(n: usize, n_knots: u64, room: usize) -> Crafted {
    let mut file = Crafted::empty();
    file.isovalues = isovalues(n_knots as usize);
    let n_moving = if n_knots > 0 { n } else { 0 };
    let n_further = n * n_knots.saturating_sub(1) as usize;
    let further = vec![0; n_further];
    file.ranks = Coded::new()
        .count(n)
        .constant(n_knots, n)
        .constant(0, if n_knots == 2 { n } else { 0 })
        .constant(0, n_moving)
        .intervals([].into_iter())
        .intervals(further.into_iter());
    let births = vec![0; n_knots as usize];
    file.triangles =
        walk(births.into_iter(), room, [].into_iter()).empty(1).intervals([].into_iter());
    file.positions = positions(n_moving, n_further);
    file.size = [n, n * n_knots as usize, 0];
    file
}

#[test]
fn unused_vertices_are_refused_before_they_take_memory() {
    let _turn = turn();
    let n = 500_000;
    refused("vertices without room", &vertices(n, 0, 0), "have room for", 1);
    for n_knots in [0, 1] {
        let file = vertices(n, n_knots, n);
        refused("vertices without knots to live", &file, "without a triangle", REFUSED);
    }
    // Vertices that could live are described by enough bytes.
    accepted("vertices without triangles", &vertices(n / 4, 2, 0), READ);
    accepted("some vertices of no use", &vertices(4000, 2, 0), READ);
}

#[test]
fn a_description_that_is_large_or_deflated_is_refused() {
    let _turn = turn();
    let with = |parameters: &str| {
        let mut file = Crafted::empty();
        let text = String::from_utf8(file.info).expect("JSON is text");
        file.info = text
            .replace("\"parameters\":null", &format!("\"parameters\":{parameters}"))
            .into_bytes();
        assert!(file.info.len() >= parameters.len());
        file
    };
    let zeros = |n: usize| format!("[{}0]", "0,".repeat(n));
    let mut packed = with(&zeros(600_000));
    packed.pack_info = true;
    refused("deflated JSON", &packed, "section INFO", 1);
    refused("large JSON", &with(&zeros(600_000)), "section INFO", 1);
    accepted("numbers", &with(&zeros(500_000)), JSON);
    let objects = format!("[{}0]", "{\"\":0},".repeat(140_000));
    accepted("objects", &with(&objects), JSON);
}

#[test]
fn valid_files_take_memory_by_their_length() {
    let _turn = turn();
    accepted("one triangle again and again", &triangle_again_and_again(8_000, 8_000), READ);
    let n_triangles = 300_000;
    let many = triangle_again_and_again(n_triangles, 4);
    accepted("more triangles", &many, READ);
    // With every other triangle reversed, each fills the gates of the one before, so that the writer needs no search.
    let spectrum = from_bytes(&many.file()).expect("it was read before");
    let spectrum = spectrum.changed(|_, patch| {
        patch.triangles.iter_mut().skip(1).step_by(2).for_each(|t| t.vertices.swap(0, 1));
    });
    let spectrum = spectrum.expect("valid");
    let written = to_bytes(&spectrum).expect("what was read can be written");
    let (n, most) = peak(|| from_bytes(&written).expect("and read").triangles().len());
    assert_eq!(n, n_triangles);
    assert_within("coded columns without information", most, written.len(), READ);
    accepted("more knots", &triangle_again_and_again(4, 100_000), READ);
    let mut events = Crafted::empty();
    let n = 200_000;
    events.events = (0..6).fold(Content::default().count(n), |c, _| c.constant(0, n));
    accepted("events", &events, READ);
    let mut collapses = triangle_again_and_again(1, 4);
    // From vertex 0 onto vertex 1, at rank 0; the first step stands for all.
    collapses.collapses =
        [0, 2, 0, 0].into_iter().fold(Content::default().count(n), |c, x| c.constant(x, n));
    accepted("collapses", &collapses, READ);
}

#[test]
fn the_layout_of_the_thesis_and_ply_take_memory_by_their_length() {
    let _turn = turn();
    let n = 200_000u32;
    let mut bytes = n.to_le_bytes().to_vec();
    bytes.extend(vec![0; 4 * n as usize + 8]);
    let (result, most) = peak(|| thesis::from_bytes(&bytes).map(|spectrum| spectrum.n_vertices()));
    assert_eq!(result.expect("vertices without knots are allowed"), n as usize);
    // A vector of 24 bytes for each vertex's knots, while it grows, in place of four bytes.
    assert_within("thesis", most, bytes.len(), 24);
    for count in [u32::MAX, n] {
        let claim = [&count.to_le_bytes()[..], &[255; 1000]].concat();
        let (result, most) = peak(|| thesis::from_bytes(&claim).is_err());
        assert!(result);
        assert_within("thesis with claims", most, claim.len(), PLAIN);
    }
    let head = "ply\nformat ascii 1.0\nelement vertex 4000000000\nproperty uchar x\nproperty uchar y\nproperty uchar z\nend_header\n";
    let ply = [head.as_bytes(), "0 0 0 ".repeat(100_000).as_bytes()].concat();
    let (result, most) = peak(|| parse_ply(&ply).is_err());
    assert!(result);
    assert_within("PLY", most, ply.len(), 2 * PLAIN);
}

/// Writes a volume, reads it and checks the message (empty on success), with at most `factor` bytes per byte of the file.
#[track_caller]
fn volume(folder: &Path, name: &str, bytes: &[u8], words: &str, factor: usize) {
    let path = folder.join(name);
    std::fs::write(&path, bytes).expect("a writable temporary folder");
    let read = || read_volume(&path, &ReadOptions::default()).err().map(|error| error.to_string());
    let (message, most) = peak(read);
    let message = message.unwrap_or_default();
    assert!(message.contains(words) && message.is_empty() == words.is_empty(), "{name}: {message}");
    assert_within(name, most, bytes.len(), factor);
}

/// Bytes that do not deflate.
fn noise(n: usize) -> Vec<u8> {
    let mut x = 1u64;
    let next = move || {
        x ^= x << 13;
        x ^= x >> 7;
        x ^= x << 17;
        (x >> 32) as u8
    };
    std::iter::repeat_with(next).take(n).collect()
}

fn gzipped(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::default());
    encoder.write_all(bytes).expect("memory takes all");
    encoder.finish().expect("memory takes all")
}

#[test]
fn volumes_take_memory_for_the_samples_in_the_file() {
    let _turn = turn();
    let folder = tempfile::tempdir().expect("a temporary folder");
    let header = |kind: &str, side: usize, encoding: &str| {
        format!("NRRD0004\ntype: {kind}\nendian: little\ndimension: 3\nsizes: {side} {side} {side}\nencoding: {encoding}\n\n")
            .into_bytes()
    };
    // A declared size that deflate could hold, but far more than this file holds.
    let million = noise(1 << 20);
    for (kind, side) in [("uchar", 1000), ("ushort", 800), ("float", 600), ("double", 500)] {
        let bytes = [header(kind, side, "gzip"), gzipped(&million)].concat();
        volume(folder.path(), "noise.nrrd", &bytes, "end early", PLAIN);
    }
    let fits = [header("uchar", 100, "gzip"), gzipped(&million[..1_000_000])].concat();
    volume(folder.path(), "fits.nrrd", &fits, "", PLAIN);
    let too_few = [header("uchar", 2000, "gzip"), gzipped(&million)].concat();
    volume(folder.path(), "few.nrrd", &too_few, "too few", 1);
    for encoding in ["raw", "text"] {
        let bytes = [header("double", 1000, encoding), million.clone()].concat();
        volume(folder.path(), "claim.nrrd", &bytes, "1000x1000x1000", 1);
    }
    let npy = |fortran: &str, side: usize| {
        let text = format!(
            "{{'descr': '|u1', 'fortran_order': {fortran}, 'shape': ({side}, {side}, {side}), }}\n"
        );
        let length = (text.len() as u16).to_le_bytes();
        [b"\x93NUMPY\x01\x00", &length[..], text.as_bytes(), &million[..1_000_000]].concat()
    };
    volume(folder.path(), "claim.npy", &npy("False", 1000), "1000000 bytes", 1);
    volume(folder.path(), "c.npy", &npy("False", 100), "", 1);
    volume(folder.path(), "fortran.npy", &npy("True", 100), "", 2);
    // Text is read as a stream: of a CUBE file only the samples are kept, eight bytes each.
    let cube = |side: usize, n: usize| {
        let axes =
            [format!("{side} 1 0 0\n"), format!("{side} 0 1 0\n"), format!("{side} 0 0 1\n")];
        let numbers: String = (0..n).map(|i| format!(" {:.5E}\n", i as f64)).collect();
        format!("a\nb\n0 0 0 0\n{}{numbers}", axes.concat()).into_bytes()
    };
    volume(folder.path(), "whole.cube", &cube(40, 64_000), "", 1);
    volume(folder.path(), "claim.cube", &cube(1000, 64_000), "too few", 1);
    let line = [&b"a\nb\n"[..], &b"1 "[..].repeat(1 << 19)].concat();
    volume(folder.path(), "line.cube", &line, "a line of more than", 1);
    volume(folder.path(), "claim_1000x1000x1000_uint8.raw", &million, "1048576 bytes", 1);
    volume(folder.path(), "a_100x100x100_uint8.raw", &million[..1_000_000], "", 1);
    volume(folder.path(), "half_50x100x100_float16.raw", &half_ones(), "every sample", 2);
}

/// Half floats that are all one.
fn half_ones() -> Vec<u8> {
    [0x00, 0x3c].repeat(500_000)
}
