//! A part: what was swept of one brick, and its file.
//!
//! # Layout
//!
//! `ISOPART1`, the length of the head (u32), the head (JSON), the columns as one zlib stream. All numbers are little endian.
//! Columns, in this order: isovalues (f64); starts of the vertices' knots and their end (u32); ranks of knots (u32);
//! positions (3 f32); corners of triangles (3 u32), births (u32), deaths (u32); shared vertices (u32), their lattice edges
//! (u64); critical points and walks (`critical`); whether triangles are caps (u8).
//!
//! # Invariants
//!
//! What is read takes no more memory than the file can stand for, passes the checks of a spectrum, and is what was written:
//! the head has the columns' checksum, and is followed by its own.

use std::io::{Read as _, Write as _};

use flate2::Compression;
use flate2::read::ZlibDecoder;
use flate2::write::ZlibEncoder;
use serde::{Deserialize, Serialize};

use super::{Plan, critical};
use crate::error::{Error, Result};
use crate::spectrum::{Knot, Patch, Spectrum, Triangle};
use crate::sweep::{Block, Counts};
use crate::topology::blocks::BlockTopology;
use crate::volume::DEFLATE_RATIO;

const MAGIC: [u8; 8] = *b"ISOPART1";

/// Longest head accepted, bytes; one takes a few thousand.
const LONGEST_HEAD: usize = 1 << 20;

/// Deflate quickly: parts are read once.
const LEVEL: u32 = 1;

/// What a part says of itself.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
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
    isovalues: u32,
    vertices: u32,
    knots: u32,
    triangles: u32,
    shared: u32,
    critical: u32,
    entries: u32,
    /// CRC-32 of the packed columns.
    crc32: u32,
}

/// See the module.
#[derive(Clone, Debug)]
pub struct Part {
    /// What it says of itself.
    pub head: PartHead,
    /// Its triangles, in the frame of the whole volume.
    pub(super) patch: Patch,
    /// Its vertices on shared planes, ascending, and their lattice edges in the whole.
    pub(super) shared: Vec<(u32, u64)>,
    /// What the events of the whole are joined from.
    pub(super) topology: BlockTopology,
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
        let fail = |e: std::io::Error| Error::internal(e.to_string());
        let s = &block.spectrum;
        let mut packer = ZlibEncoder::new(Vec::new(), Compression::new(LEVEL));
        write_columns(s, &block.shared, topology, |bytes| packer.write_all(bytes)).map_err(fail)?;
        let packed = packer.finish().map_err(fail)?;
        let head = PartHead {
            plan: plan.hash().to_owned(),
            number,
            backend: backend.to_owned(),
            counts: block.counts,
            areas: block.areas.clone(),
            isovalues: s.isovalues.len() as u32,
            vertices: s.n_vertices() as u32,
            knots: s.knots.len() as u32,
            triangles: s.triangles.len() as u32,
            shared: block.shared.len() as u32,
            critical: topology.points.len() as u32,
            entries: topology.entries.len() as u32,
            crc32: crc32fast::hash(&packed),
        };
        let head = serde_json::to_vec(&head).map_err(|e| Error::internal(e.to_string()))?;
        let mut bytes = MAGIC.to_vec();
        bytes.extend((head.len() as u32).to_le_bytes());
        bytes.extend(&head);
        bytes.extend(crc32fast::hash(&head).to_le_bytes());
        bytes.extend(packed);
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
        let (head, packed) = split(bytes, plan, number)?;
        let n_bytes = head.n_bytes();
        if n_bytes > (packed.len() as u64).saturating_mul(DEFLATE_RATIO) {
            return Err(damaged("it claims more than its length can stand for"));
        }
        let mut columns = Vec::new();
        let taken = ZlibDecoder::new(packed).take(n_bytes + 1).read_to_end(&mut columns);
        if taken.is_err() || columns.len() as u64 != n_bytes {
            return Err(damaged("its columns do not unpack"));
        }
        let (patch, shared, topology) = Columns(&columns).read(&head);
        let topology = topology.ok_or_else(|| damaged("its critical points are none"))?;
        let part = Part { head, patch, shared, topology };
        part.check(plan)?;
        Ok(part)
    }

    fn check(&self, plan: &Plan) -> Result<()> {
        let p = &self.patch;
        let info = plan.recipe.volume.clone();
        let range = plan.recipe.parameters.range.unwrap_or(info.range);
        let spectrum = Spectrum {
            volume: info,
            range,
            tolerance: plan.recipe.parameters.error,
            parameters: serde_json::Value::Null,
            events: Vec::new(),
            isovalues: p.isovalues.clone(),
            first_knot: p.first_knot.clone(),
            knots: p.knots.clone(),
            triangles: p.triangles.clone(),
            collapses: Vec::new(),
        };
        spectrum.check().map_err(|e| damaged(&e.to_string()))?;
        let is_edge = |&(v, _): &(u32, u64)| {
            (v as usize) < spectrum.n_vertices() && spectrum.trajectory(v).len() == 2
        };
        let ascends = self.shared.windows(2).all(|w| w[0].0 < w[1].0);
        let is_right = ascends && self.shared.iter().all(is_edge);
        is_right.then_some(()).ok_or_else(|| damaged("its shared vertices are none"))
    }
}

