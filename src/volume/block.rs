//! A block of samples of a larger volume, as a volume.
//!
//! # Invariants
//!
//! A block has the range and the layer's side of the whole, and its position in it. So the exact field of a block has the
//! same keys as that of the whole ([`crate::topology::exact`]), and all that depends on a few samples is the same in every
//! block that contains them.

use super::grid::{BlockPosition, Outside, Volume};
use super::memory::try_filled_vec;
use super::placement::Placement;
use super::samples::{Samples, with_samples};
use crate::error::{Error, Result};
use crate::numbers::exact;

/// Properties of a volume that its blocks need.
#[derive(Clone, Debug)]
pub struct WholeVolume<'a> {
    /// Name.
    pub name: &'a str,
    /// Samples along x, y, z.
    pub dims: [usize; 3],
    /// Placement of the whole.
    pub placement: Placement,
    /// Smallest and largest sample of the whole.
    pub range: (f64, f64),
    /// Side of the layer around the whole.
    pub outside: Outside,
}

impl Volume {
    /// The samples from `first` up to, not including, `end` as a block of this volume. Its mask is left out.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`] for a block that is not inside, or has less than 2 samples along an axis; [`Error::Input`] if
    /// memory does not suffice.
    pub fn block(&self, first: [usize; 3], end: [usize; 3]) -> Result<Volume> {
        inside(first, end, self.dims)?;
        let samples = self.samples_of(first, end)?;
        let whole = WholeVolume {
            name: &self.name,
            dims: self.dims,
            placement: self.placement,
            range: self.range,
            outside: self.outside,
        };
        Volume::block_of(&whole, first, end, samples)
    }

    /// The samples from `first` up to, not including, `end`, which are inside, x fastest.
    pub(super) fn samples_of(&self, first: [usize; 3], end: [usize; 3]) -> Result<Samples> {
        crop_samples(&self.samples, self.dims, first, end)
    }

    /// A block of a volume that is not in memory, with its samples from `first` up to, not including, `end`, x fastest.
    ///
    /// # Errors
    ///
    /// As [`Volume::block`]; [`Error::Input`] for another number of samples, and for samples outside the whole's range.
    pub fn block_of(
        whole: &WholeVolume,
        first: [usize; 3],
        end: [usize; 3],
        samples: Samples,
    ) -> Result<Volume> {
        let dims = inside(first, end, whole.dims)?;
        let name = whole.name;
        if samples.len() != dims.iter().product::<usize>() {
            let ([x, y, z], n) = (dims, samples.len());
            return Err(Error::input(format!("{name}: {n} samples, expected {x}x{y}x{z}")));
        }
        // NaN is outside, too.
        let (low, high) = whole.range;
        let is_inside = |i: usize| (low..=high).contains(&samples.get(i));
        if let Some(i) = (0..samples.len()).find(|&i| !is_inside(i)) {
            let [v, low, high] = [samples.get(i), low, high].map(exact);
            return Err(Error::input(format!("{name}: sample {v}, expected {low} to {high}")));
        }
        let placement =
            Placement { origin: whole.placement.world(first.map(|f| f as f64)), ..whole.placement };
        Ok(Volume {
            name: name.to_owned(),
            dims,
            samples,
            placement,
            outside: whole.outside,
            range: whole.range,
            mask: None,
            within: Some(BlockPosition { first, whole: whole.dims }),
        })
    }

    /// The position in the volume of which this is a block; other volumes are blocks of themselves.
    pub fn block_position(&self) -> BlockPosition {
        self.within.unwrap_or(BlockPosition { first: [0; 3], whole: self.dims })
    }
}

/// The samples from `first` up to, not including, `end`, which are inside, of samples on a grid, x fastest.
///
/// # Errors
///
/// [`Error::Input`] if memory does not suffice.
pub(crate) fn crop_samples(
    samples: &Samples,
    [nx, ny, _]: [usize; 3],
    first: [usize; 3],
    end: [usize; 3],
) -> Result<Samples> {
    Ok(with_samples!(samples, all => {
        let n = (0..3).map(|a| end[a] - first[a]).product();
        let mut kept = try_filled_vec(n, all[0]).map_err(|e| Error::input(e.to_string()))?;
        let rows = (first[2]..end[2]).flat_map(|k| (first[1]..end[1]).map(move |j| nx * (j + ny * k)));
        for (to, row) in kept.chunks_exact_mut((end[0] - first[0]).max(1)).zip(rows) {
            to.copy_from_slice(&all[row + first[0]..row + end[0]]);
        }
        Samples::from(kept)
    }))
}

/// The dimensions of a block.
fn inside(first: [usize; 3], end: [usize; 3], whole: [usize; 3]) -> Result<[usize; 3]> {
    if (0..3).any(|a| end[a] > whole[a] || end[a] < first[a].saturating_add(2)) {
        return Err(Error::Usage(format!(
            "samples {first:?} to {end:?}, expected at least 2 along each axis of {whole:?}"
        )));
    }
    Ok([0, 1, 2].map(|a| end[a] - first[a]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::topology::exact::ExactField;
    use crate::volume::phantom;

    #[test]
    fn the_exact_field_of_a_block_has_the_keys_of_the_whole() {
        for name in ["noise:9:3", "gyroid:9"] {
            let whole = phantom(name).expect("a phantom");
            let (first, end) = ([2, 4, 0], [7, 9, 5]);
            let block = whole.block(first, end).expect("inside");
            let (all, part) = (
                ExactField::new(&whole).expect("a field"),
                ExactField::new(&block).expect("a field"),
            );
            for i in 0..125usize {
                let p = [i % 5, i / 5 % 5, i / 25];
                let at = |p: [usize; 3]| p.map(|x| x as i64);
                let of_block = part.vertex(at(p));
                let of_whole = all.vertex(at([0, 1, 2].map(|a| first[a] + p[a])));
                assert_eq!(part.key(of_block), all.key(of_whole));
                assert_eq!(part.sample(of_block), all.sample(of_whole));
            }
            for c in [0.1, 0.25, 0.77] {
                let (low, high) = whole.range();
                let c = low + c * (high - low);
                assert_eq!(part.isovalue_key(c), all.isovalue_key(c));
            }
        }
    }

    #[test]
    fn a_block_outside_is_rejected() {
        let whole = phantom("gyroid:9").expect("a phantom");
        for (first, end) in [([0; 3], [10, 9, 9]), ([3; 3], [4; 3]), ([usize::MAX; 3], [9; 3])] {
            assert!(matches!(whole.block(first, end), Err(Error::Usage(_))));
        }
    }
}
