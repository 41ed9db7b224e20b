//! Constant regions: where all samples of a region have one value, the isosurface jumps across it.

use isospectrum::volume::Volume;
use serde::Serialize;

/// A connected set of equal samples that fills at least one cell.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub(super) struct ConstantRegion {
    /// The value.
    pub(super) isovalue: f64,
    /// Samples in it.
    pub(super) n_samples: usize,
    /// Constant cells in it.
    pub(super) n_cells: usize,
    /// The region's first sample (x fastest).
    pub(super) first_sample: [usize; 3],
}

/// Returns all regions with a value in `range`, by descending size, then by first sample.
pub(super) fn find(volume: &Volume, range: (f64, f64)) -> Vec<ConstantRegion> {
    let dims = volume.dims();
    let [nx, ny, nz] = dims;
    let stride = [1, nx, nx * ny];
    let samples = volume.samples();
    let mut root: Vec<u32> = match u32::try_from(samples.len()) {
        Ok(n) => (0..n).collect(),
        // The topology has the same limit of 2^32 samples.
        Err(_) => return Vec::new(),
    };
    for_each_sample(dims, |i, place| {
        for axis in 0..3 {
            if place[axis] + 1 < dims[axis] && samples.get(i) == samples.get(i + stride[axis]) {
                join(&mut root, i, i + stride[axis]);
            }
        }
    });
    let mut n_samples = vec![0u32; samples.len()];
    let mut n_cells = vec![0u32; samples.len()];
    for_each_sample(dims, |i, place| {
        let at = find_root(&mut root, i);
        n_samples[at] += 1;
        let is_corner = place[0] + 1 < nx && place[1] + 1 < ny && place[2] + 1 < nz;
        if is_corner
            && (1..8).all(|c| {
                let offset = (c & 1) * stride[0] + (c >> 1 & 1) * stride[1] + (c >> 2) * stride[2];
                samples.get(i + offset) == samples.get(i)
            })
        {
            n_cells[at] += 1;
        }
    });
    let mut regions: Vec<ConstantRegion> = (0..samples.len())
        .filter(|&i| n_cells[i] > 0 && (range.0..=range.1).contains(&samples.get(i)))
        .map(|i| ConstantRegion {
            isovalue: samples.get(i),
            n_samples: n_samples[i] as usize,
            n_cells: n_cells[i] as usize,
            first_sample: [i % nx, i / nx % ny, i / (nx * ny)],
        })
        .collect();
    regions.sort_by_key(|region| std::cmp::Reverse(region.n_samples));
    regions
}

fn for_each_sample([nx, ny, nz]: [usize; 3], mut visit: impl FnMut(usize, [usize; 3])) {
    let mut i = 0;
    for z in 0..nz {
        for y in 0..ny {
            for x in 0..nx {
                visit(i, [x, y, z]);
                i += 1;
            }
        }
    }
}

/// Returns the first sample of the set of `i`; halves the path to it.
fn find_root(root: &mut [u32], mut i: usize) -> usize {
    while root[i] as usize != i {
        root[i] = root[root[i] as usize];
        i = root[i] as usize;
    }
    i
}

fn join(root: &mut [u32], a: usize, b: usize) {
    let (a, b) = (find_root(root, a), find_root(root, b));
    root[a.max(b)] = a.min(b) as u32;
}

#[cfg(test)]
mod tests {
    use super::*;
    use isospectrum::volume::{Placement, Samples};

    #[test]
    fn a_region_fills_a_cell_and_a_line_of_equal_samples_does_not() {
        let mut samples: Vec<u8> = (0..64).map(|i| 100 + i).collect();
        for i in [0, 1, 4, 5, 16, 17, 20, 21] {
            samples[i] = 7;
        }
        // A line of equal samples along x.
        samples[40..44].fill(9);
        let volume = Volume::new("v", [4; 3], Samples::U8(samples), Placement::default());
        let volume = volume.expect("a valid volume");
        let expected =
            ConstantRegion { isovalue: 7.0, n_samples: 8, n_cells: 1, first_sample: [0, 0, 0] };
        assert_eq!(find(&volume, (0.0, 255.0)), [expected]);
        assert_eq!(find(&volume, (8.0, 255.0)), []);
    }
}
