//! The index of a folder of parts, the names of its files, and the files of shared vertices.

use serde::{Deserialize, Serialize};

use super::column::{Columns, collected, write_column, zigzag};
use super::section::{deflate, inflate};
use crate::error::{Error, Result};
use crate::volume::DEFLATE_RATIO;

/// The name of the index.
pub const INDEX: &str = "index.json";

/// The name of the file with the description of the whole.
pub const WHOLE: &str = "whole.isp";

/// The name of the format, which no other index has.
const FORMAT: &str = "isospectrum folder of parts";

/// The version of the folder.
const VERSION: u32 = 3;

const SEAM_MAGIC: [u8; 8] = *b"ISPTSEAM";

/// Keys with this bit are those of vertices shared by chunks of one part; others are those of lattice edges.
const KEY_IN_PART: u64 = 1 << 63;

/// The key of a [`ChunkName`] in the parameters of a chunk's file.
pub(crate) const PART: &str = "part";

/// Identifies a chunk.
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

/// The index of a folder.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct Index {
    /// The name of the format.
    format: String,
    /// Version of the folder.
    version: u32,
    /// Checksum of all other entries, so that a lost one is noticed.
    crc32: u32,
    /// CRC-32 of the file [`WHOLE`].
    pub(super) whole_crc32: u32,
    /// Hash of the plan that the parts are of.
    pub plan: String,
    /// Trajectories, knots and triangles of the whole; those shared by parts or chunks count once.
    pub size: [u64; 3],
    /// All parts, including those without triangles.
    pub parts: Vec<IndexedPart>,
}

/// The entry of a part.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct IndexedPart {
    /// Its first sample along x, y, z.
    pub first: [usize; 3],
    /// Its last sample plus 1 along x, y, z.
    pub end: [usize; 3],
    /// Its trajectories, knots and triangles; those shared by its chunks count once.
    pub size: [u64; 3],
    /// The number of events in it.
    pub events: usize,
    /// Its chunks, by isovalue, each starting at the end of the one before; none without triangles.
    pub chunks: Vec<IndexedChunk>,
}

/// The entry of a chunk: the triangles of a part that are alive somewhere in an interval of isovalues.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct IndexedChunk {
    /// The start of its interval; for a part's first chunk, the lowest isovalue with triangles.
    pub from: f64,
    /// The end of its interval, exclusive.
    pub to: f64,
    /// The number of triangles in its file.
    pub triangles: u64,
    /// Bytes of its files.
    pub bytes: u64,
}

impl Index {
    /// An index of this version. `whole` is the content of the file [`WHOLE`].
    ///
    /// # Errors
    ///
    /// [`Error::Internal`] if it cannot be encoded as JSON.
    pub(crate) fn new(
        plan: &str,
        size: [u64; 3],
        parts: Vec<IndexedPart>,
        whole: &[u8],
    ) -> Result<Index> {
        let index = Index {
            format: FORMAT.to_owned(),
            version: VERSION,
            crc32: 0,
            whole_crc32: crc32fast::hash(whole),
            plan: plan.to_owned(),
            size,
            parts,
        };
        Ok(Index { crc32: index.checksum()?, ..index })
    }

    /// The names of all files of the folder.
    pub(super) fn files(&self) -> Vec<String> {
        let chunks = self.parts.iter().enumerate().flat_map(|(number, part)| {
            (0..part.chunks.len())
                .flat_map(move |chunk| [chunk_name((number, chunk)), seam_name((number, chunk))])
        });
        [INDEX, WHOLE].map(str::to_owned).into_iter().chain(chunks).collect()
    }

    /// The index from its file.
    pub(super) fn from_bytes(bytes: &[u8]) -> Result<Index> {
        let no_index = |what: String| Error::input(format!("unsupported index: {what}"));
        let versioned: Versioned =
            serde_json::from_slice(bytes).map_err(|e| no_index(e.to_string()))?;
        if versioned.version != VERSION {
            return Err(no_index(format!("version {}, expected {VERSION}", versioned.version)));
        }
        let index: Index = serde_json::from_slice(bytes).map_err(|e| no_index(e.to_string()))?;
        if index.format != FORMAT {
            return Err(no_index(format!("its format is not '{FORMAT}'")));
        }
        if index.crc32 != index.checksum()? {
            return Err(Error::input(
                "entries were lost or changed, expected those of its checksum",
            ));
        }
        let is_right = |part: &IndexedPart| {
            part.chunks.iter().all(|c| c.from < c.to)
                && part.chunks.windows(2).all(|pair| pair[0].to == pair[1].from)
        };
        if !index.parts.iter().all(is_right) {
            return Err(no_index("chunks that do not follow each other".to_owned()));
        }
        Ok(index)
    }

