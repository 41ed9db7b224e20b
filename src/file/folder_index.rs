//! What is in a folder of parts, and how its files are named.

use serde::{Deserialize, Serialize};

use super::column::{Columns, collected, write_column, zigzag};
use super::section::{deflate, inflate};
use crate::error::{Error, Result};
use crate::volume::DEFLATE_RATIO;

/// The file that tells what is in the folder.
pub const INDEX: &str = "index.json";

/// The file of what is known of the whole.
pub const WHOLE: &str = "whole.isp";

/// The version of such folders; none but this one was ever in a release.
const VERSION: u32 = 2;

const SEAM_MAGIC: [u8; 8] = *b"ISPTSEAM";

/// Keys from here on are those of vertices that chunks of one part have in common; below, those of lattice edges.
const OF_PART: u64 = 1 << 63;

/// Under this name the parameters of a chunk's file tell which one it is ([`ChunkName`]).
pub(crate) const PART: &str = "part";

/// Which chunk a file is.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct ChunkName {
    /// The hash of its plan.
    pub(crate) plan: String,
    /// The number of its part.
    pub(crate) number: usize,
    /// Its number in the part.
    pub(crate) chunk: usize,
}

/// What is in a folder.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct Index {
    /// Version of the folder.
    version: u32,
    /// Hash of the plan that the parts are of.
    pub plan: String,
    /// Trajectories, knots and triangles of the whole; what parts and chunks have in common is counted once.
    pub size: [u64; 3],
    /// All parts, those without triangles too.
    pub parts: Vec<IndexedPart>,
}

/// What is known of a part without it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct IndexedPart {
    /// Its first sample along x, y, z.
    pub first: [usize; 3],
    /// The sample behind its last one.
    pub end: [usize; 3],
    /// Its trajectories, knots and triangles; what its chunks have in common is counted once.
    pub size: [u64; 3],
    /// How many events lie in it.
    pub events: usize,
    /// Its chunks, by isovalue, each beginning where the one before ends; none without triangles.
    pub chunks: Vec<IndexedChunk>,
}

/// What is known of the triangles of a part that live somewhere in an interval of isovalues, without them.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct IndexedChunk {
    /// Where it begins; in a part's first chunk, the lowest isovalue with triangles.
    pub from: f64,
    /// The isovalue from which it has none.
    pub to: f64,
    /// How many triangles are in its file.
    pub triangles: u64,
    /// Bytes of its files.
    pub bytes: u64,
}

impl Index {
    /// What is in a folder of this version.
    pub(crate) fn new(plan: &str, size: [u64; 3], parts: Vec<IndexedPart>) -> Index {
        Index { version: VERSION, plan: plan.to_owned(), size, parts }
    }

    /// The index from its file.
    pub(super) fn from_bytes(bytes: &[u8]) -> Result<Index> {
        let no_index = |what: String| Error::input(format!("no index of this version: {what}"));
        let told: Told = serde_json::from_slice(bytes).map_err(|e| no_index(e.to_string()))?;
        if told.version != VERSION {
            return Err(no_index(format!("version {}, expected {VERSION}", told.version)));
        }
        let index: Index = serde_json::from_slice(bytes).map_err(|e| no_index(e.to_string()))?;
        let is_right = |part: &IndexedPart| {
            part.chunks.iter().all(|c| c.from < c.to)
                && part.chunks.windows(2).all(|pair| pair[0].to == pair[1].from)
        };
        if !index.parts.iter().all(is_right) {
            return Err(no_index("chunks that do not follow each other".to_owned()));
        }
        Ok(index)
    }
}

/// What every version has.
#[derive(Deserialize)]
struct Told {
    version: u32,
}

impl IndexedPart {
    /// The lowest isovalue at which it has triangles, and the one from which it has none.
    pub fn lives(&self) -> Option<(f64, f64)> {
        Some((self.chunks.first()?.from, self.chunks.last()?.to))
    }

    /// Bytes of its files.
    pub fn bytes(&self) -> u64 {
        self.chunks.iter().fold(0, |n, chunk| n.saturating_add(chunk.bytes))
    }
}

impl IndexedChunk {
    pub(crate) fn new((from, to): (f64, f64), triangles: u64, bytes: u64) -> IndexedChunk {
        IndexedChunk { from, to, triangles, bytes }
    }

    /// Whether it has isovalues between two, both included.
    pub(super) fn meets(&self, (low, high): (f64, f64)) -> bool {
        self.from <= high && low < self.to
    }
}

/// The name of a chunk's spectrum file.
pub(crate) fn chunk_name((number, chunk): (usize, usize)) -> String {
    format!("{number:06}-{chunk:03}.isp")
}

