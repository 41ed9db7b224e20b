//! Lifetimes of triangles, whose vertices are given by their trajectories.

use super::region::LatticeEdge;

/// The trajectory of a vertex.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(super) enum Track {
    /// The trajectory along a lattice edge.
    Edge(LatticeEdge),
    /// The own trajectory of a tracked vertex, by number.
    Own(u32),
    /// The trajectory of a vertex inside an exact cell, by number.
    Inner(u32),
}

/// The lifetime of a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Life {
    pub(super) vertices: [Track; 3],
    pub(super) low: f64,
    pub(super) high: f64,
    pub(super) cap: bool,
}

/// Order of lifetimes: those of the tracked mesh first, then by triangle, then by isovalue.
pub(super) fn compare_by_triangle(a: &Life, b: &Life) -> std::cmp::Ordering {
    let is_exact = |l: &Life| !is_tracked(l);
    let key = |l: &Life| (is_exact(l), l.vertices);
    key(a).cmp(&key(b)).then(a.low.total_cmp(&b.low)).then(a.high.total_cmp(&b.high))
}

/// Whether a triangle is one of the tracked mesh: whether it has a tracked vertex. Tracked triangles with three vertices
/// on the seam are very rare.
pub(super) fn is_tracked(l: &Life) -> bool {
    l.vertices.iter().any(|t| matches!(t, Track::Own(_)))
}

/// Sorts the lifetimes from `first`, and joins those of the same triangle over consecutive intervals, in place.
pub(super) fn merge_consecutive(lives: &mut Vec<Life>, first: usize) {
    lives[first..].sort_unstable_by(compare_by_triangle);
    merge_sorted(lives, first);
}

/// Joins consecutive lifetimes that are sorted.
pub(super) fn merge_sorted(lives: &mut Vec<Life>, first: usize) {
    let mut end = first;
    for i in first..lives.len() {
        let (vertices, low, high) = (lives[i].vertices, lives[i].low, lives[i].high);
        match lives[first..end].last_mut() {
            Some(last) if last.vertices == vertices && last.high == low => last.high = high,
            _ => {
                lives.swap(end, i);
                end += 1;
            }
        }
    }
    lives.truncate(end);
}
