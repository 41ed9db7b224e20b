//! Thinning: trajectories with no more knots than their motion needs.

use glam::Vec3;

/// Along the surface a vertex may be so many times farther off than across it: it stays on the surface.
const ALONG: f32 = 5.0;

/// Share of the shortest edge beside a vertex by which it may be off at most.
const EDGE_SHARE: f32 = 0.1;

/// Largest angle between a normal and what is interpolated in its place, radians.
const MOST_TURN: f32 = 0.12;

/// Where a vertex is at an isovalue, and its unit normal.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Place {
    pub(crate) isovalue: f64,
    /// Voxel frame.
    pub(crate) position: Vec3,
    pub(crate) normal: Vec3,
    /// Whether the knot there stays in any case.
    pub(crate) stays: bool,
}

/// How far the trajectory that is left may be off, voxels.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Bound {
    across: f32,
    along: f32,
}

impl Bound {
    /// At most `error` across the surface, and less beside edges as short as `edge`, voxels.
    pub(crate) fn new(error: f32, edge: f32) -> Bound {
        let most = EDGE_SHARE * edge;
        Bound { across: error.min(most), along: (ALONG * error).min(most) }
    }

    /// Whether an interpolated place may stand for one.
    fn holds(&self, place: &Place, position: Vec3, normal: Vec3) -> bool {
        let off = position - place.position;
        let across = off.dot(place.normal);
        let turn = place.normal.cross(normal).length();
        across.abs() <= self.across
            && (off - across * place.normal).length() <= self.along
            && place.normal.dot(normal) > 0.0
            && turn <= MOST_TURN * normal.length()
    }
}

/// Which knots of one trajectory stay: the first, the last, those that must, and between them, from each
/// that stays, the farthest one such that the interpolation is near enough to all between.
pub(crate) fn thin(places: &[Place], bound: Bound) -> Vec<usize> {
    let mut stay = vec![0];
    let mut from = 0;
    while from + 1 < places.len() {
        let mut to = from + 1;
        while to + 1 < places.len() && !places[to].stays && is_near(&places[from..=to + 1], bound) {
            to += 1;
        }
        stay.push(to);
        from = to;
    }
    stay
}

/// Whether the straight way from the first place to the last may stand for all of them.
fn is_near(places: &[Place], bound: Bound) -> bool {
    let (Some(first), Some(last)) = (places.first(), places.last()) else { return true };
    let length = last.isovalue - first.isovalue;
    places[1..places.len() - 1].iter().all(|p| {
        let t = ((p.isovalue - first.isovalue) / length) as f32;
        let normal = first.normal.lerp(last.normal, t);
        bound.holds(p, first.position.lerp(last.position, t), normal)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn places(f: impl Fn(f64) -> Vec3, n: usize) -> Vec<Place> {
        (0..n)
            .map(|i| {
                let isovalue = i as f64 / (n - 1) as f64;
                Place { isovalue, position: f(isovalue), normal: Vec3::Z, stays: false }
            })
            .collect()
    }

    #[test]
    fn a_straight_way_keeps_its_ends_only() {
        let straight = places(|c| Vec3::new(c as f32, 2.0 * c as f32, 0.0), 50);
        assert_eq!(thin(&straight, Bound::new(1e-3, 1.0)), [0, 49]);
        let mut told = straight.clone();
        told[20].stays = true;
        assert_eq!(thin(&told, Bound::new(1e-3, 1.0)), [0, 20, 49]);
        assert_eq!(thin(&straight[..1], Bound::new(1e-3, 1.0)), [0]);
    }

    #[test]
    fn every_place_stays_within_the_error_of_the_interpolation() {
        let curved = places(|c| Vec3::new((5.0 * c).sin() as f32, c.sqrt() as f32, 0.0), 400);
        let n_knots = |error: f32, edge: f32| {
            let bound = Bound::new(error, edge);
            let stay = thin(&curved, bound);
            assert!(stay.len() < 60 && stay.windows(2).all(|w| w[0] < w[1]), "{}", stay.len());
            assert_eq!((stay[0], stay[stay.len() - 1]), (0, 399));
            assert!(stay.windows(2).all(|w| is_near(&curved[w[0]..=w[1]], bound)));
            for w in stay.windows(2) {
                let (first, last) = (curved[w[0]], curved[w[1]]);
                for p in &curved[w[0]..=w[1]] {
                    let t = (p.isovalue - first.isovalue) / (last.isovalue - first.isovalue);
                    let off = first.position.lerp(last.position, t as f32) - p.position;
                    assert!(off.z.abs() <= error && off.length() <= ALONG * error + 1e-6);
                }
            }
            stay.len()
        };
        assert!(n_knots(0.003, 1.0) > n_knots(0.03, 1.0));
        assert!(n_knots(0.03, 0.05) > n_knots(0.03, 1.0));
    }

    #[test]
    fn a_turning_normal_keeps_knots() {
        // Once around a cone.
        let mut turning = places(|_| Vec3::ZERO, 40);
        for p in &mut turning {
            let angle = std::f32::consts::TAU * p.isovalue as f32;
            p.normal = Vec3::new(angle.cos(), angle.sin(), 1.0).normalize();
        }
        assert!(thin(&turning, Bound::new(1.0, 100.0)).len() > 3);
    }
}
