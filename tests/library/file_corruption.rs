//! Untrusted files: an error or a valid spectrum, never a panic, and memory in proportion to the length of the file.

use std::io::Write as _;

use crate::common::file_sections::{
    FOOTER, SECTION_HEAD, assembled, section, sections, u64_at, unpacked, with_footer,
};
use crate::common::synthetic;
use crate::common::synthetic::{Growth, growing_sphere, on_lattice, small};
use isospectrum::Error;
use isospectrum::export::parse_ply;
use isospectrum::file::{from_bytes, thesis, to_bytes};
use isospectrum::spectrum::Spectrum;

fn tiny() -> Vec<u8> {
    let growth = Growth { subdivisions: 0, n_steps: 4, splits: 1, flips: 1, knot_distance: 2 };
    to_bytes(&growing_sphere(&growth)).expect("valid")
}

/// The place of the description among the sections of a file with one chunk.
const INFO: usize = 3;

/// An error of one line, or a spectrum that passes its check and answers queries.
fn assert_refused_or_valid(result: isospectrum::Result<Spectrum>) {
    match result {
        Ok(spectrum) => {
            spectrum.check().expect("what is read passes the check");
            spectrum.mesh_at(spectrum.range().0).expect("the range holds its end");
        }
        Err(Error::Input(what)) => assert!(!what.contains('\n'), "{what}"),
        Err(other) => panic!("another kind of error: {other:?}"),
    }
}

fn assert_refused(result: isospectrum::Result<Spectrum>, what: &str) {
    match result {
        Err(Error::Input(message)) => assert!(message.contains(what), "{message}"),
        other => panic!("{what}: not refused: {other:?}"),
    }
}

#[test]
fn every_prefix_of_a_file_is_refused() {
    let file = to_bytes(&small()).expect("valid");
    for n in 0..file.len() {
        assert!(matches!(from_bytes(&file[..n]), Err(Error::Input(_))), "{n} bytes were accepted");
    }
    assert_refused(from_bytes(&[&file[..], b"x"].concat()), "other bytes follow its end");
}

/// A small file with vertices on lattice edges.
fn tiny_lattice() -> Vec<u8> {
    to_bytes(&on_lattice(2, 0.0)).expect("valid")
}

#[test]
fn every_flipped_bit_is_noticed() {
    for mut file in [tiny(), tiny_lattice()] {
        for bit in 0..8 * file.len() {
            file[bit / 8] ^= 1 << (bit % 8);
            assert!(matches!(from_bytes(&file), Err(Error::Input(_))), "bit {bit} went unnoticed");
            file[bit / 8] ^= 1 << (bit % 8);
        }
        from_bytes(&file).expect("every bit is back");
    }
}

#[test]
fn a_flipped_bit_under_a_checksum_that_fits_is_refused_or_still_valid() {
    for file in [tiny(), tiny_lattice()] {
        let mut sections = unpacked(&file);
        assert!(from_bytes(&assembled(&file, &sections)).is_ok(), "packing is free");
        for s in 0..sections.len() {
            for bit in 0..8 * sections[s].1.len() {
                sections[s].1[bit / 8] ^= 1 << (bit % 8);
                assert_refused_or_valid(from_bytes(&assembled(&file, &sections)));
                sections[s].1[bit / 8] ^= 1 << (bit % 8);
            }
        }
    }
}

#[test]
fn many_flipped_bytes_under_checksums_that_fit_are_refused_or_still_valid() {
    let file = to_bytes(&small()).expect("valid");
    let original = unpacked(&file);
    let mut numbers = synthetic::Numbers(7);
    for _ in 0..3000 {
        let mut sections = original.clone();
        for _ in 0..1 + numbers.below(6) {
            // The description is JSON, which rarely survives a changed byte; the other sections hold numbers that refer to each other.
            let of_numbers = [0, 1, 2, 4, 5, 6, 7];
            let content = &mut sections[of_numbers[numbers.below(7) as usize]].1;
            let at = numbers.below(content.len() as u32) as usize;
            content[at] = numbers.below(256) as u8;
        }
        assert_refused_or_valid(from_bytes(&assembled(&file, &sections)));
    }
}

