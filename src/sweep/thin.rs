//! Thinning: removes knots of trajectories within a tolerance.

use glam::Vec3;

/// Largest error of a thinned trajectory across the surface, as a share of the tolerance.
const ACROSS_SHARE: f32 = 0.25;

/// Largest error along the surface, voxels, whatever the tolerance: it does not change the shape, and edges are about a voxel long.
const MAX_ALONG: f32 = 0.2;

/// Position and unit normal of a vertex at an isovalue.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Candidate {
    pub(crate) isovalue: f64,
    /// Voxel frame.
    pub(crate) position: Vec3,
    pub(crate) normal: Vec3,
    /// Whether the knot there must be kept.
    pub(crate) is_required: bool,
}

/// Largest error of a thinned trajectory, voxels.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ErrorBound {
    across: f32,
    along: f32,
}

impl ErrorBound {
    /// The bound for a tolerance, voxels.
    pub(crate) fn new(tolerance: f32) -> ErrorBound {
        ErrorBound { across: ACROSS_SHARE * tolerance, along: MAX_ALONG }
    }

    /// The bound for a vertex inside a cell, whose triangles are small: the same in all directions.
    pub(crate) fn inside(tolerance: f32) -> ErrorBound {
        let ErrorBound { across, .. } = ErrorBound::new(tolerance);
        ErrorBound { across, along: across }
    }

    /// Whether an interpolated position is near enough to a place.
    fn holds(&self, place: &Candidate, position: Vec3) -> bool {
        let off = position - place.position;
        let across = off.dot(place.normal);
        across.abs() <= self.across && (off - across * place.normal).length() <= self.along
    }
}

/// The knots of one trajectory to keep: the first, the last, those that must be kept, and from each kept one
/// the farthest such that the interpolation is near enough to all between.
pub(crate) fn thin(places: &[Candidate], bound: ErrorBound) -> Vec<usize> {
    let mut kept_knots = vec![0];
    let mut from = 0;
    while from + 1 < places.len() {
        let mut to = from + 1;
        while to + 1 < places.len()
            && !places[to].is_required
            && is_near(&places[from..=to + 1], bound)
        {
            to += 1;
        }
        kept_knots.push(to);
        from = to;
    }
    kept_knots
}

/// Whether the straight line from the first place to the last is near enough to all between.
fn is_near(places: &[Candidate], bound: ErrorBound) -> bool {
    let (Some(first), Some(last)) = (places.first(), places.last()) else { return true };
    let length = last.isovalue - first.isovalue;
    places[1..places.len() - 1].iter().all(|p| {
        let t = ((p.isovalue - first.isovalue) / length) as f32;
        bound.holds(p, first.position.lerp(last.position, t))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn places(f: impl Fn(f64) -> Vec3, n: usize) -> Vec<Candidate> {
        (0..n)
            .map(|i| {
                let isovalue = i as f64 / (n - 1) as f64;
                Candidate { isovalue, position: f(isovalue), normal: Vec3::Z, is_required: false }
            })
            .collect()
    }

    #[test]
    fn a_straight_trajectory_keeps_only_its_ends() {
        let straight = places(|c| Vec3::new(c as f32, 2.0 * c as f32, 0.0), 50);
        assert_eq!(thin(&straight, ErrorBound::new(1e-3)), [0, 49]);
        let mut kept = straight.clone();
        kept[20].is_required = true;
        assert_eq!(thin(&kept, ErrorBound::new(1e-3)), [0, 20, 49]);
        assert_eq!(thin(&straight[..1], ErrorBound::new(1e-3)), [0]);
    }

    #[test]
    fn the_interpolation_is_within_the_bound_at_every_place() {
        let curve =
            |c: f64| Vec3::new((5.0 * c).sin() as f32, c.sqrt() as f32, (4.0 * c).cos() as f32);
        let curved = places(curve, 400);
        let n_knots = |tolerance: f32| {
            let bound = ErrorBound::new(tolerance);
            let kept_knots = thin(&curved, bound);
            assert!(
                kept_knots.len() < 60 && kept_knots.windows(2).all(|w| w[0] < w[1]),
                "{}",
                kept_knots.len()
            );
            assert_eq!((kept_knots[0], kept_knots[kept_knots.len() - 1]), (0, 399));
            for w in kept_knots.windows(2) {
                let (first, last) = (curved[w[0]], curved[w[1]]);
                for p in &curved[w[0]..=w[1]] {
                    let t = (p.isovalue - first.isovalue) / (last.isovalue - first.isovalue);
                    let off = first.position.lerp(last.position, t as f32) - p.position;
                    assert!(off.z.abs() <= ACROSS_SHARE * tolerance + 1e-6, "{off} across");
                    assert!(off.truncate().length() <= MAX_ALONG + 1e-6, "{off} along");
                }
            }
            kept_knots.len()
        };
        assert!(n_knots(0.003) > n_knots(0.03));
    }

    #[test]
    fn motion_along_the_surface_needs_fewer_knots_than_motion_across() {
        let bow = |c: f64| (3.0 * c).sin() as f32;
        let along = places(|c| Vec3::new(bow(c), 0.0, 0.0), 100);
        let across = places(|c| Vec3::new(0.0, 0.0, bow(c)), 100);
        let n = |places: &[Candidate]| thin(places, ErrorBound::new(0.01)).len();
        assert!(n(&along) < n(&across));
    }
}
