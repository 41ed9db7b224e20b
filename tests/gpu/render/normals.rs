//! Pictures are shaded with the normals of the mesh that they show.

use std::sync::Arc;

use isospectrum::Parameters;
use isospectrum::render::{Renderer, View};
use isospectrum::spectrum::{Mesh, Spectrum};
use isospectrum::volume::{ReadOptions, read_volume};

use crate::common::random::Random;
use crate::common::spectra::{in_grey_levels, phantom_volume, swept, swept_with};
use crate::render::drawing::{dot, gpu, unit};

/// Maximum share of the area with wrong shading: slivers, whose own normals are dominated by rounding.
const LARGEST_SHARE: f64 = 0.001;

/// A small smooth field in a few levels: many events are close, so much of the mesh is the exact extraction, whose vertices have
/// knots at samples, far from the isovalues of their triangles.
fn levels(seed: u64) -> Spectrum {
    let smooth = phantom_volume(&format!("noise:10:{seed}"));
    swept(&Arc::new(in_grey_levels(&smooth, 24.0)))
}

/// Area-weighted normals of a mesh, from caps only at vertices of caps alone; zero without area.
fn area_weighted(mesh: &Mesh) -> Vec<[f64; 3]> {
    let mut sums = vec![[[0.0; 3]; 2]; mesh.positions.len()];
    for (corners, &is_cap) in mesh.triangles.iter().zip(&mesh.caps) {
        let (area, _) = area_of(mesh, corners);
        for &v in corners {
            let sum = &mut sums[v as usize][usize::from(is_cap)];
            *sum = std::array::from_fn(|i| sum[i] + area[i]);
        }
    }
    let of = |[mesh, caps]: [[f64; 3]; 2]| if dot(mesh, mesh) > 0.0 { mesh } else { caps };
    sums.into_iter().map(of).collect()
}

/// A triangle's normal as long as twice its area, and the area.
fn area_of(mesh: &Mesh, corners: &[u32; 3]) -> ([f64; 3], f64) {
    let [p, q, r] = corners.map(|v| mesh.positions[v as usize].map(f64::from));
    let [a, b] = [q, r].map(|x| [x[0] - p[0], x[1] - p[1], x[2] - p[2]]);
    let n = [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
    (n, 0.5 * dot(n, n).sqrt())
}

/// The area of a picture's triangles, and of those corners (a third of a triangle each) that are shaded with a normal
/// more than 30 degrees off that of the mesh at the isovalue.
fn areas(renderer: &mut Renderer<'_>, spectrum: &Spectrum, isovalue: f64) -> [f64; 2] {
    let view = View::default().with_width(32).with_height(32);
    renderer.draw(isovalue, &view).expect("a picture");
    let mesh = spectrum.mesh_at(isovalue).expect("inside the range");
    let wanted = area_weighted(&mesh);
    let shaded: Vec<_> = renderer.shaded().collect();
    assert_eq!(shaded.len(), mesh.triangles.len());
    let mut areas = [0.0; 2];
    for (corners, (_, normals)) in mesh.triangles.iter().zip(shaded) {
        let (_, area) = area_of(&mesh, corners);
        areas[0] += area;
        for (&v, found) in corners.iter().zip(normals) {
            let wanted = wanted[v as usize];
            if dot(wanted, wanted) == 0.0 {
                continue;
            }
            let cosine = dot(unit(wanted), unit(found.map(f64::from)));
            areas[1] += if cosine < 30f64.to_radians().cos() { area / 3.0 } else { 0.0 };
        }
    }
    areas
}

#[test]
fn pictures_are_shaded_with_the_normals_of_the_mesh_at_their_isovalue() {
    for seed in [3, 4] {
        let spectrum = levels(seed);
        let mut renderer = Renderer::new(gpu(), &spectrum).expect("a renderer");
        let (low, high) = spectrum.range();
        let n = 40;
        // Golden steps: nowhere near whole isovalues, and spread over the range.
        let shares = (1..=n).map(|i| (f64::from(i) * 0.618_033_988_749).fract());
        let isovalues = shares.map(|share| low + share * (high - low));
        let [mut all, mut wrong] = [0.0; 2];
        for isovalue in isovalues {
            let [area, off] = areas(&mut renderer, &spectrum, isovalue);
            (all, wrong) = (all + area, wrong + off);
        }
        assert!(all > 100.0 * f64::from(n), "hardly anything was drawn: {all} square voxels");
        assert!(wrong <= LARGEST_SHARE * all, "{wrong} of {all} square voxels are shaded wrong");
    }
}

mod real_volumes {
    use super::*;
    use crate::common::data;

    #[test]
    #[ignore = "needs $ISOSPECTRUM_DATA: run by scripts/test"]
    fn pictures_of_real_volumes_are_shaded_with_the_normals_of_their_meshes() {
        // Ranges that are computed within seconds, with exact cells among tracked ones.
        for (name, range) in [
            ("nucleon_41x41x41_uint8.raw", (150.0, 190.0)),
            ("fuel_64x64x64_uint8.raw", (20.0, 60.0)),
        ] {
            let path = data::file(name);
            let volume = read_volume(&path, &ReadOptions::default()).expect("a volume");
            let parameters = Parameters::default().with_range(Some(range));
            let spectrum = swept_with(&Arc::new(volume), &parameters);
            let mut renderer = Renderer::new(gpu(), &spectrum).expect("a renderer");
            let (low, high) = spectrum.range();
            let mut random = Random(25);
            for _ in 0..20 {
                let isovalue = low + random.unit() * (high - low);
                let [area, wrong] = areas(&mut renderer, &spectrum, isovalue);
                assert!(area > 0.0, "{name}: nothing is drawn at {isovalue}");
                assert!(wrong <= LARGEST_SHARE * area, "{name}: {wrong} of {area} at {isovalue}");
            }
        }
    }
}
