//! Divides a spectrum by isovalue into chunks, so that a reader reads only what it shows.

use super::elements::Patch;

/// The ranks at which chunks start and end, from the lowest birth to the highest death; none without triangles. At least `min` triangles are
/// born in each chunk, and at least `times` as many as are alive on both sides of its end, so a share of at most 1 / `times` of all is
/// in two chunks.
pub(crate) fn cuts(patch: &Patch, min: usize, times: usize) -> Vec<u32> {
    let n = patch.isovalues.len();
    let (mut born, mut died) = (vec![0usize; n], vec![0usize; n]);
    for t in &patch.triangles {
        born[t.birth as usize] += 1;
        died[t.death as usize] += 1;
    }
    let ends = born.iter().position(|&n| n > 0).zip(died.iter().rposition(|&n| n > 0));
    let Some((first, last)) = ends else { return Vec::new() };
    let mut cuts = vec![first as u32];
    // Triangles alive on both sides of the rank; those born since the last cut; those born from the rank on.
    let (mut across, mut own, mut left) = (0, 0, patch.triangles.len());
    for rank in first..last {
        across -= died[rank];
        if own >= min.max(times * across) && left >= min {
            cuts.push(rank as u32);
            own = 0;
        }
        across += born[rank];
        own += born[rank];
        left -= born[rank];
    }
    cuts.push(last as u32);
    cuts
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spectrum::Triangle;

    #[test]
    fn cuts_are_where_few_triangles_are_alive_on_both_sides() {
        // Ten are born at each rank and live for one rank, those of rank 5 for three.
        let one = |birth: u32, life: u32| Triangle {
            vertices: [0, 1, 2],
            birth,
            death: birth + life,
            cap: false,
        };
        let all = (0..20)
            .flat_map(|rank| std::iter::repeat_n(one(rank, if rank == 5 { 3 } else { 1 }), 10));
        let isovalues = (0..23).map(f64::from).collect();
        let mut patch = Patch { isovalues, triangles: all.collect(), ..Patch::default() };
        assert_eq!(cuts(&patch, 30, 4), [0, 3, 7, 10, 13, 16, 20]);
        assert_eq!(cuts(&patch, 1000, 4), [0, 20]);
        patch.triangles.clear();
        assert!(cuts(&patch, 1, 1).is_empty());
    }
}
