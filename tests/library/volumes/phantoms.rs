//! The built-in volumes against the properties of their formulas.

use isospectrum::Error;
use isospectrum::volume::{Volume, phantom, phantom_names};

fn built(spec: &str) -> Volume {
    phantom(spec).unwrap_or_else(|e| panic!("{e}"))
}

fn values(v: &Volume) -> Vec<f64> {
    (0..v.samples().len()).map(|i| v.samples().get(i)).collect()
}

/// Volume above `isovalue` in the coordinates of the formulas (-1 to 1), by counting samples.
fn volume_above(v: &Volume, isovalue: f64) -> f64 {
    let step = 2.0 / (v.dims()[0] - 1) as f64;
    values(v).iter().filter(|&&f| f > isovalue).count() as f64 * step.powi(3)
}

/// Maximum error of counting: half a sample (at most sqrt(3)/2 steps) all over the surface.
fn counting_error(v: &Volume, area: f64) -> f64 {
    0.5 * 3f64.sqrt() * area * 2.0 / (v.dims()[0] - 1) as f64
}

#[test]
fn every_phantom_is_listed_and_built_at_its_default_size() {
    for name in phantom_names() {
        let v = built(name);
        let n = v.dims()[0];
        assert_eq!(v.dims(), [n; 3]);
        assert!((32..=64).contains(&n), "{name}: {n}");
        assert!(v.name().starts_with(&format!("{name}:{n}")), "{}", v.name());
        assert_eq!(built(&format!("{name}:9")).dims(), [9; 3]);
        assert_eq!(values(&built(v.name())), values(&v), "{name} is not repeatable");
    }
}

#[test]
fn specs_that_name_no_phantom_are_usage_errors() {
    for (spec, part) in [
        ("", "hydrogen, sphere"),
        ("cube", "hydrogen, sphere"),
        ("sphere:", "a size from 4 to 1024"),
        ("sphere:3", "a size from 4 to 1024"),
        ("sphere:1025", "a size from 4 to 1024"),
        ("sphere:-5", "a size from 4 to 1024"),
        ("sphere:32:1", "sphere[:SIZE]"),
        ("noise:32:x", "whole number as seed"),
        ("noise:32:1:2", "noise[:SIZE[:SEED]]"),
    ] {
        match phantom(spec) {
            Err(Error::Usage(text)) => assert!(text.contains(part), "{spec}: {text}"),
            other => panic!("{spec}: {other:?}"),
        }
    }
}

#[test]
fn the_sphere_and_the_torus_enclose_the_volumes_of_their_formulas() {
    let pi = std::f64::consts::PI;
    let (sphere, torus) = (built("sphere:48"), built("torus:48"));
    for isovalue in [0.3, 0.5, 0.7] {
        let r: f64 = 1.0 - isovalue;
        let expected = 4.0 / 3.0 * pi * r.powi(3);
        let off = (volume_above(&sphere, isovalue) - expected).abs();
        assert!(off < counting_error(&sphere, 4.0 * pi * r * r), "sphere {isovalue}: {off}");
    }
    for isovalue in [0.6, 0.75, 0.9] {
        let r: f64 = 1.0 - isovalue;
        let expected = 2.0 * pi * pi * 0.55 * r * r;
        let off = (volume_above(&torus, isovalue) - expected).abs();
        assert!(off < counting_error(&torus, 4.0 * pi * pi * 0.55 * r), "torus {isovalue}: {off}");
    }
}

#[test]
fn the_blobs_have_two_peaks_that_merge_below_the_lower_one() {
    let v = built("blobs");
    let n = v.dims()[0];
    let mut peaks = Vec::new();
    for (i, j, k) in (0..n * n * n).map(|c| (c % n, c / n % n, c / n / n)) {
        let f = v.sample(i, j, k);
        let around = (0..27).filter(|&c| c != 13).all(|c| {
            let [x, y, z] = [(i, c % 3), (j, c / 3 % 3), (k, c / 9)].map(|(i, d)| i as i64 + d - 1);
            v.padded(x, y, z) < f
        });
        if around {
            peaks.push(([i, j, k], f));
        }
    }
    assert_eq!(peaks.len(), 2, "{peaks:?}");
    // The field on the way from peak to peak dips, but not to nothing: there they merge.
    let lowest = (0..=100)
        .map(|s| {
            let t = f64::from(s) / 100.0;
            let at = |a: usize| peaks[0].0[a] as f64 * (1.0 - t) + peaks[1].0[a] as f64 * t;
            v.value_at([at(0), at(1), at(2)])
        })
        .fold(f64::INFINITY, f64::min);
    assert!(lowest > 0.2 && lowest < 0.9 * peaks[1].1.min(peaks[0].1), "{lowest} {peaks:?}");
}

