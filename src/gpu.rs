//! The GPU: a device, typed buffers, kernels bound by position, and readback.
//!
//! wgpu's Vulkan, Metal and DirectX 12 back ends only: with its default back ends it falls back to
//! OpenGL in silence where no Vulkan driver is installed. The WGSL text is the only declaration of a
//! kernel's bindings; the host binds buffers in their order.
//!
//! # Errors
//!
//! wgpu reports most errors to a callback. They are kept here and returned as [`Error::Gpu`] at the
//! next readback or allocation, so a lost device or a full memory never panics.

pub mod buffer;
pub mod layout;
pub mod shader;

pub use buffer::{Buffer, Growable};

use crate::error::{Error, Result};
use bytemuck::Pod;
use shader::Shader;
use std::sync::{Arc, Mutex, PoisonError, mpsc};
use std::time::Duration;

/// Threads of a workgroup, as in `shaders/dispatch.wgsl`: 32 to 128 were equal, 256 slower.
pub const WORKGROUP_SIZE: u32 = 64;

/// Workgroups along one dimension at most (the limit of WebGPU).
pub const MAX_WORKGROUPS: u32 = 65535;

/// A kernel of a mesh takes milliseconds; a device silent for so long is lost.
const DEVICE_TIMEOUT: Duration = Duration::from_secs(120);

/// The back ends that have compute kernels on the systems we build for.
const BACKENDS: wgpu::Backends =
    wgpu::Backends::VULKAN.union(wgpu::Backends::METAL).union(wgpu::Backends::DX12);

/// A device and its queue. Shared by threads.
#[derive(Debug)]
pub struct Gpu {
    #[cfg(feature = "viewer")]
    instance: wgpu::Instance,
    #[cfg(feature = "viewer")]
    adapter: wgpu::Adapter,
    device: wgpu::Device,
    queue: wgpu::Queue,
    info: wgpu::AdapterInfo,
    failure: Arc<Mutex<Option<String>>>,
    staging: Mutex<Vec<wgpu::Buffer>>,
}

impl Gpu {
    /// The first adapter whose name contains `adapter` (any case), or the system's choice.
    ///
    /// # Errors
    ///
    /// [`Error::Gpu`] if there is none; the text says what to install or which there are.
    pub fn new(adapter: Option<&str>) -> Result<Gpu> {
        let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
        descriptor.backends = BACKENDS;
        let instance = wgpu::Instance::new(descriptor);
        let adapter = match adapter {
            Some(name) => named_adapter(&instance, name)?,
            None => {
                let options = wgpu::RequestAdapterOptions {
                    power_preference: wgpu::PowerPreference::HighPerformance,
                    ..Default::default()
                };
                pollster::block_on(instance.request_adapter(&options)).map_err(|_| none_found())?
            }
        };
        let info = adapter.get_info();
        let descriptor = wgpu::DeviceDescriptor {
            label: Some("isospectrum"),
            // All that the adapter has: the size of a storage binding limits the volume.
            required_limits: adapter.limits(),
            ..Default::default()
        };
        let (device, queue) = pollster::block_on(adapter.request_device(&descriptor))
            .map_err(|e| Error::Gpu(format!("{}: no device: {e}", info.name)))?;
        let failure = Arc::new(Mutex::new(None));
        let keep = failure.clone();
        device.on_uncaptured_error(Arc::new(move |e: wgpu::Error| note(&keep, e.to_string())));
        let keep = failure.clone();
        device.set_device_lost_callback(move |reason, text| {
            // Dropping the device is no loss.
            if reason != wgpu::DeviceLostReason::Destroyed {
                note(&keep, format!("device lost: {text}"));
            }
        });
        Ok(Gpu {
            #[cfg(feature = "viewer")]
            instance,
            #[cfg(feature = "viewer")]
            adapter,
            device,
            queue,
            info,
            failure,
            staging: Mutex::default(),
        })
    }

    /// The adapter's name and its back end: `llvmpipe (vulkan)`.
    pub fn name(&self) -> String {
        format!("{} ({})", self.info.name, self.info.backend)
    }

    /// Whether the adapter is a program on the CPU.
    pub fn is_software(&self) -> bool {
        self.info.device_type == wgpu::DeviceType::Cpu
    }

