//! Excursions: where one of two rims passes the curve in which the isosurface meets the border of the volume, and
//! comes back, and the other does not.

use glam::Vec3;

use super::rim::RimVertex;
use super::zip::{StripTriangle, zip};

/// An excursion whose ends are farther apart than this, voxels, is not closed: the curve between them is not straight.
const WIDEST: f32 = 1.5;

/// Joins a rim that stays and one that comes in, both in the direction of their own faces, by a strip. Excursions of
/// which one rim has more are closed first, straight along the curve. Else the places where the rims should be others.
pub(super) fn join(
    staying: &[RimVertex],
    incoming: &[RimVertex],
) -> Result<Vec<StripTriangle>, Vec<Vec3>> {
    let mut rims = [staying.to_vec(), incoming.to_vec()];
    let mut closed = Vec::new();
    while let Some((r, run)) = narrowest(&rims) {
        closed.extend(close(&mut rims[r], run));
    }
    let mut strip = zip(&rims[0], &rims[1])?;
    strip.append(&mut closed);
    Ok(strip)
}

/// Sides of a rim beside faces of one kind: the first and how many, both between vertices of the curve.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Excursion {
    first: usize,
    n: usize,
}

/// The narrowest excursion of the rim that has more than the other; none if both have as many, or if it can't be
/// closed.
fn narrowest(rims: &[Vec<RimVertex>; 2]) -> Option<(usize, Excursion)> {
    let runs = [0, 1].map(|r| excursions(&rims[r]));
    let r = usize::from(runs[0].len() < runs[1].len());
    let (rim, other) = (&rims[r], &rims[1 - r]);
    if runs[0].len() == runs[1].len() {
        return None;
    }
    let may_close = |e: &&Excursion| {
        let [p, q] = ends(rim, **e);
        // Where the other rim is of one kind, what is left is to be of that kind.
        let leaves_kind = !runs[1 - r].is_empty() || rim[e.first].cap != other[0].cap;
        leaves_kind
            && p.border & q.border != 0
            && e.n > 1
            && e.n + 2 <= rim.len()
            && p.position.distance(q.position) < WIDEST
    };
    let width = |e: &Excursion| {
        let [p, q] = ends(rim, *e);
        p.position.distance(q.position)
    };
    let found = runs[r].iter().filter(may_close).min_by(|a, b| width(a).total_cmp(&width(b)));
    found.map(|&e| (r, e))
}

/// The vertices between which an excursion lies.
fn ends(rim: &[RimVertex], e: Excursion) -> [RimVertex; 2] {
    [rim[e.first], rim[(e.first + e.n) % rim.len()]]
}

/// The runs of sides of one kind. None where all are of one kind.
fn excursions(rim: &[RimVertex]) -> Vec<Excursion> {
    let n = rim.len();
    let starts: Vec<usize> = (0..n).filter(|&i| rim[i].cap != rim[(i + n - 1) % n].cap).collect();
    let next = starts.iter().cycle().skip(1);
    let length = |(&first, &next): (&usize, &usize)| Excursion { first, n: (next + n - first) % n };
    starts.iter().zip(next).map(length).collect()
}

/// Fills what lies between an excursion and the curve, and goes straight along the curve instead.
fn close(rim: &mut Vec<RimVertex>, e: Excursion) -> Vec<StripTriangle> {
    let cap = rim[e.first].cap;
    rim.rotate_left(e.first);
    let mut left: Vec<RimVertex> = rim[..=e.n].to_vec();
    let mut filled = Vec::new();
    while left.len() > 2 {
        // The corner whose cut is the shortest, and makes no edge along the border but the last. Where there is
        // none, a hole is left, with which no mesh is made.
        let along = |i: usize| left.len() > 3 && left[i - 1].border & left[i + 1].border != 0;
        let cut = |i: usize| left[i - 1].position.distance_squared(left[i + 1].position);
        let corners = (1..left.len() - 1).filter(|&i| !along(i));
        let Some(i) = corners.min_by(|&a, &b| cut(a).total_cmp(&cut(b))) else { break };
        filled.push(([left[i + 1].vertex, left[i].vertex, left[i - 1].vertex], cap));
        left.remove(i);
    }
    rim.drain(1..e.n);
    rim[0].cap = !cap;
    filled
}

#[cfg(test)]
mod tests {
    use super::super::zip::tests::{assert_closes, ring};
    use super::*;

    /// A polygon of 12 sides of which 3 to 5 are caps.
    fn with_excursion(radius: f32) -> Vec<RimVertex> {
        let mut rim = ring(12, radius, 100);
        rim[3..6].iter_mut().for_each(|v| v.cap = true);
        [3, 6].into_iter().for_each(|i| rim[i].border = 1);
        rim
    }

    /// One of 8 sides around it, which stays: clockwise around the hole.
    fn around() -> Vec<RimVertex> {
        let mut rim = ring(8, 2.0, 0);
        rim.reverse();
        rim
    }

    #[test]
    fn runs_of_one_kind_are_found_around_the_end() {
        let mut rim = with_excursion(1.0);
        rim.rotate_left(4);
        let runs = excursions(&rim);
        assert_eq!(runs, [Excursion { first: 2, n: 9 }, Excursion { first: 11, n: 3 }]);
        assert!(excursions(&around()).is_empty());
    }

    #[test]
    fn an_excursion_over_the_border_is_closed_along_the_curve() {
        let (staying, incoming) = (around(), with_excursion(1.0));
        let strip = join(&staying, &incoming).expect("a strip");
        assert_eq!(strip.len(), 8 + 12);
        assert_eq!(strip.iter().filter(|t| t.1).count(), 2);
        assert_closes(&strip, [&staying, &incoming]);
    }

    #[test]
    fn a_wide_excursion_is_not_closed() {
        let points = join(&around(), &with_excursion(1.8)).expect_err("too wide");
        assert_eq!(points.len(), 2, "the ends of the excursion: {points:?}");
    }
}
