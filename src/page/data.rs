//! The spectrum as a page holds it: rounded, compressed, in letters.
//!
//! One deflate stream of sections, each a length (u64) and that many bytes: `INFO`, `ISOV`, `VERT`,
//! `TRIA` and `POSN` as FORMAT.md describes them, but positions count steps of the page, and [`ALONG`] steps
//! along the surface. Which axis each vertex faces that is no lattice vertex stands before the columns of first
//! knots; all columns begin with the coordinate along it and go on with the next axes in the order x, y, z, x.

use std::io::Write as _;

use flate2::Compression;
use flate2::write::DeflateEncoder;

use crate::error::Result;
use crate::file::{Units, parts};
use crate::spectrum::Spectrum;

/// Positions are rounded to multiples of this many voxels unless asked otherwise: a fifth of the
/// usual tolerance of 0.1 voxel, and a tenth of a pixel where a voxel is six pixels wide.
pub const DEFAULT_STEP: f64 = 1.0 / 40.0;

/// Coordinates along the surface are rounded to so many steps: a vertex that lies a thirtieth of a voxel beside
/// its place on the surface leaves the surface as it is.
pub(super) const ALONG: i64 = 4;

/// The raw deflate stream of a spectrum whose positions count steps of `step` voxels.
pub(super) fn compressed(spectrum: &Spectrum, step: f64) -> Result<Vec<u8>> {
    let units = Units { per_voxel: 1.0 / step, along: ALONG };
    let (_, sections) = parts(&units.rounded(spectrum)?, units)?;
    let mut bytes = Vec::new();
    sections.iter().for_each(|section| append(&mut bytes, section));
    let mut encoder = DeflateEncoder::new(Vec::new(), Compression::best());
    let done = encoder.write_all(&bytes);
    Ok(done.and_then(|()| encoder.finish()).expect("memory takes every byte"))
}

fn append(bytes: &mut Vec<u8>, section: &[u8]) {
    bytes.extend((section.len() as u64).to_le_bytes());
    bytes.extend(section);
}

/// Bytes in base64 (RFC 4648) with padding.
pub(super) fn base64(bytes: &[u8]) -> String {
    const LETTERS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for chunk in bytes.chunks(3) {
        let byte = |i: usize| u32::from(chunk.get(i).copied().unwrap_or(0));
        let bits = byte(0) << 16 | byte(1) << 8 | byte(2);
        for i in 0..4 {
            let letter = LETTERS[(bits >> (18 - 6 * i)) as usize & 63];
            text.push(if i <= chunk.len() { char::from(letter) } else { '=' });
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_is_that_of_the_rfc() {
        for (bytes, text) in
            [("", ""), ("f", "Zg=="), ("fo", "Zm8="), ("foo", "Zm9v"), ("foobar", "Zm9vYmFy")]
        {
            assert_eq!(base64(bytes.as_bytes()), text);
        }
        assert_eq!(base64(&[0xfb, 0xff]), "+/8=");
    }
}
