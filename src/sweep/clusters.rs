//! Groups the blocks that change into clusters; each cluster's exchange is made or refused on its own.

use std::collections::BTreeMap;

use glam::Vec3;
use rayon::prelude::*;

use super::places::Places;
use super::region::Region;
use super::tracked::Tracked;
use crate::disjoint_sets::DisjointSets;
use crate::mesh::{Face, bounds};
use crate::topology::exact::ExactField;

/// Blocks that change together, ascending, and the faces of the mesh near them, ascending.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Cluster {
    pub(super) blocks: Vec<u32>,
    pub(super) faces: Vec<Face>,
}

/// The clusters of the blocks that differ between two regions: two clusters have no sample in common, and no face is within
/// `near` voxels of both. In neither region everything is exact.
pub(super) fn clusters(
    tracked: &Tracked,
    places: &Places,
    [old, new]: [&Region; 2],
    field: &ExactField,
    near: f32,
) -> Vec<Cluster> {
    let blocks: Vec<u32> = old.blocks().symmetric_difference(new.blocks()).copied().collect();
    if blocks.is_empty() {
        return Vec::new();
    }
    let mesh = &tracked.mesh;
    let grid = new.grid;
    let number = |b: u32| blocks.binary_search(&b).ok().map(|i| i as u32);
    let marked = grid.marked(blocks.iter().copied(), 0);
    let mut sets = DisjointSets::new(blocks.len());
    for (i, &b) in blocks.iter().enumerate() {
        for other in grid.blocks_around(b).filter(|&n| marked[n as usize]) {
            sets.join(i as u32, number(other).expect("one that changes"));
        }
    }
    let size = Vec3::from(field.volume().voxel_size().map(|x| x as f32));
    let wide = grid.marked(blocks.iter().copied(), places.rings(near));
    let near_faces: Vec<(Face, Vec<u32>)> = places
        .faces_in(tracked, &wide)
        .into_par_iter()
        .with_min_len(256)
        .filter_map(|f| {
            let (low, high) = bounds(mesh.corners(f));
            let blocks = grid.blocks_in(low / size - near, high / size + near);
            let near_blocks: Vec<u32> = blocks.filter(|&b| marked[b as usize]).collect();
            (!near_blocks.is_empty()).then_some((f, near_blocks))
        })
        .collect();
    let mut firsts = Vec::with_capacity(near_faces.len());
    for (f, blocks) in near_faces {
        let numbers: Vec<u32> = blocks.into_iter().filter_map(number).collect();
        numbers.iter().for_each(|&n| {
            sets.join(numbers[0], n);
        });
        firsts.push((f, numbers[0]));
    }
    let mut all: BTreeMap<u32, Cluster> = BTreeMap::new();
    for (i, &b) in blocks.iter().enumerate() {
        all.entry(sets.find(i as u32)).or_default().blocks.push(b);
    }
    for (f, first) in firsts {
        all.entry(sets.find(first)).or_default().faces.push(f);
    }
    all.into_values().collect()
}
