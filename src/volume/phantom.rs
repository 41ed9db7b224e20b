//! Built-in analytic volumes: to try the program without data, and as oracles of tests.
//!
//! A phantom is named `NAME[:SIZE]` (or `noise:SIZE:SEED`) and is a cube of
//! SIZE samples per axis with unit spacing. Formulas use coordinates from -1 (first sample) to 1
//! (last sample) along each axis. Except in `hydrogen`, centres and phases are shifted by
//! irrational amounts, so that no two samples are equal by symmetry alone.
//!
//! `hydrogen` imitates the data set "hydrogen atom" of SFB 382 (volvis.org): the electron density
//! of a hydrogen atom in a strong magnetic field, a ring between two lobes, quantised to 8 bits.
//! Like the original it has many ties and plateaus, by symmetry and quantisation.

use std::f64::consts::{PI, SQRT_2};

use super::grid::Volume;
use super::placement::Placement;
use super::samples::Samples;
use crate::error::{Error, Result};
use crate::random::Random;

/// Smallest and largest number of samples per axis of a phantom.
const SIZES: std::ops::RangeInclusive<usize> = 4..=1024;

/// Name and default size of each phantom.
const PHANTOMS: [(&str, usize); 6] =
    [("hydrogen", 64), ("sphere", 32), ("torus", 48), ("blobs", 48), ("gyroid", 48), ("noise", 32)];

/// The centre of `sphere`, `torus` and `blobs`: near 0, at irrational distances from it.
/// (sqrt(2) - 1) / 20, (sqrt(3) - 1) / 25, (sqrt(5) - 2) / 15.
const CENTRE: [f64; 3] =
    [0.020_710_678_118_654_75, 0.029_282_032_302_755_1, 0.015_737_865_166_652_6];

/// The names of all phantoms.
pub fn phantom_names() -> Vec<&'static str> {
    PHANTOMS.iter().map(|&(name, _)| name).collect()
}

/// The phantom described by `NAME[:SIZE]` or `noise[:SIZE[:SEED]]`.
///
/// | name | value at p (coordinates -1 to 1) | type |
/// |---|---|---|
/// | `hydrogen` | 250 times the density of a 3s-3d orbital over that at the nucleus | uint8 |
/// | `sphere` | 1 - distance to the centre: isosurface c is the sphere of radius 1 - c | float32 |
/// | `torus` | 1 - distance to a circle of radius 0.55 about the z axis | float32 |
/// | `blobs` | sum of two Gaussians that merge as the isovalue falls | float32 |
/// | `gyroid` | sin x cos y + sin y cos z + sin z cos x, about two periods | float32 |
/// | `noise` | sum of 64 random cosines of at least 6 samples per wavelength | float32 |
///
/// # Errors
///
/// [`Error::Usage`] for an unknown name, a size outside 4 to 1024 or an invalid seed.
pub fn phantom(spec: &str) -> Result<Volume> {
    let mut parts = spec.split(':');
    let name = parts.next().unwrap_or_default();
    let &(name, default_size) =
        PHANTOMS.iter().find(|&&(known, _)| known == name).ok_or_else(|| {
            let names = phantom_names().join(", ");
            Error::Usage(format!("phantom '{spec}', expected one of {names}"))
        })?;
    let size = match parts.next() {
        None => default_size,
        Some(digits) => digits.parse().ok().filter(|n| SIZES.contains(n)).ok_or_else(|| {
            let (low, high) = (SIZES.start(), SIZES.end());
            Error::Usage(format!("phantom '{spec}', expected a size from {low} to {high}"))
        })?,
    };
    let seed = match parts.next() {
        None => 1,
        Some(digits) if name == "noise" => digits.parse().map_err(|_| {
            Error::Usage(format!("phantom '{spec}', expected a whole number as seed"))
        })?,
        Some(_) => return Err(Error::Usage(format!("phantom '{spec}', expected {name}[:SIZE]"))),
    };
    if parts.next().is_some() {
        return Err(Error::Usage(format!("phantom '{spec}', expected noise[:SIZE[:SEED]]")));
    }
    let samples = match name {
        "hydrogen" => {
            // The nucleus is on a sample, as in the data set, with the value 250.
            let shift = (2 * (size / 2)) as f64 / (size - 1) as f64 - 1.0;
            Samples::U8(sampled(size, |p| (250.0 * hydrogen(minus(p, [shift; 3]))).round() as u8))
        }
        "sphere" => Samples::F32(sampled(size, |p| sphere(p) as f32)),
        "torus" => Samples::F32(sampled(size, |p| torus(p) as f32)),
        "blobs" => Samples::F32(sampled(size, |p| blobs(p) as f32)),
        "gyroid" => Samples::F32(sampled(size, |p| gyroid(p) as f32)),
        _ => Samples::F32(noise(size, seed)),
    };
    let name =
        if name == "noise" { format!("{name}:{size}:{seed}") } else { format!("{name}:{size}") };
    Volume::new(name, [size; 3], samples, Placement::default())
}