/// The name of the file of a chunk's vertices in common with others.
pub(crate) fn seam_name((number, chunk): (usize, usize)) -> String {
    format!("{number:06}-{chunk:03}.seam")
}

/// The key of a vertex that several chunks of a part have: its number among these.
pub(crate) fn key_in_part(number: usize, vertex: u32) -> u64 {
    OF_PART | (number as u64) << 32 | u64::from(vertex)
}

/// The bytes of the file of vertices in common, ascending, each with its key, of a part: columns of the steps from vertex to vertex,
/// of what the keys are of, and of the steps from key to key of the same kind.
pub(crate) fn seam_bytes(number: usize, shared: &[(u32, u64)]) -> Vec<u8> {
    let mut content = (shared.len() as u64).to_le_bytes().to_vec();
    let after = std::iter::once(0).chain(shared.iter().map(|s| s.0 + 1));
    let steps: Vec<u64> = shared.iter().zip(after).map(|(s, from)| u64::from(s.0 - from)).collect();
    write_column(&mut content, &steps);
    let kinds: Vec<u64> = shared.iter().map(|s| s.1 >> 63).collect();
    write_column(&mut content, &kinds);
    let mut last = [0, key_in_part(number, 0)];
    let steps = shared.iter().map(|&(_, key)| {
        let last = &mut last[(key >> 63) as usize];
        zigzag(key.wrapping_sub(std::mem::replace(last, key)) as i64)
    });
    write_column(&mut content, &steps.collect::<Vec<u64>>());
    let mut bytes = SEAM_MAGIC.to_vec();
    bytes.extend((content.len() as u64).to_le_bytes());
    bytes.extend(deflate(&content));
    bytes.extend(crc32fast::hash(&bytes).to_le_bytes());
    bytes
}

/// Vertices in common from the file of a part.
pub(super) fn read_seam(number: usize, bytes: &[u8]) -> Result<Vec<(u32, u64)>> {
    let damaged = || Error::input("damaged vertices in common with other parts");
    let (head, crc) = bytes.split_last_chunk::<4>().ok_or_else(damaged)?;
    if crc32fast::hash(head) != u32::from_le_bytes(*crc) {
        return Err(damaged());
    }
    let rest = head.strip_prefix(&SEAM_MAGIC).ok_or_else(damaged)?;
    let (length, packed) = rest.split_first_chunk::<8>().ok_or_else(damaged)?;
    let length = u64::from_le_bytes(*length);
    if length > (packed.len() as u64).saturating_mul(DEFLATE_RATIO) {
        return Err(damaged());
    }
    let content = inflate(packed, length as usize).map_err(|_| damaged())?;
    let mut columns = Columns::new(&content);
    let n = columns.count()?;
    let steps = columns.column(n, 32)?;
    let kinds = columns.column(n, 1)?;
    let keys = columns.column(n, 64)?;
    columns.end()?;
    let (mut next, mut last) = (0u32, [0, key_in_part(number, 0)]);
    collected(n, |i| {
        let vertex = u32::try_from(steps.get(i)?).ok().and_then(|step| next.checked_add(step));
        let vertex = vertex.filter(|&v| v < u32::MAX).ok_or_else(damaged)?;
        next = vertex + 1;
        let kind = kinds.get(i)?;
        let last = &mut last[kind as usize];
        *last = last.wrapping_add(keys.get_signed(i)? as u64);
        // A key tells by itself what it is of.
        if *last >> 63 == kind { Ok((vertex, *last)) } else { Err(damaged()) }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn vertices_in_common_come_back_and_damage_is_found() {
        let all = [
            (0, 7),
            (1, key_in_part(3, 5)),
            (9, 1 << 40),
            (10, key_in_part(3, 6)),
            (4_000_000_000, 2),
        ];
        for shared in [&all[..], &all[..0]] {
            let bytes = seam_bytes(3, shared);
            assert_eq!(read_seam(3, &bytes).expect("as it was written"), shared);
            for i in 0..bytes.len() {
                let mut damaged = bytes.clone();
                damaged[i] ^= 16;
                assert!(read_seam(3, &damaged).is_err(), "byte {i}");
                assert!(read_seam(3, &bytes[..i]).is_err(), "{i} bytes");
            }
        }
        // What claims more than it can stand for.
        let mut large = SEAM_MAGIC.to_vec();
        large.extend(u64::MAX.to_le_bytes());
        large.extend(crc32fast::hash(&large).to_le_bytes());
        assert!(read_seam(0, &large).is_err());
    }
}
