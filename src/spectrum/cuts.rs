//! Where a spectrum is cut by isovalue, so that no more of it need be read than is shown.

use super::Patch;

/// Ranks from the lowest birth to the highest death; nothing without triangles. Between two of them at least `least` triangles are
/// born, and `times` as many as live on both sides of the second: so no more than a share of 1 / `times` of all stand on both sides of
/// a cut.
pub(crate) fn cuts(patch: &Patch, least: usize, times: usize) -> Vec<u32> {
    let n = patch.isovalues.len();
    let (mut born, mut died) = (vec![0usize; n], vec![0usize; n]);
    for t in &patch.triangles {
        born[t.birth as usize] += 1;
        died[t.death as usize] += 1;
    }
    let ends = born.iter().position(|&n| n > 0).zip(died.iter().rposition(|&n| n > 0));
    let Some((first, last)) = ends else { return Vec::new() };
    let mut cuts = vec![first as u32];
    // Triangles that live on both sides of a rank, those born since the last cut, and those born from the rank on.
    let (mut across, mut own, mut left) = (0, 0, patch.triangles.len());
    for rank in first..last {
        across -= died[rank];
        if own >= least.max(times * across) && left >= least {
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
    fn cuts_stand_where_few_live_on_both_sides() {
        // Ten are born at each rank; they live for one, but those of rank 5 for three.
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