#[test]
fn the_gyroid_is_balanced_about_zero_within_its_bounds() {
    let v = built("gyroid");
    // |sin x cos y + sin y cos z + sin z cos x| <= 3/2 by 2ab <= a^2 + b^2 in each term.
    assert!(v.range().0 >= -1.5 && v.range().1 <= 1.5);
    // Half the volume on each side; the cube is 1/20 of a period short of whole ones on each axis.
    let share = volume_above(&v, 0.0) / volume_above(&v, -2.0);
    assert!((share - 0.5).abs() < 0.05, "{share}");
}

#[test]
fn noise_depends_on_its_seed_and_is_smooth_from_sample_to_sample() {
    let v = built("noise:32:7");
    let f = values(&v);
    assert_ne!(f, values(&built("noise:32:8")));
    let n = f.len() as f64;
    let mean = f.iter().sum::<f64>() / n;
    let variance = f.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / n;
    // 64 waves of variance 1/64; the cube is too small to average them completely.
    assert!(mean.abs() < 0.3 && (0.7..1.3).contains(&variance), "{mean} {variance}");
    // A wave k changes by 2 (1 - cos k) <= k^2 of its variance per step; over a ball of radius
    // pi/3 the mean of k_x^2 is (pi/3)^2 / 5 = 0.22. White noise would have 2.
    let steps: Vec<f64> =
        f.chunks(32).flat_map(|row| row.windows(2).map(|w| (w[1] - w[0]).powi(2))).collect();
    let change = steps.iter().sum::<f64>() / steps.len() as f64 / variance;
    assert!((0.1..0.4).contains(&change), "{change}");
}

#[test]
fn hydrogen_has_a_ring_between_two_lobes_and_the_ties_of_its_original() {
    let v = built("hydrogen:129");
    let c = 64;
    assert_eq!(v.range(), (0.0, 250.0));
    assert_eq!(v.sample(c, c, c), 250.0);
    // 32 Bohr radii are 128 steps. From the zeros of the derivative of the wave function: lobes
    // at r = 7.238, the saddle before them at r = 2.035, the ring at r = 4.402 Bohr radii, with
    // 94.0, 15.3 and 40.9. A maximum or minimum lies within 1/8 of a sample, where the second
    // derivative changes the density by less than 1/2; rounding adds 1/2.
    let axis: Vec<f64> = (c..129).map(|i| v.sample(i, c, c)).collect();
    let lobe = axis[16..].iter().copied().fold(0.0, f64::max);
    let saddle = axis[..29].iter().copied().fold(f64::INFINITY, f64::min);
    let ring = (c + 12..129).map(|j| v.sample(c, j, c)).fold(0.0, f64::max);
    assert!((lobe - 94.0).abs() <= 1.0, "lobe {lobe}");
    assert!((saddle - 15.3).abs() <= 1.0, "saddle {saddle}");
    assert!((ring - 40.9).abs() <= 1.0, "ring {ring}");
    // A node encloses the ring: the density falls to zero between nucleus and ring.
    assert!((c..c + 18).any(|j| v.sample(c, j, c) == 0.0));
    for d in 1..=60 {
        assert_eq!(v.sample(c + d, c, c), v.sample(c - d, c, c));
        assert_eq!(v.sample(c, c + d, c), v.sample(c, c, c - d));
    }
}

#[test]
fn smooth_phantoms_have_next_to_no_equal_samples() {
    for name in ["sphere", "torus", "blobs", "gyroid", "noise"] {
        let mut f = values(&built(&format!("{name}:24")));
        let n = f.len();
        f.sort_by(f64::total_cmp);
        f.dedup();
        // Rounding to the 2^24 values of float32 makes about n / 1000 pairs meet by chance.
        assert!(f.len() > n - n / 100, "{name}: {} of {n} differ", f.len());
    }
}
