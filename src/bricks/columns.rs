//! The columns of a part's file: every number is written as one or two of 32 bits, low half first.

use std::io::{Result, Write};

use super::critical;
use super::part::{PartHead, SharedVertex};
use crate::spectrum::{Knot, Patch, Spectrum, Triangle};
use crate::topology::blocks::BlockTopology;

fn halves(n: u64) -> [u32; 2] {
    [n as u32, (n >> 32) as u32]
}

fn numbers(to: &mut dyn Write, mut numbers: impl Iterator<Item = u32>) -> Result<()> {
    numbers.try_for_each(|n| to.write_all(&n.to_le_bytes()))
}

/// Writes the columns of a border.
pub(super) fn write_border(
    shared: &[SharedVertex],
    topology: &BlockTopology,
    to: &mut dyn Write,
) -> Result<()> {
    let knots = || shared.iter().flat_map(|s| s.knots);
    numbers(to, shared.iter().map(|s| s.vertex))?;
    numbers(to, shared.iter().flat_map(|s| halves(s.edge)))?;
    numbers(to, knots().flat_map(|k| halves(k.0.to_bits())))?;
    numbers(to, knots().flat_map(|k| k.1.map(f32::to_bits)))?;
    numbers(to, critical::numbers(topology))
}

/// Writes the columns of a body.
pub(super) fn write_body(s: &Spectrum, to: &mut dyn Write) -> Result<()> {
    numbers(to, s.isovalues().iter().flat_map(|c| halves(c.to_bits())))?;
    numbers(to, s.first_knot().iter().copied())?;
    numbers(to, s.knots().iter().map(|k| k.rank))?;
    numbers(to, s.knots().iter().flat_map(|k| k.position.map(f32::to_bits)))?;
    numbers(to, s.triangles().iter().flat_map(|t| t.vertices))?;
    numbers(to, s.triangles().iter().map(|t| t.birth))?;
    numbers(to, s.triangles().iter().map(|t| t.death))?;
    let caps: Vec<u8> = s.triangles().iter().map(|t| u8::from(t.cap)).collect();
    to.write_all(&caps)
}

/// What is left of columns; there is as much as the head says.
pub(super) struct Columns<'a>(pub(super) &'a [u8]);

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

    /// The shared vertices of a border and its topology; no topology where a number means nothing.
    pub(super) fn border(mut self, head: &PartHead) -> (Vec<SharedVertex>, Option<BlockTopology>) {
        let n = head.shared as usize;
        let (vertices, edges) = (self.numbers(n), self.longs(n));
        let (isovalues, places) = (self.longs(2 * n), self.numbers(6 * n));
        let knot = |k: usize| {
            let position = [0, 1, 2].map(|a| f32::from_bits(places[3 * k + a]));
            (f64::from_bits(isovalues[k]), position)
        };
        let shared = (0..n).map(|i| SharedVertex {
            vertex: vertices[i],
            edge: edges[i],
            knots: [knot(2 * i), knot(2 * i + 1)],
        });
        let critical = self.numbers(critical::NUMBERS * head.critical as usize);
        let entries = self.numbers(3 * head.entries as usize);
        (shared.collect(), critical::topology(&critical, &entries))
    }

    /// The triangles of a body.
    pub(super) fn body(mut self, head: &PartHead) -> Patch {
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
