//! Typed buffers on the device.

use super::device::{Gpu, Read};
use super::kernel::Bind;
use crate::error::Result;
use bytemuck::Pod;
use std::marker::PhantomData;
use std::num::NonZeroU64;

/// An array of `T` on the device, bound with exactly its length.
#[derive(Debug)]
pub struct Buffer<T> {
    raw: wgpu::Buffer,
    len: usize,
    of: PhantomData<T>,
}

impl<T: Pod> Buffer<T> {
    /// A storage buffer of `len` elements, zero at first.
    ///
    /// # Errors
    ///
    /// [`crate::Error::Gpu`] if it exceeds the size of a binding, or the memory is full.
    pub fn storage(gpu: &Gpu, label: &str, len: usize) -> Result<Self> {
        Self::new(gpu, label, len, wgpu::BufferUsages::STORAGE)
    }

    /// A uniform buffer of one element.
    ///
    /// # Errors
    ///
    /// As [`Buffer::storage`].
    pub fn uniform(gpu: &Gpu, label: &str) -> Result<Self> {
        Self::new(gpu, label, 1, wgpu::BufferUsages::UNIFORM)
    }

    fn new(gpu: &Gpu, label: &str, len: usize, usage: wgpu::BufferUsages) -> Result<Self> {
        let bytes = size_of::<T>() as u64 * len as u64;
        gpu.fits(bytes, label)?;
        let raw = gpu.device().create_buffer(&wgpu::BufferDescriptor {
            label: Some(label),
            // Bindings must not be empty, and copies are in words of 4 bytes.
            size: bytes.next_multiple_of(4).max(4),
            usage: usage | wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::COPY_SRC,
            mapped_at_creation: false,
        });
        gpu.check()?;
        Ok(Buffer { raw, len, of: PhantomData })
    }

    /// Writes elements at the start.
    pub fn write(&self, gpu: &Gpu, elements: &[T]) {
        assert!(elements.len() <= self.len, "a write within the buffer");
        write_bytes(gpu, &self.raw, bytemuck::cast_slice(elements));
    }

    /// The wgpu buffer.
    pub(crate) fn raw(&self) -> &wgpu::Buffer {
        &self.raw
    }

    /// Size of its elements, bytes.
    pub fn bytes(&self) -> u64 {
        size_of::<T>() as u64 * self.len as u64
    }
}

/// Writes bytes, padded to words of 4.
fn write_bytes(gpu: &Gpu, raw: &wgpu::Buffer, bytes: &[u8]) {
    let (words, rest) = bytes.split_at(bytes.len() / 4 * 4);
    gpu.queue().write_buffer(raw, 0, words);
    if !rest.is_empty() {
        let mut word = [0; 4];
        word[..rest.len()].copy_from_slice(rest);
        gpu.queue().write_buffer(raw, words.len() as u64, &word);
    }
}

impl<T: Pod> Read for Buffer<T> {
    fn bytes(&self) -> u64 {
        Buffer::bytes(self)
    }

    fn raw(&self) -> &wgpu::Buffer {
        Buffer::raw(self)
    }
}

impl<T> Bind for Buffer<T> {
    fn binding(&self) -> wgpu::BindingResource<'_> {
        let bytes = (size_of::<T>() as u64 * self.len as u64).next_multiple_of(4);
        wgpu::BindingResource::Buffer(wgpu::BufferBinding {
            buffer: &self.raw,
            offset: 0,
            size: NonZeroU64::new(bytes.max(4)),
        })
    }
}

/// A storage buffer that is replaced by one half as large again when its elements do not fit:
/// thousands of meshes one after the other need a few allocations.
#[derive(Debug)]
pub struct Growable<T> {
    label: &'static str,
    capacity: usize,
    buffer: Buffer<T>,
}

impl<T: Pod> Growable<T> {
    /// An empty one.
    ///
    /// # Errors
    ///
    /// As [`Buffer::storage`].
    pub fn new(gpu: &Gpu, label: &'static str) -> Result<Self> {
        Ok(Growable { label, capacity: 0, buffer: Buffer::storage(gpu, label, 0)? })
    }

    /// Sets the length; the contents are lost if the buffer grows.
    ///
    /// # Errors
    ///
    /// As [`Buffer::storage`].
    pub fn resize(&mut self, gpu: &Gpu, len: usize) -> Result<()> {
        if len > self.capacity {
            let capacity = len + len / 2;
            // Near the limit of a binding the reserve is left out.
            let bytes = size_of::<T>() as u64 * capacity as u64;
            let capacity = if gpu.fits(bytes, self.label).is_ok() { capacity } else { len };
            self.buffer = Buffer::storage(gpu, self.label, capacity)?;
            self.capacity = capacity;
        }
        self.buffer.len = len;
        Ok(())
    }

    /// Replaces the contents.
    ///
    /// # Errors
    ///
    /// As [`Buffer::storage`].
    pub fn set(&mut self, gpu: &Gpu, elements: &[T]) -> Result<()> {
        self.resize(gpu, elements.len())?;
        self.buffer.write(gpu, elements);
        Ok(())
    }

    /// The buffer as long as its contents.
    pub fn buffer(&self) -> &Buffer<T> {
        &self.buffer
    }
}
