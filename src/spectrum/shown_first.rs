//! Which isovalue to show where nobody has chosen one.

use super::{Measures, Query, Spectrum};

/// Into so many equal parts the range is divided; the isovalues between them are looked at.
const PARTS: usize = 32;

/// An isosurface with this share of the largest area is worth looking at.
const AREA_SHARE: f64 = 0.1;

impl Spectrum {
    /// The isovalue to show first: the middle of the range or, where the isosurface there has less than a tenth of the
    /// largest area, the nearest isovalue with as much. Where samples are spread unevenly, as in densities and
    /// images, there may be next to nothing at the middle.
    pub fn shown_first(&self) -> f64 {
        let mut query = Query::for_some(self, PARTS);
        shown_first(self.range(), |isovalue| {
            query.mesh_at(isovalue).map_or(0.0, |mesh| Measures::of(&mesh).area)
        })
    }
}

/// As [`Spectrum::shown_first`], of a range and the area at an isovalue, or what goes with it.
pub(crate) fn shown_first((low, high): (f64, f64), mut area_at: impl FnMut(f64) -> f64) -> f64 {
    let at = |part: usize| {
        let share = part as f64 / PARTS as f64;
        low * (1.0 - share) + high * share
    };
    let looked_at: Vec<(usize, f64)> = (1..PARTS).map(|i| (i, area_at(at(i)))).collect();
    let least = AREA_SHARE * looked_at.iter().map(|l| l.1).fold(0.0, f64::max);
    let middle = PARTS / 2;
    let enough = looked_at.into_iter().filter(|l| l.1 >= least).map(|l| l.0);
    enough.min_by_key(|i| i.abs_diff(middle)).map_or(at(middle), at)
}

#[cfg(test)]
mod tests {
    use crate::spectrum::{About, Knot, Patch, Spectrum, Triangle, VolumeInfo};
    use crate::volume::{Outside, Placement};

    /// A tetrahedron that shrinks: its size goes along straight lines through these, at isovalues from 0 to 1.
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
    fn the_middle_is_shown_where_there_is_something_to_see() {
        assert_eq!(shrinking(&[(0.0, 4.0), (1.0, 1.0)]).shown_first(), 0.5);
    }

    #[test]
    fn else_the_nearest_isovalue_with_a_tenth_of_the_largest_area() {
        // From 4 down to 0.01 over the first quarter: at 5/32 a side is 1.5, its area 0.18 of that at 1/32.
        let spectrum = shrinking(&[(0.0, 4.0), (0.25, 0.01), (1.0, 0.005)]);
        assert_eq!(spectrum.shown_first(), 5.0 / 32.0);
    }
}
