//! Spectra made for tests: a sphere that grows, ripples and changes its triangles on the way.
//!
//! Every vertex moves along its own ray from the origin, so positions are known in closed form at
//! every isovalue. Splits (a vertex in the middle of a triangle) and flips keep the mesh a closed
//! surface with the Euler characteristic of a sphere at every isovalue.

use std::collections::HashMap;

use isospectrum::spectrum::{
    About, Collapse, Event, EventKind, Knot, Metadata, Patch, Spectrum, Triangle, VolumeInfo,
};
use isospectrum::volume::{Outside, Placement};

/// Size and changes of a synthetic spectrum.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Growth {
    /// The first mesh is an octahedron with its triangles cut in four this often.
    pub(crate) subdivisions: u32,
    /// Ranks after the first.
    pub(crate) n_steps: u32,
    /// Triangles split at each rank.
    pub(crate) splits: u32,
    /// Edges flipped at each rank.
    pub(crate) flips: u32,
    /// Ranks between two knots of a trajectory, about.
    pub(crate) knot_distance: u32,
}

/// Pseudorandom numbers, equal on every machine.
pub(crate) struct Numbers(pub(crate) u64);

impl Numbers {
    /// The next number below `n`.
    pub(crate) fn below(&mut self, n: u32) -> u32 {
        self.0 =
            self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (((self.0 >> 33) * u64::from(n)) >> 31) as u32
    }
}

/// The isovalue of a rank: unevenly spaced, and not all short decimals.
pub(crate) fn isovalue(rank: u32) -> f64 {
    f64::from(rank) + if rank % 3 == 1 { 1.0 / 3.0 } else { 0.0 }
}

/// The description of a volume that does not exist.
pub(crate) fn volume_info() -> VolumeInfo {
    VolumeInfo {
        name: "sphere".into(),
        dims: [128, 128, 128],
        sample_type: "uint8".into(),
        range: (0.0, 255.0),
        placement: Placement { spacing: [0.1, 0.1, 0.3], ..Placement::default() },
        outside: Outside::Low,
    }
}

/// The surface in direction `d` at `isovalue`.
fn point(d: [f64; 3], isovalue: f64) -> [f32; 3] {
    let ripple = (5.0 * d[0] + 0.05 * isovalue).sin() * (7.0 * d[1] - 0.03 * isovalue).cos();
    let radius = 20.0 + 0.15 * isovalue + 2.0 * ripple;
    d.map(|x| (64.0 + radius * x) as f32)
}

/// Builds the spectrum of a growth; the same every time.
pub(crate) fn growing_sphere(growth: &Growth) -> Spectrum {
    let mut surface = Surface::octahedron();
    (0..growth.subdivisions).for_each(|_| surface.subdivide());
    let mut numbers = Numbers(1);
    for rank in 1..growth.n_steps {
        (0..growth.splits).for_each(|_| surface.split(rank, &mut numbers));
        (0..growth.flips).for_each(|_| surface.flip(rank, &mut numbers));
    }
    surface.into_spectrum(growth, &mut numbers)
}

/// A row of octahedra around samples of [`volume_info`], whose vertices run from there to the neighbouring
/// samples, as those of the exact extraction do; each knot is up to `off` voxels off its sample.
pub(crate) fn on_lattice(n: u32, off: f32) -> Spectrum {
    let (about, mut patch) = small().into_parts();
    let size = [1.0, 1.0, 0.3 / 0.1];
    let mut numbers = Numbers(3);
    let mut place = |sample: [i32; 3]| {
        [0, 1, 2].map(|a| {
            let offset = off * numbers.below(1000) as f32 / 1000.0;
            (f64::from(sample[a]) * size[a]) as f32 + offset
        })
    };
    (patch.knots, patch.triangles, patch.collapses) = (vec![], vec![], vec![]);
    for k in 0..n {
        let middle = [10 + 2 * k as i32, 11, 12 + (k % 3) as i32];
        for way in 0..6u32 {
            let mut end = middle;
            end[way as usize / 2] += if way % 2 == 0 { -1 } else { 1 };
            for (rank, sample) in [(0, middle), (1 + k % 2, end)] {
                patch.knots.push(Knot { rank, position: place(sample) });
            }
        }
        // Some triangles end before their vertices.
        let death = if k % 4 == 1 { 1 } else { 1 + k % 2 };
        for [x, y, z] in [[1, 3, 5], [3, 0, 5], [0, 2, 5], [2, 1, 5]] {
            let faces = [[x, y, z], [y, x, 4]];
            patch.triangles.extend(faces.map(|face| Triangle {
                vertices: face.map(|v| 6 * k + v),
                birth: 0,
                death,
                cap: false,
            }));
        }
    }
    patch.first_knot = (0..=6 * n).map(|v| 2 * v).collect();
    Spectrum::new(about, patch).expect("valid")
}

struct Surface {
    directions: Vec<[f64; 3]>,
    births: Vec<u32>,
    triangles: Vec<Triangle>,
    living: Vec<usize>,
    /// The living triangle to the left of each directed edge.
    left: HashMap<(u32, u32), usize>,
}

