//! Spectrum files that are as expensive for a reader as possible: complete sections, correct checksums, and contents that
//! are compressed as far as the format allows. The writer follows FORMAT.md and shares no code with the library.

use std::collections::HashMap;
use std::io::Write as _;

use flate2::Compression;
use flate2::write::DeflateEncoder;

use super::file_sections::{FILE_HEAD, section, with_footer};

/// Content in planes: counts and columns.
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

/// Coded columns, by the range coder of FORMAT.md.
#[derive(Clone)]
pub(crate) struct Coded {
    bytes: Vec<u8>,
    /// Start of the range; bit 32 is a carry into the bytes that are not written yet.
    low: u64,
    range: u32,
    /// The byte that a carry can change, and the number of bytes 255 after it.
    last: u8,
    n_full: u64,
    n_numbers: usize,
}

impl Coded {
    pub(crate) fn new() -> Self {
        Coded { bytes: vec![], low: 0, range: u32::MAX, last: 0, n_full: 0, n_numbers: 0 }
    }

    fn shift(&mut self) {
        let carry = (self.low >> 32) as u8;
        let byte = (self.low >> 24) as u8;
        if carry == 1 || byte != 255 {
            self.bytes.push(self.last.wrapping_add(carry));
            for _ in 0..std::mem::take(&mut self.n_full) {
                self.bytes.push(255u8.wrapping_add(carry));
            }
            self.last = byte;
        } else {
            self.n_full += 1;
        }
        self.low = (self.low & 0xff_ffff) << 8;
    }

    /// Codes a decision, given the part of the range that belongs to 0.
    fn decide(&mut self, bound: u32, bit: bool) {
        if bit {
            self.low += u64::from(bound);
            self.range -= bound;
        } else {
            self.range = bound;
        }
        while self.range < 1 << 24 {
            self.range <<= 8;
            self.shift();
        }
    }

    /// Codes a decision by a model: the two estimates (fast, slow), and the decisions that it has coded.
    fn learn(&mut self, model: &mut (u32, u32, u32), bit: bool) {
        self.decide((self.range >> 15) * ((model.0 + model.1) / 4), bit);
        let early = (model.2.min(124) + 4).ilog2();
        model.2 += 1;
        for (estimate, rate) in [(&mut model.0, 4), (&mut model.1, 7)] {
            let rate = early.min(rate);
            *estimate = if bit {
                *estimate - (*estimate >> rate)
            } else {
                *estimate + ((65536 - *estimate) >> rate)
            };
        }
    }

    fn bits(&mut self, n: u32, value: u64) {
        for i in (0..n).rev() {
            // The upper half of an odd range is one larger than the lower one.
            self.range &= !1;
            self.decide(self.range / 2, value >> i & 1 == 1);
        }
    }

    pub(crate) fn count(mut self, n: usize) -> Self {
        self.bits(40, n as u64);
        self
    }

    /// A column of these numbers.
    pub(crate) fn column(mut self, numbers: impl Iterator<Item = u64> + Clone) -> Self {
        let length = |x: u64| 64 - x.leading_zeros();
        let widest = numbers.clone().map(length).max().unwrap_or(0);
        self.bits(4, u64::from(widest.div_ceil(8).max(1)));
        let kind = |x: u64| if x < 8 { x } else { 8 + u64::from((length(x) - 4).min(7)) };
        let mut models = HashMap::new();
        let mut before = (0, 0);
        for x in numbers {
            self.n_numbers += 1;
            let context = (before.0, before.1.min(7));
            let n = length(x);
            // Keys of models: the context if there is one; the length, or 64 while the length is coded; the bits decoded so far.
            let mut learn = |coded: &mut Self, key: (Option<(u64, u64)>, u32, u64), bit: bool| {
                coded.learn(models.entry(key).or_insert((1 << 15, 1 << 15, 0)), bit);
            };
            for i in 0..=n.min(63) {
                learn(&mut self, (Some(context), u32::MAX, i.into()), i < n);
            }
            let n_learnt = if n > 7 { 3 } else { n.saturating_sub(1) };
            for i in 1..=n_learnt {
                let at = if n > 7 { None } else { Some(context) };
                learn(&mut self, (at, n, x >> (n - i)), x >> (n - 1 - i) & 1 == 1);
            }
            let n_left = n.saturating_sub(1) - n_learnt;
            self.bits(n_left, x);
            before = (kind(x), before.0);
        }
        self
    }

