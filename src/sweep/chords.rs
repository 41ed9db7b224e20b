//! Splits edges of tracked triangles between two vertices of a shared plane: the neighbouring block may have the same edge.
//!
//! # Invariants
//!
//! All triangles of such an edge get the same vertex in its middle, so the mesh stays closed and its shape is unchanged.

use std::collections::BTreeMap;

use glam::Vec3;

use super::life::Life;
use super::patch::edge_trajectory;
use super::region::{LatticeEdge, PaddedGrid};
use super::shared::SharedPlanes;
use super::track::Track;
use crate::topology::exact::ExactField;

/// The ends of a chord, ascending.
type Chord = [LatticeEdge; 2];

/// Splits all chords in the upper shared planes of the block. New trajectories are appended to `inner`, in the
/// frame of the block.
pub(super) fn split_chords(
    lives: &mut Vec<Life>,
    inner: &mut Vec<Vec<(f64, Vec3)>>,
    field: &ExactField,
    range: (f64, f64),
) {
    let shared = SharedPlanes::of(field);
    if shared.is_empty() {
        return;
    }
    let grid = PaddedGrid::of(field);
    let chord = |a: Track, b: Track| -> Option<Chord> {
        let (Track::Edge(e), Track::Edge(f)) = (a, b) else { return None };
        let is_chord = shared.is_upper(e, f) && !have_a_cell(grid, e, f);
        is_chord.then(|| [e.min(f), e.max(f)])
    };
    let chords = |t: [Track; 3]| [0, 1, 2].map(|i| chord(t[i], t[(i + 1) % 3]));
    let mut spans: BTreeMap<Chord, (f64, f64)> = BTreeMap::new();
    for life in lives.iter() {
        for chord in chords(life.vertices).into_iter().flatten() {
            let span = spans.entry(chord).or_insert((life.low, life.high));
            *span = (span.0.min(life.low), span.1.max(life.high));
        }
    }
    if spans.is_empty() {
        return;
    }
    log::debug!("{} chords over shared planes are split", spans.len());
    let mut middles: BTreeMap<Chord, Track> = BTreeMap::new();
    for (chord, (low, high)) in spans {
        let trajectories = chord.map(|e| edge_trajectory(field, e, range));
        let middle = |c: f64| (c, 0.5 * (at(&trajectories[0], c) + at(&trajectories[1], c)));
        middles.insert(chord, Track::Inner(inner.len() as u32));
        inner.push(vec![middle(low), middle(high)]);
    }
    let (split, whole): (Vec<Life>, Vec<Life>) = std::mem::take(lives)
        .into_iter()
        .partition(|l| chords(l.vertices).iter().any(Option::is_some));
    *lives = whole;
    for life in split {
        let middles = chords(life.vertices).map(|c| c.map(|c| middles[&c]));
        lives.extend(
            pieces(life.vertices, middles).into_iter().map(|vertices| Life { vertices, ..life }),
        );
    }
}

/// Whether two lattice edges are edges of one cell.
fn have_a_cell(grid: PaddedGrid, e: LatticeEdge, f: LatticeEdge) -> bool {
    let ends = [e, f].map(|e| grid.ends(e).map(|v| grid.position(v)));
    (0..3).all(|a| {
        let along = ends.as_flattened().iter().map(|p| p[a]);
        let (low, high) = along.fold((usize::MAX, 0), |(l, h), x| (l.min(x), h.max(x)));
        high - low <= 1
    })
}

/// The position on a trajectory of two knots at an isovalue.
fn at([a, b]: &[(f64, Vec3); 2], isovalue: f64) -> Vec3 {
    let share = ((isovalue - a.0) / (b.0 - a.0)).clamp(0.0, 1.0);
    a.1.lerp(b.1, share as f32)
}

/// A triangle some of whose edges have a vertex in their middle.
fn pieces(t: [Track; 3], middles: [Option<Track>; 3]) -> Vec<[Track; 3]> {
    let n = middles.iter().flatten().count();
    // The triangle is rotated such that its first edges are the ones with a middle vertex.
    let first = match n {
        1 => middles.iter().position(Option::is_some),
        2 => middles.iter().position(Option::is_none).map(|i| (i + 1) % 3),
        _ => Some(0),
    };
    let turn = first.unwrap_or(0);
    let [a, b, c] = [0, 1, 2].map(|i| t[(i + turn) % 3]);
    match [0, 1, 2].map(|i| middles[(i + turn) % 3]) {
        [Some(m), None, None] => vec![[a, m, c], [m, b, c]],
        [Some(m), Some(n), None] => vec![[m, b, n], [a, m, n], [a, n, c]],
        [Some(m), Some(n), Some(o)] => vec![[a, m, o], [m, b, n], [n, c, o], [m, n, o]],
        _ => vec![[a, b, c]],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pieces_cover_a_triangle_once() {
        let own = Track::Own;
        // Opposite half-edges cancel; the rest must be the border of the triangle with its middle vertices.
        for mask in 1..8u32 {
            let middles = [0, 1, 2].map(|i| (mask >> i & 1 == 1).then_some(own(10 + i)));
            let t = [own(0), own(1), own(2)];
            let mut edges: Vec<(Track, Track)> = Vec::new();
            for piece in pieces(t, middles) {
                for i in 0..3 {
                    let edge = (piece[i], piece[(i + 1) % 3]);
                    match edges.iter().position(|e| *e == (edge.1, edge.0)) {
                        Some(at) => {
                            edges.swap_remove(at);
                        }
                        None => edges.push(edge),
                    }
                }
            }
            let mut border: Vec<(Track, Track)> = (0..3)
                .flat_map(|i| {
                    let (a, b) = (t[i], t[(i + 1) % 3]);
                    middles[i].map_or_else(|| vec![(a, b)], |m| vec![(a, m), (m, b)])
                })
                .collect();
            edges.sort();
            border.sort();
            assert_eq!(edges, border, "{mask}");
        }
    }
}
