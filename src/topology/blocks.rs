//! The events of a volume from its blocks, which are processed independently.
//!
//! # Theory
//!
//! A block with the samples around it contains all that its critical points depend on: their keys, which are those of the
//! whole ([`crate::volume::BlockPosition`]), and their stars, faces and cells. For each sample next to a saddle, the two
//! sweeps of the whole (`merge`) need the extremum at which a walk along falling or rising lattice edges ends. A walk in a
//! block ends at one of its extrema, or at the first sample that another block owns. So a block records the ends of the
//! walks from its saddles, and of those from samples at which a walk may enter. Joining the blocks concatenates walks.
//!
//! # Invariants
//!
//! - Every sample, face and cell has one owner: the block of its lowest sample.
//! - The joined topology passes the checks of a whole volume: the alternating sum of the critical points is 0, and the
//!   contour tree is a tree.

use std::collections::HashMap;

use num_bigint::BigInt;

use super::arcs::{Arc, ArcTree, n_arcs_in};
use super::critical::{
    CriticalPoint, CriticalPoints, GridElement, LAYER, layer, precise_value, sort_exactly,
};
use super::event::Event;
use super::exact::ExactField;
use super::merge::{Direction, MergeTree};
use super::net::net_events;
use super::pairs::extremum_pairs;
use crate::error::{Error, Result};
use crate::volume::{BlockPosition, Outside, Volume};

/// The samples of the whole that a block owns: the first, and one past the last, along x, y, z.
pub type Owned = [[usize; 2]; 3];

/// The critical points and walks of a block. Samples are numbered as in the padded grid of the whole.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BlockTopology {
    /// The critical points that it owns; their samples below and above are the ends of walks.
    pub(crate) points: Vec<CriticalPoint>,
    /// Its samples next to those of other blocks, each with the ends of the falling and of the rising walk.
    pub(crate) entries: Vec<[u32; 3]>,
}

/// The events and arcs of a whole volume.
#[derive(Clone, Debug)]
pub struct JoinedTopology {
    /// Its events without those that only the ramp makes, ascending.
    pub events: Vec<Event>,
    arcs: Vec<Arc>,
}

impl JoinedTopology {
    /// Number of arcs that exist somewhere in a range.
    pub fn n_arcs_in(&self, range: (f64, f64)) -> usize {
        n_arcs_in(&self.arcs, range)
    }
}

/// First sample and end of a block with one more sample than it owns on every side, where the whole has them.
pub fn with_halo(owned: Owned, whole: [usize; 3]) -> ([usize; 3], [usize; 3]) {
    let first = owned.map(|o| o[0].saturating_sub(1));
    (first, std::array::from_fn(|a| (owned[a][1] + 1).min(whole[a])))
}

/// Maps sample numbers of a block to those of the whole.
struct WholeNumbers {
    first: [usize; 3],
    whole: [usize; 3],
}

impl WholeNumbers {
    fn of(field: &ExactField) -> Result<WholeNumbers> {
        let BlockPosition { first, whole } = field.volume().block_position();
        let padded = whole.iter().try_fold(1u32, |n, &d| n.checked_mul(u32::try_from(d + 2).ok()?));
        let numbers = padded.map(|_| WholeNumbers { first, whole });
        numbers.ok_or_else(|| Error::input("2^32 samples or more, too many for the topology"))
    }

    fn of_vertex(&self, field: &ExactField, v: u32) -> u32 {
        if v == LAYER {
            return LAYER;
        }
        let p = field.position(v);
        let at = |a: usize| (p[a] + 1) as u32 + self.first[a] as u32;
        let [nx, ny, _] = self.whole.map(|n| n as u32 + 2);
        at(0) + nx * (at(1) + ny * at(2))
    }
}

/// The lowest sample of a grid element; none for the layer.
fn corner(element: GridElement) -> Option<u32> {
    match element {
        GridElement::Vertex(v) | GridElement::Face { corner: v, .. } | GridElement::Cell(v) => {
            Some(v)
        }
        GridElement::Layer => None,
    }
}

