//! Spectrum files that are as expensive for a reader as possible: complete sections, correct checksums, and contents that
//! deflate as far as the format allows.

use std::io::Write as _;

use flate2::Compression;
use flate2::write::DeflateEncoder;

/// A section content: counts and columns.
#[derive(Clone, Default)]
pub(crate) struct Content(pub(crate) Vec<u8>);

impl Content {
    pub(crate) fn count(mut self, n: usize) -> Self {
        self.0.extend((n as u64).to_le_bytes());
        self
    }

    /// A column of these numbers.
    pub(crate) fn column(mut self, numbers: impl Iterator<Item = u64> + Clone) -> Self {
        let all = numbers.clone().fold(0, |all, x| all | x);
        let width = (64 - all.leading_zeros()).div_ceil(8).max(1);
        self.0.push(width as u8);
        for plane in 0..width {
            self.0.extend(numbers.clone().map(|x| (x >> (8 * plane)) as u8));
        }
        self
    }

    /// A column of `n` times one number.
    pub(crate) fn constant(self, number: u64, n: usize) -> Self {
        self.column(std::iter::repeat_n(number, n))
    }
}

/// What the sections hold.
#[derive(Clone)]
pub(crate) struct Crafted {
    pub(crate) info: Vec<u8>,
    pub(crate) events: Content,
    pub(crate) isovalues: Content,
    pub(crate) ranks: Content,
    pub(crate) triangles: Content,
    pub(crate) positions: Content,
    pub(crate) collapses: Content,
    /// Whether `INFO` is deflated, too.
    pub(crate) pack_info: bool,
}

impl Crafted {
    /// A spectrum without anything.
    pub(crate) fn empty() -> Self {
        let volume = serde_json::json!({
            "name": "v", "dims": [4, 4, 4], "sample_type": "uint8", "range": [0.0, 1.0], "outside": "Low",
            "placement": {
                "origin": [0.0, 0.0, 0.0], "spacing": [1.0, 1.0, 1.0],
                "direction": [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
            },
        });
        let info = serde_json::json!({
            "volume": volume, "range": [0.0, 5e-324], "tolerance": 0.1, "parameters": null,
        });
        let columns = |n: usize| (0..n).fold(Content::default(), |c, _| c.constant(0, 0));
        let counted = |n: usize| (0..n).fold(Content::default(), |c, _| c.count(0).constant(0, 0));
        let with = |a: Content, b: Content| Content([a.0, b.0].concat());
        Crafted {
            info: info.to_string().into_bytes(),
            events: with(Content::default().count(0), columns(5)),
            isovalues: counted(1),
            ranks: with(Content::default().count(0), columns(3)),
            triangles: with(counted(4), columns(2)),
            positions: columns(11),
            collapses: with(Content::default().count(0), columns(4)),
            pack_info: false,
        }
    }

    /// The bytes of the file.
    pub(crate) fn file(&self) -> Vec<u8> {
        let mut file = b"\x89ISP\r\n\x1a\n\x03\0\0\0".to_vec();
        file.extend(crc32fast::hash(&file).to_le_bytes());
        let info = &self.info;
        file.extend(if self.pack_info { packed(b"INFO", info) } else { plain(b"INFO", info) });
        for (tag, content) in [
            (b"EVNT", &self.events),
            (b"ISOV", &self.isovalues),
            (b"VERT", &self.ranks),
            (b"TRIA", &self.triangles),
            (b"POSN", &self.positions),
            (b"COLL", &self.collapses),
        ] {
            file.extend(packed(tag, &content.0));
        }
        file
    }
}

/// `n` isovalues that follow one another as numbers do, from zero.
pub(crate) fn isovalues(n: usize) -> Content {
    Content::default().count(n).column((0..n).map(|i| if i == 0 { 1 << 63 } else { 1 }))
}

/// A file in which `m` times the same triangle is born at rank 0, and its last vertex has `k` knots: `2 m` neighbours to
/// look up at each of them.
pub(crate) fn triangle_again_and_again(m: usize, k: usize) -> Crafted {
    let mut file = Crafted::empty();
    file.isovalues = isovalues(k);
    let last = k as u64 - 2;
    file.ranks = Content::default()
        .count(3)
        .column([2, 2, k as u64].into_iter())
        .constant(0, 3)
        .column([last, last].into_iter().chain(std::iter::repeat_n(0, k - 1)));
    // The first triangle has three new vertices, the others go back to these; each opens three gates, all passed over.
    let starts = (0..3 * m).map(|i| if i < 3 { 0 } else { 3 - i as u64 % 3 });
    file.triangles = Content::default()
        .count(k)
        .column((0..k).map(|rank| if rank == 0 { m as u64 } else { 0 }))
        .count(3 * (m - 1))
        .constant(1, 3 * (m - 1))
        .count(0)
        .constant(0, 0)
        .count(3 * m)
        .column(starts)
        .constant(0, m)
        .constant(0, m);
    file.positions = positions(2, 3, k + 1);
    file
}

/// Section `POSN` of vertices that stay where the first is: so many of them have two knots, so many are there, and so many
/// further knots.
pub(crate) fn positions(n_of_two: usize, n_vertices: usize, n_further: usize) -> Content {
    let none = |c: Content| c.constant(0, 0);
    let flags = Content::default().constant(0, n_of_two);
    let mut content = none(none(none(none(flags))));
    for _ in 0..3 {
        content = content.constant(0, n_vertices);
    }
    for _ in 0..3 {
        content = content.constant(0, n_further);
    }
    content
}

fn plain(tag: &[u8; 4], content: &[u8]) -> Vec<u8> {
    section(tag, 0, content, content.len())
}

/// A section that is deflated nearly as far as a reader allows: a 63rd of it stands in blocks that are stored.
fn packed(tag: &[u8; 4], content: &[u8]) -> Vec<u8> {
    let (stored, deflated) = content.split_at(content.len().div_ceil(63));
    let mut stream = vec![0x78, 0x9c];
    for block in stored.chunks(0xffff) {
        let n = block.len() as u16;
        stream.push(0);
        stream.extend(n.to_le_bytes());
        stream.extend((!n).to_le_bytes());
        stream.extend(block);
    }
    let mut encoder = DeflateEncoder::new(stream, Compression::best());
    encoder.write_all(deflated).expect("memory takes every byte");
    let mut stream = encoder.finish().expect("memory takes every byte");
    let (mut a, mut b) = (1u32, 0u32);
    for &byte in content {
        a = (a + u32::from(byte)) % 65521;
        b = (b + a) % 65521;
    }
    stream.extend((b << 16 | a).to_be_bytes());
    section(tag, 1, &stream, content.len())
}

fn section(tag: &[u8; 4], method: u32, stored: &[u8], length: usize) -> Vec<u8> {
    let mut section = tag.to_vec();
    section.extend(method.to_le_bytes());
    section.extend((stored.len() as u64).to_le_bytes());
    section.extend((length as u64).to_le_bytes());
    let crc = crc32fast::hash(&[&section[..], stored].concat());
    section.extend(crc.to_le_bytes());
    section.extend(stored);
    section
}
