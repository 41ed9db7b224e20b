//! A growing storage buffer.

/// A storage buffer that grows with the data written to it.
#[derive(Debug)]
pub(super) struct StorageBuffer {
    label: &'static str,
    buffer: wgpu::Buffer,
    /// Bytes in use; at least [`StorageBuffer::MIN_SIZE`], because an empty buffer cannot be bound.
    size: u64,
}

impl StorageBuffer {
    /// Bytes of the largest element of any table.
    const MIN_SIZE: u64 = 32;

    /// An empty buffer.
    pub(super) fn new(device: &wgpu::Device, label: &'static str) -> Self {
        let buffer = Self::allocate(device, label, Self::MIN_SIZE);
        StorageBuffer { label, buffer, size: Self::MIN_SIZE }
    }

    fn allocate(device: &wgpu::Device, label: &str, size: u64) -> wgpu::Buffer {
        device.create_buffer(&wgpu::BufferDescriptor {
            label: Some(label),
            size,
            usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        })
    }

    /// Replaces the contents.
    pub(super) fn write<T: bytemuck::Pod>(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        data: &[T],
    ) {
        let bytes: &[u8] = bytemuck::cast_slice(data);
        self.size = (bytes.len() as u64).max(Self::MIN_SIZE);
        if self.size > self.buffer.size() {
            // A quarter more, so that a mesh that grows with the isovalue does not reallocate for every picture.
            let size = (self.size + self.size / 4).next_multiple_of(wgpu::COPY_BUFFER_ALIGNMENT);
            self.buffer = Self::allocate(device, self.label, size);
        }
        queue.write_buffer(&self.buffer, 0, bytes);
    }

    /// The binding of the part in use.
    pub(super) fn binding(&self) -> wgpu::BindingResource<'_> {
        wgpu::BindingResource::Buffer(wgpu::BufferBinding {
            buffer: &self.buffer,
            offset: 0,
            size: wgpu::BufferSize::new(self.size),
        })
    }
}
