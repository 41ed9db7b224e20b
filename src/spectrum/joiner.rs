//! Joins patches that share vertices, one after the other: a patch is not needed any more once it has been appended.
//!
//! # Invariants
//!
//! The result depends only on the patches and their order. Until `finish`, ranks refer to the concatenated tables of all
//! patches, so no table has to be known in advance.

use std::collections::HashMap;

use super::elements::{Knot, Patch, Triangle};
use crate::error::{Error, Result};

/// Joins patches that share vertices.
#[derive(Clone, Debug)]
pub(crate) struct Joiner {
    whole: Patch,
    /// Shared vertices by key.
    seam: HashMap<u64, u32>,
}

/// A shared vertex differs between patches: its position.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct VertexMismatch(pub(crate) [f32; 3]);

impl Default for Joiner {
    fn default() -> Self {
        let whole = Patch::empty();
        Joiner { whole, seam: HashMap::new() }
    }
}

impl Joiner {
    /// With capacity for so many vertices, knots and triangles.
    pub(crate) fn for_size([vertices, knots, triangles]: [usize; 3]) -> Self {
        let mut joiner = Joiner::default();
        joiner.whole.first_knot.reserve_exact(vertices);
        joiner.whole.knots.reserve_exact(knots);
        joiner.whole.triangles.reserve_exact(triangles);
        joiner
    }

    /// Appends a patch, and returns the number of each of its vertices in the whole. `shared` are its shared vertices, ascending, with their keys.
    ///
    /// # Errors
    ///
    /// [`Error::Input`] if the total does not fit 32 bits; the inner result is an error if a shared vertex differs.
    pub(crate) fn append(
        &mut self,
        patch: &Patch,
        shared: &[(u32, u64)],
    ) -> Result<std::result::Result<Vec<u32>, VertexMismatch>> {
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
                    return Ok(Err(VertexMismatch(
                        knots.first().map(|k| k.position).unwrap_or_default(),
                    )));
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
        Ok(Ok(numbers))
    }

    /// All patches as one.
    pub(crate) fn finish(self) -> Patch {
        let Joiner { mut whole, .. } = self;
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
        whole
    }
}

/// Extends the trajectory of a vertex to the ranks that it has in another patch; none if the two differ.
/// Trajectories on lattice edges, with two knots, may begin and end slightly beyond the values of the two samples, without moving there;
/// all others have the same knots in all patches.
fn widen(whole: &mut Patch, v: u32, knots: &[Knot]) -> Option<()> {
    let table = &whole.isovalues;
    let first = whole.first_knot[v as usize] as usize;
    let end = whole.first_knot[v as usize + 1] as usize;
    let own = whole.knots.get_mut(first..end)?;
    let at = |rank: u32| table[rank as usize];
    let is_same = |(a, b): (&Knot, &Knot)| a.position == b.position;
    if own.len() != knots.len() || !own.iter().zip(knots).all(|(a, b)| is_same((a, b))) {
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
