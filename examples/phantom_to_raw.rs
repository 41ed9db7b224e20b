//! Writes a built-in volume as a RAW file for other programs: `phantom_to_raw NAME[:size] FOLDER`.
//!
//! The file is named `NAME_XxYxZ_TYPE.raw` and holds little-endian samples, x fastest.

use std::path::Path;

use isospectrum::volume::{Samples, phantom::phantom};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().collect();
    let [_, name, folder] = arguments.as_slice() else {
        return Err("usage: phantom_to_raw NAME[:size] FOLDER".into());
    };
    let volume = phantom(name)?;
    let bytes: Vec<u8> = match volume.samples() {
        Samples::U8(s) => s.clone(),
        Samples::F32(s) => s.iter().flat_map(|v| v.to_le_bytes()).collect(),
        other => {
            return Err(format!("{} samples, expected uint8 or float32", other.type_name()).into());
        }
    };
    let [x, y, z] = volume.dims();
    let stem = name.split(':').next().unwrap_or(name);
    let file = format!("{stem}_{x}x{y}x{z}_{}.raw", volume.samples().type_name());
    let path = Path::new(folder).join(file);
    std::fs::write(&path, bytes)?;
    println!("{}", path.display());
    Ok(())
}
