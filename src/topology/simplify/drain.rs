//! Removes minima: each drains into a lower one.
//!
//! # Theory
//!
//! From a minimum, samples are visited in ascending order until one is lower than the minimum; the highest of them is the
//! saddle at which its component of the lattice meets an older one (elder rule), and the difference
//! is its persistence on the lattice. Local propagation of this kind is that of Lukasczyk, Garth, Maciejewski,
//! Tierny, "Localized Topological Simplification of Scalar Data" (2020).
//!
//! Filling the component up to its saddle would move samples by the whole persistence. Here the component is filled
//! half-way, and the path out of it is cut down to the same height: samples move by half of the persistence.
//! From the lower sample back to the minimum the path rises by a grain at each sample, and from the path into the filled
//! component too, so that every sample has a lower neighbour. `relax` smooths the remaining corners and rims.
//!
//! # Invariants
//!
//! Minima are removed from the highest to the lowest, so a component contains no other minimum to remove. Memory: a bit
//! per sample, and 24 bytes per sample of one component.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use super::lattice::Lattice;

/// Removes every minimum whose persistence on the lattice is below `depth`, and all of `marked` (ascending sample
/// indices). Returns their number.
pub(super) fn drain_minima(lattice: &mut Lattice, depth: f64, marked: &[usize]) -> usize {
    let mut minima = lattice.minima();
    minima.sort_unstable_by(|&a, &b| descending(lattice, a, b));
    let [mut seen, mut done] = [0; 2].map(|_| Marks::new(lattice.dims.iter().product()));
    let mut n_removed = 0;
    for minimum in minima {
        // The removal of another one may have changed it.
        if !lattice.is_minimum(minimum) {
            continue;
        }
        let is_marked = marked.binary_search(&minimum).is_ok();
        let depth = if is_marked { f64::INFINITY } else { depth };
        let basin = Basin::grow(lattice, minimum, depth, &mut seen);
        if let Some(outlet) = basin.outlet {
            basin.drain(lattice, outlet, &mut seen, &mut done);
            n_removed += 1;
        }
    }
    n_removed
}

fn descending(lattice: &Lattice, a: usize, b: usize) -> Ordering {
    if lattice.is_lower(a, b) { Ordering::Greater } else { Ordering::Less }
}

/// A visited sample.
struct Visited {
    sample: usize,
    /// Index of the previous one among the visited samples.
    from: u32,
}

/// The outlet of a component.
#[derive(Clone, Copy)]
struct Outlet {
    /// Index of the last sample on the path out among the visited samples.
    last: u32,
    /// Value of the lower sample after it; none for the layer.
    lower: Option<f64>,
    /// The highest value on the path.
    saddle: f64,
}

/// The samples around a minimum up to its saddle.
struct Basin {
    /// The first is the minimum.
    visited: Vec<Visited>,
    /// None if the minimum stays.
    outlet: Option<Outlet>,
}

impl Basin {
    /// Grows until the minimum drains or `depth` is reached. Afterwards only the samples of the component are marked as seen.
    fn grow(lattice: &Lattice, minimum: usize, depth: f64, seen: &mut Marks) -> Self {
        let bottom = lattice.get(minimum);
        let mut visited = vec![Visited { sample: minimum, from: 0 }];
        let mut heap = BinaryHeap::from([QueueEntry { value: bottom, sample: minimum, index: 0 }]);
        seen.set(minimum);
        let mut saddle = bottom;
        let mut outlet = None;
        while let Some(next) = heap.pop() {
            if lattice.order.is_lower(next.value, next.sample, bottom, minimum) {
                let last = visited[next.index as usize].from;
                outlet = Some(Outlet { last, lower: Some(next.value), saddle });
                seen.clear(next.sample);
                break;
            }
            saddle = saddle.max(next.value);
            if saddle - bottom >= depth {
                break;
            }
            let (around, at_border) = lattice.neighbours(next.sample);
            if at_border && lattice.order.layer_is_low {
                outlet = Some(Outlet { last: next.index, lower: None, saddle });
                break;
            }
            for sample in around.into_iter().flatten() {
                if seen.is_set(sample) {
                    continue;
                }
                seen.set(sample);
                let index = visited.len() as u32;
                visited.push(Visited { sample, from: next.index });
                heap.push(QueueEntry { value: lattice.get(sample), sample, index });
            }
        }
        if outlet.is_none() {
            visited.iter().for_each(|v| seen.clear(v.sample));
        }
        heap.into_iter().for_each(|left| seen.clear(left.sample));
        Basin { visited, outlet }
    }

    /// Fills the component half-way and cuts the path out down to the same height. Other samples that would fall below a
    /// sample that was below them are raised too, so no sample loses its lower neighbour.
    fn drain(&self, lattice: &mut Lattice, outlet: Outlet, inside: &mut Marks, done: &mut Marks) {
        let grain = lattice.grain;
        let bottom = lattice.get(self.visited[0].sample);
        let middle = grain.round(bottom + 0.5 * (outlet.saddle - bottom));
        let mut before = outlet.lower;
        // Moved samples with their old values.
        let mut moved = Vec::new();
        let mut index = outlet.last;
        loop {
            let Visited { sample, from } = self.visited[index as usize];
            let old = lattice.get(sample);
            let value =
                before.map_or(old.min(middle), |before| old.min(middle).max(before + grain.size));
            lattice.set(sample, value);
            before = Some(value);
            done.set(sample);
            moved.push((sample, old));
            if index == 0 {
                break;
            }
            index = from;
        }
        // From the path outwards, breadth first.
        let mut n_done = 0;
        while n_done < moved.len() {
            let (sample, old) = moved[n_done];
            n_done += 1;
            let floor = lattice.get(sample) + grain.size;
            for n in lattice.neighbours(sample).0.into_iter().flatten() {
                let at_n = lattice.get(n);
                let is_too_low = at_n < floor && !done.is_set(n);
                if is_too_low && (inside.is_set(n) || lattice.order.is_lower(old, sample, at_n, n))
                {
                    lattice.set(n, floor);
                    done.set(n);
                    moved.push((n, at_n));
                }
            }
        }
        moved.iter().for_each(|&(sample, _)| done.clear(sample));
        self.visited.iter().for_each(|v| inside.clear(v.sample));
    }
}

/// An entry of the priority queue; the lowest sample is the greatest entry.
struct QueueEntry {
    value: f64,
    sample: usize,
    index: u32,
}

impl Ord for QueueEntry {
    fn cmp(&self, other: &Self) -> Ordering {
        let of_values = other.value.partial_cmp(&self.value).unwrap_or(Ordering::Equal);
        of_values.then(self.sample.cmp(&other.sample))
    }
}

impl PartialOrd for QueueEntry {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for QueueEntry {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for QueueEntry {}

/// A bit per sample.
struct Marks(Vec<u64>);

impl Marks {
    fn new(n: usize) -> Self {
        Marks(vec![0; n.div_ceil(64)])
    }

    fn is_set(&self, sample: usize) -> bool {
        self.0[sample / 64] >> (sample % 64) & 1 == 1
    }

    fn set(&mut self, sample: usize) {
        self.0[sample / 64] |= 1 << (sample % 64);
    }

    fn clear(&mut self, sample: usize) {
        self.0[sample / 64] &= !(1 << (sample % 64));
    }
}
