//! The triangles alive at a rank, by looking at all of them. Twin: `shaders/compact.wgsl`.
//!
//! Where a list is needed without the CPU. It costs what the spectrum's size costs, so nothing
//! here draws by it: bench `active_set` compares it with lists that change with the rank.

use super::shader;
use crate::error::Result;
use crate::gpu::{Bindings, Buffer, Gpu, Kernel};
use bytemuck::{Pod, Zeroable};

/// What is asked; as in the shader.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Moment {
    /// Rank of the isovalue.
    pub rank: u32,
}

/// The arguments of an indirect draw; as in the shader.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct Draw {
    /// Three for each triangle listed.
    pub n_corners: u32,
    /// One.
    pub n_instances: u32,
    /// Zero.
    pub first_corner: u32,
    /// Zero.
    pub first_instance: u32,
}

/// The triangles (indices into `lifetimes`, pairs of birth and death) alive at `rank`, increasing.
pub fn alive(lifetimes: &[[u32; 2]], rank: u32) -> Vec<u32> {
    let lives = |&(_, &[birth, death]): &(u32, &[u32; 2])| birth <= rank && rank < death;
    (0..).zip(lifetimes).filter(lives).map(|(triangle, _)| triangle).collect()
}

/// The kernel with the lifetimes of one spectrum on the device.
#[derive(Debug)]
pub struct Compaction {
    kernel: Kernel,
    bindings: Bindings,
    moment: Buffer<Moment>,
    draw: Buffer<Draw>,
    alive: Buffer<u32>,
    n_triangles: usize,
}

impl Compaction {
    /// Compiles the kernel and uploads the lifetimes, pairs of birth and death.
    ///
    /// # Errors
    ///
    /// [`crate::Error::Gpu`] if the device refuses or the lifetimes do not fit a binding.
    pub fn new(gpu: &Gpu, lifetimes: &[[u32; 2]]) -> Result<Self> {
        let kernel = Kernel::new(gpu, shader::COMPACT)?;
        let n_triangles = lifetimes.len();
        let table = Buffer::storage(gpu, "compact.lifetimes", n_triangles)?;
        table.write(gpu, lifetimes);
        let moment = Buffer::uniform(gpu, "compact.moment")?;
        let draw = Buffer::storage(gpu, "compact.draw", 1)?;
        let alive = Buffer::storage(gpu, "compact.alive", n_triangles)?;
        let bindings = kernel.bind(gpu, &[&moment, &table, &draw, &alive]);
        Ok(Compaction { kernel, bindings, moment, draw, alive, n_triangles })
    }

    /// Lists the triangles alive at `rank` and waits for the draw's arguments.
    ///
    /// # Errors
    ///
    /// [`crate::Error::Gpu`] if the device is lost.
    pub fn run(&self, gpu: &Gpu, rank: u32) -> Result<Draw> {
        self.moment.write(gpu, &[Moment { rank }]);
        self.draw.write(gpu, &[Draw { n_instances: 1, ..Draw::default() }]);
        let mut encoder = gpu.encoder("compact");
        let mut pass = encoder.begin_compute_pass(&Default::default());
        self.kernel.dispatch(&mut pass, &self.bindings, self.n_triangles);
        drop(pass);
        Ok(gpu.read_after(encoder, &self.draw)?[0])
    }

    /// The triangles of the last run, in no particular order.
    ///
    /// # Errors
    ///
    /// As [`Compaction::run`].
    pub fn alive(&self, gpu: &Gpu) -> Result<Vec<u32>> {
        let n = gpu.read(&self.draw)?[0].n_corners / 3;
        let mut alive = gpu.read(&self.alive)?;
        alive.truncate(n as usize);
        Ok(alive)
    }
}
