//! The device: adapter, queue, submission, readback.
//!
//! wgpu reports most errors to a callback. They are kept and returned as [`Error::Gpu`] at the next readback or allocation, so
//! that a lost device or full memory never panics.

use crate::caught_panic::catch;
use crate::error::{Error, Result};
use std::sync::{Arc, Mutex, PoisonError, mpsc};
use std::time::Duration;

/// Kernels take milliseconds; a device that does not answer within this time is lost.
const DEVICE_TIMEOUT: Duration = Duration::from_secs(120);

/// The back ends with compute kernels on the supported systems.
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
    /// [`Error::Gpu`] if there is none; the message names what to install, or the adapters found.
    pub fn new(adapter: Option<&str>) -> Result<Gpu> {
        // wgpu panics where a driver lacks memory.
        let opened = catch(|| Gpu::open(adapter));
        opened.unwrap_or_else(|| {
            Err(Error::Gpu("the driver failed to open a device, perhaps for lack of memory".into()))
        })
    }

    fn open(adapter: Option<&str>) -> Result<Gpu> {
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
            // The highest limits of the adapter: the size of a storage binding limits the volume.
            required_limits: adapter.limits(),
            ..Default::default()
        };
        let (device, queue) = pollster::block_on(adapter.request_device(&descriptor))
            .map_err(|e| Error::Gpu(format!("{}: no device: {e}", info.name)))?;
        let failure = Arc::new(Mutex::new(None));
        let kept = failure.clone();
        device
            .on_uncaptured_error(Arc::new(move |e: wgpu::Error| keep_first(&kept, e.to_string())));
        let kept = failure.clone();
        device.set_device_lost_callback(move |reason, text| {
            // Dropping the device is not a failure.
            if reason != wgpu::DeviceLostReason::Destroyed {
                keep_first(&kept, format!("device lost: {text}"));
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

    /// The adapter's name and its API: `llvmpipe (vulkan)`.
    pub fn name(&self) -> String {
        format!("{} ({})", self.info.name, self.info.backend)
    }

    /// Whether the adapter is a software one, on the CPU.
    pub fn is_software(&self) -> bool {
        self.info.device_type == wgpu::DeviceType::Cpu
    }

    /// The instance, from which a window creates its surface.
    #[cfg(feature = "viewer")]
    pub(crate) fn instance(&self) -> &wgpu::Instance {
        &self.instance
    }

    /// The adapter, for a window.
    #[cfg(feature = "viewer")]
    pub(crate) fn adapter(&self) -> &wgpu::Adapter {
        &self.adapter
    }

    /// The wgpu device.
    pub(crate) fn device(&self) -> &wgpu::Device {
        &self.device
    }

    /// The wgpu queue.
    pub(crate) fn queue(&self) -> &wgpu::Queue {
        &self.queue
    }

    /// Checks that a storage buffer of `bytes` bytes can be bound.
    ///
    /// # Errors
    ///
    /// [`Error::Gpu`] with `what`, its size and the limit if not.
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

    /// Destroys the device, as a driver fault does; for tests.
    #[doc(hidden)]
    pub fn lose(&self) {
        self.device.destroy();
    }

    /// Waits until all submitted work is done; for benches.
    #[doc(hidden)]
    pub fn wait(&self) -> Result<()> {
        let waited = self.device.poll(wgpu::PollType::wait_indefinitely());
        waited.map(drop).map_err(|error| Error::Gpu(error.to_string()))
    }

    /// Reports the first error since the device was created.
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

    /// A new command encoder.
    pub(crate) fn encoder(&self, label: &str) -> wgpu::CommandEncoder {
        self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some(label) })
    }

    /// Submits commands without waiting.
    pub(crate) fn submit(&self, encoder: wgpu::CommandEncoder) {
        self.queue.submit([encoder.finish()]);
    }

    /// Submits commands, waits, and calls `take` with the number and the bytes of each buffer that is not empty.
    ///
    /// # Errors
    ///
    /// [`Error::Gpu`] if the device is lost, out of memory or does not answer.
    pub(crate) fn read_each_after(
        &self,
        mut encoder: wgpu::CommandEncoder,
        buffers: &[&dyn Read],
        take: &mut dyn FnMut(usize, &[u8]),
    ) -> Result<()> {
        let mut ranges = Vec::with_capacity(buffers.len());
        let mut bytes = 0;
        for buffer in buffers {
            ranges.push(bytes..bytes + buffer.bytes());
            bytes = (bytes + buffer.bytes()).next_multiple_of(wgpu::MAP_ALIGNMENT);
        }
        if bytes == 0 {
            self.submit(encoder);
            return Ok(());
        }
        let staging = self.take_staging(bytes);
        for (buffer, range) in buffers.iter().zip(&ranges).filter(|(b, _)| b.bytes() > 0) {
            encoder.copy_buffer_to_buffer(buffer.raw(), 0, &staging, range.start, buffer.bytes());
        }
        let submission = self.queue.submit([encoder.finish()]);
        let (sender, receiver) = mpsc::channel();
        staging.map_async(wgpu::MapMode::Read, 0..bytes, move |result| {
            // The receiver is dropped only after a timeout, which is an error of its own.
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
        for (i, range) in ranges.into_iter().enumerate().filter(|(_, r)| !r.is_empty()) {
            take(i, &view[range.start as usize..range.end as usize]);
        }
        drop(view);
        staging.unmap();
        self.staging.lock().unwrap_or_else(PoisonError::into_inner).push(staging);
        Ok(())
    }

    /// A staging buffer of at least `bytes` bytes, from the pool if possible.
    fn take_staging(&self, bytes: u64) -> wgpu::Buffer {
        let mut pool = self.staging.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(i) = pool.iter().position(|b| b.size() >= bytes) {
            return pool.swap_remove(i);
        }
        // A new one replaces one that is too small, so the pool has no more buffers than threads read at once.
        pool.pop();
        self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("staging"),
            size: bytes.next_power_of_two(),
            usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
            mapped_at_creation: false,
        })
    }

    fn failed(&self, error: &dyn std::error::Error) -> Error {
        // The error that the callback has kept is the cause of the timeout or the failed mapping.
        match self.check() {
            Err(first) => first,
            Ok(()) => Error::Gpu(format!("{}: {}", self.info.name, one_line(&error.to_string()))),
        }
    }
}

/// A buffer that can be read back.
pub(crate) trait Read {
    /// Size of its contents, bytes.
    fn bytes(&self) -> u64;
    /// The wgpu buffer, which begins with the contents.
    fn raw(&self) -> &wgpu::Buffer;
}

/// Keeps the first failure; later ones are consequences.
fn keep_first(failure: &Mutex<Option<String>>, text: String) {
    failure.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(text);
}

/// Joins the lines of a wgpu error.
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
