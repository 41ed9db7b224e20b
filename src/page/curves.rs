//! What the isosurfaces measure over the isovalue, for the plot above the slider.

use glam::DVec3;
use serde::Serialize;

use crate::error::Result;
use crate::export::place_in_world;
use crate::spectrum::{EventKind, Query, Spectrum, SurfaceMesh};
use crate::volume::Histogram;

/// Isovalues at which the curves are known.
const N_ISOVALUES: usize = 129;

/// Bins of the histogram; with 256, 8-bit samples have one each.
const N_BINS: usize = 256;

/// Percentiles are known to a tenth of a percent.
const N_PERCENTILES: usize = 1000;

/// What a page tells of the samples of the volume.
#[derive(Serialize)]
pub(super) struct SamplesShown {
    /// How many lie in each of as many equal parts of the range of isovalues.
    histogram: Vec<u64>,
    /// Percentiles from 0 to 100 in even steps.
    percentiles: Vec<f64>,
}

/// What a page that shows a range of isovalues tells of the samples.
pub(super) fn samples(samples: &Histogram, range: (f64, f64)) -> SamplesShown {
    let percent = |i: usize| 100.0 * i as f64 / N_PERCENTILES as f64;
    SamplesShown {
        histogram: samples.parts(N_BINS, range),
        percentiles: (0..=N_PERCENTILES).map(|i| samples.percentile(percent(i))).collect(),
    }
}

/// Curves over evenly spaced isovalues from one end of the range to the other.
#[derive(Serialize)]
pub(super) struct Curves {
    /// Connected components of the mesh, caps included.
    components: Vec<u32>,
    /// Euler characteristic of the mesh, caps included.
    euler: Vec<i64>,
    /// Area without caps, world units squared.
    area: Vec<f32>,
    /// Volume inside the mesh, caps included, world units cubed.
    volume: Vec<f32>,
    /// Isovalue and kind (0 emerge, 1 merge, 2 handle-open, 3 split, 4 handle-close, 5 vanish) of
    /// each event.
    events: Vec<(f64, u8)>,
}

/// The curves of a spectrum.
pub(super) fn curves(spectrum: &Spectrum) -> Result<Curves> {
    let (low, high) = spectrum.range;
    let mut curves = Curves {
        components: Vec::new(),
        euler: Vec::new(),
        area: Vec::new(),
        volume: Vec::new(),
        events: spectrum.events.iter().map(|e| (e.isovalue, code(e.kind))).collect(),
    };
    let mut query = Query::new(spectrum);
    for i in 0..N_ISOVALUES {
        let t = i as f64 / (N_ISOVALUES - 1) as f64;
        // Weighted, so that both ends are met exactly; between them for any rounding.
        let isovalue = (low * (1.0 - t) + high * t).clamp(low, high);
        let mesh = place_in_world(query.mesh_at(isovalue)?, &spectrum.volume.placement);
        curves.components.push(components(&mesh));
        curves.euler.push(euler(&mesh));
        curves.area.push(area(&mesh) as f32);
        curves.volume.push(volume(&mesh) as f32);
    }
    Ok(curves)
}

fn code(kind: EventKind) -> u8 {
    match kind {
        EventKind::Emerge => 0,
        EventKind::Merge => 1,
        EventKind::HandleOpen => 2,
        EventKind::Split => 3,
        EventKind::HandleClose => 4,
        EventKind::Vanish => 5,
    }
}

/// How many parts hang together by their vertices.
fn components(mesh: &SurfaceMesh) -> u32 {
    let mut parent: Vec<u32> = (0..mesh.positions.len() as u32).collect();
    let mut n = mesh.positions.len() as u32;
    for &[a, b, c] in &mesh.triangles {
        for (p, q) in [(a, b), (b, c)] {
            let (p, q) = (root(&mut parent, p), root(&mut parent, q));
            if p != q {
                parent[p as usize] = q;
                n -= 1;
            }
        }
    }
    n
}

fn root(parent: &mut [u32], mut v: u32) -> u32 {
    while parent[v as usize] != v {
        parent[v as usize] = parent[parent[v as usize] as usize];
        v = parent[v as usize];
    }
    v
}

/// Vertices less edges plus triangles; a closed mesh has three edges for two triangles.
fn euler(mesh: &SurfaceMesh) -> i64 {
    mesh.positions.len() as i64 - mesh.triangles.len() as i64 / 2
}

fn corner(mesh: &SurfaceMesh, v: u32) -> DVec3 {
    DVec3::from(mesh.positions[v as usize].map(f64::from))
}

fn area(mesh: &SurfaceMesh) -> f64 {
    let corners = mesh.triangles.iter().zip(&mesh.caps).filter(|(_, cap)| !**cap);
    let of = |triangle: &[u32; 3]| {
        let [a, b, c] = triangle.map(|v| corner(mesh, v));
        0.5 * (b - a).cross(c - a).length()
    };
    corners.map(|(triangle, _)| of(triangle)).sum()
}

/// What a closed mesh encloses: the sum of the tetrahedra that its triangles make with one of its
/// vertices, which is nearer than the origin may be.
fn volume(mesh: &SurfaceMesh) -> f64 {
    let apex = if mesh.positions.is_empty() { DVec3::ZERO } else { corner(mesh, 0) };
    let of = |triangle: &[u32; 3]| {
        let [a, b, c] = triangle.map(|v| corner(mesh, v) - apex);
        a.dot(b.cross(c)) / 6.0
    };
    mesh.triangles.iter().map(of).sum::<f64>().abs()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_outside_the_range_are_in_no_bin_but_count_for_percentiles() {
        let values = [0.0, 9.0, 10.0, 10.0, 15.0, 20.0, 21.0];
        let shown = samples(&Histogram::of_values(values.into_iter(), (0.0, 21.0)), (9.99, 20.01));
        let bins = shown.histogram;
        assert_eq!((bins[0], bins[N_BINS / 2], bins[N_BINS - 1]), (2, 1, 1));
        assert_eq!(bins.iter().sum::<u64>(), 4);
        let of = |percent: usize| shown.percentiles[percent * N_PERCENTILES / 100];
        // A bin of the finer histogram is 21 / 65,536 wide.
        assert!((of(0) - 0.0).abs() < 1e-3 && (of(50) - 10.0).abs() < 1e-3);
        assert!((of(100) - 21.0).abs() < 1e-3);
    }

    #[test]
    fn two_tetrahedra_are_two_components_with_the_volume_of_both() {
        let corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let faces = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]];
        let mut mesh = SurfaceMesh::default();
        for base in [0, 4] {
            mesh.positions.extend(corners);
            mesh.triangles.extend(faces.map(|t: [u32; 3]| t.map(|v| v + base)));
        }
        mesh.caps = vec![false; 8];
        assert_eq!((components(&mesh), euler(&mesh)), (2, 4));
        // Three right triangles of 1/2 and one of side sqrt 2.
        let expected = 2.0 * (1.5 + 3f64.sqrt() / 2.0);
        assert!((area(&mesh) - expected).abs() < 1e-12);
        // They lie in one place; each counts.
        assert!((volume(&mesh) - 2.0 / 6.0).abs() < 1e-12);
        mesh.caps[0] = true;
        assert!((area(&mesh) - expected + 0.5).abs() < 1e-12, "caps have no area");
    }
}
