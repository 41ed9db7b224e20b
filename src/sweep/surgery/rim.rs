//! Rims: the closed borders of the part of a mesh that stays and of the part that comes in.

use std::collections::BTreeMap;

use glam::Vec3;

/// Longest bridge between two rims, voxels, with what their normals differ by.
const LONGEST_BRIDGE: f32 = 2.5;

/// A vertex of a rim and the side of the rim that starts there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct RimVertex {
    /// Its number among all vertices of the surgery.
    pub(super) vertex: u32,
    /// Voxel frame.
    pub(super) position: Vec3,
    /// Unit, towards lower values.
    pub(super) normal: Vec3,
    /// Border planes it lies on.
    pub(super) border: u8,
    /// Whether the face at the side from here to the next vertex is a cap.
    pub(super) cap: bool,
}

/// A directed side of a rim as its own face has it: from, to, whether the face is a cap.
pub(super) type Side = (u32, u32, bool);

/// Whether the faces around a vertex, of each of which is told whether it is a cap, are all caps or all none. A rim
/// ends in the border of the volume with faces of both kinds.
pub(super) fn is_one_sided(mut caps: impl Iterator<Item = bool>) -> bool {
    let first = caps.next();
    first.is_some_and(|first| caps.all(|cap| cap == first))
}

/// Closed rims from their sides, each as a list of its sides; or the vertices at which a rim meets
/// itself or another.
pub(super) fn rims(sides: &[Side]) -> Result<Vec<Vec<Side>>, Vec<u32>> {
    let mut next: BTreeMap<u32, (u32, bool)> = BTreeMap::new();
    let mut pinched = Vec::new();
    for &(a, b, cap) in sides {
        if next.insert(a, (b, cap)).is_some() {
            pinched.push(a);
        }
    }
    if !pinched.is_empty() {
        pinched.sort_unstable();
        pinched.dedup();
        return Err(pinched);
    }
    let mut rims = Vec::new();
    while let Some((&first, _)) = next.first_key_value() {
        let mut rim = Vec::new();
        let mut at = first;
        while let Some((to, cap)) = next.remove(&at) {
            rim.push((at, to, cap));
            at = to;
        }
        rims.push(rim);
    }
    Ok(rims)
}

/// Rims that bound one gap: those that stay and those that come in, by their numbers.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Gap {
    pub(super) staying: Vec<usize>,
    pub(super) incoming: Vec<usize>,
}

/// The gaps between rims that stay and rims that come in: two that run nearest to each other bound one,
/// and one that has none of its own shares that of the nearest, because two parts come into one hole
/// where it is narrow between them. If there is nothing on one side, the vertices of the other.
pub(super) fn gaps(
    staying: &[Vec<RimVertex>],
    incoming: &[Vec<RimVertex>],
) -> Result<Vec<Gap>, Vec<Vec3>> {
    if staying.is_empty() != incoming.is_empty() {
        let all = staying.iter().chain(incoming).flatten();
        return Err(all.map(|v| v.position).collect());
    }
    let nearest_of = |rim: &Vec<RimVertex>, others: &[Vec<RimVertex>]| {
        let distance = |other: &[RimVertex]| {
            rim.iter().map(|v| nearest(v, other)).sum::<f32>() / rim.len() as f32
        };
        let distances: Vec<f32> = others.iter().map(|other| distance(other)).collect();
        (0..others.len()).min_by(|&a, &b| distances[a].total_cmp(&distances[b])).unwrap_or(0)
    };
    let of_incoming: Vec<usize> = incoming.iter().map(|rim| nearest_of(rim, staying)).collect();
    let of_staying: Vec<usize> = staying.iter().map(|rim| nearest_of(rim, incoming)).collect();
    let mut gaps: Vec<Gap> = Vec::new();
    let mut gap_of = [vec![usize::MAX; staying.len()], vec![usize::MAX; incoming.len()]];
    for (i, &s) in of_incoming.iter().enumerate().filter(|&(i, &s)| of_staying[s] == i) {
        (gap_of[0][s], gap_of[1][i]) = (gaps.len(), gaps.len());
        gaps.push(Gap { staying: vec![s], incoming: vec![i] });
    }
    for (i, &s) in of_incoming.iter().enumerate().filter(|&(i, _)| gap_of[1][i] == usize::MAX) {
        match gaps.get_mut(gap_of[0][s]) {
            Some(gap) => gap.incoming.push(i),
            None => return Err(incoming[i].iter().map(|v| v.position).collect()),
        }
    }
    for (s, &i) in of_staying.iter().enumerate().filter(|&(s, _)| gap_of[0][s] == usize::MAX) {
        match gaps.get_mut(gap_of[1][i]) {
            Some(gap) => gap.staying.push(s),
            None => return Err(staying[s].iter().map(|v| v.position).collect()),
        }
    }
    Ok(gaps)
}

/// Some rims as one: joined by bridges between the vertices where they come closest, each walked
/// there and back. `None` where a bridge would be long, or no two vertices are away from the border.
pub(super) fn bridged(rims: &[&[RimVertex]]) -> Option<Vec<RimVertex>> {
    let (first, rest) = rims.split_first()?;
    let mut whole = first.to_vec();
    let mut rest = rest.to_vec();
    while !rest.is_empty() {
        let mut best = (LONGEST_BRIDGE, 0, 0, 0);
        for (r, rim) in rest.iter().enumerate() {
            for (i, p) in whole.iter().enumerate().filter(|(_, p)| p.border == 0) {
                for (j, q) in rim.iter().enumerate().filter(|(_, q)| q.border == 0) {
                    let d = p.position.distance(q.position)
                        + 4.0 * (1.0 - p.normal.dot(q.normal)).max(0.0);
                    if p.cap == q.cap && d < best.0 {
                        best = (d, r, i, j);
                    }
                }
            }
        }
        let (d, r, i, j) = best;
        if d == LONGEST_BRIDGE {
            return None;
        }
        // To the vertex, over the bridge, around the other rim, and back.
        let rim = rest.remove(r);
        let around = rim.iter().cycle().skip(j).take(rim.len() + 1).copied();
        let back = std::iter::once(whole[i]);
        let tail = whole.split_off(i + 1);
        whole.extend(around.chain(back).chain(tail));
    }
    Some(whole)
}

/// Distance of a rim vertex from the nearest of another rim that faces the same way; those that do
/// not count as far.
fn nearest(v: &RimVertex, other: &[RimVertex]) -> f32 {
    let distance = |w: &RimVertex| {
        v.position.distance(w.position) + 4.0 * (1.0 - v.normal.dot(w.normal)).max(0.0)
    };
    other.iter().map(distance).fold(f32::INFINITY, f32::min)
}