impl PartHead {
    /// How many bytes the columns take.
    fn n_bytes(&self) -> u64 {
        let n = |count: u32, bytes: u64| u64::from(count) * bytes;
        n(self.isovalues, 8)
            + 4
            + n(self.vertices, 4)
            + n(self.knots, 16)
            + n(self.triangles, 21)
            + n(self.shared, 12)
            + n(self.critical, 4 * critical::NUMBERS as u64)
            + n(self.entries, 12)
    }
}

fn damaged(what: &str) -> Error {
    Error::input(format!("a damaged part: {what}"))
}

/// The head of a part and its packed columns.
fn split<'a>(bytes: &'a [u8], plan: &Plan, number: usize) -> Result<(PartHead, &'a [u8])> {
    let short = || damaged("it ends early");
    let rest = bytes.strip_prefix(&MAGIC).ok_or_else(|| damaged("it does not begin as one"))?;
    let (n, rest) = rest.split_first_chunk().ok_or_else(short)?;
    let n = u32::from_le_bytes(*n) as usize;
    if n > LONGEST_HEAD {
        return Err(damaged("its head is too long"));
    }
    let (head, rest) = rest.split_at_checked(n).ok_or_else(short)?;
    let (crc, packed) = rest.split_first_chunk().ok_or_else(short)?;
    if crc32fast::hash(head) != u32::from_le_bytes(*crc) {
        return Err(damaged("its head has another checksum"));
    }
    let head: PartHead = serde_json::from_slice(head).map_err(|e| damaged(&e.to_string()))?;
    if crc32fast::hash(packed) != head.crc32 {
        return Err(damaged("its columns have another checksum"));
    }
    if head.plan != plan.hash() || head.number != number {
        let (found, own) = (&head.plan, plan.hash());
        let of = head.number;
        return Err(Error::input(format!(
            "part {of} of plan {found}, expected part {number} of plan {own}"
        )));
    }
    Ok((head, packed))
}

/// Writes the columns of a part.
fn write_columns(
    s: &Spectrum,
    shared: &[(u32, u64)],
    topology: &BlockTopology,
    mut write: impl FnMut(&[u8]) -> std::io::Result<()>,
) -> std::io::Result<()> {
    let caps: Vec<u8> = s.triangles.iter().map(|t| u8::from(t.cap)).collect();
    // Every number is written as one or two of 32 bits, low half first.
    let halves = |n: u64| [n as u32, (n >> 32) as u32];
    let mut numbers = |numbers: &mut dyn Iterator<Item = u32>| {
        for n in numbers {
            write(&n.to_le_bytes())?;
        }
        Ok::<(), std::io::Error>(())
    };
    numbers(&mut s.isovalues.iter().flat_map(|c| halves(c.to_bits())))?;
    numbers(&mut s.first_knot.iter().copied())?;
    numbers(&mut s.knots.iter().map(|k| k.rank))?;
    numbers(&mut s.knots.iter().flat_map(|k| k.position.map(f32::to_bits)))?;
    numbers(&mut s.triangles.iter().flat_map(|t| t.vertices))?;
    numbers(&mut s.triangles.iter().map(|t| t.birth))?;
    numbers(&mut s.triangles.iter().map(|t| t.death))?;
    numbers(&mut shared.iter().map(|s| s.0))?;
    numbers(&mut shared.iter().flat_map(|s| halves(s.1)))?;
    numbers(&mut critical::numbers(topology))?;
    write(&caps)
}

/// What is left of the columns; there is as much as the head says.
struct Columns<'a>(&'a [u8]);

impl Columns<'_> {
    fn numbers(&mut self, n: usize) -> Vec<u32> {
        let (own, rest) = self.0.split_at(4 * n);
        self.0 = rest;
        let number = |b: &[u8]| u32::from_le_bytes([b[0], b[1], b[2], b[3]]);
        own.chunks_exact(4).map(number).collect()
    }

    fn longs(&mut self, n: usize) -> Vec<u64> {
        let halves = self.numbers(2 * n);
        halves.chunks_exact(2).map(|h| u64::from(h[0]) | u64::from(h[1]) << 32).collect()
    }

    fn read(mut self, head: &PartHead) -> (Patch, Vec<(u32, u64)>, Option<BlockTopology>) {
        let isovalues = self.longs(head.isovalues as usize);
        let first_knot = self.numbers(head.vertices as usize + 1);
        let ranks = self.numbers(head.knots as usize);
        let places = self.numbers(3 * head.knots as usize);
        let knot = |(&rank, p): (&u32, &[u32])| Knot {
            rank,
            position: [p[0], p[1], p[2]].map(f32::from_bits),
        };
        let knots = ranks.iter().zip(places.chunks_exact(3)).map(knot).collect();
        let n = head.triangles as usize;
        let corners = self.numbers(3 * n);
        let (births, deaths) = (self.numbers(n), self.numbers(n));
        let vertices = self.numbers(head.shared as usize);
        let edges = self.longs(head.shared as usize);
        let critical = self.numbers(critical::NUMBERS * head.critical as usize);
        let entries = self.numbers(3 * head.entries as usize);
        let topology = critical::topology(&critical, &entries);
        let caps = self.0;
        let triangle = |i: usize| Triangle {
            vertices: [0, 1, 2].map(|c| corners[3 * i + c]),
            birth: births[i],
            death: deaths[i],
            cap: caps[i] != 0,
        };
        let triangles = (0..n).map(triangle).collect();
        let patch = Patch {
            isovalues: isovalues.into_iter().map(f64::from_bits).collect(),
            first_knot,
            knots,
            triangles,
            collapses: Vec::new(),
        };
        (patch, vertices.into_iter().zip(edges).collect(), topology)
    }
}
