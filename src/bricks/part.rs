//! A part: the swept triangles of one brick, and its file.
//!
//! # Layout
//!
//! `ISOPART2`, the length of the head (u32), the head (JSON), its CRC-32, then two zlib streams: the border, which holds all that
//! other parts and the events of the whole need ([`PartBorder`]), and the body. All numbers are little endian. Columns, in order:
//!
//! - border: shared vertices (u32), their lattice edges (u64), the isovalues (f64) and positions (3 f32) of their two knots each;
//!   critical points and walks (`critical`);
//! - body: isovalues (f64); starts of the vertices' knots and their end (u32); ranks of knots (u32); positions (3 f32); corners of
//!   triangles (3 u32), births (u32), deaths (u32); whether triangles are caps (u8).
//!
//! # Invariants
//!
//! Reading takes memory in proportion to the length of the file, whatever the file declares. A part that is read is the one that
//! was written (the head holds the checksums of both streams and is followed by its own), passes the checks of a spectrum, and its
//! border agrees with its body.

use std::io::{Read, Write};

use super::columns::{self, ColumnReader};
use super::head::{PartHead, SharedVertex};
use super::plan::Plan;
use crate::error::{Error, Result};
use crate::spectrum::{About, Knot, Patch, Spectrum};
use crate::sweep::Block;
use crate::topology::blocks::BlockTopology;
use crate::volume::DEFLATE_RATIO;
use flate2::Compression;
use flate2::read::ZlibDecoder;
use flate2::write::ZlibEncoder;

const MAGIC: [u8; 8] = *b"ISOPART2";

/// Longest head accepted, bytes; usual ones take a few thousand.
const MAX_HEAD_BYTES: usize = 1 << 20;

/// Longest distance from the start of the file to the border, bytes.
const MAX_START_BYTES: u64 = MAX_HEAD_BYTES as u64 + 16;

/// Level of compression: the fastest, because a part is read only once.
const DEFLATE_LEVEL: u32 = 1;

/// All of a part that other parts and the events of the whole depend on.
#[derive(Clone, Debug)]
pub struct PartBorder {
    /// The head of the part.
    pub head: PartHead,
    /// The vertices on shared planes, ascending.
    pub(super) shared: Vec<SharedVertex>,
    /// Critical points and walks, from which the events of the whole are joined.
    pub(super) topology: BlockTopology,
}

/// The swept triangles of one brick.
#[derive(Clone, Debug)]
pub struct Part {
    /// The triangles, in the voxel frame of the whole volume.
    pub(super) patch: Patch,
    /// The border.
    pub border: PartBorder,
}

impl Part {
    /// The bytes of the file of brick `number`, from its sweep and its topology.
    ///
    /// # Errors
    ///
    /// [`Error::Internal`] if it cannot be encoded.
    pub fn to_bytes(
        plan: &Plan,
        number: usize,
        backend: &str,
        block: &Block,
        topology: &BlockTopology,
    ) -> Result<Vec<u8>> {
        let s = &block.spectrum;
        let shared: Vec<SharedVertex> =
            block.shared.iter().map(|&(v, edge)| shared_vertex(s, v, edge)).collect();
        let border = compress(|write| columns::write_border(&shared, topology, write))?;
        let body = compress(|write| columns::write_body(s, write))?;
        let head = PartHead {
            plan: plan.hash().to_owned(),
            number,
            backend: backend.to_owned(),
            counts: block.counts,
            areas: block.areas.clone(),
            isovalues: s.isovalues().len() as u32,
            vertices: s.n_vertices() as u32,
            knots: s.knots().len() as u32,
            triangles: s.triangles().len() as u32,
            shared: block.shared.len() as u32,
            critical: topology.points.len() as u32,
            entries: topology.entries.len() as u32,
            packed: [&border, &body].map(|bytes| bytes.len() as u64),
            crc32: [&border, &body].map(|bytes| crc32fast::hash(bytes)),
        };
        let head = serde_json::to_vec(&head).map_err(|e| Error::internal(e.to_string()))?;
        let mut bytes = MAGIC.to_vec();
        bytes.extend((head.len() as u32).to_le_bytes());
        bytes.extend(&head);
        bytes.extend(crc32fast::hash(&head).to_le_bytes());
        bytes.extend(border);
        bytes.extend(body);
        Ok(bytes)
    }

