//! Makes caps of triangles while they are outside a mask.
//!
//! A triangle moves, so it may cross the border of the mask. Its lifetime is then split at
//! isovalues of the table. Each piece is classified by the triangle's barycentre in the middle of the piece, and pieces are
//! short enough that it does not move far in one.

use rayon::prelude::*;

use super::data::Spectrum;
use super::elements::Triangle;

/// Most that the barycentre of a triangle moves in a piece of its lifetime, voxels, unless the piece cannot be split.
const MAX_MOTION: f32 = 0.25;

impl Spectrum {
    /// Makes caps of triangles while `is_outside` is true for their barycentres, voxel frame.
    pub(crate) fn cap_where(&mut self, is_outside: impl Fn([f64; 3]) -> bool + Sync) {
        let spectrum = &*self;
        let pieces = |&triangle: &Triangle| {
            let mut pieces = Vec::new();
            if triangle.cap {
                pieces.push(triangle);
            } else {
                spectrum.add_pieces(triangle, &is_outside, &mut pieces);
            }
            pieces
        };
        let triangles: Vec<Triangle> = self.triangles().par_iter().flat_map_iter(pieces).collect();
        self.patch_mut().triangles = triangles;
    }

    /// Appends the pieces of a triangle. Consecutive pieces of one kind are merged.
    fn add_pieces(
        &self,
        triangle: Triangle,
        is_outside: &impl Fn([f64; 3]) -> bool,
        pieces: &mut Vec<Triangle>,
    ) {
        let inner = |v: u32| self.trajectory(v).iter().map(|knot| knot.rank);
        let mut ranks: Vec<u32> = triangle.vertices.into_iter().flat_map(inner).collect();
        ranks.retain(|rank| (triangle.birth + 1..triangle.death).contains(rank));
        ranks.extend([triangle.birth, triangle.death]);
        ranks.sort_unstable();
        ranks.dedup();
        // A stack: the piece with the lowest ranks is on top.
        let mut parts: Vec<(u32, u32)> = ranks.windows(2).rev().map(|w| (w[0], w[1])).collect();
        let first = pieces.len();
        while let Some((birth, death)) = parts.pop() {
            let [from, to] = [birth, death].map(|rank| self.isovalues()[rank as usize]);
            let middle = birth + (death - birth) / 2;
            if middle > birth {
                let [p, q] = [(birth, from), (death, to)].map(|at| self.barycentre(&triangle, at));
                if p.distance(q) > MAX_MOTION {
                    parts.extend([(middle, death), (birth, middle)]);
                    continue;
                }
            }
            let cap = is_outside(
                self.barycentre(&triangle, (birth, 0.5 * from + 0.5 * to))
                    .to_array()
                    .map(f64::from),
            );
            match pieces[first..].last_mut() {
                Some(last) if last.cap == cap => last.death = death,
                _ => pieces.push(Triangle { birth, death, cap, ..triangle }),
            }
        }
    }

    /// The barycentre of a triangle at a rank and its isovalue.
    fn barycentre(&self, triangle: &Triangle, (rank, isovalue): (u32, f64)) -> glam::Vec3 {
        let position = |v| glam::Vec3::from(self.vertex_at(v, rank, isovalue));
        triangle.vertices.map(position).into_iter().sum::<glam::Vec3>() / 3.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernels::{Backend, Choice};
    use crate::progress::Silent;
    use crate::spectrum::Mesh;
    use crate::sweep::{Parameters, compute};
    use crate::volume::phantom;

    #[test]
    fn triangles_beyond_a_plane_become_caps_and_the_mesh_is_unchanged() {
        let volume = std::sync::Arc::new(phantom("sphere:12").expect("a phantom"));
        let backend = Backend::choose(Choice::Cpu, None).expect("the CPU");
        let spectrum = compute(&volume, &Parameters::default(), &backend, &Silent).expect("one");
        let mut cut = spectrum.clone();
        cut.cap_where(|p| p[0] > 7.3);
        cut.check().expect("still valid");
        assert!(cut.triangles().len() > spectrum.triangles().len(), "some are split");
        let (low, high) = spectrum.range();
        let mut n_compared = [0; 2];
        for i in 1..40 {
            let isovalue = low + (high - low) * f64::from(i) / 40.0;
            let (before, after) = (spectrum.mesh_at(isovalue), cut.mesh_at(isovalue));
            let (before, after) = (before.expect("inside"), after.expect("inside"));
            let sorted = |mesh: &Mesh| {
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
                assert_eq!(corners, same, "the mesh is unchanged");
                let x = corners.iter().map(|p| f32::from_bits(p[0])).sum::<f32>() / 3.0;
                if was_cap || (x - 7.3).abs() > MAX_MOTION {
                    assert_eq!(cap, was_cap || x > 7.3, "{x} at {isovalue}");
                    n_compared[usize::from(cap && !was_cap)] += 1;
                }
            }
        }
        assert!(n_compared[0] > 100 && n_compared[1] > 100, "{n_compared:?}");
    }
}
