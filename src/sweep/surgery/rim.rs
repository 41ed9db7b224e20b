//! Rims: the closed borders of the part of a mesh that stays and of the part that comes in.

use std::collections::BTreeMap;

use glam::Vec3;

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

/// For every rim of `incoming` the rim of `staying` that runs beside it, if they pair up one to one;
/// else the vertices of those that do not.
pub(super) fn pair(
    staying: &[Vec<RimVertex>],
    incoming: &[Vec<RimVertex>],
) -> Result<Vec<usize>, Vec<Vec3>> {
    let partner_of = |rim: &[RimVertex], others: &[Vec<RimVertex>]| {
        let distance = |other: &[RimVertex]| {
            rim.iter().map(|v| nearest(v, other)).sum::<f32>() / rim.len() as f32
        };
        let distances: Vec<f32> = others.iter().map(|other| distance(other)).collect();
        (0..others.len()).min_by(|&a, &b| distances[a].total_cmp(&distances[b]))
    };
    let of_incoming: Vec<Option<usize>> =
        incoming.iter().map(|rim| partner_of(rim, staying)).collect();
    let of_staying: Vec<Option<usize>> =
        staying.iter().map(|rim| partner_of(rim, incoming)).collect();
    let is_paired = |i: usize| of_incoming[i].is_some_and(|s| of_staying[s] == Some(i));
    let mut taken = vec![false; staying.len()];
    let mut alone: Vec<Vec3> = Vec::new();
    for (i, rim) in incoming.iter().enumerate() {
        match of_incoming[i] {
            Some(s) if is_paired(i) => taken[s] = true,
            _ => alone.extend(rim.iter().map(|v| v.position)),
        }
    }
    for (rim, _) in staying.iter().zip(&taken).filter(|(_, taken)| !**taken) {
        alone.extend(rim.iter().map(|v| v.position));
    }
    if !alone.is_empty() {
        return Err(alone);
    }
    Ok(of_incoming.into_iter().flatten().collect())
}

/// Distance of a rim vertex from the nearest of another rim that faces the same way; those that do
/// not count as far.
fn nearest(v: &RimVertex, other: &[RimVertex]) -> f32 {
    let distance = |w: &RimVertex| {
        v.position.distance(w.position) + 4.0 * (1.0 - v.normal.dot(w.normal)).max(0.0)
    };
    other.iter().map(distance).fold(f32::INFINITY, f32::min)
}
