//! The kernels on a GPU.
//!
//! Buffers stay on the device between calls and grow when a larger mesh is loaded. Positions are in
//! two buffers that are swapped by every iteration of relaxation. A call encodes all its
//! dispatches at once and reads back once.

use super::interface::{
    Advance, Advanced, DeviceWork, Kernels, RELAX_CHECK_EVERY, Relaxation, check_shape,
};
use crate::error::{Error, Result};
use crate::field::{Field, Status};
use crate::gpu::layout::{Grid, Outcome, Parameters};
use crate::gpu::{Bind, Bindings, Buffer, Gpu, Growable, Kernel, Read, shader};
use crate::mesh::Connectivity;
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
    /// [`Error::Gpu`] if the device rejects one.
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

    /// Whether it is a copy of this field.
    pub fn is_of(&self, field: &Arc<Field>) -> bool {
        Arc::ptr_eq(&self.field, field)
    }
}

/// How the samples are packed (as in `shaders/grid.wgsl`), and their bytes. The machine must be little-endian, as the device
/// is.
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
    constrained: Growable<u8>,
    ends: Growable<[f32; 3]>,
    positions: [Growable<[f32; 3]>; 2],
    normals: Growable<[f32; 3]>,
    forces: Growable<f32>,
    status: Growable<u32>,
    distances: Growable<f32>,
    /// Bound once per mesh; `None` before the first and for an empty one.
    bound: Option<BoundBuffers>,
    /// Which of the two position buffers is valid.
    current: usize,
    n_vertices: usize,
    n_faces: usize,
    work: DeviceWork,
}

/// One point for each vertex, voxel frame.
type Points = Buffer<[f32; 3]>;