    /// Checks that the boxes of the parts cover all cells of a volume of `dims` samples.
    ///
    /// # Errors
    ///
    /// [`Error::Input`].
    pub(super) fn check_cover(&self, dims: [usize; 3]) -> Result<()> {
        let is_inside = |part: &IndexedPart| {
            (0..3).all(|a| part.first[a] < part.end[a] && part.end[a] <= dims[a])
        };
        let cells = |sides: [usize; 3]| sides.iter().map(|&n| n as f64 - 1.0).product::<f64>();
        let of_part = |part: &IndexedPart| cells([0, 1, 2].map(|a| part.end[a] - part.first[a]));
        if self.parts.iter().all(is_inside)
            && self.parts.iter().map(of_part).sum::<f64>() == cells(dims)
        {
            return Ok(());
        }
        let [x, y, z] = dims;
        Err(Error::input(format!(
            "its {} parts do not cover the volume of {x}x{y}x{z} samples",
            self.parts.len()
        )))
    }

    /// CRC-32 of the JSON with 0 as the checksum.
    fn checksum(&self) -> Result<u32> {
        let json = serde_json::to_vec(&Index { crc32: 0, ..self.clone() });
        json.map(|json| crc32fast::hash(&json)).map_err(|e| Error::internal(e.to_string()))
    }
}

/// The field that every version has.
#[derive(Deserialize)]
struct Versioned {
    version: u32,
}

impl IndexedPart {
    /// The lowest isovalue with triangles, and the first one above it from which on there are none.
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

    /// Whether its interval contains isovalues between two, both included.
    pub(super) fn meets(&self, (low, high): (f64, f64)) -> bool {
        self.from <= high && low < self.to
    }
}

/// The name of a chunk's spectrum file.
pub(crate) fn chunk_name((number, chunk): (usize, usize)) -> String {
    format!("{number:06}-{chunk:03}.isp")
}

/// The name of the file of the vertices that a chunk shares with others.
pub(crate) fn seam_name((number, chunk): (usize, usize)) -> String {
    format!("{number:06}-{chunk:03}.seam")
}

/// The key of a vertex shared by chunks of one part, by its number among these.
pub(crate) fn key_in_part(number: usize, vertex: u32) -> u64 {
    KEY_IN_PART | (number as u64) << 32 | u64::from(vertex)
}

/// The bytes of the file of shared vertices, ascending, with their keys: columns of the steps from vertex to vertex,
/// the kinds of the keys, and the steps from key to key of the same kind.
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

/// Reads the shared vertices of a chunk of a part.
pub(super) fn read_seam(number: usize, bytes: &[u8]) -> Result<Vec<(u32, u64)>> {
    let damaged = || Error::input("the file of shared vertices is damaged");
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
        // The key contains its kind.
        if *last >> 63 == kind { Ok((vertex, *last)) } else { Err(damaged()) }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_must_cover_the_volume() {
        let part = |first: usize, end: usize| IndexedPart {
            first: [first, 0, 0],
            end: [end, 5, 5],
            size: [0; 3],
            events: 0,
            chunks: Vec::new(),
        };
        let covers = |parts: Vec<IndexedPart>| {
            let index = Index::new("0", [0; 3], parts, b"").expect("an index");
            let bytes = serde_json::to_vec(&index).expect("JSON");
            assert_eq!(Index::from_bytes(&bytes).expect("as it was written"), index);
            index.check_cover([9, 5, 5]).is_ok()
        };
        assert!(covers(vec![part(0, 5), part(4, 9)]));
        for wrong in [vec![], vec![part(0, 5)], vec![part(0, 5), part(5, 9)], vec![part(0, 10)]] {
            assert!(!covers(wrong));
        }
    }

    #[test]
    fn shared_vertices_are_read_as_written_and_damage_is_detected() {
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
        // A declared length that is too large.
        let mut large = SEAM_MAGIC.to_vec();
        large.extend(u64::MAX.to_le_bytes());
        large.extend(crc32fast::hash(&large).to_le_bytes());
        assert!(read_seam(0, &large).is_err());
    }
}
