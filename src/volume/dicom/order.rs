//! Orders slices along their normal, and finds their placement.
//!
//! # Theory
//!
//! DICOM PS3.3, C.7.6.2.1.1: the position of a pixel is that of its slice, plus the direction of a row times its column, plus
//! the direction of a column times its row. The step between slices is the difference of their positions. If it is not
//! parallel to the normal, as with a tilted gantry, the volume is sheared.

use std::io;

use super::header::{Plane, Slice};
use crate::volume::placement::{Placement, Space, Unit, cross, dot};
use crate::volume::select::one_of;

/// Largest distance of a slice from its evenly spaced position, in steps. Files round positions to hundredths of a
/// millimetre: two of them differ by 0.01 mm, which is 2 % of the thinnest slices of scanners (0.5 mm).
const MAX_UNEVENNESS: f64 = 0.02;

/// Slices closer than this fraction of the whole extent have the same position: far less than a step for any number of slices.
const SAME_POSITION: f64 = 1e-6;

/// Largest difference between the directions, and relative difference between the spacings, of slices: both are rounded.
const MAX_DIFFERENCE: f64 = 1e-3;

/// The direction in which slices follow each other, from those of a row and a column.
pub(super) fn normal(orientation: &[f64; 6]) -> [f64; 3] {
    let [a, b, c, d, e, f] = *orientation;
    cross([a, b, c], [d, e, f])
}

/// Whether rows and columns have the same directions, up to rounding.
pub(super) fn is_parallel(a: &[f64; 6], b: &[f64; 6]) -> bool {
    (0..6).all(|i| (a[i] - b[i]).abs() <= MAX_DIFFERENCE)
}

/// Keeps the slices of one of several volumes in time, if every position has the same number of slices. Slices of a
/// position are ordered by temporal position, then by instance number.
///
/// # Errors
///
/// `InvalidData` if one must be chosen, and if the number is too large.
pub(super) fn select_frame(slices: &mut Vec<Slice>, given: Option<usize>) -> io::Result<()> {
    let n = slices.first().and_then(|slice| slice.plane.orientation).map(|o| normal(&o));
    let height = |slice: &Slice| Some(dot(slice.plane.position?, n?));
    let heights: Option<Vec<f64>> = slices.iter().map(height).collect();
    let mut placed: Vec<(f64, Slice)> = match heights {
        Some(heights) => heights.into_iter().zip(slices.iter().copied()).collect(),
        // `sort` reports missing positions.
        None => return Ok(()),
    };
    placed.sort_by(|a, b| a.0.total_cmp(&b.0));
    let all = placed.last().map_or(0.0, |last| last.0 - placed[0].0);
    let n_places = placed.chunk_by(|a, b| b.0 - a.0 <= SAME_POSITION * all).count();
    let n_times = placed.len() / n_places.max(1);
    let is_even =
        placed.chunk_by(|a, b| b.0 - a.0 <= SAME_POSITION * all).all(|p| p.len() == n_times);
    if !is_even || n_times < 2 || n_places < 2 {
        return one_of("frame", given, 1).map(|_| ());
    }
    let frame = one_of("frame", given, n_times)?;
    let chosen = placed.chunk_by_mut(|a, b| b.0 - a.0 <= SAME_POSITION * all).map(|place| {
        place.sort_by(|(_, a), (_, b)| {
            let of_times = a.time.0.total_cmp(&b.time.0).then(a.time.1.total_cmp(&b.time.1));
            of_times.then((a.image, a.frame).cmp(&(b.image, b.frame)))
        });
        place[frame].1
    });
    *slices = chosen.collect();
    Ok(())
}

/// Sorts slices along their normal and returns the placement of the volume. `shown` names a slice.
///
/// # Errors
///
/// A description, for missing or different positions, directions or spacings, slices at the same position, missing slices
/// and uneven steps.
pub(super) fn sort(
    slices: &mut Vec<Slice>,
    shown: &dyn Fn(&Slice) -> String,
) -> Result<Placement, String> {
    let first = slices.first().ok_or("no slices")?;
    let PlaneGeometry { orientation, spacing, .. } = geometry(&first.plane, &shown(first))?;
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
        let PlaneGeometry { position, orientation: directions, spacing: distances } =
            geometry(&slice.plane, &name)?;
        if !is_parallel(&directions, &orientation) {
            return Err(format!("{name} is not parallel to {}", shown(first)));
        }
        if (0..2).any(|i| (distances[i] / spacing[i] - 1.0).abs() > MAX_DIFFERENCE) {
            return Err(format!(
                "{name} has pixel spacing {distances:?}, expected {spacing:?} as {}",
                shown(first)
            ));
        }
        placed.push((dot(position, n) / length, position, *slice));
    }
    // Stable: slices at the same position stay in order of their names.
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

