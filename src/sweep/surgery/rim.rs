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

/// For every rim of `incoming` the rim of `staying` that runs beside it, if they pair up one to one.
pub(super) fn pair(staying: &[Vec<RimVertex>], incoming: &[Vec<RimVertex>]) -> Option<Vec<usize>> {
    if staying.len() != incoming.len() {
        return None;
    }
    let partners: Vec<usize> = incoming
        .iter()
        .map(|rim| {
            let distance = |other: &[RimVertex]| {
                rim.iter().map(|v| nearest(v, other)).sum::<f32>() / rim.len() as f32
            };
            let best = (0..staying.len())
                .min_by(|&a, &b| distance(&staying[a]).total_cmp(&distance(&staying[b])));
            best.expect("as many rims stay")
        })
        .collect();
    let mut taken = partners.clone();
    taken.sort_unstable();
    taken.dedup();
    (taken.len() == partners.len()).then_some(partners)
}

/// Distance of a rim vertex from the nearest of another rim that faces the same way; those that do
/// not count as far.
fn nearest(v: &RimVertex, other: &[RimVertex]) -> f32 {
    let distance = |w: &RimVertex| {
        v.position.distance(w.position) + 4.0 * (1.0 - v.normal.dot(w.normal)).max(0.0)
    };
    other.iter().map(distance).fold(f32::INFINITY, f32::min)
}
