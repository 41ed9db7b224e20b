//! Vertices that run along an edge of the lattice, from a sample to its neighbour.
//!
//! # Theory
//!
//! Where no mesh is tracked the exact extraction shows, and its vertices lie on lattice edges: each is born at one
//! sample and ends at a neighbour. Such a *lattice vertex* is told by its sample and one of six ways, and takes
//! a byte where two free positions take six. In spectra of noisy volumes most vertices are of this kind.

use super::facing::Units;
use crate::spectrum::{Knot, VolumeInfo};

/// The samples of a volume in the whole numbers that positions are stored in.
#[derive(Debug)]
pub(super) struct Samples {
    /// Samples along x, y, z.
    dims: [i64; 3],
    /// Units of a position per cell, along x, y, z.
    cell: [f64; 3],
    units: Units,
}

impl Samples {
    /// The samples of a volume whose positions count units. None where it is not known where they lie.
    pub(super) fn new(volume: &VolumeInfo, units: Units) -> Self {
        let spacing = volume.placement.spacing;
        let least = spacing[0].min(spacing[1]).min(spacing[2]);
        let is_known = volume.placement.check().is_ok();
        let dims = volume.dims.map(|n| i64::try_from(n).unwrap_or(0));
        Samples {
            dims: if is_known { dims } else { [0; 3] },
            cell: spacing.map(|s| s / least * units.per_voxel),
            units,
        }
    }

    /// The sample nearest to a position, which may lie beside the volume.
    pub(super) fn nearest(&self, position: [i32; 3]) -> [i64; 3] {
        std::array::from_fn(|a| (f64::from(position[a]) / self.cell[a] + 0.5).floor() as i64)
    }

    /// Where a sample lies; `None` beside the volume.
    pub(super) fn place(&self, sample: [i64; 3]) -> Option<[i32; 3]> {
        let is_inside = (0..3).all(|a| (0..self.dims[a]).contains(&sample[a]));
        is_inside.then(|| {
            std::array::from_fn(|a| (sample[a] as f64 * self.cell[a] + 0.5).floor() as i32)
        })
    }

    /// The neighbour of a sample: way 2a is down axis a, 2a + 1 up.
    pub(super) fn neighbour(mut sample: [i64; 3], way: u64) -> [i64; 3] {
        sample[way as usize / 2] += 2 * (way as i64 % 2) - 1;
        sample
    }

    /// The sample that a trajectory starts at and its way, if it is that of a lattice vertex.
    pub(super) fn way_along(&self, trajectory: &[Knot]) -> Option<([i64; 3], u64)> {
        let [start, end] = trajectory else { return None };
        self.way_of([start, end].map(|knot| self.units.of(knot)))
    }

    /// The sample that a vertex starts at and its way, if these say where its two knots are.
    pub(super) fn way_of(&self, knots: [[i32; 3]; 2]) -> Option<([i64; 3], u64)> {
        let start = self.nearest(knots[0]);
        let end = self.nearest(knots[1]);
        if self.place(start) != Some(knots[0]) || self.place(end) != Some(knots[1]) {
            return None;
        }
        (0..6).find(|&way| Samples::neighbour(start, way) == end).map(|way| (start, way))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::volume::{Outside, Placement};

    fn samples(dims: [usize; 3], spacing: [f64; 3]) -> Samples {
        let volume = VolumeInfo {
            name: "v".into(),
            dims,
            sample_type: "uint8".into(),
            range: (0.0, 1.0),
            placement: Placement { spacing, ..Placement::default() },
            outside: Outside::Low,
        };
        Samples::new(&volume, Units::of_file(4, 0.1))
    }

    #[test]
    fn lattice_edges_inside_the_volume_have_a_way() {
        // A cell is 1 x 2 x 1.5 voxels.
        let samples = samples([4, 4, 4], [0.2, 0.4, 0.3]);
        assert_eq!(samples.place([3, 2, 1]), Some([3072, 4096, 1536]));
        assert_eq!(samples.nearest([3000, 4200, 1500]), [3, 2, 1]);
        let way = |from: [i32; 3], to: [i32; 3]| samples.way_of([from, to]);
        assert_eq!(way([1024, 0, 0], [0, 0, 0]), Some(([1, 0, 0], 0)));
        assert_eq!(way([0, 2048, 1536], [0, 2048, 3072]), Some(([0, 1, 1], 5)));
        for (from, to) in [
            ([3072, 0, 0], [4096, 0, 0]),
            ([0, 0, 0], [-1024, 0, 0]),
            ([0, 0, 0], [1024, 2048, 0]),
            ([0, 0, 0], [2048, 0, 0]),
            ([0, 0, 0], [0, 0, 0]),
            ([0, 0, 0], [1023, 0, 0]),
            ([1, 0, 0], [1024, 0, 0]),
        ] {
            assert_eq!(way(from, to), None, "{from:?} {to:?}");
        }
    }

    #[test]
    fn every_way_comes_back() {
        let samples = samples([3, 3, 3], [1.0, 1.0, 1.0]);
        for w in 0..6 {
            let end = Samples::neighbour([1, 1, 1], w);
            let places = [[1, 1, 1], end].map(|s| samples.place(s).expect("inside"));
            assert_eq!(samples.way_of(places), Some(([1, 1, 1], w)));
        }
    }

    #[test]
    fn without_a_known_placement_there_are_no_samples() {
        for spacing in [[0.0, 1.0, 1.0], [f64::NAN, 1.0, 1.0], [f64::INFINITY; 3]] {
            assert_eq!(samples([4, 4, 4], spacing).place([1, 1, 1]), None);
        }
    }
}
