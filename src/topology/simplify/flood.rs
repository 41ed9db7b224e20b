//! Basins filled up to the saddles they drain over.
//!
//! # Theory
//!
//! Samples are added in ascending order to a union-find along lattice edges. Where two basins meet,
//! the one with the higher minimum ends; if it is shallower than the depth to be filled, each of its
//! samples is raised to the value at which they met. Basins that have ended in a basin that is
//! itself filled are raised to the higher value, so the floors are resolved from the last to end
//! back to the first. No sample is raised by more than the depth. Connectivity is that of lattice
//! edges: every minimum of the trilinear field is a minimum of it.
//!
//! Memory: 20 bytes per sample beside the field itself.

use crate::disjoint_sets::DisjointSets;

/// Fills every basin shallower than `depth`. With `open`, samples at the border drain into the layer
/// around the volume, which lies below all of them.
pub(super) fn fill_minima(dims: [usize; 3], field: &mut [f64], depth: f64, open: bool) {
    let n = field.len();
    let mut order: Vec<u32> = (0..n as u32).collect();
    // Of equal samples the one with the higher index is lower, as under the ramp.
    order
        .sort_unstable_by(|&a, &b| field[a as usize].total_cmp(&field[b as usize]).then(b.cmp(&a)));
    // Node n is the layer. The root of a basin is its minimum.
    let layer = n as u32;
    let mut basins = DisjointSets::new(n + 1);
    // How far each basin is filled, by its minimum.
    let mut floor = vec![f64::NEG_INFINITY; n + 1];
    let mut basin_of = vec![0; n];
    let mut ended = Vec::new();
    let is_lower = |field: &[f64], a: u32, b: u32| {
        b != layer
            && (a == layer
                || field[a as usize].total_cmp(&field[b as usize]).then(b.cmp(&a)).is_lt())
    };
    for &sample in &order {
        let mut basin = sample;
        let (neighbours, at_border) = neighbours(dims, sample as usize);
        let around = neighbours.into_iter().flatten();
        for neighbour in around.chain((open && at_border).then_some(layer)) {
            // What is higher has not been added yet.
            if !is_lower(field, neighbour, sample) {
                continue;
            }
            let other = basins.find(neighbour);
            if other == basin {
                continue;
            }
            let (elder, younger) =
                if is_lower(field, basin, other) { (basin, other) } else { (other, basin) };
            basins.absorb(elder, younger);
            if younger != sample {
                let value = field[sample as usize];
                if value - field[younger as usize] < depth {
                    floor[younger as usize] = value;
                }
                ended.push((younger, elder));
            }
            basin = elder;
        }
        basin_of[sample as usize] = basin;
    }
    for &(younger, elder) in ended.iter().rev() {
        floor[younger as usize] = floor[younger as usize].max(floor[elder as usize]);
    }
    for (sample, basin) in field.iter_mut().zip(basin_of) {
        *sample = sample.max(floor[basin as usize]);
    }
}

/// The samples along the lattice edges of one, and whether it lies at the border.
fn neighbours(dims: [usize; 3], sample: usize) -> ([Option<u32>; 6], bool) {
    let [nx, ny, _] = dims;
    let position = [sample % nx, sample / nx % ny, sample / (nx * ny)];
    let strides = [1, nx, nx * ny];
    let mut found = [None; 6];
    for a in 0..3 {
        found[2 * a] = (position[a] > 0).then(|| (sample - strides[a]) as u32);
        found[2 * a + 1] = (position[a] + 1 < dims[a]).then(|| (sample + strides[a]) as u32);
    }
    (found, found.contains(&None))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Nine samples in a row between two rows of high ones.
    fn valley(row: [f64; 9]) -> Vec<f64> {
        let mut field = vec![9.0; 36];
        field[..9].copy_from_slice(&row);
        field
    }

    #[test]
    fn shallow_basins_are_filled_to_their_saddles_and_deep_ones_stay() {
        let mut field = valley([0.0, 5.0, 4.0, 4.5, 3.5, 6.0, 1.0, 7.0, 2.0]);
        fill_minima([9, 2, 2], &mut field, 2.6, false);
        // 4 and 3.5 meet at 4.5 and drain over 5; 1 is 5 deep, 2 is 5 deep.
        assert_eq!(field[..9], [0.0, 5.0, 5.0, 5.0, 5.0, 6.0, 1.0, 7.0, 2.0]);
    }

    #[test]
    fn a_basin_at_the_border_drains_into_the_layer() {
        let given = valley([0.0, 5.0, 4.0, 4.5, 3.5, 6.0, 1.0, 7.0, 2.0]);
        let mut field = given.clone();
        fill_minima([9, 2, 2], &mut field, 100.0, true);
        assert_eq!(field, given);
        fill_minima([9, 2, 2], &mut field, 100.0, false);
        assert!(field[1..9].iter().all(|&x| x >= 5.0), "{field:?}");
    }
}
