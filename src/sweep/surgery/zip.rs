//! Joins two rims that run beside each other by a strip of triangles.

use glam::Vec3;

use super::rim::RimVertex;

/// Cost of a triangle that looks away from the normals at its corners, square voxels.
const FOLD_COST: f32 = 100.0;

/// Cost of a strip that holds a triangle which may not exist.
const IMPOSSIBLE: f32 = 1e30;

/// A strip may fold so many times, or once in so many sides if that is more: the isosurface has
/// creases, and whether the mesh passes through itself is checked afterwards.
const MOST_FOLDS: usize = 2;
const SIDES_PER_FOLD: usize = 20;

/// Cosine between a triangle's normal and the mean normal of its corners below which it is folded.
const FOLDED: f32 = 0.05;

/// Rims whose lengths multiply to more than this are not joined.
const MOST_PAIRS: usize = 4_000_000;

/// A triangle and whether it is a cap.
pub(super) type StripTriangle = ([u32; 3], bool);

/// The strip between a rim that stays and one that comes in, both in the direction of their own
/// faces: of all strips the one with the fewest folds and the shortest cross edges. Where a cap would
/// have to become isosurface, or every strip folds often, the places where the rims should be others.
pub(super) fn zip(
    staying: &[RimVertex],
    incoming: &[RimVertex],
) -> Result<Vec<StripTriangle>, Vec<Vec3>> {
    let pairs = (staying.len() + 1) * (incoming.len() + 1);
    let aligned = if pairs > MOST_PAIRS { None } else { aligned(staying, incoming) };
    let Some((a, b)) = aligned else { return Err(at_border(staying, incoming)) };
    let (n, m) = (a.len(), b.len());
    let mut cost = vec![[f32::INFINITY; 2]; (n + 1) * (m + 1)];
    // Which side was advanced, and the flag before, for the best way to each state.
    let mut back = vec![[(false, 0u8); 2]; (n + 1) * (m + 1)];
    cost[0] = [0.0, 0.0];
    for i in 0..=n {
        for j in 0..=m {
            let at = i * (m + 1) + j;
            let (p, q) = (&a[i % n], &b[j % m]);
            let may_change = p.border & q.border != 0 || (i, j) == (0, 0);
            for flag in 0..2u8 {
                let so_far = cost[at][flag as usize];
                if !so_far.is_finite() {
                    continue;
                }
                let mut go = |to: usize, cap: bool, on_a: bool, corners: [&RimVertex; 3]| {
                    if u8::from(cap) != flag && !may_change {
                        return;
                    }
                    let c = so_far + triangle_cost(corners, cap);
                    let state = &mut cost[to][usize::from(cap)];
                    if c < *state {
                        *state = c;
                        back[to][usize::from(cap)] = (on_a, flag);
                    }
                };
                if i < n {
                    go(at + m + 1, p.cap, true, [&a[(i + 1) % n], p, q]);
                }
                if j < m {
                    go(at + 1, q.cap, false, [p, q, &b[(j + 1) % m]]);
                }
            }
        }
    }
    let end = cost[n * (m + 1) + m];
    let flag = usize::from(end[1] < end[0]);
    if end[flag] >= IMPOSSIBLE {
        return Err(at_border(&a, &b));
    }
    let (strip, folds) = walk_back(&a, &b, &back, flag as u8);
    let most = MOST_FOLDS.max((n + m) / SIDES_PER_FOLD);
    if folds.len() > 3 * most { Err(folds) } else { Ok(strip) }
}

/// The vertices of two rims at the border of the volume; all if there are none.
fn at_border(a: &[RimVertex], b: &[RimVertex]) -> Vec<Vec3> {
    let all = || a.iter().chain(b);
    let border: Vec<Vec3> = all().filter(|v| v.border != 0).map(|v| v.position).collect();
    if border.is_empty() { all().map(|v| v.position).collect() } else { border }
}

/// Both rims in one direction and from two vertices that belong beside each other: on the curve
/// if they cross it, else where they come closest.
fn aligned(
    staying: &[RimVertex],
    incoming: &[RimVertex],
) -> Option<(Vec<RimVertex>, Vec<RimVertex>)> {
    let mut a = staying.to_vec();
    let m = incoming.len();
    // Backwards, a side starts where it ended.
    let mut b: Vec<RimVertex> = (0..m)
        .map(|j| RimVertex { cap: incoming[(2 * m - j - 2) % m].cap, ..incoming[m - 1 - j] })
        .collect();
    let crosses = a.iter().chain(&b).any(|v| v.cap != a[0].cap);
    let mut best = (f32::INFINITY, 0, 0);
    for (i, p) in a.iter().enumerate() {
        for (j, q) in b.iter().enumerate() {
            if crosses && p.border & q.border == 0 {
                continue;
            }
            let d = p.position.distance_squared(q.position)
                + 4.0 * (1.0 - p.normal.dot(q.normal)).max(0.0);
            if d < best.0 {
                best = (d, i, j);
            }
        }
    }
    if !best.0.is_finite() {
        return None;
    }
    a.rotate_left(best.1);
    b.rotate_left(best.2);
    Some((a, b))
}

