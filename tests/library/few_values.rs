//! Floating point volumes with few different values: the topology agrees with the count on the grid at every isovalue,
//! and sweeps finish with meshes of that topology.

mod volumes;

use std::ops::Range;
use std::sync::Arc;

use crate::common::random::Random;
use crate::common::spectra::{assert_isosurfaces, random_isovalues, swept};
use isospectrum::unstable::extract::count::count;
use isospectrum::unstable::topology::Topology;
use isospectrum::unstable::topology::exact::ExactField;
use isospectrum::volume::Volume;

/// Numbers of volumes for the topology and for sweeps; more in the tests that take long.
const N_COUNTED: u64 = 300;
const N_SWEPT: u64 = 10;

/// In each of them, the number of random isovalues and of samples and events that are checked.
const N_ISOVALUES: usize = 6;

/// Isovalues anywhere in the range, at samples, at events and just below them.
fn isovalues(volume: &Volume, topology: &Topology, random: &mut Random) -> Vec<f64> {
    let (low, high) = volume.range();
    let mut isovalues = Vec::new();
    for _ in 0..N_ISOVALUES {
        isovalues.push(low + random.unit() * (high - low));
        let sample = random.below(volume.samples().len() as u64) as usize;
        isovalues.push(volume.samples().get(sample));
        let event = random.below(topology.events.len() as u64) as usize;
        let event = topology.events[event].isovalue;
        isovalues.extend([event, event.next_down()]);
    }
    isovalues
}

#[test]
fn the_topology_of_few_values_is_that_counted_on_the_grid() {
    check_topology(0..N_COUNTED);
}

#[test]
fn sweeps_of_few_values_have_the_counted_topology() {
    check_sweeps(0..N_SWEPT);
}

mod long {
    use super::*;

    #[test]
    #[ignore = "long: run by scripts/test --long"]
    fn the_topology_of_many_volumes_of_few_values_is_that_counted_on_the_grid() {
        check_topology(N_COUNTED..3 * N_COUNTED);
    }

    #[test]
    #[ignore = "long: run by scripts/test --long"]
    fn sweeps_of_many_volumes_of_few_values_have_the_counted_topology() {
        check_sweeps(N_SWEPT..3 * N_SWEPT);
    }
}

fn check_topology(seeds: Range<u64>) {
    for seed in seeds {
        let mut random = Random(seed);
        let volume = volumes::volume(seed % volumes::N_KINDS, 9, &mut random);
        let field = ExactField::new(&volume).expect("a field");
        let topology = Topology::compute(&field).unwrap_or_else(|e| panic!("seed {seed}: {e}"));
        for isovalue in isovalues(&volume, &topology, &mut random) {
            let counted = count(&field, isovalue);
            let euler: i64 = counted.iter().map(|c| c.euler).sum();
            let found = (topology.n_components_at(isovalue) as usize, topology.euler_at(isovalue));
            assert_eq!(found, (counted.len(), euler), "seed {seed} at {isovalue}");
            let mut arcs: Vec<usize> = counted
                .iter()
                .map(|c| topology.arc_of(c.low, c.high, isovalue).expect("an arc"))
                .collect();
            arcs.sort_unstable();
            assert_eq!(topology.arcs_at(isovalue), arcs, "seed {seed} at {isovalue}");
        }
    }
}

fn check_sweeps(seeds: Range<u64>) {
    for seed in seeds {
        let mut random = Random(seed);
        let volume = Arc::new(volumes::volume(seed % volumes::N_KINDS, 7, &mut random));
        let isovalues = random_isovalues(volume.range(), N_ISOVALUES, seed);
        assert_isosurfaces(&volume, &swept(&volume), &isovalues, &format!("seed {seed}"));
    }
}
