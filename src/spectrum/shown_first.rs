//! The isovalue that is shown by default.

use super::data::Spectrum;
use super::measures::Measures;
use super::query::Query;
use crate::volume::between;

/// The candidates divide the range into so many equal parts.
const PARTS: usize = 32;

/// Least share of the largest area.
const MIN_AREA_SHARE: f64 = 0.1;

impl Spectrum {
    /// The isovalue to show first: the middle of the range or, if the isosurface there has less than a tenth of the
    /// largest area, the nearest isovalue with as much. Volumes with unevenly distributed samples, such as densities and
    /// images, may have almost no surface at the middle.
    pub fn shown_first(&self) -> f64 {
        let mut query = Query::for_some(self, PARTS);
        shown_first(self.range(), |isovalue| {
            query.mesh_at(isovalue).map_or(0.0, |mesh| Measures::of(&mesh).area)
        })
    }
}

/// As [`Spectrum::shown_first`], given a range and a function that returns the area at an isovalue, or something proportional to it.
pub(crate) fn shown_first(range: (f64, f64), mut area_at: impl FnMut(f64) -> f64) -> f64 {
    let at = |part: usize| between(range, part as f64 / PARTS as f64);
    let candidates: Vec<(usize, f64)> = (1..PARTS).map(|i| (i, area_at(at(i)))).collect();
    let min_area = MIN_AREA_SHARE * candidates.iter().map(|l| l.1).fold(0.0, f64::max);
    let middle = PARTS / 2;
    let enough = candidates.into_iter().filter(|l| l.1 >= min_area).map(|l| l.0);
    enough.min_by_key(|i| i.abs_diff(middle)).map_or(at(middle), at)
}

#[cfg(test)]
mod tests {
    use crate::spectrum::{About, Knot, Patch, Spectrum, Triangle, VolumeInfo};
    use crate::volume::{Outside, Placement};

    /// A tetrahedron whose size is interpolated between these (isovalue, size), at isovalues from 0 to 1.
    fn shrinking(sizes: &[(f64, f32)]) -> Spectrum {
        let corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let n = sizes.len() as u32;
        let knots = corners.iter().flat_map(|c: &[f32; 3]| {
            let knot = |(rank, &(_, size)): (u32, &(f64, f32))| {
                let position = c.map(|x| 1.0 + size * x);
                Knot { rank, position }
            };
            (0..).zip(sizes).map(knot)
        });
        let triangle = |vertices| Triangle { vertices, birth: 0, death: n - 1, cap: false };
        let patch = Patch {
            isovalues: sizes.iter().map(|s| s.0).collect(),
            knots: knots.collect(),
            first_knot: (0..=4).map(|v| v * n).collect(),
            triangles: [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]].map(triangle).to_vec(),
            ..Patch::default()
        };
        let volume = VolumeInfo {
            name: "shrinking".into(),
            dims: [8; 3],
            sample_type: "float32".into(),
            range: (0.0, 1.0),
            placement: Placement::default(),
            outside: Outside::Low,
        };
        Spectrum::from_patch(About::new(volume, (0.0, 1.0), 0.1), patch).expect("valid")
    }

    #[test]
    fn the_middle_is_shown_if_its_area_is_large_enough() {
        assert_eq!(shrinking(&[(0.0, 4.0), (1.0, 1.0)]).shown_first(), 0.5);
    }

    #[test]
    fn otherwise_the_nearest_isovalue_with_a_tenth_of_the_largest_area_is_shown() {
        // From 4 down to 0.01 over the first quarter: at 5/32 a side is 1.5, its area 0.18 of that at 1/32.
        let spectrum = shrinking(&[(0.0, 4.0), (0.25, 0.01), (1.0, 0.005)]);
        assert_eq!(spectrum.shown_first(), 5.0 / 32.0);
    }
}
