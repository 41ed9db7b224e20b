//! Puts slices in their order along the normal, and finds where they lie.
//!
//! # Theory
//!
//! DICOM PS3.3, C.7.6.2.1.1: a pixel lies at the position of its slice, plus the direction of a row times its column, plus the
//! direction of a column times its row. The step from a slice to the next is that of their positions: where it is not along
//! the normal, as with a tilted gantry, the volume is sheared.

use std::io;

use super::Slice;
use super::header::Plane;
use crate::volume::placement::{cross, dot};
use crate::volume::select::one_of;
use crate::volume::{Placement, Space, Unit};

/// How far a slice may lie from where even steps have it, in steps. Positions are decimals, in files down to hundredths of a
/// millimetre: two that are rounded differ by 0.01 mm, which is 2 % of the thinnest slices of scanners (0.5 mm).
const UNEVEN: f64 = 0.02;

/// Slices that are nearer than this share of all lie at the same place: far less than a share of a step, whatever a step is.
const SAME: f64 = 1e-6;

/// How much the directions of slices of one series may differ: they are rounded, too.
const TURNED: f64 = 1e-3;

/// The direction in which slices follow each other, from those of a row and a column.
pub(super) fn normal(orientation: &[f64; 6]) -> [f64; 3] {
    let [a, b, c, d, e, f] = *orientation;
    cross([a, b, c], [d, e, f])
}

/// Keeps the slices of one of several volumes in time: as many slices lie at each place. Which volume is theirs is told by
/// the scanner's number of the time, else by the order in which slices were made.
///
/// # Errors
///
/// `InvalidData` where one must be chosen, and where there is none of that number.
pub(super) fn at_time(slices: &mut Vec<Slice>, given: Option<usize>) -> io::Result<()> {
    let n = slices.first().and_then(|slice| slice.plane.orientation).map(|o| normal(&o));
    let height = |slice: &Slice| Some(dot(slice.plane.position?, n?));
    let heights: Option<Vec<f64>> = slices.iter().map(height).collect();
    let mut placed: Vec<(f64, Slice)> = match heights {
        Some(heights) => heights.into_iter().zip(slices.iter().copied()).collect(),
        // What is not told is complained of later.
        None => return Ok(()),
    };
    placed.sort_by(|a, b| a.0.total_cmp(&b.0));
    let all = placed.last().map_or(0.0, |last| last.0 - placed[0].0);
    let n_places = placed.chunk_by(|a, b| b.0 - a.0 <= SAME * all).count();
    let n_times = placed.len() / n_places.max(1);
    let is_even = placed.chunk_by(|a, b| b.0 - a.0 <= SAME * all).all(|p| p.len() == n_times);
    if !is_even || n_times < 2 || n_places < 2 {
        return one_of("frame", given, 1).map(|_| ());
    }
    let frame = one_of("frame", given, n_times)?;
    let chosen = placed.chunk_by_mut(|a, b| b.0 - a.0 <= SAME * all).map(|place| {
        place.sort_by(|(_, a), (_, b)| {
            let of_times = a.time.0.total_cmp(&b.time.0).then(a.time.1.total_cmp(&b.time.1));
            of_times.then((a.image, a.frame).cmp(&(b.image, b.frame)))
        });
        place[frame].1
    });
    *slices = chosen.collect();
    Ok(())
}

/// Sorts slices along their normal; where the volume lies.
///
/// # Errors
///
/// What is wrong, with the slices named as `shown` does: positions, directions or distances that are not told or not the same,
/// slices at the same place, missing ones, and steps that are not even.
pub(super) fn sort(
    slices: &mut Vec<Slice>,
    shown: &dyn Fn(&Slice) -> String,
) -> Result<Placement, String> {
    let first = slices.first().ok_or("no slices")?;
    let Told { orientation, spacing, .. } = told(&first.plane, &shown(first))?;
    let n = normal(&orientation);
    let length = dot(n, n).sqrt();
    if !(0.9..=1.1).contains(&length) {
        return Err(format!(
            "{}: directions {orientation:?} of rows and columns, expected perpendicular ones of length 1",
            shown(first)
        ));
    }
    let mut placed = Vec::with_capacity(slices.len());
    for slice in slices.iter() {
        let name = shown(slice);
        let Told { position, orientation: directions, spacing: distances } =
            told(&slice.plane, &name)?;
        if (0..6).any(|i| (directions[i] - orientation[i]).abs() > TURNED) {
            return Err(format!(
                "{name} is turned against {}, expected parallel slices",
                shown(first)
            ));
        }
        if (0..2).any(|i| (distances[i] / spacing[i] - 1.0).abs() > TURNED) {
            return Err(format!(
                "{name} has pixels {distances:?} apart, expected {spacing:?} as {}",
                shown(first)
            ));
        }
        placed.push((dot(position, n) / length, position, *slice));
    }
    // The order of names where places are the same.
    placed.sort_by(|a, b| a.0.total_cmp(&b.0));
    *slices = placed.iter().map(|p| p.2).collect();
    let positions: Vec<[f64; 3]> = placed.iter().map(|p| p.1).collect();
    let heights: Vec<f64> = placed.iter().map(|p| p.0).collect();
    let step = step(&heights, &positions, &|i| shown(&slices[i]))?;
    let step = step.unwrap_or_else(|| n.map(|x| x / length));
    let [a, b, c, d, e, f] = orientation;
    let [down, across] = spacing;
    let steps = [[a, b, c].map(|x| x * across), [d, e, f].map(|x| x * down), step];
    let placement = Placement::from_steps(positions[0], steps);
    Ok(Placement { unit: Unit::Mm, space: Space::Lps, ..placement })
}

