//! Measures of the isosurfaces over the isovalue, for the plot above the slider.

use serde::Serialize;

use crate::error::Result;
use crate::export::place_in_world;
use crate::spectrum::{
    EventKind, Measures, Mesh, Query, Spectrum, event_persistence, most_persistent,
};
use crate::volume::{Histogram, Outside, Statistics, between};

/// The number of isovalues of the curves, evenly spaced.
const N_ISOVALUES: usize = 257;

/// The most events of which the page knows more than isovalue and kind: those of the largest persistence.
const MAX_NAMED: usize = 200;

/// The extent of the surfaces is that of every eighth of the isovalues.
const EXTENT_STEP: usize = 8;

/// The directions in which the extent of the surfaces is measured; two numbers of the plastic sequence spread them evenly.
const N_DIRECTIONS: usize = 96;

/// The number of bins of the histogram: one for each value of 8-bit samples.
const N_BINS: usize = 256;

/// The number of samples in each of [`N_BINS`] equal parts of a range of isovalues.
pub(super) fn histogram(samples: &Histogram, range: (f64, f64)) -> Vec<u64> {
    samples.parts(N_BINS, range)
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
    /// The isovalue and the kind ([`code`]) of each event.
    events: Vec<(f64, u8)>,
    /// The events of the largest persistence, ascending: number in `events`, persistence as a share of the range, position in the voxel
    /// frame.
    named: Vec<(usize, f32, [f32; 3])>,
    /// Points of the surfaces that are farthest in each of some directions, voxel frame: what the first picture is fitted to.
    #[serde(skip)]
    extent: Vec<[f32; 3]>,
}

impl Curves {
    /// Measures the isosurfaces of a spectrum.
    pub(super) fn of(spectrum: &Spectrum) -> Result<Curves> {
        let range = spectrum.range();
        let persistence = event_persistence(spectrum.events(), spectrum.volume(), range);
        let named = most_persistent(&persistence, MAX_NAMED)
            .into_iter()
            .map(|i| (i, persistence[i] as f32, spectrum.events()[i].position.map(|x| x as f32)));
        let mut extent = Extent::default();
        let mut curves = Curves {
            named: named.collect(),
            extent: Vec::new(),
            components: Vec::new(),
            euler: Vec::new(),
            area: Vec::new(),
            volume: Vec::new(),
            events: spectrum.events().iter().map(|e| (e.isovalue, e.kind.code())).collect(),
        };
        let mut query = Query::new(spectrum);
        for i in 0..N_ISOVALUES {
            let mesh = query.mesh_at(isovalue_at(range, i))?;
            if i % EXTENT_STEP == 0 {
                extent.add(&mesh);
            }
            let measures = Measures::of(&place_in_world(mesh, &spectrum.volume().placement));
            curves.components.push(measures.components);
            curves.euler.push(measures.euler);
            curves.area.push(measures.area as f32);
            curves.volume.push(measures.volume as f32);
        }
        curves.extent = extent.points();
        Ok(curves)
    }

    /// The points that the first picture is fitted to.
    pub(super) fn extent(&self) -> &[[f32; 3]] {
        &self.extent
    }

    /// Isovalues that the page offers if its author names none.
    pub(super) fn suggested(
        &self,
        spectrum: &Spectrum,
        samples: Option<&Statistics>,
    ) -> Vec<(f64, &'static str)> {
        let (low, high) = spectrum.range();
        let at = |i: usize| low + (high - low) * (i as f64 / (N_ISOVALUES - 1) as f64);
        let areas: Vec<(f64, f64)> =
            self.area.iter().enumerate().map(|(i, &area)| (at(i), f64::from(area))).collect();
        spectrum.suggested(&areas, samples)
    }
}

/// The changes at events in words, by code, for each outer side that a volume can have.
pub(super) fn words() -> serde_json::Value {
    let of = |outside| EventKind::ALL.map(|kind| kind.in_words(outside));
    serde_json::json!({ "Low": of(Outside::Low), "High": of(Outside::High) })
}

/// Isovalue `i` of [`N_ISOVALUES`], the ends of the range among them.
fn isovalue_at(range: (f64, f64), i: usize) -> f64 {
    between(range, i as f64 / (N_ISOVALUES - 1) as f64)
}

/// The points of meshes that are farthest in each of [`N_DIRECTIONS`] directions. Meshes that are mostly caps are the box of the volume,
/// which would make all others small; they count only if there are no others.
struct Extent {
    directions: Vec<[f32; 3]>,
    /// The farthest point so far in each direction and its distance: of meshes that are mostly caps, and of others.
    farthest: [Vec<(f32, [f32; 3])>; 2],
}

impl Default for Extent {
    fn default() -> Self {
        let directions = (0..N_DIRECTIONS).map(|i| {
            let (u, v) = (i as f64 * 0.754_877_666_246_693, i as f64 * 0.569_840_290_998_053);
            let (z, angle) = (2.0 * u.fract() - 1.0, std::f64::consts::TAU * v.fract());
            let r = (1.0 - z * z).sqrt();
            [r * angle.cos(), r * angle.sin(), z].map(|x| x as f32)
        });
        let none = vec![(f32::NEG_INFINITY, [0.0; 3]); N_DIRECTIONS];
        Extent { directions: directions.collect(), farthest: [none.clone(), none] }
    }
}

impl Extent {
    fn add(&mut self, mesh: &Mesh) {
        let n_caps = |is_cap: bool| -> f32 {
            let triangles = mesh.triangles.iter().zip(&mesh.caps);
            triangles.filter(|&(_, &cap)| cap == is_cap).map(|(t, _)| mesh_area(mesh, t)).sum()
        };
        let farthest = &mut self.farthest[usize::from(n_caps(true) <= n_caps(false))];
        for (direction, best) in self.directions.iter().zip(farthest) {
            for &p in &mesh.positions {
                let distance = direction[0] * p[0] + direction[1] * p[1] + direction[2] * p[2];
                if distance > best.0 {
                    *best = (distance, p);
                }
            }
        }
    }

    fn points(self) -> Vec<[f32; 3]> {
        let found = |list: &Vec<(f32, [f32; 3])>| list[0].0 > f32::NEG_INFINITY;
        let [capped, others] = self.farthest;
        let list = if found(&others) { others } else { capped };
        let mut points: Vec<[f32; 3]> =
            list.into_iter().filter(|best| best.0 > f32::NEG_INFINITY).map(|best| best.1).collect();
        points.sort_by(|a, b| a.partial_cmp(b).unwrap_or(std::cmp::Ordering::Equal));
        points.dedup();
        points
    }
}

/// Twice the area of a triangle.
fn mesh_area(mesh: &Mesh, triangle: &[u32; 3]) -> f32 {
    let [a, b, c] = triangle.map(|v| glam::Vec3::from_array(mesh.positions[v as usize]));
    (b - a).cross(c - a).length()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_outside_the_range_are_in_no_bin() {
        let values = [0.0, 9.0, 10.0, 10.0, 15.0, 20.0, 21.0];
        let samples = Histogram::of_values(values.into_iter(), (0.0, 21.0));
        let bins = histogram(&samples, (9.99, 20.01));
        assert_eq!((bins[0], bins[N_BINS / 2], bins[N_BINS - 1]), (2, 1, 1));
        assert_eq!(bins.iter().sum::<u64>(), 4);
    }
}
