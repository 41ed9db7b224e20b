//! The spectrum as a page holds it: rounded, compressed, in letters.
//!
//! One deflate stream of sections, each a length (u64) and that many bytes: `INFO`, `ISOV`, `VERT`,
//! `TRIA` and `POSN` as FORMAT.md describes them, but positions count steps of the page, and [`ALONG`] steps
//! along the surface. Which axis each vertex faces that is no lattice vertex stands before the columns of first
//! knots; all columns begin with the coordinate along it and go on with the next axes in the order x, y, z, x.

use std::io::Write as _;

use flate2::Compression;
use flate2::write::DeflateEncoder;

use super::field;
use crate::error::Result;
use crate::file::{Parts, Units};
use crate::spectrum::Spectrum;

/// Positions are rounded to multiples of this many voxels unless asked otherwise: a fifth of the
/// usual tolerance of 0.1 voxel, and a tenth of a pixel where a voxel is six pixels wide.
pub const DEFAULT_STEP: f64 = 1.0 / 40.0;

/// Coordinates along the surface are rounded to so many steps: a vertex that lies a thirtieth of a voxel beside
/// its place on the surface leaves the surface as it is.
pub(super) const ALONG: i64 = 4;

/// The raw deflate stream of a spectrum whose positions count steps of `step` voxels.
///
/// Behind the sections of the spectrum comes that of a second field (`field.rs`), of which `codes` has one for each knot.
pub(super) fn compressed(spectrum: &Spectrum, step: f64, codes: Option<&[u8]>) -> Result<Vec<u8>> {
    let units = Units::of_page(step, ALONG);
    let Parts { spectrum: arranged, order, sections } =
        Parts::new(units.rounded(spectrum)?, units)?;
    let mut bytes = Vec::new();
    sections.iter().for_each(|section| append(&mut bytes, section.bytes()));
    if let Some(codes) = codes {
        let of = |&v: &u32| {
            let [start, end] = [v, v + 1].map(|v| spectrum.first_knot()[v as usize] as usize);
            &codes[start..end]
        };
        let codes: Vec<u8> = order.iter().flat_map(of).copied().collect();
        append(&mut bytes, &field::section(&arranged, &codes));
    }
    let mut encoder = DeflateEncoder::new(Vec::new(), Compression::best());
    let done = encoder.write_all(&bytes);
    Ok(done.and_then(|()| encoder.finish()).expect("memory takes every byte"))
}

fn append(bytes: &mut Vec<u8>, section: &[u8]) {
    bytes.extend((section.len() as u64).to_le_bytes());
    bytes.extend(section);
}
