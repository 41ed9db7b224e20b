//! A part: what was swept of one brick, and its file.
//!
//! # Layout
//!
//! `ISOPART2`, the length of the head (u32), the head (JSON), its CRC-32, then two zlib streams: the border, which is all that other
//! parts and the events of the whole ask for ([`Border`]), and the body. All numbers are little endian. Columns, in this order:
//!
//! - border: shared vertices (u32), their lattice edges (u64), the isovalues (f64) and positions (3 f32) of their two knots each;
//!   critical points and walks (`critical`);
//! - body: isovalues (f64); starts of the vertices' knots and their end (u32); ranks of knots (u32); positions (3 f32); corners of
//!   triangles (3 u32), births (u32), deaths (u32); whether triangles are caps (u8).
//!
//! # Invariants
//!
//! What is read takes no more memory than the file can stand for, passes the checks of a spectrum, and is what was written:
//! the head has the checksums of both streams, and is followed by its own. The border says what the body has.

use std::io::{Read, Write};

use flate2::Compression;
use flate2::read::ZlibDecoder;
use flate2::write::ZlibEncoder;
use serde::{Deserialize, Serialize};

use super::columns::{self, Columns};
use super::{Plan, critical};
use crate::error::{Error, Result};
use crate::spectrum::{About, Knot, Patch, Spectrum};
use crate::sweep::{Block, Counts};
use crate::topology::blocks::BlockTopology;
use crate::volume::DEFLATE_RATIO;

const MAGIC: [u8; 8] = *b"ISOPART2";

/// Longest head accepted, bytes; one takes a few thousand.
const LONGEST_HEAD: usize = 1 << 20;

/// Most bytes that precede the border.
const LONGEST_START: u64 = LONGEST_HEAD as u64 + 16;

/// Deflate quickly: parts are read once.
const LEVEL: u32 = 1;

/// What a part says of itself.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct PartHead {
    /// Hash of the plan that it is of.
    pub plan: String,
    /// Its brick's number.
    pub number: usize,
    /// What computed it.
    pub backend: String,
    /// What happened.
    pub counts: Counts,
    /// Areas of tracked and of other triangles at isovalues evenly spread over the range.
    pub areas: Vec<[f64; 2]>,
    pub(super) isovalues: u32,
    pub(super) vertices: u32,
    pub(super) knots: u32,
    pub(super) triangles: u32,
    pub(super) shared: u32,
    pub(super) critical: u32,
    pub(super) entries: u32,
    /// Bytes of the packed border and of the packed body.
    packed: [u64; 2],
    /// CRC-32 of both.
    crc32: [u32; 2],
}

/// A vertex on a plane that bricks share.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct SharedVertex {
    /// Its number in the part.
    pub(super) vertex: u32,
    /// Its lattice edge in the whole.
    pub(super) edge: u64,
    /// Its two knots: isovalues and positions.
    pub(super) knots: [(f64, [f32; 3]); 2],
}

/// What other parts and the whole want to know of a part.
#[derive(Clone, Debug)]
pub struct Border {
    /// What the part says of itself.
    pub head: PartHead,
    /// Its vertices on shared planes, ascending.
    pub(super) shared: Vec<SharedVertex>,
    /// What the events of the whole are joined from.
    pub(super) topology: BlockTopology,
}

/// See the module.
#[derive(Clone, Debug)]
pub struct Part {
    /// Its triangles, in the frame of the whole volume.
    pub(super) patch: Patch,
    /// What it has in common with others.
    pub border: Border,
}

