//! Files of many chunks.

use std::sync::{Arc, LazyLock};

use super::*;
use crate::file::container::write_end;
use crate::file::index::Index;
use crate::file::{FileQuery, FileWalk, copy};
use crate::kernels::{Backend, Choice};
use crate::progress::Silent;
use crate::random::Random;
use crate::spectrum::Query;
use crate::sweep::{Parameters, compute};
use crate::volume::phantom;

/// A spectrum, and its file in chunks of few triangles.
fn in_chunks() -> (Spectrum, Vec<u8>, FileTables) {
    static ONCE: LazyLock<(Spectrum, Vec<u8>)> = LazyLock::new(computed);
    let (spectrum, bytes) = ONCE.clone();
    let tables = FileTables::read(&&bytes[..]).expect("just written");
    (spectrum, bytes, tables)
}

fn computed() -> (Spectrum, Vec<u8>) {
    let volume = Arc::new(phantom("blobs:12").expect("a phantom"));
    let backend = Backend::choose(Choice::Cpu, None).expect("the CPU");
    let spectrum = compute(&volume, &Parameters::default(), &backend, &Silent).expect("one");
    let spectrum = spectrum.quantised();
    let n_ranks = spectrum.isovalues().len() as u32;
    let tree = Tree::with_chunks_of(500, spectrum.triangles(), n_ranks);
    let Written { bytes, spectrum, .. } = written(tree, spectrum).expect("a short description");
    let tables = FileTables::read(&&bytes[..]).expect("just written");
    let n_chunks = tables.index.sizes().len();
    assert!(n_chunks >= 9, "{n_chunks} chunks");
    (spectrum, bytes)
}

/// The file with some bytes of chunks replaced, and checksums that fit.
fn with_chunks(bytes: &[u8], tables: &FileTables, chunks: &[Vec<u8>]) -> Vec<u8> {
    let mut file = bytes[..16].to_vec();
    let mut sizes = tables.index.sizes().to_vec();
    for (size, chunk) in sizes.iter_mut().zip(chunks) {
        (size.bytes, size.crc) = (chunk.len() as u64, crc32fast::hash(chunk));
        file.extend(chunk);
    }
    let position = file.len();
    let mut rest = &bytes[tables.places[tables.places.len() - 1].end as usize..];
    let start = rest;
    for tag in [*b"INFO", *b"EVNT", *b"ISOV", *b"COLL"] {
        super::super::section::split_section(&mut rest, tag).expect("just written");
    }
    file.extend(&start[..start.len() - rest.len()]);
    let mut index = Index::default();
    index.push(tree_of(tables).clone(), sizes);
    write_end(&mut file, &index, position as u64);
    file
}

/// The tree of a file that has one.
fn tree_of(tables: &FileTables) -> &Tree {
    tables.index.trees().next().expect("one").tree
}

fn chunks_of(bytes: &[u8], tables: &FileTables) -> Vec<Vec<u8>> {
    let of =
        |place: &std::ops::Range<u64>| bytes[place.start as usize..place.end as usize].to_vec();
    tables.places.iter().map(of).collect()
}

#[test]
fn a_file_of_many_chunks_is_read_as_written_and_written_again() {
    let (spectrum, bytes, tables) = in_chunks();
    let read = from_bytes(&bytes).expect("just written");
    assert!(read == spectrum);
    assert!(written(tree_of(&tables).clone(), read).expect("a file").bytes == bytes);
}

#[test]
fn chunks_at_an_isovalue_give_the_mesh_of_the_whole() {
    let (spectrum, bytes, tables) = in_chunks();
    let mut whole = Query::new(&spectrum);
    let (low, high) = spectrum.range();
    let between = (0..40).map(|i| low + (high - low) * f64::from(i) / 39.0);
    let of_table = spectrum.isovalues().iter().copied().step_by(13);
    let (mut n_read, mut n_meshes) = (0, 0);
    for c in between.chain(of_table).filter(|c| (low..=high).contains(c)) {
        let patch = read_patch(&tables, &&bytes[..], c..=c).expect("just written");
        let part = Spectrum::new(tables.about.clone(), patch).expect("valid");
        n_read += part.triangles().len();
        n_meshes += 1;
        assert_eq!(part.mesh_at(c).expect("inside"), whole.mesh_at(c).expect("inside"), "at {c}");
    }
    let (mean, all) = (n_read / n_meshes, spectrum.triangles().len());
    assert!(2 * mean < all, "{mean} of {all} triangles are read");
}

