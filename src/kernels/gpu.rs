//! The kernels on a GPU.
//!
//! Buffers stay on the device between calls and grow when a larger mesh comes; positions lie in
//! two buffers that change places with every iteration of relaxation. A call encodes all its
//! dispatches in one pass and reads back one small struct.

use super::field::Field;
use super::{
    Connectivity, Kernels, RELAX_CHECK_EVERY, Relaxation, Status, check_shape, is_check, shader,
};
use crate::error::{Error, Result};
use crate::gpu::layout::{Grid, Outcome, Parameters};
use crate::gpu::{Bindings, Buffer, Gpu, Growable, Kernel};
use crate::volume::Samples;
use std::sync::Arc;

/// Workgroups of the reduction, as in `shaders/reduce.wgsl`.
pub const REDUCE_WORKGROUPS: u32 = 16;

/// The compiled kernels of a device.
#[derive(Debug)]
pub struct Pipelines {
    gpu: Arc<Gpu>,
    normals: Kernel,
    project: Kernel,
    relax: Kernel,
    deviation: Kernel,
    reduce: Kernel,
}

impl Pipelines {
    /// Compiles all kernels.
    ///
    /// # Errors
    ///
    /// [`Error::Gpu`] if the device does not take one.
    pub fn new(gpu: Arc<Gpu>) -> Result<Self> {
        Ok(Pipelines {
            normals: Kernel::new(&gpu, shader::NORMALS)?,
            project: Kernel::new(&gpu, shader::PROJECT)?,
            relax: Kernel::new(&gpu, shader::RELAX)?,
            deviation: Kernel::new(&gpu, shader::DEVIATION)?,
            reduce: Kernel::new(&gpu, shader::REDUCE)?,
            gpu,
        })
    }

    /// The device they are for.
    pub fn gpu(&self) -> &Gpu {
        &self.gpu
    }
}

/// A field on the device, shared by all kernels that work on it.
#[derive(Debug)]
pub struct DeviceField {
    field: Arc<Field>,
    grid: Buffer<Grid>,
    samples: Buffer<u8>,
}

impl DeviceField {
    /// Copies a field to the device.
    ///
    /// # Errors
    ///
    /// [`Error::Gpu`] if its samples are more bytes than a binding may have.
    pub fn new(gpu: &Gpu, field: Arc<Field>) -> Result<Self> {
        let (sample_type, bytes) = packed(&field);
        let samples = Buffer::storage(gpu, "samples", bytes.len())?;
        samples.write(gpu, bytes);
        let grid = Buffer::uniform(gpu, "grid")?;
        grid.write(
            gpu,
            &[Grid {
                inverse_cell_size: field.inverse_cell_size().to_array(),
                outside: field.outside(),
                dims: field.dims().to_array(),
                sample_type,
            }],
        );
        Ok(DeviceField { grid, samples, field })
    }

    /// Whether it is this field's.
    pub fn is_of(&self, field: &Arc<Field>) -> bool {
        Arc::ptr_eq(&self.field, field)
    }
}

/// How the samples are packed (as in `shaders/grid.wgsl`), and their bytes, on machines that store
/// the lowest byte first as the device does.
fn packed(field: &Field) -> (u32, &[u8]) {
    match (field.mapped(), field.volume().samples()) {
        (Some(values), _) => (4, bytemuck::cast_slice(values)),
        (_, Samples::U8(values)) => (0, values),
        (_, Samples::I8(values)) => (1, bytemuck::cast_slice(values)),
        (_, Samples::U16(values)) => (2, bytemuck::cast_slice(values)),
        (_, Samples::I16(values)) => (3, bytemuck::cast_slice(values)),
        (_, Samples::F32(values)) => (4, bytemuck::cast_slice(values)),
        (None, Samples::U32(_) | Samples::I32(_) | Samples::F64(_)) => {
            unreachable!("a field maps the types that do not fit f32")
        }
    }
}

/// The kernels behind [`Kernels`], on a device.
#[derive(Debug)]
pub struct GpuKernels {
    pipelines: Arc<Pipelines>,
    field: Arc<DeviceField>,
    parameters: Buffer<Parameters>,
    outcome: Buffer<Outcome>,
    faces: Growable<[u32; 3]>,
    ring_offsets: Growable<u32>,
    ring: Growable<u32>,
    held: Growable<u8>,
    positions: [Growable<[f32; 3]>; 2],
    normals: Growable<[f32; 3]>,
    forces: Growable<f32>,
    status: Growable<u32>,
    distances: Growable<f32>,
    /// Bound once per mesh; none before the first and for an empty one.
    bound: Option<Bound>,
    /// Which of the two position buffers is valid.
    current: usize,
    n_vertices: usize,
    n_faces: usize,
}

