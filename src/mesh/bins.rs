//! Boxes sorted into the cells (bins) of a uniform grid.

use glam::{DVec3, IVec3, Vec3};
use rayon::prelude::*;

/// Largest number of bins that a box overlaps, mean over all boxes, beyond [`FREE_ENTRIES`] in all.
const MAX_MEAN_BINS: f64 = 32.0;
const FREE_ENTRIES: f64 = 4096.0;

/// Boxes, sorted into the bins that they overlap: cubes, doubled along the axes of boxes so long
/// that they would overlap too many.
pub(crate) struct Bins {
    origin: Vec3,
    size: Vec3,
    /// The largest index of a bin along each axis.
    last: IVec3,
    /// The lowest bin of each box.
    lowest: Vec<IVec3>,
    /// The number of a bin, times 2^32, plus the index of a box; ascending.
    entries: Vec<u64>,
}

impl Bins {
    /// Sorts boxes, given by their lowest and highest corners, into bins of this size, in the frame of the boxes.
    pub(crate) fn of(boxes: &[(Vec3, Vec3)], size: f32) -> Bins {
        let origin = boxes.iter().map(|b| b.0).reduce(Vec3::min).unwrap_or_default();
        let top = boxes.iter().map(|b| b.1).reduce(Vec3::max).unwrap_or_default();
        let (size, last) = (Vec3::splat(size), IVec3::ZERO);
        let (lowest, entries) = (Vec::new(), Vec::new());
        let mut bins = Bins { origin, size, last, lowest, entries };
        bins.widen(boxes, top);
        let mut lowest = Vec::with_capacity(boxes.len());
        let mut entries: Vec<u64> = Vec::with_capacity(4 * boxes.len());
        for (i, b) in (0u64..).zip(boxes) {
            let (low, high) = (bins.bin(b.0), bins.bin(b.1));
            lowest.push(low);
            for z in low.z..=high.z {
                for y in low.y..=high.y {
                    let number = |x| bins.number(IVec3::new(x, y, z));
                    let row = (low.x..=high.x).map(|x| number(x) << 32 | i);
                    entries.extend(row);
                }
            }
        }
        entries.par_sort_unstable();
        Bins { lowest, entries, ..bins }
    }

    /// Doubles the bins along the axis along which boxes overlap the most, until the number of entries is a small
    /// multiple of the number of boxes: memory must not depend on their size; and until numbers of bins have 32 bits.
    fn widen(&mut self, boxes: &[(Vec3, Vec3)], top: Vec3) {
        let max = MAX_MEAN_BINS * boxes.len() as f64 + FREE_ENTRIES;
        loop {
            self.last = self.bin(top);
            let n = self.last.as_dvec3() + 1.0;
            if n.element_product() > f64::from(u32::MAX) {
                let axis = (1..3).fold(0, |best, a| if n[a] > n[best] { a } else { best });
                self.size[axis] *= 2.0;
                continue;
            }
            let (mut n_bins, mut reach) = (0.0, DVec3::ZERO);
            for b in boxes {
                let span = (self.bin(b.1).as_dvec3() - self.bin(b.0).as_dvec3()) + 1.0;
                n_bins += span.max(DVec3::ONE).element_product();
                reach += span;
            }
            if n_bins <= max {
                return;
            }
            let axis = (1..3).fold(0, |best, a| if reach[a] > reach[best] { a } else { best });
            self.size[axis] *= 2.0;
        }
    }

    fn bin(&self, p: Vec3) -> IVec3 {
        ((p - self.origin) / self.size).as_ivec3()
    }

    fn number(&self, bin: IVec3) -> u64 {
        let [x, y, z] = bin.to_array().map(|i| i as u64);
        let [nx, ny, _] = self.last.to_array().map(|i| i as u64 + 1);
        x + nx * (y + ny * z)
    }

    /// The number of the lowest bin that two boxes overlap, if they overlap each other.
    pub(crate) fn first_common(&self, i: u32, j: u32) -> u64 {
        self.number(self.lowest[i as usize].max(self.lowest[j as usize]))
    }

    /// The entries of each bin that is not empty: one for every box in it, ascending.
    pub(crate) fn each(&self) -> impl Iterator<Item = &[u64]> {
        self.entries.chunk_by(|a, b| a >> 32 == b >> 32)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    impl Bins {
        /// The boxes in the bin of a point, ascending.
        fn boxes_at(&self, p: Vec3) -> Vec<u32> {
            let bin = self.bin(p);
            if bin.cmplt(IVec3::ZERO).any() || bin.cmpgt(self.last).any() {
                return Vec::new();
            }
            let at = self.number(bin);
            self.entries.iter().filter(|e| *e >> 32 == at).map(|e| *e as u32).collect()
        }
    }

    #[test]
    fn a_box_is_in_every_bin_that_it_overlaps() {
        let one = (Vec3::ZERO, Vec3::new(2.5, 0.5, 0.5));
        let other = (Vec3::new(2.2, 0.2, 0.2), Vec3::splat(3.0));
        let bins = Bins::of(&[one, other], 1.0);
        let at = |x: f32, y: f32, z: f32| bins.boxes_at(Vec3::new(x, y, z));
        assert_eq!(at(0.9, 0.1, 0.1), [0]);
        assert_eq!(at(2.4, 0.4, 0.4), [0, 1]);
        assert_eq!(at(2.9, 2.9, 2.9), [1]);
        assert!(at(0.5, 2.5, 0.5).is_empty() && at(9.0, 9.0, 9.0).is_empty());
        assert!(at(-5.0, -5.0, -5.0).is_empty());
        assert_eq!(bins.each().map(<[_]>::len).sum::<usize>(), 3 + 2 * 4 * 4);
    }

    #[test]
    fn the_memory_for_long_boxes_is_a_small_multiple_of_their_number() {
        // Each box overlaps 10^12 bins of size 1.
        let long = |i: usize| {
            let low = Vec3::new(i as f32, 0.25, -2e11);
            (low, low + Vec3::new(0.5, 0.5, 1e12))
        };
        let boxes: Vec<(Vec3, Vec3)> = (0..1000).map(long).collect();
        let bins = Bins::of(&boxes, 1.0);
        let n = bins.each().map(<[_]>::len).sum::<usize>();
        assert!(n <= 32 * 1000 + 4096, "{n} entries");
        // Neighbouring boxes are still in different bins.
        assert_eq!(bins.boxes_at(Vec3::new(7.1, 0.5, 3e11)), [7]);
        let endless = Bins::of(&[(Vec3::ZERO, Vec3::splat(f32::INFINITY))], 1.0);
        assert!(endless.each().map(<[_]>::len).sum::<usize>() <= 4096 + 32);
    }

    #[test]
    fn without_boxes_all_bins_are_empty() {
        let bins = Bins::of(&[], 1.0);
        assert!(bins.boxes_at(Vec3::ZERO).is_empty() && bins.each().next().is_none());
    }
}