    /// The head of part `number` of a plan, once the checksums of its columns have been verified.
    ///
    /// # Errors
    ///
    /// [`Error::Input`] for a damaged file, or a part of another plan or brick.
    pub fn head(bytes: &[u8], plan: &Plan, number: usize) -> Result<PartHead> {
        split_file(bytes, plan, number).map(|(head, _)| head)
    }

    /// Decodes part `number` of a plan.
    ///
    /// # Errors
    ///
    /// [`Error::Input`] as [`Part::head`], and for columns that contradict each other.
    pub fn from_bytes(bytes: &[u8], plan: &Plan, number: usize) -> Result<Part> {
        let (head, [border, body]) = split_file(bytes, plan, number)?;
        let patch = ColumnReader(&decompress(body, head.body_bytes())?).body(&head);
        let border = PartBorder::decode(head, border)?;
        Part { patch, border }.checked(plan)
    }

    /// The part, if it passes the checks of a spectrum and its border agrees with its body.
    fn checked(self, plan: &Plan) -> Result<Part> {
        let Part { patch, border } = self;
        let info = plan.recipe.volume.clone();
        let range = plan.recipe.parameters.range.unwrap_or(info.range);
        let about = About::new(info, range, plan.recipe.parameters.error);
        let patch = Patch { collapses: Vec::new(), ..patch };
        let spectrum = Spectrum::new(about, patch).map_err(|e| damaged(&e.to_string()))?;
        let agrees = |s: &SharedVertex| {
            let v = s.vertex;
            (v as usize) < spectrum.n_vertices()
                && spectrum.trajectory(v).len() == 2
                && shared_vertex(&spectrum, v, s.edge) == *s
        };
        let ascends = border.shared.windows(2).all(|w| w[0].vertex < w[1].vertex);
        if !ascends || !border.shared.iter().all(agrees) {
            return Err(damaged("invalid shared vertices"));
        }
        Ok(Part { patch: spectrum.into_parts().1, border })
    }

    /// The vertices on shared planes, ascending, each with its lattice edge in the whole.
    pub(super) fn shared(&self) -> Vec<(u32, u64)> {
        self.border.shared.iter().map(|s| (s.vertex, s.edge)).collect()
    }
}

impl PartBorder {
    /// Reads the border of part `number` of a plan, and nothing after it.
    ///
    /// # Errors
    ///
    /// [`Error::Input`] as [`Part::from_bytes`]; [`Error::Io`] with an empty path, which the caller fills in.
    pub(super) fn read(file: &mut impl Read, plan: &Plan, number: usize) -> Result<PartBorder> {
        let io = |e: std::io::Error| Error::io("", e);
        // `read_to_end` allocates no more than the file has, whatever length the head declares.
        let mut bytes = Vec::new();
        file.take(MAX_START_BYTES).read_to_end(&mut bytes).map_err(io)?;
        let (head, start) = decode_head(&bytes, plan, number)?;
        let missing = head.packed[0].saturating_sub((bytes.len() - start) as u64);
        file.take(missing).read_to_end(&mut bytes).map_err(io)?;
        let end = start.saturating_add(head.packed[0] as usize);
        let border = bytes.get(start..end).ok_or_else(|| damaged("it ends early"))?;
        if crc32fast::hash(border) != head.crc32[0] {
            return Err(damaged("the checksum of its border does not match"));
        }
        PartBorder::decode(head, border)
    }

