//! Shaders, kernels and pictures on the GPU. Needs an adapter; a software adapter is enough.

#[path = "../common/mod.rs"]
mod common;

mod device_lost;
mod kernels;
mod render;
mod shaders;
mod sweep;
