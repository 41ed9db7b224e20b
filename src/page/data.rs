//! The spectrum as a page stores it: rounded and compressed.
//!
//! A raw deflate stream of sections, each a length (u64) and that many bytes: `INFO`, `ISOV`, `VERT`, `TRIA` and `POSN` as
//! FORMAT.md describes them, except that positions count steps of the page. `page/file.js` reads it.

use std::io::Write as _;

use flate2::Compression;
use flate2::write::DeflateEncoder;

use super::field;
use crate::error::Result;
use crate::file::{Parts, Units};
use crate::spectrum::Spectrum;

/// The default step of positions, voxels: a quarter of the default tolerance of 0.1 voxel, and a seventh of a pixel where a voxel is six
/// pixels wide.
pub const DEFAULT_STEP: f64 = 1.0 / 40.0;

/// Compresses a spectrum whose positions are rounded to steps of `step` voxels. `codes` are those of a second field, one per knot;
/// their section (`field`) comes last.
pub(super) fn compressed(spectrum: &Spectrum, step: f64, codes: Option<&[u8]>) -> Result<Vec<u8>> {
    let units = Units::of_page(step);
    let Parts { spectrum: arranged, order, sections } =
        Parts::new(units.rounded(spectrum)?, units)?;
    let mut bytes = Vec::new();
    sections.iter().for_each(|section| push_section(&mut bytes, section.bytes()));
    if let Some(codes) = codes {
        let codes_of = |&v: &u32| {
            let [start, end] = [v, v + 1].map(|v| spectrum.first_knot()[v as usize] as usize);
            &codes[start..end]
        };
        let codes: Vec<u8> = order.iter().flat_map(codes_of).copied().collect();
        push_section(&mut bytes, &field::section(&arranged, &codes));
    }
    let mut encoder = DeflateEncoder::new(Vec::new(), Compression::best());
    let done = encoder.write_all(&bytes);
    Ok(done.and_then(|()| encoder.finish()).expect("writing to memory succeeds"))
}

fn push_section(bytes: &mut Vec<u8>, section: &[u8]) {
    bytes.extend((section.len() as u64).to_le_bytes());
    bytes.extend(section);
}
