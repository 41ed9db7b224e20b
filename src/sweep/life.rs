//! Lifetimes of triangles, whose vertices are given by their trajectories.

use super::region::LatticeEdge;

/// Which trajectory a vertex has.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(super) enum Track {
    /// That of a lattice edge.
    Edge(LatticeEdge),
    /// One of its own, by number.
    Own(u32),
    /// That of a vertex inside an exact cell, by number.
    Inner(u32),
}

/// A triangle over the isovalues at which it lives.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Life {
    pub(super) vertices: [Track; 3],
    pub(super) low: f64,
    pub(super) high: f64,
    pub(super) cap: bool,
}

/// The order of lives: those of the tracked mesh first, then triangle by triangle, ascending in time.
pub(super) fn by_triangle(a: &Life, b: &Life) -> std::cmp::Ordering {
    let is_exact = |l: &Life| !is_tracked(l);
    let key = |l: &Life| (is_exact(l), l.vertices);
    key(a).cmp(&key(b)).then(a.low.total_cmp(&b.low)).then(a.high.total_cmp(&b.high))
}

/// Whether a life is one of the tracked mesh. Between vertices of the seam alone there is next to nothing of that.
pub(super) fn is_tracked(l: &Life) -> bool {
    l.vertices.iter().any(|t| matches!(t, Track::Own(_)))
}

/// Joins the lives of one triangle over intervals that follow each other, in place: there are many.
pub(super) fn merge_consecutive(lives: &mut Vec<Life>, first: usize) {
    lives[first..].sort_unstable_by(by_triangle);
    merge_sorted(lives, first);
}

/// The same, once they are in order.
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