fn renumbered(element: GridElement, number: impl Fn(u32) -> u32) -> GridElement {
    match element {
        GridElement::Vertex(v) => GridElement::Vertex(number(v)),
        GridElement::Face { corner, axis } => GridElement::Face { corner: number(corner), axis },
        GridElement::Cell(v) => GridElement::Cell(number(v)),
        GridElement::Layer => GridElement::Layer,
    }
}

/// The topology of the samples that a block owns. The block must contain those around them too ([`with_halo`]).
///
/// # Errors
///
/// [`Error::Input`] if the whole has 2^32 samples or more; [`Error::Internal`] for walks that do not end.
pub fn block_topology(block: &Volume, owned: Owned) -> Result<BlockTopology> {
    let field = &ExactField::new(block)?;
    let numbers = WholeNumbers::of(field)?;
    let (points, falling, rising) = CriticalPoints::unordered(field)?;
    let whole_position = |v: u32| {
        let p = field.position(v);
        [0, 1, 2].map(|a| p[a] + numbers.first[a] as i64)
    };
    let owns = |v: u32| {
        let p = whole_position(v);
        v != LAYER && (0..3).all(|a| owned[a][0] as i64 <= p[a] && p[a] < owned[a][1] as i64)
    };
    let number = |v: u32| numbers.of_vertex(field, v);
    let falling = walk_ends(&falling, owns)?;
    let rising = walk_ends(&rising, owns)?;
    let end = |ends: &[u32], v: u32| number(ends[v as usize]);
    // The block at the corner whose key the layer has records the layer.
    let has_layer = match block.outside() {
        Outside::Low => owned.iter().all(|o| o[0] == 0),
        Outside::High => (0..3).all(|a| owned[a][1] == numbers.whole[a]),
    };
    let own = points.into_iter().filter(|p| corner(p.element).is_some_and(owns));
    let own = own.chain(has_layer.then(|| layer(field)));
    let points = own.map(|p| CriticalPoint {
        element: renumbered(p.element, number),
        low: p.low.map(|v| end(&falling, v)),
        high: p.high.map(|v| end(&rising, v)),
        ..p
    });
    let points = points.collect();
    let is_at_block_border = |p: [i64; 3]| {
        (0..3).any(|a| {
            let [first, end] = owned[a].map(|x| x as i64);
            (p[a] == first && first > 0) || (p[a] == end - 1 && end < numbers.whole[a] as i64)
        })
    };
    let all = 0..field.n_vertices() as u32;
    // A walk that starts in the layer continues at the first sample.
    let is_first = |v: u32| whole_position(v) == [0; 3];
    let entries =
        all.filter(|&v| owns(v) && (is_at_block_border(whole_position(v)) || is_first(v)));
    let entries = entries.map(|v| [number(v), end(&falling, v), end(&rising, v)]).collect();
    Ok(BlockTopology { points, entries })
}

/// The end of the walk from each sample: an extremum, or the first sample that the block does not own.
fn walk_ends(walk: &[u32], owns: impl Fn(u32) -> bool) -> Result<Vec<u32>> {
    let mut ends: Vec<Option<u32>> = vec![None; walk.len()];
    let mut path = Vec::new();
    for start in 0..walk.len() as u32 {
        let mut v = start;
        let end = loop {
            if let Some(end) = ends[v as usize] {
                break end;
            }
            if path.len() > walk.len() {
                return Err(Error::internal("a walk along the lattice does not end"));
            }
            path.push(v);
            let next = walk[v as usize];
            if !owns(v) || next == v {
                break v;
            }
            v = next;
        };
        path.drain(..).for_each(|v| ends[v as usize] = Some(end));
    }
    Ok(ends.into_iter().map(|end| end.unwrap_or(LAYER)).collect())
}

