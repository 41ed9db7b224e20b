//! What runs on the GPU: shaders, kernels, pictures. Needs an adapter; a software one does.

#[path = "../common/mod.rs"]
mod common;

mod device_lost;
mod kernels;
mod render;
mod shaders;
mod sweep;
