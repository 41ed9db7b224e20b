//! A compiled kernel and the buffers bound to it.

use super::device::Gpu;
use super::shader::Shader;
use crate::error::Result;

/// Threads of a workgroup, as in `shaders/dispatch.wgsl`: 32 to 128 were equal, 256 slower.
pub const WORKGROUP_SIZE: u32 = 64;

/// Workgroups along one dimension at most (the limit of WebGPU).
pub const MAX_WORKGROUPS: u32 = 65535;

/// A compiled kernel.
#[derive(Debug)]
pub struct Kernel {
    name: &'static str,
    pipeline: wgpu::ComputePipeline,
}

/// Buffers bound to a kernel.
#[derive(Debug)]
pub struct Bindings(wgpu::BindGroup);

impl Kernel {
    /// Compiles a kernel; entry point and label are its name.
    ///
    /// # Errors
    ///
    /// [`crate::Error::Gpu`] if the device rejects it.
    pub fn new(gpu: &Gpu, shader: Shader) -> Result<Kernel> {
        let name = shader.name;
        let module = gpu.device().create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some(name),
            source: wgpu::ShaderSource::Wgsl(shader.text().into()),
        });
        let pipeline = gpu.device().create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some(name),
            layout: None,
            module: &module,
            entry_point: Some(name),
            compilation_options: Default::default(),
            cache: None,
        });
        gpu.check()?;
        Ok(Kernel { name, pipeline })
    }

    /// Binds buffers in the order of the shader's bindings.
    pub fn bind(&self, gpu: &Gpu, buffers: &[&dyn Bind]) -> Bindings {
        let entries: Vec<_> = buffers
            .iter()
            .zip(0..)
            .map(|(buffer, binding)| wgpu::BindGroupEntry { binding, resource: buffer.binding() })
            .collect();
        Bindings(gpu.device().create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some(self.name),
            layout: &self.pipeline.get_bind_group_layout(0),
            entries: &entries,
        }))
    }

    /// Runs one thread for each of `n` elements.
    pub(crate) fn dispatch(&self, pass: &mut wgpu::ComputePass<'_>, bindings: &Bindings, n: usize) {
        let groups = (n as u64).div_ceil(u64::from(WORKGROUP_SIZE)) as u32;
        self.dispatch_workgroups(
            pass,
            bindings,
            [groups.min(MAX_WORKGROUPS), groups.div_ceil(MAX_WORKGROUPS)],
        );
    }

    /// Runs `x` by `y` workgroups.
    pub(crate) fn dispatch_workgroups(
        &self,
        pass: &mut wgpu::ComputePass<'_>,
        bindings: &Bindings,
        [x, y]: [u32; 2],
    ) {
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &bindings.0, &[]);
        pass.dispatch_workgroups(x, y, 1);
    }
}

/// A buffer that can be bound to a kernel.
pub trait Bind {
    /// The range of a device buffer that the kernel sees.
    fn binding(&self) -> wgpu::BindingResource<'_>;
}
