//! Sweeps over a part of a volume's range: the mesh is complete at both ends.
//!
//! The oracle counts the isosurface on the grid, without a mesh.

use std::sync::Arc;

use crate::common::random::Random;
use crate::common::spectra::{assert_topology, in_grey_levels, phantom_volume, swept, swept_with};
use isospectrum::spectrum::Spectrum;
use isospectrum::unstable::topology::exact::ExactField;
use isospectrum::volume::{Outside, Placement, ReadOptions, Samples, Volume, phantom, read_volume};
use isospectrum::{Counts, Error, Parameters};

fn swept_over(volume: &Arc<Volume>, range: (f64, f64)) -> Spectrum {
    let spectrum = swept_with(volume, &Parameters::default().with_range(Some(range)));
    assert_eq!(spectrum.range(), range);
    spectrum
}

/// Checks that the mesh at an isovalue has the topology of the isosurface there, and returns how many
/// triangles it has.
fn check_at(volume: &Volume, spectrum: &Spectrum, isovalue: f64) -> usize {
    let field = ExactField::new(volume).expect("a field");
    let mesh = spectrum.mesh_at(isovalue).expect("inside the range");
    assert_topology(
        &field,
        isovalue,
        &mesh,
        &format!("{} of {:?}", volume.name(), spectrum.range()),
    );
    mesh.triangles.len()
}

#[test]
fn a_range_that_ends_inside_the_volumes_has_its_mesh_at_the_last_isovalue() {
    let volume = phantom_volume("sphere:16");
    let (low, high) = volume.range();
    let at = |share: f64| low + share * (high - low);
    let spectrum = swept_over(&volume, (at(0.4), at(0.7)));
    let last = check_at(&volume, &spectrum, at(0.7));
    // The mesh just below the end has the same triangles; only vertices move in the last step.
    let before = spectrum.mesh_at(at(0.7).next_down()).expect("inside the range");
    assert_eq!(last, before.triangles.len());
    assert!(last > 100, "{last} triangles");
}

#[test]
fn the_last_isovalue_may_be_that_of_samples_and_of_events() {
    let mut n_events_there = 0;
    for seed in 1..=2 {
        let volume = Arc::new(in_grey_levels(&phantom_volume(&format!("noise:10:{seed}")), 12.0));
        for last in [4.0, 6.0, 7.0, 9.0] {
            let spectrum = swept_over(&volume, (last - 2.0, last));
            // Components that appear at this isovalue are present, those that vanish are not.
            assert!(check_at(&volume, &spectrum, last) > 0);
            check_at(&volume, &spectrum, last - 1.0);
            check_at(&volume, &spectrum, last.next_down());
            n_events_there += usize::from(spectrum.events().iter().any(|e| e.isovalue == last));
        }
    }
    assert!(n_events_there >= 4, "{n_events_there} of 8 ranges end at an event");
}

#[test]
fn random_fields_have_the_counted_topology_at_the_end_of_random_ranges() {
    let mut random = Random(25);
    for seed in 0..4 {
        let volume = phantom_volume(&format!("noise:8:{seed}"));
        let (low, high) = volume.range();
        let at = |share: f64| low + share * (high - low);
        let first = 0.6 * random.unit();
        let last = first + (0.95 - first) * random.unit();
        let spectrum = swept_over(&volume, (at(first), at(last)));
        check_at(&volume, &spectrum, spectrum.range().1);
        check_at(&volume, &spectrum, spectrum.range().0);
    }
}

#[test]
fn sampling_isovalues_at_a_distance_that_divides_the_range_end_at_its_end() {
    let volume = Arc::new(in_grey_levels(&phantom_volume("noise:10:2"), 60.0));
    for step in [1.0, 0.1, 0.7] {
        let range = Some((20.0, 27.0));
        let spectrum =
            swept_with(&volume, &Parameters::default().with_range(range).with_step(Some(step)));
        assert!(check_at(&volume, &spectrum, 27.0) > 0);
    }
}

#[test]
fn at_the_highest_sample_only_the_border_of_the_volume_is_left() {
    for outside in [Outside::Low, Outside::High] {
        let volume = phantom("noise:8:3").expect("a phantom").with_outside(outside);
        let volume = Arc::new(volume);
        let spectrum = swept(&volume);
        let n = check_at(&volume, &spectrum, volume.range().1);
        assert_eq!(n > 0, outside == Outside::High, "{n} triangles");
        check_at(&volume, &spectrum, volume.range().0);
    }
}

mod real_volumes {
    use super::*;
    use crate::common::data;

    #[test]
    #[ignore = "needs $ISOSPECTRUM_DATA: run by scripts/test"]
    fn nucleon_has_its_mesh_at_the_end_of_a_range() {
        let path = data::file("nucleon_41x41x41_uint8.raw");
        let volume = read_volume(&path, &ReadOptions::default()).expect("a volume");
        let volume = Arc::new(volume);
        let spectrum = swept_over(&volume, (100.0, 110.0));
        let n = check_at(&volume, &spectrum, 110.0);
        assert!(n > 1000, "{n} triangles");
        assert!(matches!(spectrum.mesh_at(110.5), Err(Error::Range { .. })));
    }
}

#[test]
fn a_range_far_from_an_outlier_takes_no_more_steps_than_its_shortest_allow() {
    let noise = phantom_volume("noise:6");
    let mut samples: Vec<f64> = noise.values().collect();
    let (low, high) = noise.range();
    samples[0] = low + 1e4 * (high - low);
    let volume = Volume::new("outlier", noise.dims(), Samples::F64(samples), Placement::default());
    let volume = Arc::new(volume.expect("a valid volume"));
    let at = |share: f64| low + share * (high - low);
    let spectrum = swept_over(&volume, (at(0.4), at(0.6)));
    let steps = Counts::of(&spectrum).expect("counted").steps;
    // 64 of the shortest steps cover the range; each direction ends with a shorter one.
    assert!(steps < 2 * 64, "{steps} steps");
    check_at(&volume, &spectrum, at(0.53));
}

/// A volume of two values, the lower one first.
fn volume_of_two_values(low: f32, high: f32) -> Arc<Volume> {
    let noise = phantom_volume("noise:4");
    let (least, largest) = noise.range();
    let is_high = noise.values().map(|value| value > 0.5 * (least + largest));
    let samples = is_high.map(|is_high| if is_high { high } else { low }).collect();
    let volume = Volume::new("two", noise.dims(), Samples::F32(samples), Placement::default());
    Arc::new(volume.expect("a valid volume"))
}

#[test]
fn samples_of_neighbouring_f32_numbers_take_as_many_steps_as_others() {
    let low: f32 = 29_999_998_976.0;
    let near_zero = volume_of_two_values(0.0, 2048.0);
    let far_from_zero = volume_of_two_values(low, low.next_up());
    assert_eq!(near_zero.range().1, far_from_zero.range().1 - far_from_zero.range().0);
    let steps = |volume| {
        let spectrum = swept_with(volume, &Parameters::default());
        let (least, largest) = volume.range();
        check_at(volume, &spectrum, least + 0.37 * (largest - least));
        Counts::of(&spectrum).expect("counted").steps
    };
    let [near, far] = [steps(&near_zero), steps(&far_from_zero)];
    assert!(far < 2 * near, "{far} steps, {near} with samples of 0 and 2048");
}
