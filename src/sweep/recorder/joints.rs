//! Joints: trajectories that begin or end on the way of others meet them, whatever knots those have.
//!
//! Thinning moves vertices a little where it drops a knot. What was recorded to begin in the middle of an edge, or to end
//! in another vertex, would then miss it: the surface would jump there, and faces that are about to vanish would
//! turn over.

use std::collections::BTreeMap;

use glam::Vec3;

use super::{Joint, Trajectory, Unranked};

/// A joint lies on ways that end in other joints. How far it misses them falls in each round by the share of
/// the way that is left to their ends.
const ROUNDS: usize = 6;

/// A knot and the segments of trajectories on which it lies.
struct Joined {
    knot: usize,
    /// Two knots, and the weights of their places.
    on: Vec<([usize; 2], [f32; 2])>,
}

/// Moves the first and last knots of trajectories to where their joints are. `knots` are sorted by trajectory and
/// isovalue; `index` is a trajectory's number in them, if it is there.
pub(super) fn join(
    knots: &mut [(u32, Unranked)],
    joints: &[Joint],
    index: impl Fn(Trajectory) -> Option<u32>,
) {
    let find = |i: u32, c: f64| {
        let order = |k: &(u32, Unranked)| (k.0.cmp(&i)).then(k.1.isovalue.total_cmp(&c));
        knots.binary_search_by(order)
    };
    let segment = |t: Trajectory, c: f64| {
        let i = index(t)?;
        match find(i, c) {
            Ok(at) => Some(([at, at], [1.0, 0.0])),
            Err(after) => {
                let [from, to] = [knots.get(after.checked_sub(1)?)?, knots.get(after)?];
                let share = ((c - from.1.isovalue) / (to.1.isovalue - from.1.isovalue)) as f32;
                (from.0 == i && to.0 == i).then_some(([after - 1, after], [1.0 - share, share]))
            }
        }
    };
    let joined = |j: &Joint| {
        let knot = find(index(j.trajectory)?, j.isovalue).ok()?;
        let weighted = |&(t, weight): &(Trajectory, f32)| {
            let (between, weights) = segment(t, j.isovalue)?;
            Some((between, weights.map(|w| weight * w)))
        };
        Some((knot, j.of.iter().map(weighted).collect::<Option<Vec<_>>>()?))
    };
    // One for each knot, the same whatever the order in which logs were appended: two tell of one knot only where a
    // trajectory has a single one.
    let joined: BTreeMap<usize, Vec<_>> = joints.iter().filter_map(joined).collect();
    let joined: Vec<Joined> = joined.into_iter().map(|(knot, on)| Joined { knot, on }).collect();
    for _ in 0..ROUNDS {
        let place = |k: usize| Vec3::from(knots[k].1.position);
        let places: Vec<Vec3> = joined
            .iter()
            .map(|j| j.on.iter().map(|(k, w)| w[0] * place(k[0]) + w[1] * place(k[1])).sum())
            .collect();
        for (j, p) in joined.iter().zip(places) {
            knots[j.knot].1.position = p.to_array();
        }
    }
}