impl Surface {
    fn octahedron() -> Self {
        let mut surface = Surface {
            directions: vec![],
            births: vec![0; 6],
            triangles: vec![],
            living: vec![],
            left: HashMap::new(),
        };
        for axis in 0..3 {
            for sign in [1.0, -1.0] {
                let mut d = [0.0; 3];
                d[axis] = sign;
                surface.directions.push(d);
            }
        }
        for [x, y, z] in [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4]] {
            surface.add([x, y, z], 0);
            surface.add([y, x, 5], 0);
        }
        surface
    }

    fn add(&mut self, vertices: [u32; 3], birth: u32) {
        let [a, b, c] = vertices;
        let index = self.triangles.len();
        self.triangles.push(Triangle { vertices, birth, death: u32::MAX, cap: a % 7 == 0 });
        self.left.extend([(a, b), (b, c), (c, a)].map(|edge| (edge, index)));
        self.living.push(index);
    }

    fn end(&mut self, index: usize, rank: u32) {
        self.triangles[index].death = rank;
    }

    fn middle(&mut self, of: &[u32], birth: u32) -> u32 {
        let mut d = [0.0; 3];
        for &v in of {
            (0..3).for_each(|i| d[i] += self.directions[v as usize][i]);
        }
        let length = d.iter().map(|x| x * x).sum::<f64>().sqrt();
        self.directions.push(d.map(|x| x / length));
        self.births.push(birth);
        self.directions.len() as u32 - 1
    }

    fn subdivide(&mut self) {
        let old = std::mem::take(&mut self.triangles);
        self.living.clear();
        self.left.clear();
        let mut middles: HashMap<(u32, u32), u32> = HashMap::new();
        for Triangle { vertices: [a, b, c], .. } in old {
            let [ab, bc, ca] = [(a, b), (b, c), (c, a)].map(|(p, q)| {
                let edge = (p.min(q), p.max(q));
                middles.get(&edge).copied().unwrap_or_else(|| {
                    let m = self.middle(&[p, q], 0);
                    middles.insert(edge, m);
                    m
                })
            });
            for t in [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]] {
                self.add(t, 0);
            }
        }
    }

    /// A living triangle that was not born at `rank`.
    fn pick(&mut self, rank: u32, numbers: &mut Numbers) -> Option<usize> {
        for _ in 0..20 {
            let at = numbers.below(self.living.len() as u32) as usize;
            let triangle = &self.triangles[self.living[at]];
            if triangle.death != u32::MAX {
                self.living.swap_remove(at);
            } else if triangle.birth < rank {
                return Some(self.living[at]);
            }
        }
        None
    }

    fn split(&mut self, rank: u32, numbers: &mut Numbers) {
        let Some(index) = self.pick(rank, numbers) else { return };
        let [a, b, c] = self.triangles[index].vertices;
        self.end(index, rank);
        let m = self.middle(&[a, b, c], rank);
        for t in [[a, b, m], [b, c, m], [c, a, m]] {
            self.add(t, rank);
        }
    }

    fn flip(&mut self, rank: u32, numbers: &mut Numbers) {
        let Some(index) = self.pick(rank, numbers) else { return };
        let [a, b, c] = self.triangles[index].vertices;
        let other = self.left[&(b, a)];
        let d = *self.triangles[other].vertices.iter().find(|v| **v != a && **v != b).unwrap();
        let taken = |a, b| self.left.get(&(a, b)).is_some_and(|&t| self.triangles[t].death > rank);
        if self.triangles[other].birth == rank || c == d || taken(c, d) || taken(d, c) {
            return;
        }
        self.end(index, rank);
        self.end(other, rank);
        self.add([c, a, d], rank);
        self.add([d, b, c], rank);
    }

    fn into_spectrum(mut self, growth: &Growth, numbers: &mut Numbers) -> Spectrum {
        let last = growth.n_steps;
        for triangle in self.triangles.iter_mut().filter(|t| t.death == u32::MAX) {
            triangle.death = last;
        }
        let mut deaths = self.births.clone();
        for triangle in &self.triangles {
            for v in triangle.vertices {
                deaths[v as usize] = deaths[v as usize].max(triangle.death);
            }
        }
        let (mut first_knot, mut knots) = (vec![0], Vec::new());
        for (v, d) in self.directions.iter().enumerate() {
            let mut rank = self.births[v];
            loop {
                knots.push(Knot { rank, position: point(*d, isovalue(rank)) });
                if rank >= deaths[v] {
                    break;
                }
                rank = deaths[v]
                    .min(rank + 1 + growth.knot_distance / 2 + numbers.below(growth.knot_distance));
            }
            first_knot.push(knots.len() as u32);
        }
        let kinds = [EventKind::Emerge, EventKind::Merge, EventKind::HandleOpen, EventKind::Vanish];
        let metadata = r#"{"step":0.1,"backend":"cpu","repaired":0}"#;
        let mut about = About::new(volume_info(), (isovalue(0), isovalue(last)), 0.1);
        about.parameters = Metadata::from_json(metadata).expect("JSON");
        about.events = (0..4)
            .map(|i| Event {
                isovalue: f64::from(i) / 3.0,
                position: [0.1 * f64::from(i), -1.5, 7.0],
                kind: kinds[i as usize],
                persistence: (i > 0).then_some(0.25 * f64::from(i)),
            })
            .collect();
        let patch = Patch {
            isovalues: (0..=last).map(isovalue).collect(),
            first_knot,
            knots,
            triangles: self.triangles,
            collapses: (0..4u32)
                .map(|i| Collapse { vertex: i + 1, target: i, rank: last / 2, upward: i % 2 == 0 })
                .collect(),
        };
        Spectrum::new(about, patch).expect("the generator keeps the invariants")
    }
}

/// A spectrum of a few hundred triangles with splits, flips, births and deaths.
pub(crate) fn small() -> Spectrum {
    growing_sphere(&Growth { subdivisions: 1, n_steps: 12, splits: 2, flips: 4, knot_distance: 4 })
}
