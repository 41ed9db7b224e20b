//! The columns of a part's file. All numbers are 32-bit words; 64-bit numbers take two, low word first.

use std::io::{Result, Write};

use super::critical;
use super::head::{PartHead, SharedVertex};
use crate::spectrum::{Knot, Patch, Spectrum, Triangle};
use crate::topology::blocks::BlockTopology;

fn words(n: u64) -> [u32; 2] {
    [n as u32, (n >> 32) as u32]
}

fn write_words(to: &mut dyn Write, mut words: impl Iterator<Item = u32>) -> Result<()> {
    words.try_for_each(|n| to.write_all(&n.to_le_bytes()))
}

/// Writes the columns of a border.
pub(super) fn write_border(
    shared: &[SharedVertex],
    topology: &BlockTopology,
    to: &mut dyn Write,
) -> Result<()> {
    let knots = || shared.iter().flat_map(|s| s.knots);
    write_words(to, shared.iter().map(|s| s.vertex))?;
    write_words(to, shared.iter().flat_map(|s| words(s.edge)))?;
    write_words(to, knots().flat_map(|k| words(k.0.to_bits())))?;
    write_words(to, knots().flat_map(|k| k.1.map(f32::to_bits)))?;
    write_words(to, critical::encode(topology))
}

/// Writes the columns of a body.
pub(super) fn write_body(s: &Spectrum, to: &mut dyn Write) -> Result<()> {
    write_words(to, s.isovalues().iter().flat_map(|c| words(c.to_bits())))?;
    write_words(to, s.first_knot().iter().copied())?;
    write_words(to, s.knots().iter().map(|k| k.rank))?;
    write_words(to, s.knots().iter().flat_map(|k| k.position.map(f32::to_bits)))?;
    write_words(to, s.triangles().iter().flat_map(|t| t.vertices))?;
    write_words(to, s.triangles().iter().map(|t| t.birth))?;
    write_words(to, s.triangles().iter().map(|t| t.death))?;
    let caps: Vec<u8> = s.triangles().iter().map(|t| u8::from(t.cap)).collect();
    to.write_all(&caps)
}

/// Reads columns from bytes, front to back. The caller has checked that there are as many bytes as the head declares.
pub(super) struct ColumnReader<'a>(pub(super) &'a [u8]);

impl ColumnReader<'_> {
    fn words(&mut self, n: usize) -> Vec<u32> {
        let (own, rest) = self.0.split_at(4 * n);
        self.0 = rest;
        let word = |b: &[u8]| u32::from_le_bytes([b[0], b[1], b[2], b[3]]);
        own.chunks_exact(4).map(word).collect()
    }

    fn long_words(&mut self, n: usize) -> Vec<u64> {
        let words = self.words(2 * n);
        words.chunks_exact(2).map(|w| u64::from(w[0]) | u64::from(w[1]) << 32).collect()
    }

    /// The shared vertices and the topology of a border; `None` for the topology if a word is invalid.
    pub(super) fn border(mut self, head: &PartHead) -> (Vec<SharedVertex>, Option<BlockTopology>) {
        let n = head.shared as usize;
        let (vertices, edges) = (self.words(n), self.long_words(n));
        let (isovalues, positions) = (self.long_words(2 * n), self.words(6 * n));
        let knot = |k: usize| {
            let position = [0, 1, 2].map(|a| f32::from_bits(positions[3 * k + a]));
            (f64::from_bits(isovalues[k]), position)
        };
        let shared = (0..n).map(|i| SharedVertex {
            vertex: vertices[i],
            edge: edges[i],
            knots: [knot(2 * i), knot(2 * i + 1)],
        });
        let critical = self.words(critical::WORDS * head.critical as usize);
        let entries = self.words(3 * head.entries as usize);
        (shared.collect(), critical::decode(&critical, &entries))
    }

    /// The triangles of a body.
    pub(super) fn body(mut self, head: &PartHead) -> Patch {
        let isovalues = self.long_words(head.isovalues as usize);
        let first_knot = self.words(head.vertices as usize + 1);
        let ranks = self.words(head.knots as usize);
        let positions = self.words(3 * head.knots as usize);
        let knot = |(&rank, p): (&u32, &[u32])| Knot {
            rank,
            position: [p[0], p[1], p[2]].map(f32::from_bits),
        };
        let knots = ranks.iter().zip(positions.chunks_exact(3)).map(knot).collect();
        let n = head.triangles as usize;
        let corners = self.words(3 * n);
        let (births, deaths) = (self.words(n), self.words(n));
        let caps = self.0;
        let triangle = |i: usize| Triangle {
            vertices: [0, 1, 2].map(|c| corners[3 * i + c]),
            birth: births[i],
            death: deaths[i],
            cap: caps[i] != 0,
        };
        Patch {
            isovalues: isovalues.into_iter().map(f64::from_bits).collect(),
            first_knot,
            knots,
            triangles: (0..n).map(triangle).collect(),
            collapses: Vec::new(),
        }
    }
}