impl Part {
    /// The part of a brick, and the bytes of its file.
    ///
    /// # Errors
    ///
    /// [`Error::Internal`] if it cannot be packed.
    pub fn to_bytes(
        plan: &Plan,
        number: usize,
        backend: &str,
        (block, topology): (&Block, &BlockTopology),
    ) -> Result<Vec<u8>> {
        let s = &block.spectrum;
        let shared: Vec<SharedVertex> = block.shared.iter().map(|&of| shared_of(s, of)).collect();
        let border = packed(|write| columns::write_border(&shared, topology, write))?;
        let body = packed(|write| columns::write_body(s, write))?;
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

    /// The head of a part, of a plan and a number, whose columns arrived whole.
    ///
    /// # Errors
    ///
    /// [`Error::Input`] for a damaged file, or a part of another plan or brick.
    pub fn head(bytes: &[u8], plan: &Plan, number: usize) -> Result<PartHead> {
        split(bytes, plan, number).map(|(head, _)| head)
    }

    /// A part of a plan from its file.
    ///
    /// # Errors
    ///
    /// [`Error::Input`] as [`Part::head`], and for columns that contradict each other.
    pub fn from_bytes(bytes: &[u8], plan: &Plan, number: usize) -> Result<Part> {
        let (head, [border, body]) = split(bytes, plan, number)?;
        let patch = Columns(&unpacked(body, head.n_bytes_of_body())?).body(&head);
        let border = Border::unpacked(head, border)?;
        let part = Part { patch, border };
        part.checked(plan)
    }

    /// The part if it passes the checks.
    fn checked(self, plan: &Plan) -> Result<Part> {
        let Part { patch, border } = self;
        let info = plan.recipe.volume.clone();
        let range = plan.recipe.parameters.range.unwrap_or(info.range);
        let about = About::new(info, range, plan.recipe.parameters.error);
        let patch = Patch { collapses: Vec::new(), ..patch };
        let spectrum = Spectrum::new(about, patch).map_err(|e| damaged(&e.to_string()))?;
        let is_there = |s: &SharedVertex| {
            let v = s.vertex;
            (v as usize) < spectrum.n_vertices()
                && spectrum.trajectory(v).len() == 2
                && shared_of(&spectrum, (v, s.edge)) == *s
        };
        let ascends = border.shared.windows(2).all(|w| w[0].vertex < w[1].vertex);
        if !ascends || !border.shared.iter().all(is_there) {
            return Err(damaged("its shared vertices are none"));
        }
        Ok(Part { patch: spectrum.into_parts().1, border })
    }

    /// Its vertices on shared planes, ascending, each with its lattice edge in the whole.
    pub(super) fn shared(&self) -> Vec<(u32, u64)> {
        self.border.shared.iter().map(|s| (s.vertex, s.edge)).collect()
    }
}

impl Border {
    /// The border of a part of a plan from its file, of which no more is read.
    ///
    /// # Errors
    ///
    /// [`Error::Input`] as [`Part::from_bytes`]; [`Error::Io`], whose path is left to the caller.
    pub(super) fn read(file: &mut impl Read, plan: &Plan, number: usize) -> Result<Border> {
        let io = |e: std::io::Error| Error::io("", e);
        // The head tells how long the border is; what it claims is read only as far as it is there.
        let mut bytes = Vec::new();
        file.take(LONGEST_START).read_to_end(&mut bytes).map_err(io)?;
        let (head, start) = head_of(&bytes, plan, number)?;
        let missing = head.packed[0].saturating_sub((bytes.len() - start) as u64);
        file.take(missing).read_to_end(&mut bytes).map_err(io)?;
        let end = start.saturating_add(head.packed[0] as usize);
        let border = bytes.get(start..end).ok_or_else(|| damaged("it ends early"))?;
        if crc32fast::hash(border) != head.crc32[0] {
            return Err(damaged("its border has another checksum"));
        }
        Border::unpacked(head, border)
    }

    fn unpacked(head: PartHead, packed: &[u8]) -> Result<Border> {
        let columns = unpacked(packed, head.n_bytes_of_border())?;
        let (shared, topology) = Columns(&columns).border(&head);
        let topology = topology.ok_or_else(|| damaged("its critical points are none"))?;
        Ok(Border { head, shared, topology })
    }
}

/// What others want to know of a vertex on a shared plane, which has two knots.
fn shared_of(s: &Spectrum, (vertex, edge): (u32, u64)) -> SharedVertex {
    let own = s.trajectory(vertex);
    let knot = |k: &Knot| (s.isovalues()[k.rank as usize], k.position);
    SharedVertex { vertex, edge, knots: [0, 1].map(|i| knot(&own[i.min(own.len() - 1)])) }
}

impl PartHead {
    /// How many trajectories, knots and triangles the part has.
    pub fn size(&self) -> [u64; 3] {
        [self.vertices, self.knots, self.triangles].map(u64::from)
    }

