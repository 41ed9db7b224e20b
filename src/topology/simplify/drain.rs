//! Minima taken away: each drains into a lower one.
//!
//! # Theory
//!
//! From a minimum samples are taken in ascending order until one is lower than the minimum itself; the highest on the
//! way is the saddle at which its component of the lattice meets an older one (the elder rule), and the difference
//! is its persistence on the lattice. Local propagation of this kind is that of Lukasczyk, Garth, Maciejewski,
//! Tierny, "Localized Topological Simplification of Scalar Data" (2020).
//!
//! Filling the component up to its saddle would move samples by the whole persistence. Here the component is filled
//! half-way, and the way that leads out of it is cut down to the same height: half of the persistence on either side.
//! From the lower sample back to the minimum the way rises by a grain at each sample, and from there into the filled
//! component likewise, so that every one of them has a lower neighbour. What this leaves of corners and rims is
//! smoothed afterwards (`relax`).
//!
//! # Invariants
//!
//! Minima go from the highest to the lowest, so a component holds no other minimum that is to go. Memory: a bit per
//! sample, and 24 bytes per sample of one component.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use super::lattice::Lattice;

/// Takes away every minimum whose persistence on the lattice is below `depth`, and those of `marked` (ascending
/// numbers) whatever theirs is. Returns how many went.
pub(super) fn drain_minima(lattice: &mut Lattice, depth: f64, marked: &[usize]) -> usize {
    let mut minima = lattice.minima();
    minima.sort_unstable_by(|&a, &b| descending(lattice, a, b));
    let [mut seen, mut done] = [0; 2].map(|_| Marks::new(lattice.dims.iter().product()));
    let mut n_gone = 0;
    for minimum in minima {
        // One that went may have changed it.
        if !lattice.is_minimum(minimum) {
            continue;
        }
        let is_marked = marked.binary_search(&minimum).is_ok();
        let depth = if is_marked { f64::INFINITY } else { depth };
        let component = Component::grow(lattice, minimum, depth, &mut seen);
        if let Some(outlet) = component.outlet {
            component.drain(lattice, outlet, &mut seen, &mut done);
            n_gone += 1;
        }
    }
    n_gone
}

fn descending(lattice: &Lattice, a: usize, b: usize) -> Ordering {
    if lattice.is_lower(a, b) { Ordering::Greater } else { Ordering::Less }
}

/// A sample that was met, and from where.
struct Visited {
    sample: usize,
    /// Place, among those visited, of the one before it.
    from: u32,
}

/// Where a component drains.
#[derive(Clone, Copy)]
struct Outlet {
    /// The last of the component on the way out, a place among those visited.
    last: u32,
    /// What lies behind it; none is the layer.
    lower: Option<f64>,
    /// The highest value on the way.
    saddle: f64,
}

/// What is around a minimum up to its saddle.
struct Component {
    /// The minimum is the first.
    visited: Vec<Visited>,
    /// None where the minimum stays.
    outlet: Option<Outlet>,
}

impl Component {
    /// Grows until the minimum drains, or is `depth` deep. Those in the component are marked as seen afterwards, and no others.
    fn grow(lattice: &Lattice, minimum: usize, depth: f64, seen: &mut Marks) -> Self {
        let bottom = lattice.get(minimum);
        let mut visited = vec![Visited { sample: minimum, from: 0 }];
        let mut heap = BinaryHeap::from([Next { value: bottom, sample: minimum, place: 0 }]);
        seen.set(minimum);
        let mut saddle = bottom;
        let mut outlet = None;
        while let Some(next) = heap.pop() {
            if lattice.order.is_lower(next.value, next.sample, bottom, minimum) {
                let last = visited[next.place as usize].from;
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
                outlet = Some(Outlet { last: next.place, lower: None, saddle });
                break;
            }
            for sample in around.into_iter().flatten() {
                if seen.is_set(sample) {
                    continue;
                }
                seen.set(sample);
                let place = visited.len() as u32;
                visited.push(Visited { sample, from: next.place });
                heap.push(Next { value: lattice.get(sample), sample, place });
            }
        }
        if outlet.is_none() {
            visited.iter().for_each(|v| seen.clear(v.sample));
        }
        heap.into_iter().for_each(|left| seen.clear(left.sample));
        Component { visited, outlet }
    }

    /// Fills the component half-way and cuts the way out down to there. Whatever else would come to lie below a sample
    /// that it lay above is raised too, so nothing loses the neighbour that it drains into.
    fn drain(&self, lattice: &mut Lattice, outlet: Outlet, inside: &mut Marks, done: &mut Marks) {
        let grain = lattice.grain;
        let bottom = lattice.get(self.visited[0].sample);
        let middle = grain.round(bottom + 0.5 * (outlet.saddle - bottom));
        let mut before = outlet.lower;
        // Samples that were moved, with what they were before.
        let mut moved = Vec::new();
        let mut place = outlet.last;
        loop {
            let Visited { sample, from } = self.visited[place as usize];
            let old = lattice.get(sample);
            let value =
                before.map_or(old.min(middle), |before| old.min(middle).max(before + grain.size));
            lattice.set(sample, value);
            before = Some(value);
            done.set(sample);
            moved.push((sample, old));
            if place == 0 {
                break;
            }
            place = from;
        }
        // From the way outwards, breadth first.
        let mut n_done = 0;
        while n_done < moved.len() {
            let (sample, old) = moved[n_done];
            n_done += 1;
            let floor = lattice.get(sample) + grain.size;
            for n in lattice.neighbours(sample).0.into_iter().flatten() {
                let at_n = lattice.get(n);
                let is_beside = at_n < floor && !done.is_set(n);
                if is_beside && (inside.is_set(n) || lattice.order.is_lower(old, sample, at_n, n)) {
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

/// A sample that comes next; the lowest is the greatest.
struct Next {
    value: f64,
    sample: usize,
    place: u32,
}

impl Ord for Next {
    fn cmp(&self, other: &Self) -> Ordering {
        let of_values = other.value.partial_cmp(&self.value).unwrap_or(Ordering::Equal);
        of_values.then(self.sample.cmp(&other.sample))
    }
}

impl PartialOrd for Next {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Next {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Next {}

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