    /// The instance, which a window makes its surface with.
    #[cfg(feature = "viewer")]
    pub(crate) fn instance(&self) -> &wgpu::Instance {
        &self.instance
    }

    /// The adapter.
    #[cfg(feature = "viewer")]
    pub(crate) fn adapter(&self) -> &wgpu::Adapter {
        &self.adapter
    }

    /// The device.
    pub(crate) fn device(&self) -> &wgpu::Device {
        &self.device
    }

    /// Its queue.
    pub(crate) fn queue(&self) -> &wgpu::Queue {
        &self.queue
    }

    /// Whether a storage buffer of so many bytes can be bound.
    ///
    /// # Errors
    ///
    /// [`Error::Gpu`] with `what` and both sizes if not.
    pub fn fits(&self, bytes: u64, what: &str) -> Result<()> {
        let limits = self.device.limits();
        let allowed = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
        if bytes <= allowed {
            return Ok(());
        }
        Err(Error::Gpu(format!(
            "{what} of {} MiB on {}, expected at most {} MiB (--backend cpu has no limit)",
            bytes.div_ceil(1 << 20),
            self.info.name,
            allowed >> 20
        )))
    }

    /// Loses the device, as a fault of a driver does; for tests of what comes then.
    #[doc(hidden)]
    pub fn lose(&self) {
        self.device.destroy();
    }

    /// Waits until all that was asked for is done; for benches.
    #[doc(hidden)]
    pub fn wait(&self) -> Result<()> {
        let waited = self.device.poll(wgpu::PollType::wait_indefinitely());
        waited.map(drop).map_err(|error| Error::Gpu(error.to_string()))
    }

    /// The first error since the device was made.
    ///
    /// # Errors
    ///
    /// [`Error::Gpu`] with its text.
    pub fn check(&self) -> Result<()> {
        match &*self.failure.lock().unwrap_or_else(PoisonError::into_inner) {
            None => Ok(()),
            Some(text) => Err(Error::Gpu(format!("{}: {}", self.info.name, one_line(text)))),
        }
    }

