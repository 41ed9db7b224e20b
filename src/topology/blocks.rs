//! The events of a volume from its blocks, none of which knows the others.
//!
//! # Theory
//!
//! A block with the samples around it has all that its critical points depend on: their keys, which are the whole's
//! ([`crate::volume::Within`]), and their stars, faces and cells. The two sweeps of the whole (`merge`) ask for no more than, of
//! each sample beside a saddle, the extremum that a walk along falling or rising lattice edges ends at. A walk in a block ends at
//! an extremum of it, or at the first sample that another block owns. So a block tells where the walks from its saddles end, and
//! those from its samples that a walk may come in at; to go on where another block's walk has ended is all that is left to do.
//!
//! # Invariants
//!
//! - Every sample, face and cell is owned by one block: that of its lowest sample.
//! - What is joined passes the checks of a whole volume's topology: the alternating sum of the critical points is 0, and the
//!   contour tree is a tree.

use std::collections::HashMap;

use num_bigint::BigInt;

use super::critical::{
    CriticalPoint, CriticalPoints, LAYER, Place, in_order, layer, precise_value,
};
use super::exact::ExactField;
use super::merge::{Direction, MergeTree};
use super::{Arc, Tree};
use crate::error::{Error, Result};
use crate::topology::Event;
use crate::volume::{Outside, Volume, Within};

/// A block's samples in the whole, the first and the one behind the last along x, y, z.
pub type Owned = [[usize; 2]; 3];

/// What a block tells of the topology. Samples are numbered as in the padded grid of the whole.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BlockTopology {
    /// The critical points that it owns; the samples beside them are the ends of walks from there.
    pub(crate) points: Vec<CriticalPoint>,
    /// Its samples beside those of other blocks, each with the ends of the falling and of the rising walk from there.
    pub(crate) entries: Vec<[u32; 3]>,
}

/// The events of a whole volume, and how its arcs show.
#[derive(Clone, Debug)]
pub struct JoinedTopology {
    /// Its events, those of the ramp left out, ascending.
    pub events: Vec<Event>,
    arcs: Vec<Arc>,
}

impl JoinedTopology {
    /// How many arcs show somewhere in a range.
    pub fn n_arcs_in(&self, range: (f64, f64)) -> usize {
        super::n_arcs_in(&self.arcs, range)
    }
}

/// The samples that a block needs to tell of those that it owns: one more on every side where there are any.
pub fn with_halo(owned: Owned, whole: [usize; 3]) -> ([usize; 3], [usize; 3]) {
    let first = owned.map(|o| o[0].saturating_sub(1));
    (first, std::array::from_fn(|a| (owned[a][1] + 1).min(whole[a])))
}

/// The numbers of a block's samples in the whole.
struct Numbers {
    first: [usize; 3],
    whole: [usize; 3],
}

