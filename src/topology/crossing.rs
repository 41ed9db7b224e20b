//! A lattice edge that a given component crosses, found from an event without looking at the rest of
//! the volume.
//!
//! # Theory
//!
//! Just above the event at which an arc begins, its component crosses a lattice edge beside the
//! critical point, from a sample below the event to one above it. Where the isovalue reaches the
//! higher sample of such an edge, and the sample is no event of the component, the component goes
//! on to cross every edge that rises from it: what it encloses there is connected around the sample.
//! So a rising walk finds an edge for any isovalue of the arc; a falling walk does from the event at
//! its end. The order of samples is that of the generic field, so plateaus are no special case. What
//! is found is asked for its arc, because components that meet at the event share its edges.

use super::critical::Place;
use super::exact::ExactField;
use super::{Topology, TopologyEvent};

/// Which way a walk along lattice edges leads.
#[derive(Clone, Copy, PartialEq)]
enum Walk {
    Rising,
    Falling,
}

impl Topology {
    /// A lattice edge that the component of an arc crosses at an isovalue, as (sample not above the
    /// isovalue, sample above it), both of the padded grid. `None` where no walk from the arc's two
    /// events finds one, as where it begins and ends at the layer.
    pub fn crossing_of(
        &self,
        field: &ExactField<'_>,
        arc: usize,
        isovalue: f64,
    ) -> Option<(u32, u32)> {
        let level = field.isovalue_level(isovalue);
        let found = |event: Option<u32>, walk: Walk| {
            let event = &self.events[event? as usize];
            edges_at(field, event).into_iter().find_map(|edge| {
                let (low, high) = follow(field, edge, level, walk)?;
                (self.arc_of(low, high, isovalue) == Some(arc)).then_some((low, high))
            })
        };
        let arc = &self.arcs[arc];
        found(arc.birth_event, Walk::Rising).or_else(|| found(arc.death_event, Walk::Falling))
    }
}

/// The lattice edges beside an event from a sample that is not above it to one that is not below it.
fn edges_at(field: &ExactField, event: &TopologyEvent) -> Vec<(u32, u32)> {
    let strides = field.strides();
    match event.place {
        Place::Vertex(v) => neighbours(field, v)
            .map(|u| if field.key(u) > field.key(v) { (v, u) } else { (u, v) })
            .collect(),
        Place::Face { corner, axis } => {
            let [u, v] = [1, 2].map(|n| strides[(axis as usize + n) % 3]);
            rising_pairs(field, event, &[corner, corner + u, corner + u + v, corner + v])
        }
        Place::Cell(corner) => {
            rising_pairs(field, event, &field.cell_offsets().map(|o| corner + o))
        }
        Place::Layer => Vec::new(),
    }
}

/// The lattice edges between some samples that lead from below an event to above it.
fn rising_pairs(field: &ExactField, event: &TopologyEvent, corners: &[u32]) -> Vec<(u32, u32)> {
    let strides = field.strides();
    let mut pairs = Vec::new();
    for &low in corners.iter().filter(|&&c| field.order_key(c) <= event.key) {
        for &high in corners.iter().filter(|&&c| field.order_key(c) > event.key) {
            if strides.contains(&low.abs_diff(high)) {
                pairs.push((low, high));
            }
        }
    }
    pairs
}

/// Walks from an edge until one has a sample on either side of a level.
fn follow(
    field: &ExactField,
    (mut low, mut high): (u32, u32),
    level: i64,
    walk: Walk,
) -> Option<(u32, u32)> {
    loop {
        let is_below = field.level(low) <= level;
        let is_above = field.level(high) > level;
        match walk {
            _ if is_below && is_above => return Some((low, high)),
            Walk::Rising if is_below => {
                let next = neighbours(field, high).max_by_key(|&u| field.key(u))?;
                if field.key(next) <= field.key(high) {
                    return None;
                }
                (low, high) = (high, next);
            }
            Walk::Falling if is_above => {
                let next = neighbours(field, low).min_by_key(|&u| field.key(u))?;
                if field.key(next) >= field.key(low) {
                    return None;
                }
                (low, high) = (next, low);
            }
            _ => return None,
        }
    }
}

/// The neighbours of a sample along lattice edges.
fn neighbours<'f>(field: &'f ExactField, vertex: u32) -> impl Iterator<Item = u32> + 'f {
    let strides = field.strides();
    let dims = field.dims();
    let position = field.position(vertex).map(|p| (p + 1) as usize);
    (0..3).flat_map(move |a| {
        let before = (position[a] > 0).then(|| vertex - strides[a]);
        let after = (position[a] + 1 < dims[a]).then(|| vertex + strides[a]);
        [before, after].into_iter().flatten()
    })
}