/// All buffers bound to all kernels, with either buffer of positions as the current one.
#[derive(Debug)]
struct BoundBuffers {
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
            constrained: Growable::new(gpu, "constrained")?,
            ends: Growable::new(gpu, "ends of constrained vertices")?,
            positions: [Growable::new(gpu, "positions")?, Growable::new(gpu, "moved positions")?],
            normals: Growable::new(gpu, "normals")?,
            forces: Growable::new(gpu, "forces")?,
            status: Growable::new(gpu, "status")?,
            distances: Growable::new(gpu, "distances")?,
            bound: None,
            current: 0,
            n_vertices: 0,
            n_faces: 0,
            work: DeviceWork::default(),
            pipelines,
            field,
        })
    }

    fn bind(&self) -> BoundBuffers {
        let Pipelines { gpu, normals, project, relax, deviation, reduce } = &*self.pipelines;
        let DeviceField { grid, samples, .. } = &*self.field;
        let parameters = &self.parameters;
        let [ring_offsets, ring] =
            [&self.ring_offsets, &self.ring].map(|b| b.buffer() as &dyn Bind);
        let [faces, distances] = [self.faces.buffer() as &dyn Bind, self.distances.buffer()];
        let (constrained, vertex_normals) = (self.constrained.buffer(), self.normals.buffer());
        let ends = self.ends.buffer();
        let (forces, status) = (self.forces.buffer(), self.status.buffer());
        let both = |bind: &dyn Fn(&Points, &Points) -> Bindings| {
            let [a, b] = [self.positions[0].buffer(), self.positions[1].buffer()];
            [bind(a, b), bind(b, a)]
        };
        BoundBuffers {
            normals: both(&|positions, _| {
                normals.bind(gpu, &[positions, ring_offsets, ring, vertex_normals])
            }),
            project: both(&|positions, _| {
                project.bind(
                    gpu,
                    &[
                        grid,
                        samples,
                        parameters,
                        constrained,
                        vertex_normals,
                        positions,
                        status,
                        ends,
                    ],
                )
            }),
            relax: both(&|positions, moved| {
                relax.bind(
                    gpu,
                    &[
                        grid,
                        samples,
                        parameters,
                        constrained,
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
            reduce: reduce.bind(gpu, &[forces, &self.outcome]),
        }
    }

    fn set_parameters(&self, isovalue: f64, reach: f32, strength: f32, share: f32) {
        let field = &self.field.field;
        let parameters = Parameters {
            isovalue: field.isovalue(isovalue),
            reach,
            strength,
            value_noise: field.value_noise(),
            slab_tolerance: field.slab_tolerance(),
            share,
        };
        self.parameters.write(&self.pipelines.gpu, &[parameters]);
    }

    fn bound(&self) -> &BoundBuffers {
        self.bound.as_ref().expect("a mesh with vertices")
    }

    /// Submits commands, waits, and reads several buffers at once.
    fn read<const N: usize>(
        &mut self,
        encoder: wgpu::CommandEncoder,
        buffers: impl FnOnce(&Self) -> [&dyn Read; N],
    ) -> Result<[Vec<u32>; N]> {
        self.work.submissions += 1;
        self.work.read_backs += 1;
        let mut words = [const { Vec::new() }; N];
        let gpu = &self.pipelines.gpu;
        gpu.read_each_after(encoder, &buffers(self), &mut |i, bytes| {
            words[i] = bytemuck::pod_collect_to_vec(bytes);
        })?;
        Ok(words)
    }

    /// Encodes a projection of the valid positions.
    fn encode_projection(&self, pass: &mut wgpu::ComputePass<'_>) {
        let Pipelines { normals, project, .. } = &*self.pipelines;
        normals.dispatch(pass, &self.bound().normals[self.current], self.n_vertices);
        project.dispatch(pass, &self.bound().project[self.current], self.n_vertices);
    }

    /// Encodes `n` iterations of relaxation, each from one buffer of positions to the other; returns which is valid afterwards.
    fn encode_relaxation(&self, pass: &mut wgpu::ComputePass<'_>, n: u32) -> usize {
        let Pipelines { normals, relax, .. } = &*self.pipelines;
        (0..n).fold(self.current, |current, _| {
            normals.dispatch(pass, &self.bound().normals[current], self.n_vertices);
            relax.dispatch(pass, &self.bound().relax[current], self.n_vertices);
            1 - current
        })
    }

    /// Relaxes in rounds of [`RELAX_CHECK_EVERY`] iterations until the largest force is below the threshold.
    fn relax_in_rounds(&mut self, threshold: f32, max_iterations: u32) -> Result<()> {
        let mut done = 0;
        while done < max_iterations {
            let n = RELAX_CHECK_EVERY.min(max_iterations - done);
            let Pipelines { gpu, reduce, .. } = &*self.pipelines;
            let mut encoder = gpu.encoder("relax");
            encoder.clear_buffer(self.outcome.raw(), 0, None);
            let mut pass = encoder.begin_compute_pass(&Default::default());
            let current = self.encode_relaxation(&mut pass, n);
            reduce.dispatch_workgroups(&mut pass, &self.bound().reduce, [REDUCE_WORKGROUPS, 1]);
            drop(pass);
            self.current = current;
            let [words] = self.read(encoder, |k| [&k.outcome])?;
            let Outcome { largest_force } = bytemuck::cast_slice(&words)[0];
            done += n;
            if n == RELAX_CHECK_EVERY && f32::from_bits(largest_force) < threshold {
                break;
            }
        }
        Ok(())
    }

    /// Submits commands without waiting, and begins a new command buffer.
    fn submit(&mut self, encoder: &mut wgpu::CommandEncoder) {
        let gpu = self.pipelines.gpu();
        gpu.submit(std::mem::replace(encoder, gpu.encoder("advance")));
        self.work.submissions += 1;
    }

    /// Encodes the normals of the valid positions, submits, and reads the state of the mesh.
    fn read_back(&mut self, mut encoder: wgpu::CommandEncoder) -> Result<Advanced> {
        let mut pass = encoder.begin_compute_pass(&Default::default());
        let bindings = &self.bound().normals[self.current];
        self.pipelines.normals.dispatch(&mut pass, bindings, self.n_vertices);
        drop(pass);
        let [positions, normals, status] = self.read(encoder, |k| {
            [k.positions[k.current].buffer(), k.normals.buffer(), k.status.buffer()]
        })?;
        Ok(Advanced {
            positions: bytemuck::cast_slice(&positions).to_vec(),
            normals: bytemuck::cast_slice(&normals).to_vec(),
            status: status.into_iter().map(status_of).collect::<Result<_>>()?,
        })
    }
}

impl Kernels for GpuKernels {
    fn load(&mut self, connectivity: &Connectivity, positions: &[[f32; 3]]) -> Result<()> {
        check_shape(connectivity, positions.len());
        let gpu = &*self.pipelines.gpu;
        let n = positions.len();
        self.faces.set(gpu, &connectivity.faces)?;
        self.ring_offsets.set(gpu, &connectivity.ring_offsets)?;
        self.ring.set(gpu, &connectivity.ring)?;
        self.constrained.set(gpu, &connectivity.constrained)?;
        self.ends.set(gpu, positions)?;
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

    fn advance(&mut self, advance: &Advance) -> Result<Advanced> {
        let &Advance { isovalues, reach, ends, relaxation } = advance;
        let Relaxation { isovalue: relaxed_at, strength, threshold, max_iterations } = relaxation;
        if self.bound.is_none() {
            return Ok(Advanced::default());
        }
        if !ends.is_empty() {
            // The length is that of the loaded positions, so the bindings stay valid.
            self.ends.set(self.pipelines.gpu(), ends)?;
        }
        // The parameters hold one isovalue at a time, for projection and relaxation.
        let relaxes_at_last = isovalues.last() == Some(&relaxed_at);
        let mut encoder = self.pipelines.gpu.encoder("advance");
        for (i, &isovalue) in isovalues.iter().enumerate() {
            self.set_parameters(isovalue, reach, strength, advance.constrained_share(i));
            self.encode_projection(&mut encoder.begin_compute_pass(&Default::default()));
            if i + 1 < isovalues.len() || !relaxes_at_last {
                self.submit(&mut encoder);
            }
        }
        if !relaxes_at_last {
            self.set_parameters(relaxed_at, reach, strength, 0.0);
        }
        if max_iterations <= RELAX_CHECK_EVERY {
            let mut pass = encoder.begin_compute_pass(&Default::default());
            self.current = self.encode_relaxation(&mut pass, max_iterations);
        } else {
            self.submit(&mut encoder);
            self.relax_in_rounds(threshold, max_iterations)?;
        }
        self.read_back(encoder)
    }

    fn deviation(&mut self, isovalue: f64, reach: f32) -> Result<Vec<f32>> {
        if self.bound.is_none() {
            return Ok(Vec::new());
        }
        self.set_parameters(isovalue, reach, 0.0, 0.0);
        let Pipelines { gpu, deviation, .. } = &*self.pipelines;
        let mut encoder = gpu.encoder("deviation");
        let mut pass = encoder.begin_compute_pass(&Default::default());
        deviation.dispatch(&mut pass, &self.bound().deviation[self.current], self.n_faces);
        drop(pass);
        let [distances] = self.read(encoder, |k| [k.distances.buffer()])?;
        Ok(distances.into_iter().map(f32::from_bits).collect())
    }

    fn device_work(&self) -> DeviceWork {
        self.work
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