/// The step between slices; none for a single one. `heights` are along the normal.
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
    // Of two the smaller: the other is a gap.
    let usual = sorted[(gaps.len() - 1) / 2];
    let all = heights[n - 1] - heights[0];
    let between = |i| format!("{} (at {:.3} mm) and {}", shown(i), heights[i], shown(i + 1));
    if let Some(i) = gaps.iter().position(|&gap| gap <= SAME_POSITION * all) {
        return Err(format!(
            "{} are at the same position, expected one slice per position, or the same number at each (several volumes in time)",
            between(i)
        ));
    }
    for (i, &gap) in gaps.iter().enumerate() {
        if (gap - usual).abs() <= 2.0 * MAX_UNEVENNESS * usual {
            continue;
        }
        let times = (gap / usual).round();
        if times >= 2.0 && (gap - times * usual).abs() <= 2.0 * MAX_UNEVENNESS * usual {
            return Err(format!(
                "{} are {gap:.3} mm apart, the others {usual:.3}: {} missing",
                between(i),
                times - 1.0
            ));
        }
        return Err(format!(
            "{} are {gap:.3} mm apart, expected {usual:.3} as for the others",
            between(i)
        ));
    }
    let (first, last) = (positions[0], positions[n - 1]);
    let step: [f64; 3] = std::array::from_fn(|a| (last[a] - first[a]) / (n - 1) as f64);
    for (i, position) in positions.iter().enumerate() {
        let off: [f64; 3] = std::array::from_fn(|a| position[a] - first[a] - step[a] * i as f64);
        let off = dot(off, off).sqrt();
        if off > MAX_UNEVENNESS * dot(step, step).sqrt() {
            return Err(format!(
                "{} is {off:.3} mm away from its position in even steps from {} to {}",
                shown(i),
                shown(0),
                shown(n - 1)
            ));
        }
    }
    Ok(Some(step))
}

/// Position, directions and pixel spacing of a slice.
struct PlaneGeometry {
    position: [f64; 3],
    orientation: [f64; 6],
    spacing: [f64; 2],
}

fn geometry(plane: &Plane, name: &str) -> Result<PlaneGeometry, String> {
    let missing = |what: &str| format!("no {what} in {name}, which the position of a slice needs");
    let position = plane.position.ok_or_else(|| missing("ImagePositionPatient"))?;
    let orientation = plane.orientation.ok_or_else(|| missing("ImageOrientationPatient"))?;
    let spacing = plane.spacing.ok_or_else(|| missing("PixelSpacing"))?;
    if !spacing.iter().all(|&s| s > 0.0) {
        return Err(format!("{name}: pixel spacing {spacing:?}, expected positive numbers"));
    }
    Ok(PlaneGeometry { position, orientation, spacing })
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
                "s1 (at 1.000 mm) and s2 are 2.000 mm apart, the others 1.000: 1 missing",
            ),
            (at(&[0.0, 1.0, 1.0, 2.0]), "s1 (at 1.000 mm) and s2 are at the same position"),
            (
                at(&[0.0, 1.0, 2.0, 3.3]),
                "s2 (at 2.000 mm) and s3 are 1.300 mm apart, expected 1.000",
            ),
            (at(&[0.0, 1.0, 1.0, 1.0]), "s1 (at 1.000 mm) and s2 are at the same position"),
            (at(&[0.0, 0.0]), "s0 (at 0.000 mm) and s1 are at the same position"),
            (vec![[0.0; 3], [0.3, 0.0, 1.0], [0.0, 0.0, 2.0]], "s1 is 0.300 mm away"),
        ] {
            let message = sorted(&positions).expect_err("no even steps");
            assert!(message.contains(expected), "{message}");
        }
        // Rounded to hundredths of a millimetre.
        assert!(sorted(&at(&[0.0, 0.63, 1.25, 1.88, 2.5])).is_ok());
    }
}