impl Numbers {
    fn of(field: &ExactField) -> Result<Numbers> {
        let Within { first, whole } = field.volume().within();
        let padded = whole.iter().try_fold(1u32, |n, &d| n.checked_mul(u32::try_from(d + 2).ok()?));
        let numbers = padded.map(|_| Numbers { first, whole });
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

/// Where the lowest sample of a place is; none of the layer.
fn corner(place: Place) -> Option<u32> {
    match place {
        Place::Vertex(v) | Place::Face { corner: v, .. } | Place::Cell(v) => Some(v),
        Place::Layer => None,
    }
}

fn moved(place: Place, number: impl Fn(u32) -> u32) -> Place {
    match place {
        Place::Vertex(v) => Place::Vertex(number(v)),
        Place::Face { corner, axis } => Place::Face { corner: number(corner), axis },
        Place::Cell(v) => Place::Cell(number(v)),
        Place::Layer => Place::Layer,
    }
}

/// The topology of the samples that a block owns, which has those around them too ([`with_halo`]).
///
/// # Errors
///
/// [`Error::Input`] if the whole has 2^32 samples or more; [`Error::Internal`] for walks that do not end.
pub fn of_block(block: &Volume, owned: Owned) -> Result<BlockTopology> {
    let field = &ExactField::new(block)?;
    let numbers = Numbers::of(field)?;
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
    let falling = ends(&falling, owns)?;
    let rising = ends(&rising, owns)?;
    let end = |ends: &[u32], v: u32| number(ends[v as usize]);
    // The layer is told of by the block at the corner whose key it has.
    let has_layer = match block.outside() {
        Outside::Low => owned.iter().all(|o| o[0] == 0),
        Outside::High => (0..3).all(|a| owned[a][1] == numbers.whole[a]),
    };
    let own = points.into_iter().filter(|p| corner(p.place).is_some_and(owns));
    let own = own.chain(has_layer.then(|| layer(field)));
    let points = own.map(|p| CriticalPoint {
        place: moved(p.place, number),
        low: p.low.map(|v| end(&falling, v)),
        high: p.high.map(|v| end(&rising, v)),
        ..p
    });
    let points = points.collect();
    let beside = |p: [i64; 3]| {
        (0..3).any(|a| {
            let [first, end] = owned[a].map(|x| x as i64);
            (p[a] == first && first > 0) || (p[a] == end - 1 && end < numbers.whole[a] as i64)
        })
    };
    let all = 0..field.n_vertices() as u32;
    // A walk that starts in the layer on its far side goes on at the first sample.
    let is_first = |v: u32| whole_position(v) == [0; 3];
    let entries = all.filter(|&v| owns(v) && (beside(whole_position(v)) || is_first(v)));
    let entries = entries.map(|v| [number(v), end(&falling, v), end(&rising, v)]).collect();
    Ok(BlockTopology { points, entries })
}

/// Where walks end, by sample: at an extremum, or at the first sample that is not owned.
fn ends(walk: &[u32], owns: impl Fn(u32) -> bool) -> Result<Vec<u32>> {
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

/// Joins what all blocks of a volume tell. `block` gives a few samples of the volume.
///
/// # Errors
///
/// [`Error::Internal`] if they contradict each other; those of `block`.
pub fn joined(
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
    in_order(&mut points, |run| {
        let value = |p: &CriticalPoint| precise_at(p, whole, &block);
        run.iter().map(value).collect()
    })?;
    let nodes = [Direction::Up, Direction::Down].map(|d| extrema(&points, d));
    let [low, high] = [0, 1].map(|side| Ends { nodes: &nodes[side], walks: &walks, side });
    for p in &mut points {
        (p.low, p.high) = (low.of(p.low)?, high.of(p.high)?);
    }
    // The trees want the room.
    drop((nodes, walks));
    let join = MergeTree::of_nodes(Direction::Up, &points)?;
    let split = MergeTree::of_nodes(Direction::Down, &points)?;
    let tree = Tree::of(points, &join, &split, outside, keys)?;
    Ok(JoinedTopology { events: super::net::net_events(&tree.events, &tree.arcs), arcs: tree.arcs })
}

/// The nodes of the extrema that walks in a direction end at, by their samples.
fn extrema(points: &[CriticalPoint], direction: Direction) -> HashMap<u32, u32> {
    let own = points.iter().zip(0..).filter(|(p, _)| direction.begins_at(p));
    own.map(|(p, node)| (direction.own_sample(p), node)).collect()
}

/// From the samples that walks of blocks end at to the nodes of extrema.
struct Ends<'a> {
    nodes: &'a HashMap<u32, u32>,
    walks: &'a HashMap<u32, [u32; 2]>,
    side: usize,
}

impl Ends<'_> {
    fn of(&self, samples: [u32; 2]) -> Result<[u32; 2]> {
        let [a, b] = samples.map(|sample| self.node(sample));
        Ok([a?, b?])
    }

    fn node(&self, mut sample: u32) -> Result<u32> {
        let lost = |sample| Error::internal(format!("a walk is lost at sample {sample}"));
        for _ in 0..=self.walks.len() {
            if let Some(&node) = self.nodes.get(&sample) {
                return Ok(node);
            }
            sample = self.walks.get(&sample).ok_or_else(|| lost(sample))?[self.side];
        }
        Err(lost(sample))
    }
}

/// The exact value of a point, by the samples around it.
fn precise_at(
    point: &CriticalPoint,
    whole: [usize; 3],
    block: &impl Fn([usize; 3], [usize; 3]) -> Result<Volume>,
) -> Result<BigInt> {
    let Some(v) = corner(point.place).filter(|_| !matches!(point.place, Place::Vertex(_))) else {
        return Ok(precise_value(None, point));
    };
    let [nx, ny] = [whole[0] as u32 + 2, whole[1] as u32 + 2];
    let p = [v % nx, v / nx % ny, v / (nx * ny)].map(|x| (x as usize).wrapping_sub(1));
    if (0..3).any(|a| p[a] >= whole[a]) {
        return Err(Error::input(format!("a critical point at sample {v}, which is none")));
    }
    // A face at the upper end of the volume has cells below it only.
    let first: [usize; 3] = std::array::from_fn(|a| p[a].min(whole[a] - 2));
    let volume = block(first, first.map(|f| f + 2))?;
    let field = ExactField::new(&volume)?;
    let own = field.vertex([0, 1, 2].map(|a| (p[a] - first[a]) as i64));
    let place = moved(point.place, |_| own);
    Ok(precise_value(Some(&field), &CriticalPoint { place, ..*point }))
}