/// The step from slice to slice, of which there are several; `heights` are along the normal.
fn step(
    heights: &[f64],
    positions: &[[f64; 3]],
    shown: &dyn Fn(usize) -> String,
) -> Result<Option<[f64; 3]>, String> {
    let n = heights.len();
    if n < 2 {
        return Ok(None);
    }
    let gaps: Vec<f64> = heights.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let mut sorted = gaps.clone();
    sorted.sort_by(f64::total_cmp);
    // Of two the smaller: the other one has a gap.
    let usual = sorted[(gaps.len() - 1) / 2];
    let all = heights[n - 1] - heights[0];
    let between = |i| format!("{} (at {:.3} mm) and {}", shown(i), heights[i], shown(i + 1));
    if let Some(i) = gaps.iter().position(|&gap| gap <= SAME * all) {
        return Err(format!(
            "{} lie at the same place, expected one slice each, or as many at each place (of several volumes in time)",
            between(i)
        ));
    }
    for (i, &gap) in gaps.iter().enumerate() {
        if (gap - usual).abs() <= 2.0 * UNEVEN * usual {
            continue;
        }
        let times = (gap / usual).round();
        if times >= 2.0 && (gap - times * usual).abs() <= 2.0 * UNEVEN * usual {
            return Err(format!(
                "{} are {gap:.3} mm apart, the others {usual:.3}: expected no gaps, {} missing",
                between(i),
                times - 1.0
            ));
        }
        return Err(format!("{} are {gap:.3} mm apart, expected {usual:.3} as others", between(i)));
    }
    let (first, last) = (positions[0], positions[n - 1]);
    let step: [f64; 3] = std::array::from_fn(|a| (last[a] - first[a]) / (n - 1) as f64);
    for (i, position) in positions.iter().enumerate() {
        let off: [f64; 3] = std::array::from_fn(|a| position[a] - first[a] - step[a] * i as f64);
        let off = dot(off, off).sqrt();
        if off > UNEVEN * dot(step, step).sqrt() {
            return Err(format!(
                "{} lies {off:.3} mm from where even steps from {} to {} have it",
                shown(i),
                shown(0),
                shown(n - 1)
            ));
        }
    }
    Ok(Some(step))
}

/// Position, directions and distances of a slice, all of which must be told.
struct Told {
    position: [f64; 3],
    orientation: [f64; 6],
    spacing: [f64; 2],
}

fn told(plane: &Plane, name: &str) -> Result<Told, String> {
    let none = |what: &str| format!("no {what} in {name}, which tells where a slice lies");
    let position = plane.position.ok_or_else(|| none("ImagePositionPatient"))?;
    let orientation = plane.orientation.ok_or_else(|| none("ImageOrientationPatient"))?;
    let spacing = plane.spacing.ok_or_else(|| none("PixelSpacing"))?;
    if !spacing.iter().all(|&s| s > 0.0) {
        return Err(format!("{name}: pixels {spacing:?} apart, expected positive distances"));
    }
    Ok(Told { position, orientation, spacing })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sorted(positions: &[[f64; 3]]) -> Result<(Vec<usize>, Placement), String> {
        let slice = |(image, &position): (usize, &[f64; 3])| {
            let orientation = Some([1.0, 0.0, 0.0, 0.0, 1.0, 0.0]);
            let plane = Plane {
                position: Some(position),
                orientation,
                spacing: Some([3.0, 2.0]),
                ..Plane::default()
            };
            Slice { image, frame: 0, plane, time: (0.0, 0.0) }
        };
        let mut slices: Vec<Slice> = positions.iter().enumerate().map(slice).collect();
        let placement = sort(&mut slices, &|slice| format!("s{}", slice.image))?;
        Ok((slices.iter().map(|slice| slice.image).collect(), placement))
    }

    #[test]
    fn slices_follow_each_other_along_the_normal_and_a_tilt_shears() {
        let (order, placement) =
            sorted(&[[0.0, 0.5, 2.5], [0.0, 0.0, 0.0], [0.0, 0.25, 1.25]]).expect("even steps");
        assert_eq!(order, [1, 2, 0]);
        assert!(placement.is_sheared());
        assert_eq!((placement.spacing[0], placement.spacing[1]), (2.0, 3.0));
        let at = placement.world([0.0, 0.0, 2.0]);
        assert!((at[1] - 0.5).abs() < 1e-12 && (at[2] - 2.5).abs() < 1e-12, "{at:?}");
    }

    #[test]
    fn what_is_missing_double_or_uneven_is_named() {
        let at = |z: &[f64]| z.iter().map(|&z| [0.0, 0.0, z]).collect::<Vec<_>>();
        for (positions, expected) in [
            (
                at(&[0.0, 1.0, 3.0, 4.0]),
                "s1 (at 1.000 mm) and s2 are 2.000 mm apart, the others 1.000: expected no gaps, 1 missing",
            ),
            (at(&[0.0, 1.0, 1.0, 2.0]), "s1 (at 1.000 mm) and s2 lie at the same place"),
            (
                at(&[0.0, 1.0, 2.0, 3.3]),
                "s2 (at 2.000 mm) and s3 are 1.300 mm apart, expected 1.000",
            ),
            (at(&[0.0, 1.0, 1.0, 1.0]), "s1 (at 1.000 mm) and s2 lie at the same place"),
            (at(&[0.0, 0.0]), "s0 (at 0.000 mm) and s1 lie at the same place"),
            (vec![[0.0; 3], [0.3, 0.0, 1.0], [0.0, 0.0, 2.0]], "s1 lies 0.300 mm from"),
        ] {
            let said = sorted(&positions).expect_err("no even steps");
            assert!(said.contains(expected), "{said}");
        }
        // Rounded to hundredths of a millimetre.
        assert!(sorted(&at(&[0.0, 0.63, 1.25, 1.88, 2.5])).is_ok());
    }
}
