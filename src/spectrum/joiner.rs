//! Joins patches that have vertices in common, one after the other: none of them is needed once it has been taken in.
//!
//! # Invariants
//!
//! The result depends on the order of the patches alone. Ranks refer to the tables of all patches, one behind the other, until
//! the last has come: so no table has to be known before.

use std::collections::HashMap;

use super::{Knot, Patch, Triangle};
use crate::error::{Error, Result};

/// See the module.
#[derive(Clone, Debug)]
pub(crate) struct Joiner {
    whole: Patch,
    seam: Seam,
}

/// Vertices in common, by their keys.
pub(crate) type Seam = HashMap<u64, u32>;

/// A vertex in common is another one in another patch: where.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Unlike(pub(crate) [f32; 3]);

impl Default for Joiner {
    fn default() -> Self {
        let whole = Patch { first_knot: vec![0], ..Patch::default() };
        Joiner { whole, seam: Seam::new() }
    }
}

impl Joiner {
    /// For so many vertices, knots and triangles in all, which may turn out to be fewer.
    pub(crate) fn for_size([vertices, knots, triangles]: [usize; 3]) -> Self {
        let mut joiner = Joiner::default();
        joiner.whole.first_knot.reserve_exact(vertices);
        joiner.whole.knots.reserve_exact(knots);
        joiner.whole.triangles.reserve_exact(triangles);
        joiner
    }

    /// Takes in a patch; `shared` are its vertices in common with others, ascending, and their keys.
    ///
    /// # Errors
    ///
    /// [`Error::Input`] where all are too many for 32 bits; within the result, where a vertex in common differs.
    pub(crate) fn append(
        &mut self,
        patch: &Patch,
        shared: &[(u32, u64)],
    ) -> Result<std::result::Result<(), Unlike>> {
        let too_many = |_| Error::input("2^32 knots, triangles or isovalues or more in all parts");
        let whole = &mut self.whole;
        let base = u32::try_from(whole.isovalues.len()).map_err(too_many)?;
        whole.isovalues.extend_from_slice(&patch.isovalues);
        u32::try_from(whole.isovalues.len()).map_err(too_many)?;
        u32::try_from(whole.triangles.len() + patch.triangles.len()).map_err(too_many)?;
        let n = patch.first_knot.len() - 1;
        let mut numbers: Vec<u32> = Vec::with_capacity(n);
        let mut shared = shared.iter().peekable();
        for v in 0..n as u32 {
            let [from, to] = [v, v + 1].map(|v| patch.first_knot[v as usize] as usize);
            let knots = patch.knots[from..to].iter();
            let knots = knots.map(|k| Knot { rank: k.rank + base, ..*k });
            let key = shared.next_if(|s| s.0 == v).map(|s| s.1);
            if let Some(&known) = key.and_then(|key| self.seam.get(&key)) {
                let knots: Vec<Knot> = knots.collect();
                if widen(whole, known, &knots).is_none() {
                    return Ok(Err(Unlike(knots.first().map(|k| k.position).unwrap_or_default())));
                }
                numbers.push(known);
                continue;
            }
            let number = whole.first_knot.len() as u32 - 1;
            whole.knots.extend(knots);
            whole.first_knot.push(u32::try_from(whole.knots.len()).map_err(too_many)?);
            self.seam.extend(key.map(|key| (key, number)));
            numbers.push(number);
        }
        whole.triangles.extend(patch.triangles.iter().map(|t| Triangle {
            vertices: t.vertices.map(|v| numbers[v as usize]),
            birth: t.birth + base,
            death: t.death + base,
            cap: t.cap,
        }));
        Ok(Ok(()))
    }

    /// Goes on where [`Joiner::finish`] ended.
    pub(crate) fn resume(whole: Patch, seam: Seam) -> Self {
        Joiner { whole, seam }
    }

    /// All patches as one, and where the vertices in common are in it.
    pub(crate) fn finish(self) -> (Patch, Seam) {
        let Joiner { mut whole, seam } = self;
        let tables = whole.isovalues;
        let mut isovalues = tables.clone();
        isovalues.sort_unstable_by(f64::total_cmp);
        isovalues.dedup();
        let ranks: Vec<u32> =
            tables.iter().map(|&x| isovalues.partition_point(|&c| c < x) as u32).collect();
        drop(tables);
        whole.knots.iter_mut().for_each(|k| k.rank = ranks[k.rank as usize]);
        for t in &mut whole.triangles {
            (t.birth, t.death) = (ranks[t.birth as usize], ranks[t.death as usize]);
        }
        whole.isovalues = isovalues;
        (whole, seam)
    }
}

/// Lets a vertex that is there already live as long as the same one of another patch, which is where it is; not if it is not.
/// Lives of vertices on lattice edges, with two knots, may reach a trace beyond the samples between which they move, where they
/// rest; all others have the same knots everywhere.
fn widen(whole: &mut Patch, v: u32, knots: &[Knot]) -> Option<()> {
    let table = &whole.isovalues;
    let first = whole.first_knot[v as usize] as usize;
    let end = whole.first_knot[v as usize + 1] as usize;
    let own = whole.knots.get_mut(first..end)?;
    let at = |rank: u32| table[rank as usize];
    let is_there = |(a, b): (&Knot, &Knot)| a.position == b.position;
    if own.len() != knots.len() || !own.iter().zip(knots).all(|(a, b)| is_there((a, b))) {
        return None;
    }
    let ([from, to], [other_from, other_to]) = (own, knots) else {
        let own = &whole.knots[first..end];
        return own.iter().zip(knots).all(|(a, b)| at(a.rank) == at(b.rank)).then_some(());
    };
    if at(other_from.rank) < at(from.rank) {
        from.rank = other_from.rank;
    }
    if at(other_to.rank) > at(to.rank) {
        to.rank = other_to.rank;
    }
    Some(())
}