#[test]
fn a_query_of_a_file_gives_the_meshes_of_the_whole_in_any_order() {
    let (spectrum, bytes, _) = in_chunks();
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("s.isp");
    std::fs::write(&path, bytes).expect("writable");
    let file = Arc::new(SpectrumFile::open(&path).expect("just written"));
    assert_eq!(file.size(), Size::of(&spectrum));
    let mut whole = Query::new(&spectrum);
    let (low, high) = spectrum.range();
    let mut query = FileQuery::new(file.clone());
    // The file is not opened again.
    std::fs::remove_file(&path).expect("there");
    let mut random = Random::new(5);
    for _ in 0..60 {
        let c = low + (high - low) * f64::from(random.below(1000) as u32) / 999.0;
        assert_eq!(query.mesh_at(c).expect("inside"), whole.mesh_at(c).expect("inside"), "at {c}");
    }
    assert!(matches!(query.mesh_at(high + 1.0), Err(Error::Range { .. })));
}

#[test]
fn a_damaged_chunk_is_named_and_the_others_still_give_meshes() {
    let (spectrum, mut bytes, tables) = in_chunks();
    let last = tables.places.len() - 1;
    bytes[tables.places[last].start as usize + 40] ^= 4;
    let error = from_bytes(&bytes).expect_err("damaged").to_string();
    let span = &tree_of(&tables).chunks()[last].span;
    let [from, to] = [span.start, span.end - 1].map(|rank| spectrum.isovalues()[rank as usize]);
    let expected =
        format!("chunk {last} (isovalues {from} to {to}): damaged: its checksum is wrong");
    assert_eq!(error, expected);
    let below = spectrum.isovalues()[span.start as usize - 1];
    let patch = read_patch(&tables, &&bytes[..], below..=below).expect("another chunk");
    Spectrum::new(tables.about.clone(), patch).expect("valid");
}

#[test]
fn chunks_that_are_missing_doubled_or_swapped_are_refused() {
    let (_, bytes, tables) = in_chunks();
    let chunks = chunks_of(&bytes, &tables);
    assert!(with_chunks(&bytes, &tables, &chunks) == bytes);
    for i in 1..chunks.len() {
        for (what, change) in [
            (
                "doubled",
                (|chunks, i| chunks[i] = chunks[i - 1].clone()) as fn(&mut Vec<Vec<u8>>, usize),
            ),
            ("swapped", |chunks, i| chunks.swap(i - 1, i)),
            ("empty", |chunks, i| chunks[i].clear()),
        ] {
            let mut chunks = chunks.clone();
            change(&mut chunks, i);
            let error = from_bytes(&with_chunks(&bytes, &tables, &chunks)).expect_err(what);
            let error = error.to_string();
            assert!(error.starts_with("chunk ") && !error.contains('\n'), "{what} {i}: {error}");
        }
        // Without their bytes in the index, other bytes are in no chunk.
        let place = &tables.places[i];
        let without = [&bytes[..place.start as usize], &bytes[place.end as usize..]].concat();
        assert!(from_bytes(&without).is_err());
    }
}

#[test]
fn changed_bytes_of_chunks_under_checksums_that_fit_are_refused_or_still_valid() {
    let (_, bytes, tables) = in_chunks();
    let original = chunks_of(&bytes, &tables);
    let mut random = Random::new(11);
    let mut n_read = 0;
    for _ in 0..100 {
        let mut chunks = original.clone();
        let i = random.below(chunks.len());
        let mut sections = Vec::new();
        let mut rest = &chunks[i][..];
        while rest.len() > 28 {
            let n = u64::from_le_bytes(rest[8..16].try_into().expect("eight bytes")) as usize;
            sections.push(rest[..28 + n].to_vec());
            rest = &rest[28 + n..];
        }
        let section = &mut sections[random.below(3)];
        let at = 28 + random.below(section.len() - 28);
        section[at] = random.below(256) as u8;
        let crc = crc32fast::hash(&[&section[..24], &section[28..]].concat());
        section[24..28].copy_from_slice(&crc.to_le_bytes());
        chunks[i] = sections.concat();
        let changed = with_chunks(&bytes, &tables, &chunks);
        let read = from_bytes(&changed);
        let copied = opened(&changed, |file| copy(&file, &mut Vec::new()));
        assert_eq!(copied.is_ok(), read.is_ok(), "{copied:?}, {:?}", read.err());
        match read {
            Ok(spectrum) => {
                spectrum.check().expect("what is read is valid");
                n_read += 1;
            }
            Err(error) => assert!(!error.to_string().contains('\n'), "{error}"),
        }
    }
    assert!(n_read > 0, "all were refused");
}