/// One point for each vertex, voxel frame.
type Points = Buffer<[f32; 3]>;

/// All buffers bound to all kernels, for either buffer of positions being the current one.
#[derive(Debug)]
struct Bound {
    normals: [Bindings; 2],
    project: [Bindings; 2],
    relax: [Bindings; 2],
    deviation: [Bindings; 2],
    reduce: Bindings,
}

impl GpuKernels {
    /// Kernels over a field on the device, without a mesh yet.
    ///
    /// # Errors
    ///
    /// [`Error::Gpu`] if the device's memory is full.
    pub fn new(pipelines: Arc<Pipelines>, field: Arc<DeviceField>) -> Result<Self> {
        let gpu = &*pipelines.gpu;
        Ok(GpuKernels {
            parameters: Buffer::uniform(gpu, "parameters")?,
            outcome: Buffer::storage(gpu, "outcome", 1)?,
            faces: Growable::new(gpu, "faces")?,
            ring_offsets: Growable::new(gpu, "ring offsets")?,
            ring: Growable::new(gpu, "ring")?,
            held: Growable::new(gpu, "held")?,
            positions: [Growable::new(gpu, "positions")?, Growable::new(gpu, "moved positions")?],
            normals: Growable::new(gpu, "normals")?,
            forces: Growable::new(gpu, "forces")?,
            status: Growable::new(gpu, "status")?,
            distances: Growable::new(gpu, "distances")?,
            bound: None,
            current: 0,
            n_vertices: 0,
            n_faces: 0,
            pipelines,
            field,
        })
    }

    fn bind(&self) -> Bound {
        let Pipelines { gpu, normals, project, relax, deviation, reduce } = &*self.pipelines;
        let DeviceField { grid, samples, .. } = &*self.field;
        let parameters = &self.parameters;
        let [faces, distances] =
            [self.faces.buffer() as &dyn crate::gpu::Bind, self.distances.buffer()];
        let [ring_offsets, ring] = [self.ring_offsets.buffer(), self.ring.buffer()];
        let (held, vertex_normals) = (self.held.buffer(), self.normals.buffer());
        let (forces, status) = (self.forces.buffer(), self.status.buffer());
        let both = |bind: &dyn Fn(&Points, &Points) -> Bindings| {
            let [a, b] = [self.positions[0].buffer(), self.positions[1].buffer()];
            [bind(a, b), bind(b, a)]
        };
        Bound {
            normals: both(&|positions, _| {
                normals.bind(gpu, &[positions, ring_offsets, ring, vertex_normals])
            }),
            project: both(&|positions, _| {
                project.bind(
                    gpu,
                    &[grid, samples, parameters, held, vertex_normals, positions, status],
                )
            }),
            relax: both(&|positions, moved| {
                relax.bind(
                    gpu,
                    &[
                        grid,
                        samples,
                        parameters,
                        held,
                        ring_offsets,
                        ring,
                        vertex_normals,
                        positions,
                        moved,
                        forces,
                    ],
                )
            }),
            deviation: both(&|positions, _| {
                deviation.bind(gpu, &[grid, samples, parameters, faces, positions, distances])
            }),
            reduce: reduce.bind(gpu, &[forces, status, &self.outcome]),
        }
    }

    fn set_parameters(&self, isovalue: f64, reach: f32, strength: f32) {
        let field = &self.field.field;
        let parameters = Parameters {
            isovalue: field.isovalue(isovalue),
            reach,
            strength,
            value_noise: field.value_noise(),
            slab_tolerance: field.slab_tolerance(),
        };
        self.parameters.write(&self.pipelines.gpu, &[parameters]);
    }

    /// Encodes `steps` in one pass, then the reduction, and reads its outcome.
    fn run_and_reduce(
        &self,
        bound: &Bound,
        label: &str,
        steps: impl FnOnce(&mut wgpu::ComputePass<'_>),
    ) -> Result<Outcome> {
        let Pipelines { gpu, reduce, .. } = &*self.pipelines;
        let mut encoder = gpu.encoder(label);
        encoder.clear_buffer(self.outcome.raw(), 0, None);
        {
            let mut pass = encoder.begin_compute_pass(&Default::default());
            steps(&mut pass);
            reduce.dispatch_workgroups(&mut pass, &bound.reduce, [REDUCE_WORKGROUPS, 1]);
        }
        Ok(gpu.read_after(encoder, &self.outcome)?[0])
    }
}

impl Kernels for GpuKernels {
    fn name(&self) -> String {
        self.pipelines.gpu.name()
    }

