//! Lifetimes of triangles, whose vertices are given by their trajectories.

use super::isovalue_ranks::IsovalueRanks;
use super::track::{Track, TrackCodes};
use crate::spectrum::Triangle;

/// The lifetime of a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Life {
    pub(super) vertices: [Track; 3],
    pub(super) low: f64,
    pub(super) high: f64,
    pub(super) cap: bool,
}

impl Life {
    /// The triangle with the codes of its trajectories in place of vertices, and ranks of a table of isovalues.
    pub(super) fn coded(&self, codes: TrackCodes, ends: &IsovalueRanks) -> Triangle {
        let [birth, death] = [self.low, self.high].map(|c| ends.rank(c));
        Triangle { vertices: self.vertices.map(|t| codes.code(t)), birth, death, cap: self.cap }
    }
}

/// Joins the lifetimes of the same triangle over consecutive intervals, from number `first` on, where triangles are sorted by vertices and birth.
pub(super) fn merge_sorted(triangles: &mut Vec<Triangle>, first: usize) {
    let mut end = first;
    for i in first..triangles.len() {
        let next = triangles[i];
        match triangles[first..end].last_mut() {
            Some(last) if last.vertices == next.vertices && last.death == next.birth => {
                last.death = next.death;
            }
            _ => {
                triangles[end] = next;
                end += 1;
            }
        }
    }
    triangles.truncate(end);
}
