//! NumPy's `.npz`: a ZIP of `.npy` files, stored (`numpy.savez`) or deflated (`numpy.savez_compressed`), each by its name.
//!
//! Source: `numpy/lib/npyio.py`, and APPNOTE.TXT of PKWARE for ZIP, which crate `zip` reads. Sizes in a ZIP may be wrong:
//! memory grows while samples are read, and the checksum of each array is verified.

use std::fs::File;
use std::io::{self, BufReader, Read as _};

use zip::{CompressionMethod, ZipArchive};

use super::data_error::invalid;
use super::npy;
use super::read_options::ReadOptions;
use super::samples::SampleGrid;
use super::select::by_name;
use super::stream::DEFLATE_RATIO;

/// Reads an array of a `.npz` file: the only one, or the one named in the options.
///
/// # Errors
///
/// `InvalidData` for damaged ones, if an array must be chosen, and as for a `.npy` file.
pub(super) fn read(file: File, length: u64, options: &ReadOptions) -> io::Result<SampleGrid> {
    let damaged = |e: zip::result::ZipError| invalid(format!("damaged ZIP: {e}"));
    let mut zip = ZipArchive::new(BufReader::new(file)).map_err(damaged)?;
    let files: Vec<(usize, String)> = (0..zip.len())
        .filter_map(|i| Some((i, zip.name_for_index(i)?.ok()?.strip_suffix(".npy")?.to_owned())))
        .collect();
    if files.is_empty() {
        return Err(invalid("no array, expected at least one"));
    }
    let names: Vec<&str> = files.iter().map(|(_, name)| name.as_str()).collect();
    let chosen = by_name(&names, options.array.as_deref(), None)?;
    let mut entry = zip.by_index(files[chosen].0).map_err(damaged)?;
    let (size, compressed) = (entry.size(), entry.compressed_size().min(length));
    let ratio = match entry.compression() {
        CompressionMethod::Stored => 1,
        _ => DEFLATE_RATIO,
    };
    if size > compressed.saturating_mul(ratio) {
        return Err(invalid(format!(
            "{compressed} bytes, too few for the {size} bytes of an array"
        )));
    }
    let of_array = |e: io::Error| match e.kind() {
        io::ErrorKind::UnexpectedEof => invalid("the array ends early"),
        _ => e,
    };
    let grid = npy::read_array(&mut entry, size, ratio).map_err(of_array)?;
    // Reading past the end verifies the checksum.
    if entry.read(&mut [0]).map_err(of_array)? != 0 {
        return Err(invalid(format!("more than the {size} bytes of the array")));
    }
    Ok(grid)
}
