//! Where one of two closed surfaces that run beside each other has a handle, or a part, that the other lacks.
//!
//! By Gauss and Bonnet, what the angles around the vertices of a surface lack to 2 pi sums up to 2 pi times its Euler
//! characteristic, and place by place it is the curvature there, which two surfaces beside each other share. Where one
//! has a handle that the other has not, it lacks 4 pi less.

use std::collections::BTreeMap;
use std::f64::consts::{PI, TAU};

use glam::{DVec3, IVec3, Vec3};

/// What surfaces lack is summed up in cubes of this side, voxels.
const SIDE: f32 = 1.0;

/// Cubes up to so many away count together, the fewest first.
const FARTHEST: i32 = 3;

/// What makes a handle, of the 4 pi that it takes: some of it lies farther away.
const ENOUGH: f64 = 3.0 * PI;

/// A surface: positions in the voxel frame, and triangles.
pub(super) type Surface<'a> = (&'a [[f32; 3]], &'a [[u32; 3]]);

/// By how much one surface's angles lack more than those of the other, by cube.
type Lacks = BTreeMap<[i32; 3], f64>;

/// Middles of the cubes in which two surfaces differ most in the way in which they differ on the whole; empty if their Euler
/// characteristics are equal.
pub(super) fn where_they_differ(a: Surface, b: Surface) -> Vec<Vec3> {
    let mut lacks = Lacks::new();
    add(&mut lacks, a, 1.0);
    add(&mut lacks, b, -1.0);
    let whole: f64 = lacks.values().sum();
    if whole.abs() < PI {
        return Vec::new();
    }
    for reach in 0..=FARTHEST {
        let sums = lacks.keys().map(|&at| (whole.signum() * sum_around(&lacks, at, reach), at));
        // Of equal ones the last, by the order of the cubes.
        let Some((most, at)) = sums.max_by(|x, y| x.0.total_cmp(&y.0)) else { break };
        if most > ENOUGH || reach == FARTHEST {
            let near = lacks.keys().map(|&k| IVec3::from(k)).filter(|&k| is_near(k, at, reach));
            return near.map(|k| SIDE * (k.as_vec3() + 0.5)).collect();
        }
    }
    Vec::new()
}

fn is_near(cube: IVec3, at: [i32; 3], reach: i32) -> bool {
    (cube - IVec3::from(at)).abs().max_element() <= reach
}

/// What is lacked in the cubes up to `reach` away from one.
fn sum_around(lacks: &Lacks, [x, y, z]: [i32; 3], reach: i32) -> f64 {
    let mut sum = 0.0;
    for i in x - reach..=x + reach {
        for j in y - reach..=y + reach {
            let row = lacks.range([i, j, z - reach]..=[i, j, z + reach]);
            sum += row.map(|(_, lack)| lack).sum::<f64>();
        }
    }
    sum
}

/// Adds to each cube what the angles around its vertices lack to 2 pi, times `weight`.
fn add(lacks: &mut Lacks, (positions, triangles): Surface, weight: f64) {
    let mut angles: Vec<Option<f64>> = vec![None; positions.len()];
    for t in triangles {
        let corners: [DVec3; 3] = t.map(|v| Vec3::from(positions[v as usize]).as_dvec3());
        for i in 0..3 {
            let (u, v) = (corners[(i + 1) % 3] - corners[i], corners[(i + 2) % 3] - corners[i]);
            *angles[t[i] as usize].get_or_insert(0.0) += u.cross(v).length().atan2(u.dot(v));
        }
    }
    for (&p, angle) in positions.iter().zip(angles) {
        if let Some(angle) = angle {
            let cube = (Vec3::from(p) / SIDE).floor().as_ivec3().to_array();
            *lacks.entry(cube).or_default() += weight * (TAU - angle);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::extract::{Extraction, extract};
    use crate::topology::Topology;
    use crate::topology::exact::ExactField;
    use crate::volume::phantom;

    fn surface(extraction: &Extraction) -> Surface<'_> {
        (&extraction.positions, &extraction.faces)
    }

    #[test]
    fn surfaces_on_both_sides_of_an_event_differ_where_it_happens() {
        let mut n = 0;
        for name in ["torus:24", "blobs:24"] {
            let volume = phantom(name).expect("a phantom");
            let field = ExactField::new(&volume).expect("a field");
            let events = Topology::compute(&field).expect("a topology").net_events();
            let just = 1e-4;
            let is_alone = |c: f64| {
                events.iter().filter(|e| (e.isovalue - c).abs() <= 2.0 * just).count() == 1
            };
            for event in events.iter().filter(|e| is_alone(e.isovalue)) {
                let [before, after] = [-just, just].map(|d| extract(&field, event.isovalue + d));
                let place = Vec3::from(event.position.map(|x| x as f32));
                let found = where_they_differ(surface(&before), surface(&after));
                assert!(!found.is_empty(), "{name}, {}", event.isovalue);
                for p in found {
                    assert!(p.distance(place) < 4.0, "{name}: {p}, the event is at {place}");
                }
                n += 1;
            }
        }
        assert!(n > 3, "{n} events");
    }

    #[test]
    fn one_surface_does_not_differ_from_itself_moved() {
        let volume = phantom("torus:24").expect("a phantom");
        let field = ExactField::new(&volume).expect("a field");
        let [a, b] = [0.5, 0.51].map(|share| extract(&field, share));
        assert!(where_they_differ(surface(&a), surface(&b)).is_empty());
    }
}
