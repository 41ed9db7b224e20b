//! Triangles of a mesh that pass through each other.

use glam::{DVec3, Vec3};

/// Parameters within this of an end or side do not count as a crossing.
const EDGE_MARGIN: f64 = 1e-9;

/// The triangles that intersect another one with which they share no edge, ascending.
///
/// Two triangles intersect if a side of one crosses the inside of the other; sides through a shared
/// vertex do not count. Candidates come from a uniform grid over the bounding boxes; the test is in
/// f64. `positions` in any metric frame.
pub fn intersecting(positions: &[[f32; 3]], triangles: &[[u32; 3]]) -> Vec<u32> {
    let corners: Vec<[Vec3; 3]> =
        triangles.iter().map(|t| t.map(|v| Vec3::from(positions[v as usize]))).collect();
    let mut hit = vec![false; triangles.len()];
    for_each_candidate(&corners, |f, g| {
        if !(hit[f] && hit[g]) && intersect(triangles[f], corners[f], triangles[g], corners[g]) {
            (hit[f], hit[g]) = (true, true);
        }
    });
    (0..triangles.len() as u32).filter(|&f| hit[f as usize]).collect()
}

/// Calls `visit` for pairs whose bounding boxes meet, each pair once.
fn for_each_candidate(corners: &[[Vec3; 3]], mut visit: impl FnMut(usize, usize)) {
    if corners.is_empty() {
        return;
    }
    let boxes: Vec<(Vec3, Vec3)> =
        corners.iter().map(|t| (t[0].min(t[1]).min(t[2]), t[0].max(t[1]).max(t[2]))).collect();
    let mean = boxes.iter().map(|b| (b.1 - b.0).max_element()).sum::<f32>() / boxes.len() as f32;
    let cell = (1.5 * mean).max(1e-6);
    let origin = boxes.iter().fold(Vec3::INFINITY, |o, b| o.min(b.0));
    let place = |p: Vec3| ((p - origin) / cell).as_ivec3();
    let mut entries: Vec<(u64, u32)> = Vec::with_capacity(corners.len() * 4);
    for (f, b) in boxes.iter().enumerate() {
        let (low, high) = (place(b.0), place(b.1));
        for z in low.z..=high.z {
            for y in low.y..=high.y {
                for x in low.x..=high.x {
                    entries.push((((z as u64) << 42) | ((y as u64) << 21) | x as u64, f as u32));
                }
            }
        }
    }
    entries.sort_unstable();
    for bin in entries.chunk_by(|a, b| a.0 == b.0) {
        for (i, &(key, f)) in bin.iter().enumerate() {
            for &(_, g) in &bin[i + 1..] {
                let (a, b) = (boxes[f as usize], boxes[g as usize]);
                if a.0.cmpgt(b.1).any() || b.0.cmpgt(a.1).any() {
                    continue;
                }
                // The pair is visited in the first cell that both boxes cover.
                let first = place(a.0.max(b.0));
                if ((first.z as u64) << 42) | ((first.y as u64) << 21) | first.x as u64 == key {
                    visit(f as usize, g as usize);
                }
            }
        }
    }
}

/// Whether two triangles that share no edge intersect.
fn intersect(f: [u32; 3], a: [Vec3; 3], g: [u32; 3], b: [Vec3; 3]) -> bool {
    if f.iter().filter(|v| g.contains(v)).count() >= 2 {
        return false;
    }
    let (a, b) = (a.map(|p| p.as_dvec3()), b.map(|p| p.as_dvec3()));
    let crosses = |f: [u32; 3], a: [DVec3; 3], g: [u32; 3], b: [DVec3; 3]| {
        (0..3).any(|i| {
            let j = (i + 1) % 3;
            !g.contains(&f[i]) && !g.contains(&f[j]) && segment_crosses(a[i], a[j], b)
        })
    };
    crosses(f, a, g, b) || crosses(g, b, f, a)
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
    let inside = |x: f64| x > EDGE_MARGIN && x < 1.0 - EDGE_MARGIN;
    inside(u) && v > EDGE_MARGIN && u + v < 1.0 - EDGE_MARGIN && inside(w)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn crossing_triangles_are_found_and_neighbours_are_not() {
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
