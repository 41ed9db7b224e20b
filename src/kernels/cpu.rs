//! The kernels on the CPU: the reference, and the backend for small meshes and machines without a GPU.
//!
//! # Invariants
//!
//! Every vertex is computed from the state before the stage, and reductions are maxima, which do not depend on order: results
//! are equal for any number of threads.

use super::interface::{Advance, Advanced, Kernels, RELAX_CHECK_EVERY, Relaxation, check_shape};
use super::{deviation, normals, project, relax};
use crate::error::Result;
use crate::field::{Field, Status, step};
use crate::mesh::Connectivity;
use glam::Vec3;
use rayon::prelude::*;
use std::sync::Arc;

/// Vertices per task at least: they take some tens of microseconds, and a step that is repeated moves a few hundred.
const MIN_TASK_VERTICES: usize = 128;

/// The CPU twins behind [`Kernels`]. Any number of them may share one field.
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

    /// Projects free vertices, and moves constrained ones by a share of their way to `ends`, unless that is empty.
    fn project(&mut self, isovalue: f64, reach: f32, ends: &[[f32; 3]], share: f32) {
        self.update_normals();
        let isovalue = self.field.isovalue(isovalue);
        let (field, connectivity, positions, normals) =
            (&*self.field, &self.connectivity, &self.positions, &self.normals);
        let mut projected = vec![(Vec3::ZERO, Status::Reached); positions.len()];
        for_each(&mut projected, |v, result| {
            let p = positions[v];
            *result = if connectivity.constrained[v] != 0 {
                let end = ends.get(v).map_or(p, |&end| end.into());
                (project::constrained_at(p, end, share), Status::Reached)
            } else {
                step::onto_isosurface(field, p, normals[v], isovalue, reach)
            };
        });
        for (v, (q, status)) in projected.into_iter().enumerate() {
            self.positions[v] = q;
            self.status[v] = status;
        }
    }

    /// Relaxes until the largest force is below the threshold.
    fn relax(&mut self, relaxation: Relaxation) {
        let Relaxation { isovalue, strength, threshold, max_iterations } = relaxation;
        let isovalue = self.field.isovalue(isovalue);
        for done in 1..=max_iterations {
            let largest_force = self.relax_once(isovalue, strength);
            if done.is_multiple_of(RELAX_CHECK_EVERY) && largest_force < threshold {
                break;
            }
        }
    }

    /// One iteration of relaxation; returns the largest force before it.
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

    fn advance(&mut self, advance: &Advance) -> Result<Advanced> {
        for (i, &isovalue) in advance.isovalues.iter().enumerate() {
            self.project(isovalue, advance.reach, advance.ends, advance.constrained_share(i));
        }
        self.relax(advance.relaxation);
        self.update_normals();
        Ok(Advanced {
            positions: self.positions.iter().map(Vec3::to_array).collect(),
            normals: self.normals.iter().map(Vec3::to_array).collect(),
            status: self.status.clone(),
        })
    }

    fn deviation(&mut self, isovalue: f64, reach: f32) -> Result<Vec<f32>> {
        let isovalue = self.field.isovalue(isovalue);
        let (field, connectivity, positions) = (&*self.field, &self.connectivity, &self.positions);
        let mut distances = vec![0.0; connectivity.faces.len()];
        for_each(&mut distances, |f, distance| {
            *distance = deviation::deviation(field, connectivity, positions, f, isovalue, reach);
        });
        Ok(distances)
    }
}

/// Applies `f` to every element and its index, on threads where there are many.
fn for_each<T: Send>(elements: &mut [T], f: impl Fn(usize, &mut T) + Sync) {
    elements.par_iter_mut().enumerate().with_min_len(MIN_TASK_VERTICES).for_each(|(i, e)| f(i, e));
}
