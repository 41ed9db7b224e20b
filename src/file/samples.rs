//! Vertices that run along an edge of the lattice, from a sample to its neighbour.
//!
//! # Theory
//!
//! Where no mesh is tracked the spectrum has the exact extraction, whose vertices are on lattice edges: each is born at one
//! sample and ends at a neighbour. Such a *lattice vertex* is stored as its first sample and one of six directions. This takes
//! one byte; two free positions take six. In spectra of noisy volumes most vertices are of this kind.

use super::units::Units;
use crate::spectrum::{Knot, VolumeInfo};

/// The positions of samples in the integers that positions are stored in.
#[derive(Debug)]
pub(super) struct Samples {
    /// Samples along x, y, z.
    dims: [i64; 3],
    /// Units of a position per cell, along x, y, z.
    cell: [f64; 3],
    units: Units,
}

impl Samples {
    /// The samples of a volume, in these units. There are none if the volume has no valid placement.
    pub(super) fn new(volume: &VolumeInfo, units: Units) -> Self {
        let is_known = volume.placement.check().is_ok();
        let dims = volume.dims.map(|n| i64::try_from(n).unwrap_or(0));
        Samples {
            dims: if is_known { dims } else { [0; 3] },
            cell: volume.placement.cell_size().map(|s| s * units.per_voxel),
            units,
        }
    }

    /// The sample nearest to a position. It may be outside the volume.
    pub(super) fn nearest(&self, position: [i32; 3]) -> [i64; 3] {
        std::array::from_fn(|a| (f64::from(position[a]) / self.cell[a] + 0.5).floor() as i64)
    }

    /// The position of a sample; `None` outside the volume.
    pub(super) fn position(&self, sample: [i64; 3]) -> Option<[i32; 3]> {
        let is_inside = (0..3).all(|a| (0..self.dims[a]).contains(&sample[a]));
        is_inside.then(|| {
            std::array::from_fn(|a| (sample[a] as f64 * self.cell[a] + 0.5).floor() as i32)
        })
    }

    /// The neighbour of a sample: direction 2a is down axis a, 2a + 1 up.
    pub(super) fn neighbour(mut sample: [i64; 3], direction: u64) -> [i64; 3] {
        sample[direction as usize / 2] += 2 * (direction as i64 % 2) - 1;
        sample
    }

    /// The first sample of a trajectory and the direction to the second, if it is that of a lattice vertex.
    pub(super) fn edge_of(&self, trajectory: &[Knot]) -> Option<([i64; 3], u64)> {
        let [start, end] = trajectory else { return None };
        self.edge_between([start, end].map(|knot| self.units.of(knot)))
    }

    /// The sample at the first of two positions and the direction to the second, if they are at neighbouring samples.
    pub(super) fn edge_between(&self, positions: [[i32; 3]; 2]) -> Option<([i64; 3], u64)> {
        let [start, end] = positions.map(|p| self.nearest(p));
        if [start, end].map(|sample| self.position(sample)) != positions.map(Some) {
            return None;
        }
        let direction = (0..6).find(|&d| Samples::neighbour(start, d) == end)?;
        Some((start, direction))
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
        // 1024 units per voxel.
        Samples::new(&volume, Units::of_file(0.01))
    }

    #[test]
    fn lattice_edges_inside_the_volume_have_a_direction() {
        // A cell is 1 x 1.5 x 1.25 voxels.
        let samples = samples([4, 4, 4], [0.2, 0.3, 0.25]);
        assert_eq!(samples.position([3, 2, 1]), Some([3072, 3072, 1280]));
        assert_eq!(samples.nearest([3000, 3100, 1250]), [3, 2, 1]);
        let edge = |from: [i32; 3], to: [i32; 3]| samples.edge_between([from, to]);
        assert_eq!(edge([1024, 0, 0], [0, 0, 0]), Some(([1, 0, 0], 0)));
        assert_eq!(edge([0, 1536, 1280], [0, 1536, 2560]), Some(([0, 1, 1], 5)));
        for (from, to) in [
            ([3072, 0, 0], [4096, 0, 0]),
            ([0, 0, 0], [-1024, 0, 0]),
            ([0, 0, 0], [1024, 1536, 0]),
            ([0, 0, 0], [2048, 0, 0]),
            ([0, 0, 0], [0, 0, 0]),
            ([0, 0, 0], [1023, 0, 0]),
            ([1, 0, 0], [1024, 0, 0]),
        ] {
            assert_eq!(edge(from, to), None, "{from:?} {to:?}");
        }
    }

    #[test]
    fn every_direction_is_found() {
        let samples = samples([3, 3, 3], [1.0, 1.0, 1.0]);
        for direction in 0..6 {
            let end = Samples::neighbour([1, 1, 1], direction);
            let positions = [[1, 1, 1], end].map(|s| samples.position(s).expect("inside"));
            assert_eq!(samples.edge_between(positions), Some(([1, 1, 1], direction)));
        }
    }

    #[test]
    fn without_a_valid_placement_there_are_no_samples() {
        for spacing in [[0.0, 1.0, 1.0], [f64::NAN, 1.0, 1.0], [f64::INFINITY; 3]] {
            assert_eq!(samples([4, 4, 4], spacing).position([1, 1, 1]), None);
        }
    }
}
