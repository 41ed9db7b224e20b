//! The summary of a spectrum file, from its tables: it is correct, and no more of the file is read.

use std::io::{Cursor, Read, Result as IoResult, Seek, SeekFrom};

use crate::common::file_sections::{FILE_HEAD, assembled, sections, tag, unpacked};
use crate::common::synthetic::{Growth, growing_sphere, small};
use isospectrum::file::{Summary, from_bytes, to_bytes};
use isospectrum::spectrum::{Size, Spectrum};

/// A file that counts the bytes read.
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

/// The summary of a file, and the number of bytes read for it.
fn summary(bytes: &[u8]) -> isospectrum::Result<(Summary, usize)> {
    let mut file = Counted { file: Cursor::new(bytes), n: 0 };
    let summary = Summary::from_reader(&mut file, bytes.len() as u64)?;
    Ok((summary, file.n))
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
fn a_summary_reads_the_tables_and_no_chunk() {
    let file = to_bytes(&sphere()).expect("valid");
    let whole = from_bytes(&file).expect("just written");
    let (found, n) = summary(&file).expect("just written");
    assert_eq!(found.size, Size::of(&whole));
    assert_eq!(found.spectrum.about(), whole.about());
    assert_eq!((found.spectrum.n_vertices(), found.spectrum.triangles().len()), (0, 0));
    assert_eq!(found.bytes, file.len() as u64);
    let tables = file.len() - tables_at(&file);
    assert_eq!(n, FILE_HEAD + tables);
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
    assert_eq!(longer, "the file ends too early, or other bytes follow its end");
    for at in (0..FILE_HEAD).chain(tables_at(&file)..file.len()) {
        let mut damaged = file.clone();
        damaged[at] ^= 1 << (at % 8);
        assert!(summary(&damaged).is_err(), "byte {at}");
    }
}

/// The offset of the tables of a file.
fn tables_at(file: &[u8]) -> usize {
    sections(file).into_iter().find(|&at| tag(file, at) == b"INFO").expect("a description")
}

/// The file with a text of `INFO` replaced, and correct checksums.
fn with_replaced_info(file: &[u8], text: &str, other: &str) -> Vec<u8> {
    let mut sections = unpacked(file);
    let (_, info, _) = sections.iter_mut().find(|(tag, ..)| tag == b"INFO").expect("a description");
    let found = std::str::from_utf8(info).expect("JSON");
    assert!(found.contains(text), "{found}");
    *info = found.replacen(text, other, 1).into_bytes();
    assembled(file, &sections)
}

#[test]
fn a_wrong_size_is_an_error_of_one_line() {
    let spectrum = small();
    let file = to_bytes(&spectrum).expect("valid");
    let Size { triangles, most_triangles, .. } = Size::of(&spectrum);
    let refused = |text: &str, other: &str| {
        let changed = with_replaced_info(&file, text, other);
        from_bytes(&changed).expect_err("another size").to_string()
    };
    let message = refused(&format!("\"triangles\":{triangles},"), "\"triangles\":7,");
    assert_eq!(message, format!("section INFO: 7 triangles, found {triangles}"));
    let message =
        refused(&format!("\"most_triangles\":{most_triangles},"), "\"most_triangles\":7,");
    let expected = format!("section INFO: 7 triangles at an isovalue, found {most_triangles}");
    assert_eq!(message, expected);
    let size = serde_json::to_string(&Size::of(&spectrum)).expect("JSON");
    let message = refused(&format!(",\"size\":{size}"), "");
    assert!(message.starts_with("section INFO: missing field `size`"), "{message}");
    let message = refused("\"knots\":", "\"nots\":");
    assert!(message.starts_with("section INFO: unknown field `nots`"), "{message}");
    // A summary checks the size as far as the index has it.
    let changed =
        with_replaced_info(&file, &format!("\"triangles\":{triangles},"), "\"triangles\":7,");
    let message = summary(&changed).expect_err("another size").to_string();
    assert_eq!(message, format!("section INFO: 7 triangles, found {triangles}"));
    let changed = with_replaced_info(
        &file,
        &format!("\"most_triangles\":{most_triangles},"),
        "\"most_triangles\":7,",
    );
    assert_eq!(summary(&changed).expect("a size").0.size.most_triangles, 7);
    let without = with_replaced_info(&file, &format!(",\"size\":{size}"), "");
    let message = summary(&without).expect_err("no size").to_string();
    assert!(message.starts_with("section INFO: missing field `size`"), "{message}");
}
