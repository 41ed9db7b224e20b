//! What a spectrum file tells in its first sections: no more is read for it, and it is what is behind them.

use std::io::{Cursor, Read, Result as IoResult, Seek, SeekFrom};

use crate::common::synthetic::{Growth, growing_sphere, small};
use isospectrum::file::{Summary, from_bytes, to_bytes};
use isospectrum::spectrum::{Size, Spectrum};

/// Length of what precedes the content of a section, and of what precedes the first section.
const SECTION_HEAD: usize = 28;
const FILE_HEAD: usize = 16;

/// A file that counts what is read of it.
struct Counted<'a> {
    file: Cursor<&'a [u8]>,
    n: usize,
}

impl Read for Counted<'_> {
    fn read(&mut self, bytes: &mut [u8]) -> IoResult<usize> {
        let n = self.file.read(bytes)?;
        self.n += n;
        Ok(n)
    }
}

impl Seek for Counted<'_> {
    fn seek(&mut self, to: SeekFrom) -> IoResult<u64> {
        self.file.seek(to)
    }
}

/// What a file tells, and how many of its bytes were read for it.
fn summary(bytes: &[u8]) -> isospectrum::Result<(Summary, usize)> {
    let mut file = Counted { file: Cursor::new(bytes), n: 0 };
    let summary = Summary::from_reader(&mut file, bytes.len() as u64)?;
    Ok((summary, file.n))
}

/// Bytes in the file of a section that begins at `at`, with its head.
fn section(file: &[u8], at: usize) -> usize {
    let length = file[at + 8..at + 16].try_into().expect("eight bytes");
    SECTION_HEAD + u64::from_le_bytes(length) as usize
}

fn sphere() -> Spectrum {
    growing_sphere(&Growth {
        subdivisions: 4,
        n_steps: 40,
        splits: 40,
        flips: 90,
        knot_distance: 9,
    })
}

#[test]
fn no_more_is_read_than_the_first_two_sections_and_the_heads_of_the_others() {
    let file = to_bytes(&sphere()).expect("valid");
    let whole = from_bytes(&file).expect("just written");
    let (told, n) = summary(&file).expect("just written");
    assert_eq!(told.size, Size::of(&whole));
    assert_eq!(told.spectrum.about(), whole.about());
    assert_eq!((told.spectrum.n_vertices(), told.spectrum.triangles().len()), (0, 0));
    assert_eq!(told.bytes, file.len() as u64);
    let info = section(&file, FILE_HEAD);
    let events = section(&file, FILE_HEAD + info);
    assert_eq!(n, FILE_HEAD + info + events + 5 * SECTION_HEAD);
    assert!(20 * n < file.len(), "{n} of {} bytes", file.len());
}

#[test]
fn every_truncated_or_damaged_summary_is_refused() {
    let file = to_bytes(&small()).expect("valid");
    for n in 0..file.len() {
        let refused = summary(&file[..n]).expect_err("a part of a file").to_string();
        assert!(!refused.contains('\n'), "{refused}");
    }
    let longer = summary(&[&file[..], b"x"].concat()).expect_err("one byte more").to_string();
    assert_eq!(longer, "1 bytes after the last section");
    let info = section(&file, FILE_HEAD);
    let read = FILE_HEAD + info + section(&file, FILE_HEAD + info);
    for at in 0..read {
        let mut damaged = file.clone();
        damaged[at] ^= 1 << (at % 8);
        assert!(summary(&damaged).is_err(), "byte {at}");
    }
}

/// The file with another text in place of one in `INFO`, and checksums that fit.
fn told_otherwise(file: &[u8], text: &str, other: &str) -> Vec<u8> {
    let end = FILE_HEAD + section(file, FILE_HEAD);
    let info = std::str::from_utf8(&file[FILE_HEAD + SECTION_HEAD..end]).expect("JSON");
    assert!(info.contains(text), "{info}");
    let info = info.replacen(text, other, 1);
    let mut changed = file[..FILE_HEAD + 8].to_vec();
    let length = (info.len() as u64).to_le_bytes();
    changed.extend([length, length].concat());
    let crc = crc32fast::hash(&[&changed[FILE_HEAD..], info.as_bytes()].concat());
    changed.extend(crc.to_le_bytes());
    changed.extend(info.as_bytes());
    changed.extend(&file[end..]);
    changed
}

#[test]
fn a_size_that_is_not_that_of_the_spectrum_is_one_line() {
    let spectrum = small();
    let file = to_bytes(&spectrum).expect("valid");
    let Size { triangles, most_triangles, .. } = Size::of(&spectrum);
    let refused = |text: &str, other: &str| {
        let changed = told_otherwise(&file, text, other);
        from_bytes(&changed).expect_err("another size").to_string()
    };
    let said = refused(&format!("\"triangles\":{triangles},"), "\"triangles\":7,");
    assert_eq!(said, format!("section INFO: 7 triangles, found {triangles}"));
    let said = refused(&format!("\"most_triangles\":{most_triangles},"), "\"most_triangles\":7,");
    let expected = format!("section INFO: 7 triangles at an isovalue, found {most_triangles}");
    assert_eq!(said, expected);
    let size = serde_json::to_string(&Size::of(&spectrum)).expect("JSON");
    let said = refused(&format!(",\"size\":{size}"), "");
    assert!(said.starts_with("section INFO: missing field `size`"), "{said}");
    let said = refused("\"knots\":", "\"nots\":");
    assert!(said.starts_with("section INFO: unknown field `nots`"), "{said}");
    // What tells of itself is believed until it is read: that is what makes it fast.
    let changed = told_otherwise(&file, &format!("\"triangles\":{triangles},"), "\"triangles\":7,");
    assert_eq!(summary(&changed).expect("a size").0.size.triangles, 7);
    let without = told_otherwise(&file, &format!(",\"size\":{size}"), "");
    let said = summary(&without).expect_err("no size").to_string();
    assert!(said.starts_with("section INFO: missing field `size`"), "{said}");
}
