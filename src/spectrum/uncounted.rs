//! Triangles that lie where nothing counts become caps, for as long as they lie there.
//!
//! A triangle moves, so it may come from where it counts to where it does not: then its lifetime is cut in pieces at
//! isovalues of the table. Where each piece lies is told by the triangle's middle in the middle of the piece, and pieces are
//! short enough that it does not go far in one.

use rayon::prelude::*;

use super::{Spectrum, Triangle};

/// How far the middle of a triangle may go in a piece of its lifetime, voxels.
const FAR: f32 = 0.25;

impl Spectrum {
    /// Makes caps of triangles while `is_out` holds for their barycentres, voxel frame.
    pub(crate) fn cap_where(&mut self, is_out: impl Fn([f64; 3]) -> bool + Sync) {
        let spectrum = &*self;
        let pieces = |&triangle: &Triangle| {
            let mut pieces = Vec::new();
            if triangle.cap {
                pieces.push(triangle);
            } else {
                spectrum.add_pieces(triangle, &is_out, &mut pieces);
            }
            pieces
        };
        let triangles: Vec<Triangle> = self.triangles().par_iter().flat_map_iter(pieces).collect();
        self.patch.triangles = triangles;
    }

    /// Appends the pieces of a triangle, each as long as it can be.
    fn add_pieces(
        &self,
        triangle: Triangle,
        is_out: &impl Fn([f64; 3]) -> bool,
        pieces: &mut Vec<Triangle>,
    ) {
        let inner = |v: u32| self.trajectory(v).iter().map(|knot| knot.rank);
        let mut ranks: Vec<u32> = triangle.vertices.into_iter().flat_map(inner).collect();
        ranks.retain(|rank| (triangle.birth + 1..triangle.death).contains(rank));
        ranks.extend([triangle.birth, triangle.death]);
        ranks.sort_unstable();
        ranks.dedup();
        // The next in the order of ranks is the last.
        let mut parts: Vec<(u32, u32)> = ranks.windows(2).rev().map(|w| (w[0], w[1])).collect();
        let first = pieces.len();
        while let Some((birth, death)) = parts.pop() {
            let [from, to] = [birth, death].map(|rank| self.isovalues()[rank as usize]);
            let middle = birth + (death - birth) / 2;
            if middle > birth {
                let [p, q] = [(birth, from), (death, to)].map(|at| self.middle(&triangle, at));
                if p.distance(q) > FAR {
                    parts.extend([(middle, death), (birth, middle)]);
                    continue;
                }
            }
            let cap = is_out(
                self.middle(&triangle, (birth, 0.5 * from + 0.5 * to)).to_array().map(f64::from),
            );
            match pieces[first..].last_mut() {
                Some(last) if last.cap == cap => last.death = death,
                _ => pieces.push(Triangle { birth, death, cap, ..triangle }),
            }
        }
    }

    /// The barycentre of a triangle at an isovalue, of which the rank is told.
    fn middle(&self, triangle: &Triangle, (rank, isovalue): (u32, f64)) -> glam::Vec3 {
        let place = |v| glam::Vec3::from(self.vertex_at(v, rank, isovalue));
        triangle.vertices.map(place).into_iter().sum::<glam::Vec3>() / 3.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernels::{Backend, Choice};
    use crate::progress::Silent;
    use crate::spectrum::SurfaceMesh;
    use crate::sweep::{Parameters, compute};
    use crate::volume::phantom;

    #[test]
    fn triangles_that_pass_a_plane_are_caps_beyond_it_and_the_mesh_stays() {
        let volume = std::sync::Arc::new(phantom("sphere:12").expect("a phantom"));
        let backend = Backend::choose(Choice::Cpu, None).expect("the CPU");
        let spectrum = compute(&volume, &Parameters::default(), &backend, &Silent).expect("one");
        let mut cut = spectrum.clone();
        cut.cap_where(|p| p[0] > 7.3);
        cut.check().expect("still a spectrum");
        assert!(cut.triangles().len() > spectrum.triangles().len(), "some are cut");
        let (low, high) = spectrum.range();
        let mut n_told = [0; 2];
        for i in 1..40 {
            let isovalue = low + (high - low) * f64::from(i) / 40.0;
            let (before, after) = (spectrum.mesh_at(isovalue), cut.mesh_at(isovalue));
            let (before, after) = (before.expect("inside"), after.expect("inside"));
            let sorted = |mesh: &SurfaceMesh| {
                let corners =
                    |t: &[u32; 3]| t.map(|v| mesh.positions[v as usize].map(f32::to_bits));
                let all = mesh.triangles.iter().zip(&mesh.caps);
                let mut all: Vec<_> = all.map(|(t, &cap)| (corners(t), cap)).collect();
                all.sort_unstable();
                all
            };
            let (before, after) = (sorted(&before), sorted(&after));
            assert_eq!(before.len(), after.len());
            for ((corners, was_cap), (same, cap)) in before.into_iter().zip(after) {
                assert_eq!(corners, same, "the mesh stays");
                let x = corners.iter().map(|p| f32::from_bits(p[0])).sum::<f32>() / 3.0;
                if was_cap || (x - 7.3).abs() > FAR {
                    assert_eq!(cap, was_cap || x > 7.3, "{x} at {isovalue}");
                    n_told[usize::from(cap && !was_cap)] += 1;
                }
            }
        }
        assert!(n_told[0] > 100 && n_told[1] > 100, "{n_told:?}");
    }
}