    /// A column of `n` times one number.
    pub(crate) fn constant(self, number: u64, n: usize) -> Self {
        self.column(std::iter::repeat_n(number, n))
    }

    /// `n` empty columns.
    pub(crate) fn empty(self, n: usize) -> Self {
        (0..n).fold(self, |c, _| c.constant(0, 0))
    }

    /// `n` empty columns, each after its count.
    pub(crate) fn empty_counted(self, n: usize) -> Self {
        (0..n).fold(self, |c, _| c.count(0).constant(0, 0))
    }

    /// Rank intervals, none of which is coded by a frequent end: their lengths less 1.
    pub(crate) fn intervals(self, lengths: impl ExactSizeIterator<Item = u64> + Clone) -> Self {
        let n = lengths.len();
        self.empty_counted(1).count(n).column(lengths).constant(0, n)
    }

    /// The section: 16 numbers to a stored byte at most.
    fn section(&self, tag: &[u8; 4]) -> Vec<u8> {
        let mut end = self.clone();
        (0..5).for_each(|_| end.shift());
        end.bytes.resize(end.bytes.len().max(self.n_numbers.div_ceil(16)), 0);
        section(tag, 2, &end.bytes, self.n_numbers as u64)
    }
}

/// The contents of the sections.
#[derive(Clone)]
pub(crate) struct Crafted {
    pub(crate) info: Vec<u8>,
    pub(crate) events: Content,
    pub(crate) isovalues: Content,
    pub(crate) ranks: Coded,
    pub(crate) triangles: Coded,
    pub(crate) positions: Coded,
    pub(crate) collapses: Content,
    /// Whether `INFO` is deflated, too.
    pub(crate) pack_info: bool,
    /// Vertices, knots and triangles, all of which live at one rank.
    pub(crate) size: [usize; 3],
}

impl Crafted {
    /// An empty spectrum.
    pub(crate) fn empty() -> Self {
        let volume = serde_json::json!({
            "name": "v", "dims": [4, 4, 4], "sample_type": "uint8", "range": [0.0, 1.0], "outside": "Low",
            "placement": {
                "origin": [0.0, 0.0, 0.0], "spacing": [1.0, 1.0, 1.0],
                "direction": [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], "unit": "unknown", "space": "UNKNOWN",
            },
        });
        let info = serde_json::json!({
            "volume": volume, "range": [0.0, 5e-324], "tolerance": 0.1, "parameters": null,
        });
        let columns = |n: usize| (0..n).fold(Content::default(), |c, _| c.constant(0, 0));
        let with = |a: Content, b: Content| Content([a.0, b.0].concat());
        Crafted {
            info: info.to_string().into_bytes(),
            events: with(Content::default().count(0), columns(6)),
            isovalues: isovalues(0),
            ranks: Coded::new()
                .count(0)
                .empty(3)
                .intervals([].into_iter())
                .intervals([].into_iter()),
            triangles: walk([].into_iter(), 0, [].into_iter()).empty(1).intervals([].into_iter()),
            positions: positions(0, 0),
            collapses: with(Content::default().count(0), columns(4)),
            pack_info: false,
            size: [0; 3],
        }
    }

