//! Critical points and monotone walks in a part's file, as 32-bit words.
//!
//! A point takes 18 words: its key (4, low ones first), its isovalue (2) and position (6) as bits, its index and the kind of its
//! place (1), the sample of the place (1), the ends of the walks below (2) and above (2). A walk takes 3: its sample and both
//! ends. All points precede all walks.

use crate::topology::blocks::BlockTopology;
use crate::topology::critical::{CriticalPoint, GridElement, LAYER};

/// Words of a point.
pub(super) const WORDS: usize = 18;

/// Kinds of places, after the faces, whose kind is their axis.
const VERTEX: u32 = 3;
const CELL: u32 = 4;
const OUTER_LAYER: u32 = 5;

/// Bound on the magnitude of a key: differences of keys below it do not overflow.
const MAX_KEY: u128 = 1 << 125;

/// The words of all points and walks.
pub(super) fn encode(topology: &BlockTopology) -> impl Iterator<Item = u32> {
    let points = topology.points.iter().flat_map(encode_point);
    points.chain(topology.entries.iter().copied().flatten())
}

fn encode_point(p: &CriticalPoint) -> [u32; WORDS] {
    let (kind, sample) = match p.element {
        GridElement::Vertex(v) => (VERTEX, v),
        GridElement::Face { corner, axis } => (u32::from(axis), corner),
        GridElement::Cell(v) => (CELL, v),
        GridElement::Layer => (OUTER_LAYER, LAYER),
    };
    let key = p.key as u128;
    let [x, y, z] = p.position.map(f64::to_bits);
    let halves = |n: u64| [n as u32, (n >> 32) as u32];
    let mut numbers = [0; WORDS];
    let all = [0, 32, 64, 96].map(|shift| (key >> shift) as u32).into_iter();
    let all = all.chain([p.isovalue.to_bits(), x, y, z].into_iter().flat_map(halves));
    let all = all.chain([u32::from(p.index) | kind << 2, sample]).chain(p.low).chain(p.high);
    numbers.iter_mut().zip(all).for_each(|(to, from)| *to = from);
    numbers
}

/// Points and walks from their words; `None` if a word is invalid.
pub(super) fn decode(points: &[u32], entries: &[u32]) -> Option<BlockTopology> {
    let points = points.chunks_exact(WORDS).map(decode_point).collect::<Option<_>>()?;
    let entries = entries.chunks_exact(3).map(|e| [e[0], e[1], e[2]]).collect();
    Some(BlockTopology { points, entries })
}

fn decode_point(n: &[u32]) -> Option<CriticalPoint> {
    let key = n[..4].iter().rev().fold(0u128, |key, &x| key << 32 | u128::from(x));
    let float = |at: usize| f64::from_bits(u64::from(n[at]) | u64::from(n[at + 1]) << 32);
    let (index, sample) = ((n[12] & 3) as u8, n[13]);
    let element = match n[12] >> 2 {
        axis @ 0..3 => GridElement::Face { corner: sample, axis: axis as u8 },
        VERTEX => GridElement::Vertex(sample),
        CELL => GridElement::Cell(sample),
        OUTER_LAYER => GridElement::Layer,
        _ => return None,
    };
    let position = [6, 8, 10].map(float);
    let isovalue = float(4);
    let is_finite = isovalue.is_finite() && position.iter().all(|x| x.is_finite());
    let is_key = (key as i128).unsigned_abs() < MAX_KEY;
    (is_finite && is_key).then_some(CriticalPoint {
        key: key as i128,
        isovalue,
        position,
        index,
        element,
        low: [n[14], n[15]],
        high: [n[16], n[17]],
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::topology::blocks::block_topology;
    use crate::volume::phantom;

    #[test]
    fn points_and_walks_survive_a_round_trip() {
        let volume = phantom("noise:9:3").expect("a phantom");
        let block = volume.block([0; 3], [7, 9, 9]).expect("inside");
        let all = block_topology(&block, [[0, 6], [0, 9], [0, 9]]).expect("a topology");
        assert!(all.points.len() > 20 && !all.entries.is_empty());
        let words: Vec<u32> = encode(&all).collect();
        let (points, entries) = words.split_at(WORDS * all.points.len());
        assert_eq!(decode(points, entries), Some(all));
    }
}
