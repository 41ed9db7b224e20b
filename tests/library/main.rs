//! The library, through its public items and those of `inside`, on the processor.

#[path = "../common/mod.rs"]
mod common;

mod border;
mod bricks;
mod bricks_file;
mod components;
mod exports;
mod extraction;
mod few_values;
mod file_corruption;
mod file_format;
mod file_summary;
mod masks;
mod neighbours;
mod oracle;
mod ranges;
mod scenes;
mod simplify;
mod spectrum;
mod sweep;
mod topology;
mod verify;
mod volumes;
