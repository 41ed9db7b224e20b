//! Boundaries and fans of a list of triangles, which need not be a manifold.

use std::collections::BTreeMap;

use crate::grouped::grouped;

/// A corner of a triangle: the triangle, and which of its corners.
type Corner = (u32, u32);

/// A side of a triangle, at the lower one of its ends: the higher one, and whether it leads to the lower one.
type Side = (u32, bool);

/// The number of vertices of some triangles, those included that none of them uses.
fn n_vertices(triangles: &[[u32; 3]]) -> usize {
    triangles.as_flattened().iter().max().map_or(0, |&v| v as usize + 1)
}

/// Where fans of triangles meet in a vertex without a common edge, gives all fans but one a copy of the vertex, numbered from
/// `first_copy`. Returns the original of each copy.
pub(super) fn split_fans(triangles: &mut [[u32; 3]], first_copy: usize) -> Vec<u32> {
    let corners = (0..3 * triangles.len() as u32).map(|i| (i / 3, i % 3));
    let corners = corners.map(|(t, i)| (triangles[t as usize][i as usize], (t, i)));
    let (starts, corners) = grouped(n_vertices(triangles), corners);
    let mut copies: Vec<(u32, Vec<Corner>)> = Vec::new();
    let mut left: Vec<Corner> = Vec::new();
    let mut part: Vec<Corner> = Vec::new();
    for (v, ends) in (0..).zip(starts.windows(2)) {
        let others = |&(t, i): &Corner| {
            let t = triangles[t as usize];
            [t[(i as usize + 1) % 3], t[(i as usize + 2) % 3]]
        };
        // Walks the fan of one corner in both directions; the remaining corners belong to other fans.
        left.clear();
        left.extend(&corners[ends[0] as usize..ends[1] as usize]);
        let mut is_first = true;
        while let Some(first) = left.pop() {
            part.clear();
            part.push(first);
            let [mut start, mut end] = others(&first);
            loop {
                let next = left.iter().position(|c| {
                    let [a, b] = others(c);
                    a == end || b == start
                });
                let Some(i) = next else { break };
                let corner = left.swap_remove(i);
                let [a, b] = others(&corner);
                if a == end {
                    end = b;
                } else {
                    start = a;
                }
                part.push(corner);
            }
            if !is_first {
                copies.push((v, part.clone()));
            }
            is_first = false;
        }
    }
    for (n, (_, part)) in copies.iter().enumerate() {
        for &(t, i) in part {
            triangles[t as usize][i as usize] = (first_copy + n) as u32;
        }
    }
    copies.into_iter().map(|c| c.0).collect()
}

/// The boundary of some triangles: per vertex on it the next one.
///
/// # Errors
///
/// A vertex at which the triangles are not a manifold.
pub(super) fn boundary(triangles: &[[u32; 3]]) -> std::result::Result<BTreeMap<u32, u32>, u32> {
    let sides = triangles.iter().flat_map(|t| {
        (0..3).map(|i| {
            let (a, b) = (t[i], t[(i + 1) % 3]);
            (a.min(b), (a.max(b), a > b))
        })
    });
    let (starts, mut sides): (_, Vec<Side>) = grouped(n_vertices(triangles), sides);
    let mut next = BTreeMap::new();
    for (low, ends) in (0..).zip(starts.windows(2)) {
        let of_vertex = &mut sides[ends[0] as usize..ends[1] as usize];
        of_vertex.sort_unstable();
        for group in of_vertex.chunk_by(|x, y| x.0 == y.0) {
            let high = group[0].0;
            match group {
                [(_, turned)] => {
                    let (a, b) = if *turned { (high, low) } else { (low, high) };
                    if next.insert(a, b).is_some() {
                        return Err(a);
                    }
                }
                [(_, false), (_, true)] => {}
                _ => return Err(low),
            }
        }
    }
    Ok(next)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fans_that_meet_in_a_vertex_only_are_split() {
        // Two fans around vertex 0, and one that closes around vertex 9.
        let mut triangles =
            [[0, 1, 2], [0, 2, 3], [0, 4, 5], [9, 10, 11], [9, 11, 12], [9, 12, 10]];
        assert_eq!(split_fans(&mut triangles, 13), [0]);
        let around = |n: u32, t: &[[u32; 3]]| t.iter().filter(|t| t.contains(&n)).count();
        let mut sizes = [around(0, &triangles), around(13, &triangles)];
        sizes.sort_unstable();
        assert_eq!(sizes, [1, 2]);
        assert_eq!(around(9, &triangles), 3);
        assert!(split_fans(&mut triangles, 14).is_empty());
        assert!(boundary(&triangles).is_ok());
    }

    #[test]
    fn the_boundary_leads_around_and_a_third_triangle_at_an_edge_is_an_error() {
        let square = [[0, 1, 2], [0, 2, 3]];
        assert_eq!(boundary(&square), Ok(BTreeMap::from([(0, 1), (1, 2), (2, 3), (3, 0)])));
        assert_eq!(boundary(&[[0, 1, 2], [0, 2, 3], [2, 0, 4]]), Err(0));
    }
}