    fn load(&mut self, connectivity: &Connectivity, positions: &[[f32; 3]]) -> Result<()> {
        check_shape(connectivity, positions.len());
        let gpu = &*self.pipelines.gpu;
        let n = positions.len();
        self.faces.set(gpu, &connectivity.faces)?;
        self.ring_offsets.set(gpu, &connectivity.ring_offsets)?;
        self.ring.set(gpu, &connectivity.ring)?;
        self.held.set(gpu, &connectivity.held)?;
        self.positions[0].set(gpu, positions)?;
        self.positions[1].resize(gpu, n)?;
        self.normals.resize(gpu, n)?;
        self.forces.resize(gpu, n)?;
        self.status.set(gpu, &vec![Status::Reached as u32; n])?;
        self.distances.resize(gpu, connectivity.faces.len())?;
        self.current = 0;
        self.n_vertices = n;
        self.n_faces = connectivity.faces.len();
        self.bound = (n > 0).then(|| self.bind());
        self.pipelines.gpu.check()
    }

    fn project(&mut self, isovalue: f64, reach: f32) -> Result<u32> {
        let Some(bound) = &self.bound else { return Ok(0) };
        self.set_parameters(isovalue, reach, 0.0);
        let Pipelines { normals, project, .. } = &*self.pipelines;
        let outcome = self.run_and_reduce(bound, "project", |pass| {
            normals.dispatch(pass, &bound.normals[self.current], self.n_vertices);
            project.dispatch(pass, &bound.project[self.current], self.n_vertices);
        })?;
        Ok(outcome.n_failed)
    }

    fn relax(
        &mut self,
        isovalue: f64,
        strength: f32,
        threshold: f32,
        max_iterations: u32,
    ) -> Result<Relaxation> {
        let Some(bound) = &self.bound else { return Ok(Relaxation::default()) };
        self.set_parameters(isovalue, 0.0, strength);
        let Pipelines { normals, relax, .. } = &*self.pipelines;
        let mut done = Relaxation::default();
        let mut current = self.current;
        while done.iterations < max_iterations {
            let n = RELAX_CHECK_EVERY.min(max_iterations - done.iterations);
            let outcome = self.run_and_reduce(bound, "relax", |pass| {
                for _ in 0..n {
                    normals.dispatch(pass, &bound.normals[current], self.n_vertices);
                    relax.dispatch(pass, &bound.relax[current], self.n_vertices);
                    current = 1 - current;
                }
            })?;
            done = Relaxation {
                iterations: done.iterations + n,
                largest_force: f32::from_bits(outcome.largest_force),
            };
            if is_check(done.iterations) && done.largest_force < threshold {
                break;
            }
        }
        self.current = current;
        Ok(done)
    }

    fn deviation(&mut self, isovalue: f64, reach: f32) -> Result<Vec<f32>> {
        let Some(bound) = &self.bound else { return Ok(Vec::new()) };
        self.set_parameters(isovalue, reach, 0.0);
        let Pipelines { gpu, deviation, .. } = &*self.pipelines;
        let mut encoder = gpu.encoder("deviation");
        {
            let mut pass = encoder.begin_compute_pass(&Default::default());
            deviation.dispatch(&mut pass, &bound.deviation[self.current], self.n_faces);
        }
        gpu.read_after(encoder, self.distances.buffer())
    }

    fn positions(&mut self) -> Result<Vec<[f32; 3]>> {
        self.pipelines.gpu.read(self.positions[self.current].buffer())
    }

    fn normals(&mut self) -> Result<Vec<[f32; 3]>> {
        let Some(bound) = &self.bound else { return Ok(Vec::new()) };
        let Pipelines { gpu, normals, .. } = &*self.pipelines;
        let mut encoder = gpu.encoder("normals");
        {
            let mut pass = encoder.begin_compute_pass(&Default::default());
            normals.dispatch(&mut pass, &bound.normals[self.current], self.n_vertices);
        }
        gpu.read_after(encoder, self.normals.buffer())
    }

    fn status(&mut self) -> Result<Vec<Status>> {
        let status = self.pipelines.gpu.read(self.status.buffer())?;
        status.into_iter().map(status_of).collect()
    }
}

fn status_of(word: u32) -> Result<Status> {
    match word {
        0 => Ok(Status::Reached),
        1 => Ok(Status::ReachedByGradient),
        2 => Ok(Status::Failed),
        _ => Err(Error::Gpu(format!("a vertex has status {word}, expected 0, 1 or 2"))),
    }
}
