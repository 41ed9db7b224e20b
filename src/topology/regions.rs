//! Critical regions: connected samples of one value at which the topology changes.
//!
//! # Theory
//!
//! In a volume with ties a critical "point" is often a region of equal samples (Weber,
//! Scheuermann, Hamann, "Detecting critical regions in scalar fields", VisSym 2003). The ramp
//! resolves it into simple critical points, all at the region's value; what happens in the volume
//! as it is, is their sum. So a region that only the ramp makes look critical has the sum 0, and
//! a ring with higher surroundings is seen as what it is, the start of a torus (components +1,
//! Euler characteristic 0), which counting the components around it would call a minimum.
//!
//! An event belongs to a region if it has the region's value and lies at one of its samples, or in
//! a face or cell with one of them as a corner (the first such corner counts).

use serde::{Deserialize, Serialize};

use crate::topology::EventKind;
use crate::topology::critical::Place;
use crate::topology::exact::{ExactField, ORDER_BITS};
use crate::topology::{Topology, TopologyEvent};

/// Connected samples of one value, at least two, with events at their value.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct CriticalRegion {
    /// The value of its samples.
    pub isovalue: f64,
    /// How many samples it has, connected along lattice edges.
    pub n_samples: usize,
    /// The sample of the region nearest to its centre, voxel frame.
    pub position: [f64; 3],
    /// How many events belong to it.
    pub n_events: usize,
    /// By how much its events change the number of isosurface components.
    pub components_change: i64,
    /// By how much its events change the Euler characteristic.
    pub euler_change: i64,
}

/// No region yet.
const NONE: u32 = u32::MAX;

/// The critical regions of a volume, in the order of their first events.
pub fn critical_regions(field: &ExactField<'_>, topology: &Topology) -> Vec<CriticalRegion> {
    let mut region_of = vec![NONE; field.n_vertices()];
    let mut regions: Vec<CriticalRegion> = Vec::new();
    for event in &topology.events {
        let Some(sample) = touched_sample(field, event) else { continue };
        if region_of[sample as usize] == NONE {
            let region = fill(field, sample, &mut region_of, regions.len() as u32);
            regions.push(region);
        }
        let region = &mut regions[region_of[sample as usize] as usize];
        region.n_events += 1;
        region.components_change += components_change(event.kind);
        region.euler_change += if event.index % 2 == 0 { 2 } else { -2 };
    }
    regions.retain(|r| r.n_samples >= 2);
    regions
}

/// By how much an event changes the number of components.
fn components_change(kind: EventKind) -> i64 {
    match kind {
        EventKind::Emerge | EventKind::Split => 1,
        EventKind::Merge | EventKind::Vanish => -1,
        EventKind::HandleOpen | EventKind::HandleClose => 0,
    }
}

/// The first sample around an event that has the event's value without the ramp.
fn touched_sample(field: &ExactField<'_>, event: &TopologyEvent) -> Option<u32> {
    let value = field.value(event.key >> ORDER_BITS);
    let is_touched = |v: &u32| field.value(field.key(*v)) == value;
    let strides = field.strides();
    match event.place {
        Place::Vertex(v) => Some(v),
        Place::Face { corner, axis } => {
            let [i, j] = [strides[(axis as usize + 1) % 3], strides[(axis as usize + 2) % 3]];
            [corner, corner + i, corner + j, corner + i + j].into_iter().find(is_touched)
        }
        Place::Cell(corner) => {
            field.cell_offsets().into_iter().map(|o| corner + o).find(is_touched)
        }
        Place::Layer => None,
    }
}

/// Labels the samples connected to `seed` that have its value.
fn fill(field: &ExactField<'_>, seed: u32, region_of: &mut [u32], region: u32) -> CriticalRegion {
    let level = field.level(seed);
    let mut samples = vec![seed];
    let mut done = 0;
    region_of[seed as usize] = region;
    let mut sum = [0i64; 3];
    while done < samples.len() {
        let v = samples[done];
        done += 1;
        let p = field.position(v);
        (0..3).for_each(|a| sum[a] += p[a]);
        for stride in field.strides() {
            for neighbour in [v - stride, v + stride] {
                let is_new = region_of[neighbour as usize] == NONE
                    && field.level(neighbour) == level
                    && !field.is_in_layer(neighbour);
                if is_new {
                    region_of[neighbour as usize] = region;
                    samples.push(neighbour);
                }
            }
        }
    }
    let n = samples.len() as f64;
    let distance = |v: &u32| -> f64 {
        let p = field.position(*v);
        (0..3).map(|a| (p[a] as f64 - sum[a] as f64 / n).powi(2)).sum()
    };
    let nearest = samples
        .iter()
        .copied()
        .min_by(|a, b| distance(a).total_cmp(&distance(b)).then(a.cmp(b)))
        .unwrap_or(seed);
    let size = field.volume().voxel_size();
    let position = field.position(nearest);
    CriticalRegion {
        isovalue: field.sample(seed),
        n_samples: samples.len(),
        position: std::array::from_fn(|a| position[a] as f64 * size[a]),
        n_events: 0,
        components_change: 0,
        euler_change: 0,
    }
}
