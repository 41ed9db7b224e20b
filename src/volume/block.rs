//! A block of samples of a larger volume, as a volume.
//!
//! # Invariants
//!
//! A block has the range and the layer's side of the whole, and keeps where it lies in it: so the exact field of a block
//! has the very keys that the whole's field has there ([`crate::topology::exact`]), and whatever depends on a few samples
//! alone is the same in every block that has them.

use serde::{Deserialize, Serialize};

use super::decode::reserve;
use super::{Outside, Placement, Samples, Volume};
use crate::error::{Error, Result};
use crate::volume::with_samples;

/// Where a block of samples lies in a volume.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Within {
    /// The block's first sample in the whole, along x, y, z.
    pub first: [usize; 3],
    /// Samples of the whole along x, y, z.
    pub whole: [usize; 3],
}

/// What a block has of the volume that it is of.
#[derive(Clone, Debug)]
pub struct Whole<'a> {
    /// Name.
    pub name: &'a str,
    /// Samples along x, y, z.
    pub dims: [usize; 3],
    /// Where the whole's samples lie.
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
    /// [`Error::Usage`] for a block that is not inside, or has less than 2 samples along an axis; [`Error::Input`] where
    /// memory does not suffice.
    pub fn block(&self, first: [usize; 3], end: [usize; 3]) -> Result<Volume> {
        inside(first, end, self.dims)?;
        let samples = self.samples_of(first, end)?;
        let whole = Whole {
            name: &self.name,
            dims: self.dims,
            placement: self.placement,
            range: self.range,
            outside: self.outside,
        };
        Volume::block_of(&whole, first, end, samples)
    }

    /// The samples from `first` up to, not including, `end`, which lie inside, x fastest.
    pub(super) fn samples_of(&self, first: [usize; 3], end: [usize; 3]) -> Result<Samples> {
        part_of_samples(&self.samples, self.dims, first, end)
    }

    /// A block of a volume that is not there itself: its samples from `first` up to, not including, `end`, x fastest.
    ///
    /// # Errors
    ///
    /// As [`Volume::block`]; [`Error::Input`] if there are more or fewer samples, or some outside the whole's range.
    pub fn block_of(
        whole: &Whole,
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
        // What is no number is not inside either.
        let (low, high) = whole.range;
        let is_inside = |i: usize| (low..=high).contains(&samples.get(i));
        if let Some(i) = (0..samples.len()).find(|&i| !is_inside(i)) {
            let v = samples.get(i);
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
            within: Some(Within { first, whole: whole.dims }),
        })
    }

    /// Where the volume lies in the one that it is a block of; a volume that is none is its own.
    pub fn within(&self) -> Within {
        self.within.unwrap_or(Within { first: [0; 3], whole: self.dims })
    }
}

/// Of samples on a grid, x fastest, those from `first` up to, not including, `end`, which lie inside.
///
/// # Errors
///
/// [`Error::Input`] where memory does not suffice.
pub(crate) fn part_of_samples(
    samples: &Samples,
    [nx, ny, _]: [usize; 3],
    first: [usize; 3],
    end: [usize; 3],
) -> Result<Samples> {
    Ok(with_samples!(samples, all => {
        let n = (0..3).map(|a| end[a] - first[a]).product();
        let mut kept = reserve(n, all[0]).map_err(|e| Error::input(e.to_string()))?;
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
    fn a_block_outside_is_refused_in_one_line() {
        let whole = phantom("gyroid:9").expect("a phantom");
        for (first, end) in [([0; 3], [10, 9, 9]), ([3; 3], [4; 3]), ([usize::MAX; 3], [9; 3])] {
            assert!(matches!(whole.block(first, end), Err(Error::Usage(_))));
        }
    }
}
