//! One storage buffer of the shader.

/// A storage buffer that grows with what is written to it.
#[derive(Debug)]
pub(super) struct Table {
    label: &'static str,
    buffer: wgpu::Buffer,
    /// Bytes in use; at least [`Table::LEAST`], since nothing cannot be bound.
    size: u64,
}

impl Table {
    /// Bytes of the largest element of any table.
    const LEAST: u64 = 32;

    /// An empty table.
    pub(super) fn new(device: &wgpu::Device, label: &'static str) -> Self {
        Table { label, buffer: Self::buffer(device, label, Self::LEAST), size: Self::LEAST }
    }

    fn buffer(device: &wgpu::Device, label: &str, size: u64) -> wgpu::Buffer {
        device.create_buffer(&wgpu::BufferDescriptor {
            label: Some(label),
            size,
            usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        })
    }

    /// Replaces what the table holds.
    pub(super) fn write<T: bytemuck::Pod>(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        data: &[T],
    ) {
        let bytes: &[u8] = bytemuck::cast_slice(data);
        self.size = (bytes.len() as u64).max(Self::LEAST);
        if self.size > self.buffer.size() {
            // A quarter more, so that a mesh that grows with the isovalue does not allocate for
            // every picture.
            let roomy = (self.size + self.size / 4).next_multiple_of(wgpu::COPY_BUFFER_ALIGNMENT);
            self.buffer = Self::buffer(device, self.label, roomy);
        }
        queue.write_buffer(&self.buffer, 0, bytes);
    }

    /// The part in use, to be bound.
    pub(super) fn binding(&self) -> wgpu::BindingResource<'_> {
        wgpu::BindingResource::Buffer(wgpu::BufferBinding {
            buffer: &self.buffer,
            offset: 0,
            size: wgpu::BufferSize::new(self.size),
        })
    }
}