    fn n_bytes_of_border(&self) -> u64 {
        let n = |count: u32, bytes: u64| u64::from(count) * bytes;
        n(self.shared, 12 + 2 * 20)
            + n(self.critical, 4 * critical::NUMBERS as u64)
            + n(self.entries, 12)
    }

    fn n_bytes_of_body(&self) -> u64 {
        let n = |count: u32, bytes: u64| u64::from(count) * bytes;
        n(self.isovalues, 8) + 4 + n(self.vertices, 4) + n(self.knots, 16) + n(self.triangles, 21)
    }
}

fn damaged(what: &str) -> Error {
    Error::input(format!("a damaged part: {what}"))
}

/// What `fill` writes, packed.
fn packed(fill: impl FnOnce(&mut dyn Write) -> std::io::Result<()>) -> Result<Vec<u8>> {
    let mut packer = ZlibEncoder::new(Vec::new(), Compression::new(LEVEL));
    let packed = fill(&mut packer).and_then(|()| packer.finish());
    packed.map_err(|e| Error::internal(e.to_string()))
}

/// `n_bytes` of columns.
fn unpacked(packed: &[u8], n_bytes: u64) -> Result<Vec<u8>> {
    if n_bytes > (packed.len() as u64).saturating_mul(DEFLATE_RATIO) {
        return Err(damaged("it claims more than its length can stand for"));
    }
    let mut columns = Vec::new();
    let taken = ZlibDecoder::new(packed).take(n_bytes + 1).read_to_end(&mut columns);
    if taken.is_err() || columns.len() as u64 != n_bytes {
        return Err(damaged("its columns do not unpack"));
    }
    Ok(columns)
}

/// The head of a part, and where what follows it begins.
fn head_of(bytes: &[u8], plan: &Plan, number: usize) -> Result<(PartHead, usize)> {
    let short = || damaged("it ends early");
    let rest = bytes.strip_prefix(&MAGIC).ok_or_else(|| damaged("it does not begin as one"))?;
    let (n, rest) = rest.split_first_chunk().ok_or_else(short)?;
    let n = u32::from_le_bytes(*n) as usize;
    if n > LONGEST_HEAD {
        return Err(damaged("its head is too long"));
    }
    let (head, rest) = rest.split_at_checked(n).ok_or_else(short)?;
    let (crc, rest) = rest.split_first_chunk().ok_or_else(short)?;
    if crc32fast::hash(head) != u32::from_le_bytes(*crc) {
        return Err(damaged("its head has another checksum"));
    }
    let head: PartHead = serde_json::from_slice(head).map_err(|e| damaged(&e.to_string()))?;
    if head.plan != plan.hash() || head.number != number {
        let (found, own) = (&head.plan, plan.hash());
        let of = head.number;
        return Err(Error::input(format!(
            "part {of} of plan {found}, expected part {number} of plan {own}"
        )));
    }
    Ok((head, bytes.len() - rest.len()))
}

/// The head of a part, its packed border and its packed body.
fn split<'a>(bytes: &'a [u8], plan: &Plan, number: usize) -> Result<(PartHead, [&'a [u8]; 2])> {
    let (head, start) = head_of(bytes, plan, number)?;
    let rest = &bytes[start..];
    let n = usize::try_from(head.packed[0]).unwrap_or(usize::MAX);
    let (border, body) = rest.split_at_checked(n).ok_or_else(|| damaged("it ends early"))?;
    if body.len() as u64 != head.packed[1] || [border, body].map(crc32fast::hash) != head.crc32 {
        return Err(damaged("its columns have another checksum"));
    }
    Ok((head, [border, body]))
}
