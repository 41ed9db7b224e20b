//! Joins tracked triangles whose vertices are all on lattice edges to those of exact cells that they continue.
//!
//! # Theory
//!
//! Where exact cells are released their triangles become part of the mesh unchanged, and an exact cell may have the triangle again later. Such a
//! triangle is one, and its lifetime lasts from the first of them to the last.

use rayon::prelude::*;

use super::ranked_set::RankedSet;
use crate::spectrum::Triangle;

/// Joins `seam` to the triangles from number `first` on, and appends those that continue none. Vertices are codes below `n_codes`.
pub(super) fn join_seam_triangles(
    triangles: &mut Vec<Triangle>,
    first: usize,
    mut seam: Vec<Triangle>,
    n_codes: usize,
) {
    seam.par_sort_unstable_by_key(key);
    let firsts = RankedSet::new(n_codes, seam.par_iter().map(|t| t.vertices[0]));
    let is_seam = |t: &Triangle| {
        firsts.contains(t.vertices[0])
            && seam.binary_search_by_key(&t.vertices, |s| s.vertices).is_ok()
    };
    // With their numbers, if they have one.
    let exact = triangles.par_iter().enumerate().skip(first).filter(|(_, t)| is_seam(t));
    let mut all: Vec<(Triangle, Option<usize>)> = exact.map(|(i, t)| (*t, Some(i))).collect();
    all.par_extend(seam.into_par_iter().map(|t| (t, None)));
    all.par_sort_unstable_by_key(|(t, i)| (key(t), *i));
    let continues = |a: &(Triangle, Option<usize>), b: &(Triangle, Option<usize>)| {
        a.0.vertices == b.0.vertices && a.0.death == b.0.birth
    };
    let mut joined = Vec::new();
    for of_one in all.chunk_by(continues) {
        let last = of_one[of_one.len() - 1].0;
        let whole = Triangle { death: last.death, ..of_one[0].0 };
        let mut numbers = of_one.iter().filter_map(|(_, i)| *i);
        match numbers.next() {
            Some(i) => triangles[i] = whole,
            None => joined.push(whole),
        }
        // An empty lifetime marks a triangle that is part of another one.
        numbers.for_each(|i| triangles[i].death = triangles[i].birth);
    }
    triangles.retain(|t| t.birth < t.death);
    triangles.extend(joined);
}

fn key(t: &Triangle) -> ([u32; 3], u32) {
    (t.vertices, t.birth)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_triangle_that_continues_another_is_joined_to_it() {
        let t = |v: u32, birth: u32, death: u32| Triangle {
            vertices: [v, v + 1, v + 2],
            birth,
            death,
            cap: false,
        };
        // Tracked, then exact: one before, one after, one between two and one without a neighbour in time.
        let mut triangles =
            vec![t(0, 5, 6), t(1, 0, 3), t(2, 4, 6), t(3, 0, 1), t(3, 2, 3), t(4, 0, 1)];
        let seam = vec![t(4, 2, 3), t(3, 1, 2), t(2, 2, 4), t(1, 3, 9), t(7, 1, 2)];
        join_seam_triangles(&mut triangles, 1, seam, 10);
        let expected = vec![
            t(0, 5, 6),
            t(1, 0, 9),
            t(2, 2, 6),
            t(3, 0, 3),
            t(4, 0, 1),
            t(4, 2, 3),
            t(7, 1, 2),
        ];
        assert_eq!(triangles, expected);
    }
}
