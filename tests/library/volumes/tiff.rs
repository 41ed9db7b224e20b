//! TIFF as libtiff wrote it before TIFF 6.0.

use super::{folder, message, read_ok, write};
use isospectrum::Samples;

const WIDTH: usize = 20;
const HEIGHT: usize = 18;
const TILE: usize = 16;
const N_PAGES: usize = 2;

/// A file of pages of 8-bit samples. `chunks` are the strips or tiles of a page, `tags` those of their offsets and lengths.
fn file(chunks: impl Fn(usize) -> Vec<Vec<u8>>, tags: [u16; 2], other: &[(u16, u32)]) -> Vec<u8> {
    let mut bytes = b"II*\0\0\0\0\0".to_vec();
    let mut link = 4;
    for page in 0..N_PAGES {
        let chunks = chunks(page);
        let mut offsets = Vec::new();
        for chunk in &chunks {
            offsets.push(bytes.len() as u32);
            bytes.extend(chunk);
        }
        let lengths: Vec<u32> = chunks.iter().map(|chunk| chunk.len() as u32).collect();
        let mut entries: Vec<(u16, Vec<u32>)> = vec![
            (256, vec![WIDTH as u32]),
            (257, vec![HEIGHT as u32]),
            (258, vec![8]),
            (262, vec![1]),
            (277, vec![1]),
            (tags[0], offsets),
            (tags[1], lengths),
        ];
        entries.extend(other.iter().map(|&(tag, value)| (tag, vec![value])));
        entries.sort();
        let start = bytes.len() as u32;
        bytes[link..link + 4].copy_from_slice(&start.to_le_bytes());
        let mut values_at = start + 2 + 12 * entries.len() as u32 + 4;
        let mut values = Vec::new();
        bytes.extend((entries.len() as u16).to_le_bytes());
        for (tag, numbers) in &entries {
            bytes.extend(tag.to_le_bytes());
            bytes.extend(4u16.to_le_bytes());
            bytes.extend((numbers.len() as u32).to_le_bytes());
            match numbers[..] {
                [one] => bytes.extend(one.to_le_bytes()),
                _ => {
                    bytes.extend(values_at.to_le_bytes());
                    values_at += 4 * numbers.len() as u32;
                    values.extend(numbers.iter().flat_map(|n| n.to_le_bytes()));
                }
            }
        }
        link = bytes.len();
        bytes.extend([0; 4]);
        bytes.extend(values);
    }
    bytes
}

fn sample(x: usize, y: usize, page: usize) -> u8 {
    (7 * x + 13 * y + 101 * page) as u8
}

#[test]
fn tiles_with_the_tags_of_strips_are_read() {
    let tiles = |page: usize| {
        let starts = [(0, 0), (TILE, 0), (0, TILE), (TILE, TILE)];
        let tile = |(x, y): (usize, usize)| {
            (0..TILE * TILE).map(|i| sample(x + i % TILE, y + i / TILE, page)).collect()
        };
        starts.map(tile).to_vec()
    };
    let sizes = [(259, 1), (322, TILE as u32), (323, TILE as u32)];
    let folder = folder();
    for (name, tags) in [("now.tif", [324, 325]), ("before.tif", [273, 279])] {
        let volume = read_ok(&write(&folder, name, &file(tiles, tags, &sizes)));
        assert_eq!(volume.dims(), [WIDTH, HEIGHT, N_PAGES]);
        let of_page = |page| (0..WIDTH * HEIGHT).map(move |i| sample(i % WIDTH, i / WIDTH, page));
        let expected: Vec<u8> = (0..N_PAGES).flat_map(of_page).collect();
        assert_eq!(*volume.samples(), Samples::U8(expected), "{name}");
    }
}

#[test]
fn lzw_with_the_lowest_bit_first_is_named() {
    // The code 256 of nine bits, lowest bit first, and others.
    let strip = |_: usize| vec![[vec![0, 1], vec![0x55; 200]].concat()];
    let folder = folder();
    let path = write(&folder, "old.tif", &file(strip, [273, 279], &[(259, 5)]));
    let text = message(&path);
    assert!(text.contains("lowest bit first"), "{text}");
    // Damaged, but of the present kind.
    let strip = |_: usize| vec![[vec![0x80, 0], vec![0xff; 200]].concat()];
    let path = write(&folder, "damaged.tif", &file(strip, [273, 279], &[(259, 5)]));
    assert!(!message(&path).contains("bit first"));
}