    /// The bytes of the file.
    pub(crate) fn file(&self) -> Vec<u8> {
        let mut file = b"\x89ISP\r\n\x1a\n\x01\0\0\0".to_vec();
        file.extend(crc32fast::hash(&file).to_le_bytes());
        let [trajectories, knots, triangles] = self.size;
        let count = |content: &Content| {
            u64::from_le_bytes(content.0[..8].try_into().expect("a count comes first"))
        };
        let size = serde_json::json!({
            "isovalues": count(&self.isovalues), "trajectories": trajectories, "knots": knots,
            "triangles": triangles, "most_triangles": triangles, "collapses": count(&self.collapses),
        });
        let mut info = self.info.clone();
        info.pop();
        info.extend(format!(",\"size\":{size}}}").into_bytes());
        file.extend(self.ranks.section(b"VERT"));
        file.extend(self.triangles.section(b"TRIA"));
        file.extend(self.positions.section(b"POSN"));
        let tables = file.len();
        let chunk = &file[FILE_HEAD..];
        let index = [0, trajectories, knots, triangles, chunk.len()]
            .map(|x| x as u64)
            .into_iter()
            .chain([crc32fast::hash(chunk).into()]);
        let index =
            index.fold(Content::default().count(1), |index, x| index.column([x].into_iter()));
        file.extend(if self.pack_info { packed(b"INFO", &info) } else { plain(b"INFO", &info) });
        file.extend(packed(b"EVNT", &self.events.0));
        file.extend(packed(b"ISOV", &self.isovalues.0));
        file.extend(packed(b"COLL", &self.collapses.0));
        file.extend(packed(b"INDX", &index.0));
        with_footer(file, tables)
    }
}

/// The first `n` floating point numbers from zero as isovalues.
pub(crate) fn isovalues(n: usize) -> Content {
    Content::default().count(n).column((0..n).map(|i| if i == 0 { 1 << 63 } else { 1 }))
}

/// A file in which `m` times the same triangle is born at rank 0, and its last vertex has `k` knots: `2 m` neighbours to
/// look up at each of them.
pub(crate) fn triangle_again_and_again(m: usize, k: usize) -> Crafted {
    let mut file = Crafted::empty();
    file.isovalues = isovalues(k);
    let last = k as u64 - 2;
    let further = [last, last].into_iter().chain(std::iter::repeat_n(0, k - 1));
    file.ranks = Coded::new()
        .count(3)
        .column([2, 2, k as u64].into_iter())
        .constant(0, 2)
        .constant(0, 3)
        .intervals([].into_iter())
        .intervals(further.collect::<Vec<u64>>().into_iter());
    // The first triangle has three new vertices, the others reuse them; each opens three gates, all skipped.
    let starts = (0..3 * m).map(|i| if i < 3 { 0 } else { 3 - i as u64 % 3 });
    let births = (0..k).map(|rank| if rank == 0 { m as u64 } else { 0 });
    // The first death is coded by an interval, the others repeat it.
    file.triangles = walk(births, 3 * (m - 1), starts)
        .column((0..m).map(|i| if i == 0 { 2 } else { 1 }))
        .intervals([last].into_iter());
    file.positions = positions(3, k + 1);
    file.size = [3, k + 4, m];
    file
}

/// The first nine columns of section `TRIA`: births by rank, so many gates without a triangle, and triangles without a gate.
pub(crate) fn walk(
    births: impl ExactSizeIterator<Item = u64> + Clone,
    n_skipped: usize,
    starts: impl ExactSizeIterator<Item = u64> + Clone,
) -> Coded {
    Coded::new()
        .count(births.len())
        .column(births)
        .count(n_skipped)
        .constant(1, n_skipped)
        .empty_counted(2)
        .count(starts.len())
        .column(starts)
        .empty_counted(4)
}

/// Section `POSN` of vertices that stay where the first is and face x, none of them a lattice vertex.
pub(crate) fn positions(n_vertices: usize, n_further: usize) -> Coded {
    let axes = Coded::new().empty(4).constant(0, n_vertices);
    let first = (0..3).fold(axes, |c, _| c.constant(0, n_vertices));
    (0..3).fold(first, |c, _| c.constant(0, n_further))
}

fn plain(tag: &[u8; 4], content: &[u8]) -> Vec<u8> {
    section(tag, 0, content, content.len() as u64)
}

/// A section deflated nearly to the limit of readers: a 63rd of it is in stored blocks.
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
    section(tag, 1, &stream, content.len() as u64)
}