/// The values of `field` on a cube of `size` samples per axis, x fastest.
fn sampled<T>(size: usize, field: impl Fn([f64; 3]) -> T) -> Vec<T> {
    let at = |i: usize| 2.0 * i as f64 / (size - 1) as f64 - 1.0;
    let mut values = Vec::with_capacity(size * size * size);
    for k in 0..size {
        for j in 0..size {
            values.extend((0..size).map(|i| field([at(i), at(j), at(k)])));
        }
    }
    values
}

/// Density of an electron in the third shell of hydrogen, over that at the nucleus.
///
/// The states 3s and 3d_z2 have one energy, so a field along the axis (here x) mixes them at
/// once. Unnormalised and with r in Bohr radii,
///
/// ```text
/// psi = (27 - 18 r + 2 r^2  +  m r^2 (3 cos^2 - 1)) exp(-r / 3)
/// ```
///
/// solves the field-free Schroedinger equation exactly for every m (Griffiths, Introduction to
/// Quantum Mechanics, tables 4.3 and 4.7). From m = 1/2 on the lobes on the axis join the
/// centre without a node while a node still encloses the ring. m = 1.75 gives densities of lobe,
/// ring and saddle near those of the data set: about 0.38, 0.16 and 0.06.
fn hydrogen(p: [f64; 3]) -> f64 {
    const MIX: f64 = 1.75;
    const HALF_WIDTH: f64 = 16.0;
    let r2 = HALF_WIDTH * HALF_WIDTH * dot(p, p);
    let r = r2.sqrt();
    let axial = HALF_WIDTH * p[0];
    let psi =
        (27.0 - 18.0 * r + 2.0 * r2 + MIX * (3.0 * axial * axial - r2)) * (-r / 3.0).exp() / 27.0;
    psi * psi
}

/// 1 - distance to the centre.
fn sphere(p: [f64; 3]) -> f64 {
    let d = minus(p, CENTRE);
    1.0 - dot(d, d).sqrt()
}

/// 1 - distance to a circle of radius 0.55 about the z axis.
fn torus(p: [f64; 3]) -> f64 {
    let d = minus(p, CENTRE);
    1.0 - (d[0].hypot(d[1]) - 0.55).hypot(d[2])
}

/// Two Gaussians of heights 1 and 0.8 that merge at a saddle between them.
fn blobs(p: [f64; 3]) -> f64 {
    let bump = |centre: [f64; 3], width: f64| {
        let d = minus(minus(p, CENTRE), centre);
        (-dot(d, d) / (width * width)).exp()
    };
    bump([-0.35, -0.12, 0.05], 0.35) + 0.8 * bump([0.35, 0.15, -0.1], 0.3)
}

/// Schoen's gyroid over almost two periods per axis (a whole number would repeat the samples of
/// the first on the last), with irrational phases.
fn gyroid(p: [f64; 3]) -> f64 {
    let [x, y, z] = [0, 1, 2].map(|a| 1.95 * PI * p[a] + SQRT_2 * (a + 1) as f64 / 7.0);
    x.sin() * y.cos() + y.sin() * z.cos() + z.sin() * x.cos()
}

/// A sum of cosines of equal amplitude whose wave vectors are uniform in a ball.
///
/// The ball ends at 1/6 cycle per sample, so the trilinear field follows the wave field. The
/// amplitude gives the sum a variance of 1; with 64 waves it is close to a Gaussian field.
fn noise(size: usize, seed: u64) -> Vec<f32> {
    const N_WAVES: usize = 64;
    let mut random = Random::new(seed);
    let mut values = vec![0.0f64; size * size * size];
    let amplitude = (2.0 / N_WAVES as f64).sqrt();
    for _ in 0..N_WAVES {
        let wave = in_ball(&mut random).map(|k| 2.0 * PI / 6.0 * k);
        let phase = 2.0 * PI * random.unit();
        // cos(a + b) from tables of a = phase + kx x and b = ky y + kz z.
        let along_x: Vec<(f64, f64)> =
            (0..size).map(|i| (phase + wave[0] * i as f64).sin_cos()).collect();
        for (row, values) in values.chunks_exact_mut(size).enumerate() {
            let (j, k) = (row % size, row / size);
            let (sin, cos) = (wave[1] * j as f64 + wave[2] * k as f64).sin_cos();
            for (v, &(sin_x, cos_x)) in values.iter_mut().zip(&along_x) {
                *v += amplitude * (cos_x * cos - sin_x * sin);
            }
        }
    }
    values.into_iter().map(|v| v as f32).collect()
}

/// Uniform in the unit ball, by rejection.
fn in_ball(random: &mut Random) -> [f64; 3] {
    loop {
        let p = [0; 3].map(|_| 2.0 * random.unit() - 1.0);
        if dot(p, p) <= 1.0 {
            return p;
        }
    }
}

fn minus(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