/// Joins the topology of all blocks of a volume. `block` reads a few samples of the volume.
///
/// # Errors
///
/// [`Error::Internal`] if they contradict each other; those of `block`.
pub fn join_blocks(
    blocks: Vec<BlockTopology>,
    (whole, outside): ([usize; 3], Outside),
    block: impl Fn([usize; 3], [usize; 3]) -> Result<Volume> + Sync,
) -> Result<JoinedTopology> {
    // The same for all blocks.
    let keys = ExactField::new(&block([0; 3], [2; 3])?)?.isovalue_keys();
    let n_points = blocks.iter().map(|b| b.points.len()).sum();
    let mut points: Vec<CriticalPoint> = Vec::with_capacity(n_points);
    let mut walks: HashMap<u32, [u32; 2]> = HashMap::new();
    for b in blocks {
        points.extend(b.points);
        walks.extend(b.entries.iter().map(|&[v, falling, rising]| (v, [falling, rising])));
    }
    // The layer is the lowest sample, or the highest.
    let first = 1 + (whole[0] as u32 + 2) * (1 + (whole[1] as u32 + 2));
    let beyond = walks.get(&first).copied().unwrap_or([LAYER; 2]);
    walks.insert(
        LAYER,
        match outside {
            Outside::Low => [LAYER, beyond[1]],
            Outside::High => [beyond[0], LAYER],
        },
    );
    sort_exactly(&mut points, |run| {
        let value = |p: &CriticalPoint| precise_at(p, whole, &block);
        run.iter().map(value).collect()
    })?;
    let nodes = [Direction::Up, Direction::Down].map(|d| extrema(&points, d));
    let [low, high] = [0, 1].map(|side| WalkEnds { nodes: &nodes[side], walks: &walks, side });
    for p in &mut points {
        (p.low, p.high) = (low.of(p.low)?, high.of(p.high)?);
    }
    // Free memory for the trees.
    drop((nodes, walks));
    let join = MergeTree::of_nodes(Direction::Up, &points)?;
    let split = MergeTree::of_nodes(Direction::Down, &points)?;
    let tree = ArcTree::of(points, &join, &split, outside, keys)?;
    let pairs = extremum_pairs(&tree.events, tree.layer, [&join, &split]);
    Ok(JoinedTopology { events: net_events(&tree.events, &tree.arcs, &pairs), arcs: tree.arcs })
}

/// The nodes of the extrema at which walks in a direction end, by sample.
fn extrema(points: &[CriticalPoint], direction: Direction) -> HashMap<u32, u32> {
    let own = points.iter().zip(0..).filter(|(p, _)| direction.starts_at(p));
    own.map(|(p, node)| (direction.own_sample(p), node)).collect()
}

/// Maps the ends of the walks of blocks to the nodes of extrema.
struct WalkEnds<'a> {
    nodes: &'a HashMap<u32, u32>,
    walks: &'a HashMap<u32, [u32; 2]>,
    side: usize,
}

impl WalkEnds<'_> {
    fn of(&self, samples: [u32; 2]) -> Result<[u32; 2]> {
        let [a, b] = samples.map(|sample| self.node(sample));
        Ok([a?, b?])
    }

    fn node(&self, mut sample: u32) -> Result<u32> {
        let broken =
            |sample| Error::internal(format!("a walk does not continue at sample {sample}"));
        for _ in 0..=self.walks.len() {
            if let Some(&node) = self.nodes.get(&sample) {
                return Ok(node);
            }
            sample = self.walks.get(&sample).ok_or_else(|| broken(sample))?[self.side];
        }
        Err(broken(sample))
    }
}

/// The exact value of a point, from the samples around it.
fn precise_at(
    point: &CriticalPoint,
    whole: [usize; 3],
    block: &impl Fn([usize; 3], [usize; 3]) -> Result<Volume>,
) -> Result<BigInt> {
    let Some(v) =
        corner(point.element).filter(|_| !matches!(point.element, GridElement::Vertex(_)))
    else {
        return Ok(precise_value(None, point));
    };
    let [nx, ny] = [whole[0] as u32 + 2, whole[1] as u32 + 2];
    let p = [v % nx, v / nx % ny, v / (nx * ny)].map(|x| (x as usize).wrapping_sub(1));
    if (0..3).any(|a| p[a] >= whole[a]) {
        return Err(Error::input(format!("a critical point at sample {v}, outside the volume")));
    }
    // A face at the upper end of the volume has only a cell below.
    let first: [usize; 3] = std::array::from_fn(|a| p[a].min(whole[a] - 2));
    let volume = block(first, first.map(|f| f + 2))?;
    let field = ExactField::new(&volume)?;
    let own = field.vertex([0, 1, 2].map(|a| (p[a] - first[a]) as i64));
    let element = renumbered(point.element, |_| own);
    Ok(precise_value(Some(&field), &CriticalPoint { element, ..*point }))
}