/// What a triangle costs: its new cross edge, from its first to its last corner, and much if it
/// folds; infinite if it may not exist.
fn triangle_cost(t: [&RimVertex; 3], cap: bool) -> f32 {
    let borders = t.map(|v| v.border);
    let may_be = if cap { borders.contains(&0) } else { borders[0] & borders[1] & borders[2] == 0 };
    if !may_be {
        return f32::INFINITY;
    }
    let cross = t[0].position.distance_squared(t[2].position);
    cross + if is_folded(t, cap) { FOLD_COST } else { 0.0 }
}

/// Whether a triangle looks away from the normals at its corners.
fn is_folded(t: [&RimVertex; 3], cap: bool) -> bool {
    let [p, q, r] = t.map(|v| v.position);
    let n = (q - p).cross(r - p);
    let mean: Vec3 = t.iter().map(|v| v.normal).sum();
    n.dot(mean) < FOLDED * n.length() * mean.length() && !cap
}

/// The triangles on the best way, and the corners of those that are folded.
fn walk_back(
    a: &[RimVertex],
    b: &[RimVertex],
    back: &[[(bool, u8); 2]],
    last: u8,
) -> (Vec<StripTriangle>, Vec<Vec3>) {
    let (n, m) = (a.len(), b.len());
    let (mut i, mut j, mut flag) = (n, m, last);
    let mut strip = Vec::with_capacity(n + m);
    let mut folds = Vec::new();
    while (i, j) != (0, 0) {
        let (on_a, before) = back[i * (m + 1) + j][flag as usize];
        let cap = flag == 1;
        let corners = if on_a {
            i -= 1;
            [&a[(i + 1) % n], &a[i % n], &b[j % m]]
        } else {
            j -= 1;
            [&b[j % m], &b[(j + 1) % m], &a[i % n]]
        };
        strip.push((corners.map(|v| v.vertex), cap));
        if is_folded(corners, cap) {
            folds.extend(corners.iter().map(|v| v.position));
        }
        flag = before;
    }
    (strip, folds)
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// A polygon around the z axis, counter-clockwise seen from above, normals up.
    pub(in super::super) fn ring(n: usize, radius: f32, first: u32) -> Vec<RimVertex> {
        (0..n)
            .map(|i| {
                let angle = std::f32::consts::TAU * (i as f32 + 0.3) / n as f32;
                RimVertex {
                    vertex: first + i as u32,
                    position: radius * Vec3::new(angle.cos(), angle.sin(), 0.0),
                    normal: Vec3::Z,
                    border: 0,
                    cap: false,
                }
            })
            .collect()
    }

    /// Every side of a rim is met from the other side, every other side has its twin.
    pub(in super::super) fn assert_closes(strip: &[StripTriangle], rims: [&[RimVertex]; 2]) {
        let of = |t: [u32; 3]| [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])];
        let mut sides: Vec<(u32, u32)> = strip.iter().flat_map(|&(t, _)| of(t)).collect();
        sides.sort_unstable();
        assert!(sides.windows(2).all(|w| w[0] != w[1]), "a side twice: {sides:?}");
        for rim in rims {
            for i in 0..rim.len() {
                let side = (rim[(i + 1) % rim.len()].vertex, rim[i].vertex);
                assert!(sides.binary_search(&side).is_ok(), "{side:?} of {strip:?}");
            }
        }
        let open = sides.iter().filter(|s| sides.binary_search(&(s.1, s.0)).is_err()).count();
        assert_eq!(open, rims[0].len() + rims[1].len());
    }

    #[test]
    fn a_strip_closes_the_gap_between_two_rings() {
        for (n, m) in [(12, 12), (9, 17), (30, 5), (3, 3)] {
            // What stays lies outside, so its rim runs clockwise around the hole.
            let mut staying = ring(n, 2.0, 0);
            staying.reverse();
            let incoming = ring(m, 1.0, 100);
            let strip = zip(&staying, &incoming).expect("a strip");
            assert_eq!(strip.len(), n + m);
            assert_closes(&strip, [&staying, &incoming]);
        }
    }

    #[test]
    fn a_cap_is_not_joined_to_the_isosurface() {
        let mut staying = ring(8, 2.0, 0);
        staying.reverse();
        let mut incoming = ring(8, 1.0, 100);
        incoming.iter_mut().for_each(|v| v.cap = true);
        assert!(zip(&staying, &incoming).is_err());
    }
}
