//! The GPU: a device, typed buffers, kernels bound by position, and readback.
//!
//! Only wgpu's Vulkan, Metal and DirectX 12 back ends are used: its defaults silently fall back to
//! OpenGL where no Vulkan driver is installed. The WGSL text is the only declaration of a
//! kernel's bindings; the host binds buffers in their order.

mod buffer;
mod device;
mod kernel;
pub mod layout;
pub mod shader;

pub use buffer::{Buffer, Growable};
pub use device::Gpu;
pub(crate) use device::Read;
pub use kernel::{Bind, Bindings, Kernel, MAX_WORKGROUPS, WORKGROUP_SIZE};