    fn decode(head: PartHead, packed: &[u8]) -> Result<PartBorder> {
        let columns = decompress(packed, head.border_bytes())?;
        let (shared, topology) = ColumnReader(&columns).border(&head);
        let topology = topology.ok_or_else(|| damaged("invalid critical points"))?;
        Ok(PartBorder { head, shared, topology })
    }
}

/// A vertex on a shared plane with its two knots.
fn shared_vertex(s: &Spectrum, vertex: u32, edge: u64) -> SharedVertex {
    let own = s.trajectory(vertex);
    let knot = |k: &Knot| (s.isovalues()[k.rank as usize], k.position);
    SharedVertex { vertex, edge, knots: [0, 1].map(|i| knot(&own[i.min(own.len() - 1)])) }
}

fn damaged(what: &str) -> Error {
    Error::input(format!("a damaged part: {what}"))
}

/// The bytes that `fill` writes, compressed.
fn compress(fill: impl FnOnce(&mut dyn Write) -> std::io::Result<()>) -> Result<Vec<u8>> {
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::new(DEFLATE_LEVEL));
    let compressed = fill(&mut encoder).and_then(|()| encoder.finish());
    compressed.map_err(|e| Error::internal(e.to_string()))
}

/// Decompresses `n_bytes` of columns.
fn decompress(packed: &[u8], n_bytes: u64) -> Result<Vec<u8>> {
    if n_bytes > (packed.len() as u64).saturating_mul(DEFLATE_RATIO) {
        return Err(damaged("it declares more than its length allows"));
    }
    let mut columns = Vec::new();
    let read = ZlibDecoder::new(packed).take(n_bytes + 1).read_to_end(&mut columns);
    if read.is_err() || columns.len() as u64 != n_bytes {
        return Err(damaged("its columns cannot be decompressed"));
    }
    Ok(columns)
}

/// The head of part `number`, and the offset of the byte after its checksum.
fn decode_head(bytes: &[u8], plan: &Plan, number: usize) -> Result<(PartHead, usize)> {
    let short = || damaged("it ends early");
    let rest = bytes.strip_prefix(&MAGIC).ok_or_else(|| damaged("no part file"))?;
    let (n, rest) = rest.split_first_chunk().ok_or_else(short)?;
    let n = u32::from_le_bytes(*n) as usize;
    if n > MAX_HEAD_BYTES {
        return Err(damaged("its head is too long"));
    }
    let (head, rest) = rest.split_at_checked(n).ok_or_else(short)?;
    let (crc, rest) = rest.split_first_chunk().ok_or_else(short)?;
    if crc32fast::hash(head) != u32::from_le_bytes(*crc) {
        return Err(damaged("the checksum of its head does not match"));
    }
    let head: PartHead = serde_json::from_slice(head).map_err(|e| damaged(&e.to_string()))?;
    if head.plan != plan.hash() || head.number != number {
        let (found, found_plan, own) = (head.number, &head.plan, plan.hash());
        return Err(Error::input(format!(
            "part {found} of plan {found_plan}, expected part {number} of plan {own}"
        )));
    }
    Ok((head, bytes.len() - rest.len()))
}

/// The head of part `number`, its compressed border and its compressed body.
fn split_file<'a>(
    bytes: &'a [u8],
    plan: &Plan,
    number: usize,
) -> Result<(PartHead, [&'a [u8]; 2])> {
    let (head, start) = decode_head(bytes, plan, number)?;
    let rest = &bytes[start..];
    let n = usize::try_from(head.packed[0]).unwrap_or(usize::MAX);
    let (border, body) = rest.split_at_checked(n).ok_or_else(|| damaged("it ends early"))?;
    if body.len() as u64 != head.packed[1] || [border, body].map(crc32fast::hash) != head.crc32 {
        return Err(damaged("the checksum of its columns does not match"));
    }
    Ok((head, [border, body]))
}