/// The result of `of` for an open file with these bytes.
fn opened<R>(bytes: &[u8], of: impl FnOnce(Arc<SpectrumFile>) -> R) -> R {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("s.isp");
    std::fs::write(&path, bytes).expect("writable");
    of(Arc::new(SpectrumFile::open(&path).expect("its tables are valid")))
}

#[test]
fn a_walk_reads_each_chunk_once_and_has_the_meshes_of_the_whole_on_its_way() {
    let (spectrum, bytes, _) = in_chunks();
    let mut whole = Query::new(&spectrum);
    let (low, high) = spectrum.range();
    opened(&bytes, |file| {
        let mut walk = FileWalk::counting(file);
        let mut lives = Vec::new();
        for c in (0..50).map(|i| low + (high - low) * f64::from(i) / 49.0) {
            walk.up_to(c, &mut |birth, death| lives.push((birth, death))).expect("valid");
            let part = walk.spectrum().expect("valid");
            let mut query = Query::for_some(&*part, 1);
            assert_eq!(query.mesh_at(c).expect("inside"), whole.mesh_at(c).expect("inside"));
            // Numbers of vertices in the file are those of the whole.
            let numbers = query.parts().0.iter().map(|&v| walk.number_of(v));
            let expected = whole.parts().0.iter().map(|&v| u64::from(v));
            assert!(numbers.eq(expected), "at {c}");
        }
        walk.finish(&mut |birth, death| lives.push((birth, death))).expect("valid");
        // Going back reads chunks again, and counts none twice.
        walk.to(low, &mut |_, _| panic!("counted twice")).expect("valid");
        let mut expected: Vec<(u32, u32)> =
            spectrum.triangles().iter().map(|t| (t.birth, t.death)).collect();
        expected.sort_unstable();
        lives.sort_unstable();
        assert!(lives == expected, "{} of {} lifetimes", lives.len(), expected.len());
        assert_eq!(walk.isovalues(), spectrum.isovalues());
    });
}

#[test]
fn a_copy_has_the_same_bytes_and_a_wrong_size_is_found() {
    let (spectrum, bytes, _) = in_chunks();
    let mut copied = Vec::new();
    opened(&bytes, |file| copy(&file, &mut copied)).expect("valid");
    assert!(copied == bytes);
    let most = Size::of(&spectrum).most_triangles;
    let [text, wrong] = [most, most - 1].map(|n| format!("\"most_triangles\":{n},"));
    assert_eq!(text.len(), wrong.len());
    let at = bytes.windows(text.len()).position(|window| window == text.as_bytes());
    let at = at.expect("INFO is text");
    let start = bytes[..at].windows(4).rposition(|window| window == b"INFO").expect("before it");
    let mut changed = bytes;
    changed[at..at + text.len()].copy_from_slice(wrong.as_bytes());
    let n = u64::from_le_bytes(changed[start + 8..start + 16].try_into().expect("eight bytes"));
    let section = &changed[start..start + 28 + n as usize];
    let crc = crc32fast::hash(&[&section[..24], &section[28..]].concat());
    changed[start + 24..start + 28].copy_from_slice(&crc.to_le_bytes());
    let error = opened(&changed, |file| copy(&file, &mut Vec::new())).expect_err("a wrong size");
    let expected = format!("section INFO: {} triangles at an isovalue, found {most}", most - 1);
    assert!(error.to_string().ends_with(&expected), "{error}");
    assert_eq!(from_bytes(&changed).expect_err("a wrong size").to_string(), expected);
}
