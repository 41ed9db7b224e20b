//! What is in a folder of parts, and how its files are named.

use serde::{Deserialize, Serialize};

use crate::error::{Error, Result};

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

/// The key of a vertex that several chunks of a part have: its number in the part.
pub(crate) fn key_in_part(number: usize, vertex: u32) -> u64 {
    OF_PART | (number as u64) << 32 | u64::from(vertex)
}

/// The bytes of the file of vertices in common, each with its key.
pub(crate) fn seam_bytes(shared: &[(u32, u64)]) -> Vec<u8> {
    let mut bytes = SEAM_MAGIC.to_vec();
    bytes.extend((shared.len() as u32).to_le_bytes());
    bytes.extend(shared.iter().flat_map(|s| s.0.to_le_bytes()));
    bytes.extend(shared.iter().flat_map(|s| s.1.to_le_bytes()));
    bytes.extend(crc32fast::hash(&bytes).to_le_bytes());
    bytes
}

/// Vertices in common from their file.
pub(super) fn read_seam(bytes: &[u8]) -> Result<Vec<(u32, u64)>> {
    let damaged = || Error::input("damaged vertices in common with other parts");
    let (content, crc) = bytes.split_last_chunk::<4>().ok_or_else(damaged)?;
    if crc32fast::hash(content) != u32::from_le_bytes(*crc) {
        return Err(damaged());
    }
    let rest = content.strip_prefix(&SEAM_MAGIC).ok_or_else(damaged)?;
    let (n, rest) = rest.split_first_chunk::<4>().ok_or_else(damaged)?;
    let n = u32::from_le_bytes(*n) as usize;
    if rest.len() as u64 != 12 * n as u64 {
        return Err(damaged());
    }
    let (vertices, keys) = rest.split_at(4 * n);
    let vertices = vertices.chunks_exact(4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]));
    let key = |b: &[u8]| b.iter().rev().fold(0u64, |key, &byte| key << 8 | u64::from(byte));
    Ok(vertices.zip(keys.chunks_exact(8).map(key)).collect())
}
