//! The device that kernels run on: chosen once, then shared by all threads.

use super::cpu::CpuKernels;
use super::gpu::{DeviceField, GpuKernels, Pipelines};
use super::interface::{Advance, Advanced, DeviceWork, Kernels};
use crate::error::Result;
use crate::field::Field;
use crate::gpu::Gpu;
use crate::mesh::Connectivity;
use std::sync::{Arc, Mutex, PoisonError, Weak};

/// Meshes with fewer vertices run on the CPU whatever the backend.
///
/// Loading, projecting, relaxing four times and reading back takes 4 ms on the device however small
/// the mesh is, as long as 450 vertices take on one core (bench `small`, software adapter, both under the
/// same load). With twice as many, a device twice as fast as a core begins to gain.
pub const MIN_GPU_VERTICES: usize = 1024;

/// The backend to use.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum Choice {
    /// A GPU if there is one, else the CPU. Software adapters do not count: they took 3 to 7
    /// times as long as the CPU kernels (bench `kernels`).
    #[default]
    Auto,
    /// A GPU; an error where there is none.
    Gpu,
    /// The CPU.
    Cpu,
}

/// The device on which the stages of a sweep run that work on all vertices at once. Shared by threads.
///
/// ```
/// use isospectrum::{Backend, Choice};
///
/// assert_eq!(Backend::choose(Choice::Cpu, None)?.name(), "cpu");
/// # Ok::<(), isospectrum::Error>(())
/// ```
#[derive(Debug)]
pub struct Backend {
    pipelines: Option<Arc<Pipelines>>,
    /// Whether the CPU may serve a field that does not fit the device.
    may_fall_back: bool,
    /// The most recent field on the device: threads that work on one field share it.
    latest: Mutex<Weak<DeviceField>>,
}

impl Backend {
    /// Opens a backend; `adapter` is a part of the adapter's name.
    ///
    /// # Errors
    ///
    /// [`crate::Error::Gpu`] if a GPU is required, by choice or by name, and there is none; the message
    /// names what to install.
    pub fn choose(choice: Choice, adapter: Option<&str>) -> Result<Backend> {
        let open = || Pipelines::new(Arc::new(Gpu::new(adapter)?));
        let pipelines = match choice {
            Choice::Cpu => None,
            Choice::Gpu => Some(open()?),
            Choice::Auto if adapter.is_some() => Some(open()?),
            Choice::Auto => match open() {
                Ok(pipelines) if pipelines.gpu().is_software() => {
                    let name = pipelines.gpu().name();
                    log::info!("{name} is a software adapter, slower than the CPU kernels");
                    None
                }
                Ok(pipelines) => Some(pipelines),
                Err(e) => {
                    log::info!("kernels run on the CPU: {e}");
                    None
                }
            },
        };
        let backend = Backend {
            pipelines: pipelines.map(Arc::new),
            may_fall_back: choice == Choice::Auto,
            latest: Mutex::default(),
        };
        log::info!("kernels run on {}", backend.name());
        Ok(backend)
    }

    /// `cpu`, or the adapter's name and its API: `llvmpipe (vulkan)`.
    pub fn name(&self) -> String {
        match &self.pipelines {
            None => "cpu".into(),
            Some(pipelines) => pipelines.gpu().name(),
        }
    }

    /// The GPU that kernels run on; `None` on the CPU.
    pub fn gpu(&self) -> Option<&Gpu> {
        self.pipelines.as_deref().map(Pipelines::gpu)
    }

    /// Kernels over a field, one set for each thread. The field is copied to the device once and stays there
    /// while kernels over it exist.
    ///
    /// # Errors
    ///
    /// [`crate::Error::Gpu`] if the samples do not fit the device and a GPU is required.
    pub fn kernels(&self, field: &Arc<Field>) -> Result<Box<dyn Kernels + Send>> {
        let cpu = CpuKernels::new(field.clone());
        let Some(pipelines) = &self.pipelines else { return Ok(Box::new(cpu)) };
        match self.device_field(pipelines, field) {
            Ok(device_field) => {
                let gpu = GpuKernels::new(pipelines.clone(), device_field)?;
                Ok(Box::new(BySize { cpu, gpu, on_gpu: false }))
            }
            Err(e) if self.may_fall_back => {
                log::warn!("kernels run on the CPU: {e}");
                Ok(Box::new(cpu))
            }
            Err(e) => Err(e),
        }
    }

    fn device_field(&self, pipelines: &Pipelines, field: &Arc<Field>) -> Result<Arc<DeviceField>> {
        let mut latest = self.latest.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(known) = latest.upgrade().filter(|known| known.is_of(field)) {
            return Ok(known);
        }
        let device_field = Arc::new(DeviceField::new(pipelines.gpu(), field.clone())?);
        *latest = Arc::downgrade(&device_field);
        Ok(device_field)
    }
}

/// Large meshes on the GPU, small ones on the CPU.
struct BySize {
    cpu: CpuKernels,
    gpu: GpuKernels,
    on_gpu: bool,
}

impl BySize {
    fn active(&mut self) -> &mut dyn Kernels {
        if self.on_gpu { &mut self.gpu } else { &mut self.cpu }
    }
}

impl Kernels for BySize {
    fn load(&mut self, connectivity: &Connectivity, positions: &[[f32; 3]]) -> Result<()> {
        self.on_gpu = positions.len() >= MIN_GPU_VERTICES;
        self.active().load(connectivity, positions)
    }

    fn advance(&mut self, advance: &Advance) -> Result<Advanced> {
        self.active().advance(advance)
    }

    fn deviation(&mut self, isovalue: f64, reach: f32) -> Result<Vec<f32>> {
        self.active().deviation(isovalue, reach)
    }

    fn device_work(&self) -> DeviceWork {
        self.gpu.device_work()
    }
}
