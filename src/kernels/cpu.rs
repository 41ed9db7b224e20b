//! The kernels on the CPU: the reference, and the backend for small meshes and bare machines.
//!
//! # Invariants
//!
//! Every vertex is computed from the state before the pass, whole passes are sums and maxima that
//! do not depend on order: results are equal for any number of threads.

use super::field::Field;
use super::{
    Advance, Advanced, Connectivity, Kernels, Relaxation, Status, check_shape, deviation, is_check,
    normals, project, relax, step,
};
use crate::error::Result;
use glam::Vec3;
use rayon::prelude::*;
use std::sync::Arc;

/// Vertices, or faces, that one task covers at least: they take some tens of microseconds, and a step taken again moves a few
/// hundred.
const AT_ONCE: usize = 128;

/// The CPU twins behind [`Kernels`]. Many may share one field.
#[derive(Debug)]
pub struct CpuKernels {
    field: Arc<Field>,
    connectivity: Connectivity,
    positions: Vec<Vec3>,
    moved: Vec<(Vec3, f32)>,
    normals: Vec<Vec3>,
    status: Vec<Status>,
}

impl CpuKernels {
    /// Kernels over a field, without a mesh yet.
    pub fn new(field: Arc<Field>) -> Self {
        CpuKernels {
            field,
            connectivity: Connectivity { ring_offsets: vec![0], ..Default::default() },
            positions: Vec::new(),
            moved: Vec::new(),
            normals: Vec::new(),
            status: Vec::new(),
        }
    }

    fn update_normals(&mut self) {
        let (connectivity, positions) = (&self.connectivity, &self.positions);
        for_each(&mut self.normals, |v, n| *n = normals::normal(connectivity, positions, v));
    }

    /// Projects, and moves what is held by a share of its way to `ends`, if there are any; how many failed.
    fn project_all(&mut self, isovalue: f64, reach: f32, ends: &[[f32; 3]], share: f32) -> u32 {
        self.update_normals();
        let isovalue = self.field.isovalue(isovalue);
        let (field, connectivity, positions, normals) =
            (&*self.field, &self.connectivity, &self.positions, &self.normals);
        let mut work: Vec<(Vec3, Status)> = vec![(Vec3::ZERO, Status::Reached); positions.len()];
        for_each(&mut work, |v, place| {
            let p = positions[v];
            *place = if connectivity.held[v] != 0 {
                let end = ends.get(v).map_or(p, |&end| end.into());
                (project::held(p, end, share), Status::Reached)
            } else {
                step::onto_isosurface(field, p, normals[v], isovalue, reach)
            };
        });
        let mut n_failed = 0;
        for (v, (q, status)) in work.into_iter().enumerate() {
            self.positions[v] = q;
            self.status[v] = status;
            n_failed += u32::from(status == Status::Failed);
        }
        n_failed
    }

    /// One iteration of relaxation; the largest force before it.
    fn relax_once(&mut self, isovalue: f32, strength: f32) -> f32 {
        self.update_normals();
        let (field, connectivity, positions, normals) =
            (&*self.field, &self.connectivity, &self.positions, &self.normals);
        for_each(&mut self.moved, |v, moved| {
            *moved =
                relax::relaxed(field, connectivity, positions, normals[v], v, isovalue, strength);
        });
        let mut largest = 0.0f32;
        for (p, (q, force)) in self.positions.iter_mut().zip(&self.moved) {
            *p = *q;
            largest = largest.max(*force);
        }
        largest
    }
}

impl Kernels for CpuKernels {
    fn name(&self) -> String {
        "cpu".into()
    }

    fn load(&mut self, connectivity: &Connectivity, positions: &[[f32; 3]]) -> Result<()> {
        check_shape(connectivity, positions.len());
        self.connectivity.clone_from(connectivity);
        self.positions.clear();
        self.positions.extend(positions.iter().map(|&p| Vec3::from_array(p)));
        self.moved.resize(positions.len(), (Vec3::ZERO, 0.0));
        self.normals.resize(positions.len(), Vec3::ZERO);
        self.status.clear();
        self.status.resize(positions.len(), Status::Reached);
        Ok(())
    }

    fn project(&mut self, isovalue: f64, reach: f32) -> Result<u32> {
        Ok(self.project_all(isovalue, reach, &[], 0.0))
    }

    fn relax(
        &mut self,
        isovalue: f64,
        strength: f32,
        threshold: f32,
        max_iterations: u32,
    ) -> Result<Relaxation> {
        let isovalue = self.field.isovalue(isovalue);
        let mut done = Relaxation::default();
        while done.iterations < max_iterations {
            let largest_force = self.relax_once(isovalue, strength);
            done = Relaxation { iterations: done.iterations + 1, largest_force };
            if is_check(done.iterations) && largest_force < threshold {
                break;
            }
        }
        Ok(done)
    }

    fn advance(&mut self, advance: &Advance) -> Result<Advanced> {
        let &Advance { isovalues, reach, ends, relaxed_at, strength, threshold, max_iterations } =
            advance;
        for (i, &isovalue) in isovalues.iter().enumerate() {
            self.project_all(isovalue, reach, ends, advance.held_share(i));
        }
        self.relax(relaxed_at, strength, threshold, max_iterations)?;
        let (positions, normals) = (self.positions()?, self.normals()?);
        Ok(Advanced { positions, normals, status: self.status()? })
    }

    fn deviation(&mut self, isovalue: f64, reach: f32) -> Result<Vec<f32>> {
        let isovalue = self.field.isovalue(isovalue);
        let (field, faces, positions) = (&*self.field, &self.connectivity.faces, &self.positions);
        let mut distances = vec![0.0; faces.len()];
        for_each(&mut distances, |f, distance| {
            let [a, b, c] = faces[f].map(|v| positions[v as usize]);
            *distance = deviation::face_deviation(field, a, b, c, isovalue, reach);
        });
        Ok(distances)
    }

    fn positions(&mut self) -> Result<Vec<[f32; 3]>> {
        Ok(self.positions.iter().map(Vec3::to_array).collect())
    }

    fn normals(&mut self) -> Result<Vec<[f32; 3]>> {
        self.update_normals();
        Ok(self.normals.iter().map(Vec3::to_array).collect())
    }

    fn status(&mut self) -> Result<Vec<Status>> {
        Ok(self.status.clone())
    }
}

/// Applies `f` to every element and its index, on threads where there are many.
fn for_each<T: Send>(elements: &mut [T], f: impl Fn(usize, &mut T) + Sync) {
    elements.par_iter_mut().enumerate().with_min_len(AT_ONCE).for_each(|(i, e)| f(i, e));
}