#[test]
fn control_characters_in_a_key_of_the_description_are_escaped() {
    let file = tiny();
    let mut sections = unpacked(&file);
    let key = format!("{{\"a\\n\\u001b[31m{}\":1,", "b".repeat(100_000));
    sections[INFO].1.splice(..1, key.into_bytes());
    let error = from_bytes(&assembled(&file, &sections)).expect_err("unknown key").to_string();
    assert!(error.starts_with("section INFO: unknown field `a??[31mbbb"), "{error}");
    assert!(error.len() < 300 && !error.contains(char::is_control), "{error}");
}

#[test]
fn a_missing_or_moved_section_is_named() {
    let file = tiny();
    let mut sections = unpacked(&file);
    sections.swap(4, 5);
    assert_refused(from_bytes(&assembled(&file, &sections)), "section 'ISOV', expected 'EVNT'");
    sections.swap(4, 5);
    sections.truncate(6);
    assert_refused(from_bytes(&assembled(&file, &sections)), "the file ends inside section COLL");
    let mut sections = unpacked(&file);
    sections.swap(0, 1);
    assert_refused(from_bytes(&assembled(&file, &sections)), "section 'TRIA', expected 'VERT'");
}

#[test]
fn counts_beyond_the_file_allocate_nothing() {
    let file = tiny();
    let original = unpacked(&file);
    // Each of these counts is the first number of its section.
    for s in [4, 5, 6, 7] {
        for count in [u64::MAX, u64::MAX / 8, 1 << 40, u64::from(u32::MAX), 1 << 31] {
            let mut sections = original.clone();
            sections[s].1[..8].copy_from_slice(&count.to_le_bytes());
            assert!(matches!(from_bytes(&assembled(&file, &sections)), Err(Error::Input(_))));
        }
    }
}

#[test]
fn coded_columns_are_as_long_as_declared_and_fully_used() {
    let file = tiny();
    let original = unpacked(&file);
    for s in [0, 1, 2] {
        let n_numbers = original[s].2.expect("coded columns");
        let n_stored = original[s].1.len() as u64;
        for (n, what) in [
            (64 * n_stored + 1, "cannot hold"),
            (u64::MAX, "cannot hold"),
            (n_numbers + 1, "1 numbers too many"),
            (n_numbers - 1, "fewer bytes than its numbers need"),
        ] {
            let mut sections = original.clone();
            sections[s].2 = Some(n);
            assert_refused(from_bytes(&assembled(&file, &sections)), what);
        }
        let mut sections = original.clone();
        sections[s].1.extend([0; 9]);
        let padded = from_bytes(&assembled(&file, &sections)).expect("zeros are no harm");
        assert!(padded == from_bytes(&file).expect("valid"));
        sections[s].1.push(1);
        assert_refused(from_bytes(&assembled(&file, &sections)), "1 bytes too many");
        sections[s].2 = None;
        assert_refused(from_bytes(&assembled(&file, &sections)), "packing 0, expected 2");
    }
    for s in [3, 4, 5, 6, 7] {
        let mut sections = original.clone();
        sections[s].2 = Some(1);
        assert_refused(from_bytes(&assembled(&file, &sections)), "packing 2, expected 0 or 1");
    }
}

#[test]
fn lengths_beyond_the_file_allocate_nothing() {
    for field in [8, 16] {
        for length in [u64::MAX, 1 << 60, 1 << 33] {
            let mut file = tiny();
            for at in sections(&file) {
                let before = file.clone();
                file[at + field..at + field + 8].copy_from_slice(&length.to_le_bytes());
                if field == 16 {
                    // With a correct checksum, the length is used for unpacking.
                    let end = at + SECTION_HEAD + u64_at(&file, at + 8) as usize;
                    let whole = [&file[at..at + 24], &file[at + SECTION_HEAD..end]].concat();
                    file[at + 24..at + 28].copy_from_slice(&crc32fast::hash(&whole).to_le_bytes());
                }
                assert!(matches!(from_bytes(&file), Err(Error::Input(_))));
                file = before;
            }
        }
    }
}

