//! Numbers next to the values of samples and events: the mesh is closed there, and has the topology of the isosurface.

use std::ops::Range;

use crate::common::random::Random;
use crate::common::spectra::cpu;
use isospectrum::unstable::extract::count::count;
use isospectrum::unstable::topology::exact::ExactField;
use isospectrum::verify::mesh_topology;
use isospectrum::volume::{Outside, Placement, Samples, Volume};
use isospectrum::{Noise, Parameters, Preparation, Prepared, Query, Silent};

/// Distances from a value, units in the last place. A level of the exact field has up to 512 of them.
const OFFSETS: [i64; 9] = [-466, -40, -2, -1, 0, 1, 2, 40, 466];

/// Most values of samples and events that are checked in a volume.
const MAX_VALUES: usize = 40;

/// Number of volumes; the rest of 90 in the test that takes long (300 took six minutes).
const N_VOLUMES: u64 = 18;

#[test]
fn meshes_next_to_the_values_of_samples_are_closed() {
    check(0..N_VOLUMES, 5);
}

mod long {
    #[test]
    #[ignore = "long: run by scripts/test --long"]
    fn meshes_next_to_the_values_of_samples_of_many_volumes_are_closed() {
        super::check(super::N_VOLUMES..90, 9);
    }
}

/// The number a few units in the last place away.
fn moved(x: f64, by: i64) -> f64 {
    // As integers, negative numbers are mirrored at 0.
    let mirrored = |bits: i64| if bits < 0 { i64::MIN.wrapping_sub(bits) } else { bits };
    f64::from_bits(mirrored(mirrored(x.to_bits() as i64) + by) as u64)
}

/// A volume with up to `most` samples along an axis, of one of six kinds by its seed: any numbers, a mirrored field, terraces, small
/// integers, 32-bit numbers, numbers far from 0. Half of them are smooth, the others noise.
fn volume(seed: u64, most: u64, random: &mut Random) -> Volume {
    let dims: [usize; 3] = std::array::from_fn(|_| 2 + random.below(most - 1) as usize);
    let n = dims.iter().product();
    let at = |i: usize| [i % dims[0], i / dims[0] % dims[1], i / (dims[0] * dims[1])];
    let waves: [[f64; 4]; 5] = [(); 5].map(|()| [(); 4].map(|()| 2.0 * random.unit() - 1.0));
    let is_smooth = random.below(2) == 0;
    let value = |i: usize| {
        let p = at(i).map(|x| 0.9 * x as f64);
        let wave = |w: &[f64; 4]| (w[0] * p[0] + w[1] * p[1] + w[2] * p[2] + 3.0 * w[3]).sin();
        if is_smooth { waves.iter().map(wave).sum::<f64>() / 5.0 } else { random.unit() }
    };
    let mut values: Vec<f64> = (0..n).map(value).collect();
    // At least two different ones after rounding.
    (values[0], values[n - 1]) = (-1.0, 1.0);
    let samples = match seed % 6 {
        0 => Samples::F64(values),
        1 => {
            let mirrored = |i: usize| {
                let p = at(i);
                let q: [usize; 3] = std::array::from_fn(|a| p[a].min(dims[a] - 1 - p[a]));
                q[0] + dims[0] * (q[1] + dims[1] * q[2])
            };
            let mut values: Vec<f64> = (0..n).map(|i| values[mirrored(i)]).collect();
            values[n / 2] = 1.0;
            Samples::F64(values)
        }
        2 => {
            let (n, step) = (2 + random.below(5), 0.05 + random.unit());
            Samples::F32(values.iter().map(|v| ((v * n as f64).floor() * step) as f32).collect())
        }
        3 => {
            let n = 1 + random.below(7);
            Samples::I16(values.iter().map(|v| (v * n as f64).round() as i16).collect())
        }
        4 => Samples::F32(values.iter().map(|&v| v as f32).collect()),
        _ => {
            let offset = [1e3, -1e6, 1e12, 3.0][random.below(4) as usize];
            Samples::F64(values.iter().map(|v| offset + v).collect())
        }
    };
    let outside = if random.below(3) == 0 { Outside::High } else { Outside::Low };
    let volume = Volume::new(format!("seed {seed}"), dims, samples, Placement::default());
    volume.expect("a valid volume").with_outside(outside)
}

fn check(seeds: Range<u64>, most: u64) {
    for seed in seeds {
        let mut random = Random(seed * 7919);
        let given = volume(seed, most, &mut random);
        let error = [0.1, 0.1, 0.05, 1.0][random.below(4) as usize];
        let (low, high) = given.range();
        let share = (random.below(4) == 0).then(|| 0.02 + 0.2 * random.unit());
        let noise = Noise { persistence: share.map(|s| s * (high - low)), ..Noise::default() };
        let prepared = Prepared::new(given, Preparation::default(), noise).expect("prepared");
        let parameters = Parameters::default().with_error(error);
        let spectrum = prepared.compute(&parameters, &cpu(), &Silent).expect("a spectrum");

        let (volume, events) = (prepared.volume(), spectrum.events().iter().map(|e| e.isovalue));
        let samples = (0..volume.samples().len()).map(|i| volume.samples().get(i));
        let mut values: Vec<f64> = samples.chain(events).collect();
        values.sort_by(f64::total_cmp);
        values.dedup();
        let stride = values.len().div_ceil(MAX_VALUES);
        let field = ExactField::new(volume).expect("a field");
        let mut query = Query::new(&spectrum);
        let (low, high) = spectrum.range();
        for value in values.into_iter().step_by(stride) {
            let near = OFFSETS.map(|by| moved(value, by));
            for isovalue in near.into_iter().filter(|c| (low..=high).contains(c)) {
                let mesh = query.mesh_at(isovalue).expect("in the range");
                let found = mesh_topology(mesh.positions.len(), &mesh.triangles);
                assert!(found.is_closed_manifold(), "seed {seed} at {isovalue:?}: {found:?}");
                let counted = count(&field, isovalue);
                let euler: i64 = counted.iter().map(|c| c.euler).sum();
                assert_eq!(
                    (found.components, found.euler),
                    (counted.len(), euler),
                    "seed {seed} at {isovalue:?}"
                );
            }
        }
    }
}
