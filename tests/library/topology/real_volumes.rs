//! Real volumes against two independent counts.

use super::*;
use crate::common::data;

fn real_volume(file: &str, dims: [usize; 3]) -> Volume {
    let samples = std::fs::read(data::file(file)).expect("readable");
    volume(dims, Samples::U8(samples)).expect("a valid volume")
}

#[test]
#[ignore = "needs $ISOSPECTRUM_DATA: run by scripts/test"]
fn a_real_volume_agrees_with_the_count_from_the_grid() {
    check_grid("nucleon_41x41x41_uint8.raw", 41);
}

fn check_grid(file: &str, n: usize) {
    let volume = real_volume(file, [n; 3]);
    let field = ExactField::new(&volume).expect("a field");
    let topology = Topology::compute(&field).expect("a topology");
    for isovalue in [0.0, 17.5, 191.0] {
        check(&field, &topology, isovalue, file);
    }
}

#[test]
#[ignore = "needs $ISOSPECTRUM_DATA: run by scripts/test"]
fn real_volumes_agree_with_the_count_of_the_extraction() {
    check_extraction(&[
        ("nucleon_41x41x41_uint8.raw", [41; 3]),
        ("fuel_64x64x64_uint8.raw", [64; 3]),
    ]);
}

mod long {
    #[test]
    #[ignore = "long, needs $ISOSPECTRUM_DATA: run by scripts/test --long"]
    fn a_larger_real_volume_agrees_with_the_count_from_the_grid() {
        super::check_grid("fuel_64x64x64_uint8.raw", 64);
    }

    #[test]
    #[ignore = "long, needs $ISOSPECTRUM_DATA: run by scripts/test --long"]
    fn larger_real_volumes_agree_with_the_count_of_the_extraction() {
        super::check_extraction(&[
            ("hydrogen_atom_128x128x128_uint8.raw", [128; 3]),
            ("tooth_103x94x161_uint8.raw", [103, 94, 161]),
        ]);
    }
}

fn check_extraction(volumes: &[(&str, [usize; 3])]) {
    for &(file, dims) in volumes {
        let volume = real_volume(file, dims);
        let field = ExactField::new(&volume).expect("a field");
        let topology = Topology::compute(&field).expect("a topology");
        let nets: Vec<f64> = topology.net_events().iter().map(|e| e.isovalue).collect();
        let middle = nets[nets.len() / 2];
        for c in [0.0, 1.0, 10.5, middle, middle.next_down(), 130.25, 200.0] {
            let counted = count(&field, c);
            let mut arcs = Vec::new();
            for component in &counted {
                let arc = topology.arc_of(component.low, component.high, c).expect("an arc");
                assert_eq!(topology.arcs[arc].euler, component.euler, "{file} at {c}: arc {arc}");
                arcs.push(arc);
            }
            arcs.sort_unstable();
            assert_eq!(topology.arcs_at(c), arcs, "{file} at {c}: one component per arc");
            assert_eq!(topology.n_components_at(c) as usize, counted.len(), "{file} at {c}");
        }
    }
}