#[test]
fn a_deflate_bomb_is_refused() {
    let file = tiny();
    let zeros = vec![0; 50_000_000];
    let mut packer = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::best());
    packer.write_all(&zeros).expect("memory takes every byte");
    let bomb = packer.finish().expect("memory takes every byte");
    let all = sections(&file);
    let (at, next) = (all[4], all[5]);
    for length in [zeros.len() as u64, 64 * bomb.len() as u64, 1] {
        let rest = &file[next..file.len() - FOOTER];
        let bombed = [&file[..at], &section(b"EVNT", 1, &bomb, length), rest].concat();
        let bombed = with_footer(bombed, all[INFO]);
        assert_refused(from_bytes(&bombed), "section EVNT");
    }
}

#[test]
fn text_and_empty_files_are_refused() {
    for bytes in [&b""[..], b"ply\n", b"\x89PNG\r\n\x1a\n0000000000", &[0; 100]] {
        assert_refused(from_bytes(bytes), "not a spectrum file");
    }
}

#[test]
fn the_layout_of_the_thesis_survives_every_prefix_and_every_flipped_bit() {
    let growth = Growth { subdivisions: 0, n_steps: 4, splits: 1, flips: 1, knot_distance: 2 };
    let mut file = thesis::to_bytes(&growing_sphere(&growth)).expect("valid");
    for n in 0..file.len() {
        assert!(matches!(thesis::from_bytes(&file[..n]), Err(Error::Input(_))), "{n} bytes");
    }
    for bit in 0..8 * file.len() {
        file[bit / 8] ^= 1 << (bit % 8);
        assert_refused_or_valid(thesis::from_bytes(&file));
        file[bit / 8] ^= 1 << (bit % 8);
    }
    for count in [u32::MAX, 1 << 28] {
        assert!(thesis::from_bytes(&count.to_le_bytes()).is_err());
    }
}

#[test]
fn a_ply_file_survives_every_prefix_and_every_flipped_bit() {
    let text = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n\
                property float z\nelement face 1\nproperty list uchar int vertex_indices\n\
                end_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
    let mut binary = text.replace("ascii", "binary_big_endian").into_bytes();
    binary.truncate(binary.len() - "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n".len());
    for x in [0f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0] {
        binary.extend(x.to_be_bytes());
    }
    binary.push(3);
    (0..3u32).for_each(|v| binary.extend(v.to_be_bytes()));
    for mut file in [text.as_bytes().to_vec(), binary] {
        let whole = parse_ply(&file).expect("valid");
        assert_eq!(whole.triangles, [[0, 1, 2]]);
        // The last two bytes of the text are a digit and a line end.
        for n in 0..file.len() - 2 {
            assert!(matches!(parse_ply(&file[..n]), Err(Error::Input(_))), "{n} bytes");
        }
        for bit in 0..8 * file.len() {
            file[bit / 8] ^= 1 << (bit % 8);
            if let Ok(mesh) = parse_ply(&file) {
                let n = mesh.positions.len() as u32;
                assert!(mesh.triangles.as_flattened().iter().all(|&v| v < n));
            }
            file[bit / 8] ^= 1 << (bit % 8);
        }
    }
}

#[test]
fn a_ply_file_with_counts_beyond_its_length_is_refused_at_once() {
    let head = "ply\nformat binary_little_endian 1.0\n";
    for rest in [
        "element vertex 18446744073709551615\nproperty float x\nend_header\n",
        "element empty 18446744073709551615\nelement vertex 1\nproperty float x\nend_header\n",
        "element x 1\nproperty list double uchar y\nend_header\n\0\0\0\0\0\0\u{70}\u{43}",
        "element face 1\nproperty list char int vertex_indices\nend_header\n\u{7f}",
    ] {
        assert!(matches!(parse_ply(format!("{head}{rest}").as_bytes()), Err(Error::Input(_))));
    }
}
