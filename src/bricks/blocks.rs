//! Cutting a volume into blocks of samples.

use crate::error::{Error, Result};
use crate::volume::Volume;

/// Blocks of samples along x, y, z: for each the first sample and the one after the last.
pub type Blocks = Vec<([usize; 3], [usize; 3])>;

/// Fewest cells along the side of a brick: smaller bricks have more border than interior.
const MIN_SIDE: usize = 4;

/// Checks the side of bricks, before samples are read.
///
/// # Errors
///
/// [`Error::Usage`] for bricks smaller than 4 cells.
pub fn check_side(side: usize) -> Result<()> {
    if side < MIN_SIDE {
        return Err(Error::Usage(format!(
            "bricks of {side} cells, expected {MIN_SIDE} or more along a side"
        )));
    }
    Ok(())
}

/// Cuts a volume of `dims` samples into blocks, x fastest. Their number along an axis makes their sides as close to `side` cells as
/// possible; sides differ by at most two cells. Neighbouring blocks share one plane of samples.
pub fn cut(dims: [usize; 3], side: usize) -> Blocks {
    let [x, y, z] = dims.map(|n| intervals(n.saturating_sub(1), side.max(1)));
    let (x, y) = (&x, &y);
    z.iter()
        .flat_map(|k| y.iter().flat_map(move |j| x.iter().map(move |i| [i, j, k])))
        .map(|axes| (axes.map(|a| a.0), axes.map(|a| a.1 + 1)))
        .collect()
}

/// Cuts the cells of an axis into intervals that begin at even cells, because the sweep works on blocks of 2^3 cells.
fn intervals(n_cells: usize, side: usize) -> Vec<(usize, usize)> {
    let n = ((n_cells + side / 2) / side).clamp(1, n_cells.div_ceil(2).max(1));
    let at = |i: usize| {
        if i == n { n_cells } else { (i * n_cells / n).next_multiple_of(2).min(n_cells) }
    };
    (0..n).map(|i| (at(i), at(i + 1))).filter(|(a, b)| a < b).collect()
}

/// CRC-32 of a volume's samples, little endian, x fastest.
pub(super) fn checksum(volume: &Volume) -> u32 {
    crc32fast::hash(&volume.samples().to_le_bytes())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_cover_all_cells_once_and_share_their_planes() {
        for (dims, side) in
            [([41, 41, 41], 20), ([7, 200, 2], 8), ([129, 513, 1000], 128), ([2, 2, 2], 4)]
        {
            let blocks = cut(dims, side);
            let cells = |(first, end): &([usize; 3], [usize; 3])| -> usize {
                (0..3).map(|a| end[a] - 1 - first[a]).product()
            };
            let all: usize = dims.iter().map(|n| n - 1).product();
            assert_eq!(blocks.iter().map(cells).sum::<usize>(), all, "{dims:?}");
            for (first, end) in &blocks {
                for a in 0..3 {
                    assert!(first[a] == 0 || blocks.iter().any(|b| b.1[a] == first[a] + 1));
                    assert!(end[a] == dims[a] || blocks.iter().any(|b| b.0[a] + 1 == end[a]));
                }
            }
        }
        assert_eq!(cut([41; 3], 20).len(), 8);
        assert_eq!(cut([257; 3], 128).len(), 8);
    }
}
