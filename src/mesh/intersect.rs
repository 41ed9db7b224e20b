//! Triangles that intersect each other.

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::bins::Bins;
use super::measure::bounds;

/// Bins per task at least.
const MIN_TASK_BINS: usize = 512;

/// A segment that passes a side of the triangle, or touches it with one of its own ends, within this margin does not cross it;
/// in barycentric coordinates and as a share of the segment.
const CROSSING_MARGIN: f64 = 1e-9;

/// The triangles that intersect another one without sharing an edge with it, ascending.
///
/// Two triangles intersect if a side of one crosses the inside of the other; sides through a shared
/// vertex do not count. Candidates come from a uniform grid over the bounding boxes; the test is in
/// f64. `positions` in any metric frame.
pub fn intersecting(positions: &[[f32; 3]], triangles: &[[u32; 3]]) -> Vec<u32> {
    let corners: Vec<[Vec3; 3]> =
        triangles.iter().map(|t| t.map(|v| Vec3::from(positions[v as usize]))).collect();
    let mut hit = vec![false; triangles.len()];
    let boxes: Vec<(Vec3, Vec3)> = corners.iter().copied().map(bounds).collect();
    let sizes = boxes.iter().map(|b| (b.1 - b.0).max_element()).sum::<f32>();
    let bins = Bins::of(&boxes, (1.5 * sizes / boxes.len() as f32).max(1e-6));
    let crossing = |f: u32, g: u32| {
        let (f, g) = (f as usize, g as usize);
        intersect(triangles[f], corners[f], triangles[g], corners[g])
    };
    let each: Vec<&[u64]> = bins.each().collect();
    let pairs: Vec<[u32; 2]> = each
        .par_iter()
        .with_min_len(MIN_TASK_BINS)
        .flat_map_iter(|bin| pairs_of(&bins, &boxes, bin).filter(|&[f, g]| crossing(f, g)))
        .collect();
    pairs.into_iter().flatten().for_each(|f| hit[f as usize] = true);
    (0..triangles.len() as u32).filter(|&f| hit[f as usize]).collect()
}

/// The pairs of a bin's triangles whose bounding boxes overlap; of the bins that both boxes overlap, only the lowest has
/// the pair.
fn pairs_of<'a>(
    bins: &'a Bins,
    boxes: &'a [(Vec3, Vec3)],
    bin: &'a [u64],
) -> impl Iterator<Item = [u32; 2]> + 'a {
    bin.iter().enumerate().flat_map(move |(i, &entry)| {
        let f = entry as u32;
        let a = boxes[f as usize];
        bin[i + 1..].iter().filter_map(move |&other| {
            let g = other as u32;
            let b = boxes[g as usize];
            let overlap = a.0.cmple(b.1).all() && b.0.cmple(a.1).all();
            (overlap && bins.first_common(f, g) == entry >> 32).then_some([f, g])
        })
    })
}

/// Whether two triangles that share no edge intersect.
fn intersect(f: [u32; 3], a: [Vec3; 3], g: [u32; 3], b: [Vec3; 3]) -> bool {
    if f.iter().filter(|v| g.contains(v)).count() >= 2 {
        return false;
    }
    let (a, b) = (a.map(|p| p.as_dvec3()), b.map(|p| p.as_dvec3()));
    if is_on_one_side(f, a, g, b) || is_on_one_side(g, b, f, a) {
        return false;
    }
    let crosses = |f: [u32; 3], a: [DVec3; 3], g: [u32; 3], b: [DVec3; 3]| {
        (0..3).any(|i| {
            let j = (i + 1) % 3;
            !g.contains(&f[i]) && !g.contains(&f[j]) && segment_crosses(a[i], a[j], b)
        })
    };
    crosses(f, a, g, b) || crosses(g, b, f, a)
}

/// Whether the corners of the first triangle that are not corners of the second are all on one side of the second's plane.
fn is_on_one_side(f: [u32; 3], a: [DVec3; 3], g: [u32; 3], b: [DVec3; 3]) -> bool {
    let n = (b[1] - b[0]).cross(b[2] - b[0]);
    let own = (0..3).filter(|&i| !g.contains(&f[i]));
    let (low, high) = own
        .map(|i| (a[i] - b[0]).dot(n))
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), d| (low.min(d), high.max(d)));
    low > 0.0 || high < 0.0
}

/// Whether the open segment pq crosses the inside of a triangle (Möller and Trumbore 1997).
fn segment_crosses(p: DVec3, q: DVec3, t: [DVec3; 3]) -> bool {
    let (d, e1, e2) = (q - p, t[1] - t[0], t[2] - t[0]);
    let h = d.cross(e2);
    let det = e1.dot(h);
    if det.abs() < 1e-14 {
        return false;
    }
    let s = p - t[0];
    let u = s.dot(h) / det;
    let k = s.cross(e1);
    let v = d.dot(k) / det;
    let w = e2.dot(k) / det;
    let inside = |x: f64| x > CROSSING_MARGIN && x < 1.0 - CROSSING_MARGIN;
    inside(u) && v > CROSSING_MARGIN && u + v < 1.0 - CROSSING_MARGIN && inside(w)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn crossing_triangles_are_found_but_not_neighbours() {
        let p = [
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [0.0, 1.0, 0.0],
            [0.2, 0.2, -0.5],
            [0.2, 0.2, 0.5],
            [0.9, 0.9, 0.1],
            [5.0, 5.0, 5.0],
        ];
        assert_eq!(intersecting(&p, &[[0, 1, 2], [3, 4, 5]]), vec![0, 1]);
        assert_eq!(intersecting(&p, &[[0, 1, 2], [1, 2, 5]]), Vec::<u32>::new());
        assert_eq!(intersecting(&p, &[[0, 1, 2], [2, 5, 6]]), Vec::<u32>::new());
    }
}