    /// A fresh list of commands.
    pub(crate) fn encoder(&self, label: &str) -> wgpu::CommandEncoder {
        self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some(label) })
    }

    /// Submits commands that nobody waits for.
    pub(crate) fn submit(&self, encoder: wgpu::CommandEncoder) {
        self.queue.submit([encoder.finish()]);
    }

    /// Submits commands, then waits for and returns the contents of `buffer`.
    ///
    /// # Errors
    ///
    /// [`Error::Gpu`] if the device is lost, out of memory or silent.
    pub(crate) fn read_after<T: Pod>(
        &self,
        encoder: wgpu::CommandEncoder,
        buffer: &Buffer<T>,
    ) -> Result<Vec<T>> {
        let mut contents = Vec::new();
        self.read_each_after(encoder, &[buffer], &mut |_, bytes| {
            // The mapping has no alignment of its own, so the bytes are collected.
            contents = bytemuck::pod_collect_to_vec(bytes);
        })?;
        Ok(contents)
    }

    /// Submits commands, then waits for several buffers at once, and hands over the bytes of each that has some, with its
    /// number.
    ///
    /// # Errors
    ///
    /// As `Gpu::read_after`.
    pub(crate) fn read_each_after(
        &self,
        mut encoder: wgpu::CommandEncoder,
        buffers: &[&dyn Read],
        take: &mut dyn FnMut(usize, &[u8]),
    ) -> Result<()> {
        let mut places = Vec::with_capacity(buffers.len());
        let mut bytes = 0;
        for buffer in buffers {
            places.push(bytes..bytes + buffer.bytes());
            bytes = (bytes + buffer.bytes()).next_multiple_of(wgpu::MAP_ALIGNMENT);
        }
        if bytes == 0 {
            self.submit(encoder);
            return Ok(());
        }
        let staging = self.take_staging(bytes);
        for (buffer, place) in buffers.iter().zip(&places).filter(|(b, _)| b.bytes() > 0) {
            encoder.copy_buffer_to_buffer(buffer.raw(), 0, &staging, place.start, buffer.bytes());
        }
        let submission = self.queue.submit([encoder.finish()]);
        let (sender, receiver) = mpsc::channel();
        staging.map_async(wgpu::MapMode::Read, 0..bytes, move |result| {
            // The receiver is gone only after a timeout, which has been reported.
            let _ = sender.send(result);
        });
        let wait = wgpu::PollType::Wait {
            submission_index: Some(submission),
            timeout: Some(DEVICE_TIMEOUT),
        };
        self.device.poll(wait).map_err(|e| self.failed(&e))?;
        self.check()?;
        receiver
            .recv_timeout(DEVICE_TIMEOUT)
            .map_err(|e| self.failed(&e))?
            .map_err(|e| self.failed(&e))?;
        let view = staging.get_mapped_range(0..bytes).map_err(|e| self.failed(&e))?;
        for (i, place) in places.into_iter().enumerate().filter(|(_, p)| !p.is_empty()) {
            take(i, &view[place.start as usize..place.end as usize]);
        }
        drop(view);
        staging.unmap();
        self.staging.lock().unwrap_or_else(PoisonError::into_inner).push(staging);
        Ok(())
    }

    /// Waits for and returns the contents of `buffer`.
    ///
    /// # Errors
    ///
    /// As `Gpu::read_after`.
    pub fn read<T: Pod>(&self, buffer: &Buffer<T>) -> Result<Vec<T>> {
        self.read_after(self.encoder("read"), buffer)
    }

    /// A staging buffer of at least so many bytes, from the pool if it has one.
    fn take_staging(&self, bytes: u64) -> wgpu::Buffer {
        let mut pool = self.staging.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(i) = pool.iter().position(|b| b.size() >= bytes) {
            return pool.swap_remove(i);
        }
        // Too small ones are replaced, so the pool is never longer than the threads that read.
        pool.pop();
        self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("staging"),
            size: bytes.next_power_of_two(),
            usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
            mapped_at_creation: false,
        })
    }

    fn failed(&self, error: &dyn std::error::Error) -> Error {
        // The callback's text says more than the timeout or the failed mapping it led to.
        match self.check() {
            Err(first) => first,
            Ok(()) => Error::Gpu(format!("{}: {}", self.info.name, one_line(&error.to_string()))),
        }
    }
}

/// Keeps the first failure; those after it are its consequences.
fn note(failure: &Mutex<Option<String>>, text: String) {
    failure.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(text);
}

/// wgpu's errors run over several lines; ours have one.
fn one_line(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

fn none_found() -> Error {
    Error::Gpu(
        "no Vulkan, Metal or DirectX 12 adapter found: install a driver (Debian, Ubuntu: \
         mesa-vulkan-drivers, which has a software adapter too) or use --backend cpu"
            .into(),
    )
}

fn named_adapter(instance: &wgpu::Instance, name: &str) -> Result<wgpu::Adapter> {
    let adapters = pollster::block_on(instance.enumerate_adapters(BACKENDS));
    if adapters.is_empty() {
        return Err(none_found());
    }
    let names: Vec<String> = adapters.iter().map(|a| a.get_info().name).collect();
    let wanted = name.to_lowercase();
    adapters.into_iter().zip(&names).find(|(_, n)| n.to_lowercase().contains(&wanted)).map_or_else(
        || {
            Err(Error::Gpu(format!(
                "no adapter named '{name}', expected one of: {}",
                names.join(", ")
            )))
        },
        |(adapter, _)| Ok(adapter),
    )
}

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
    /// [`Error::Gpu`] if the device does not take it.
    pub fn new(gpu: &Gpu, shader: Shader) -> Result<Kernel> {
        let name = shader.name;
        let module = gpu.device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some(name),
            source: wgpu::ShaderSource::Wgsl(shader.text().into()),
        });
        let pipeline = gpu.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
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
        Bindings(gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
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

    /// Runs so many workgroups along x and y.
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

/// What can be read back.
pub(crate) trait Read {
    /// Its bytes.
    fn bytes(&self) -> u64;
    /// The buffer that begins with them.
    fn raw(&self) -> &wgpu::Buffer;
}

/// What can be bound to a kernel.
pub trait Bind {
    /// The range of a device buffer that the kernel sees.
    fn binding(&self) -> wgpu::BindingResource<'_>;
}
