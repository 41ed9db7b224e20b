//! A mask as a spectrum stores it: a compressed bit per sample.

use std::io::{Read as _, Write as _};

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD as BASE64;
use flate2::Compression;
use flate2::bufread::ZlibDecoder;
use flate2::write::ZlibEncoder;
use serde::{Deserialize, Serialize};

use super::Mask;
use super::apply::check_dims;
use crate::error::{Error, Result};
use crate::volume::grid::Volume;
use crate::volume::stream::DEFLATE_RATIO;

/// Most bytes of base64 that a mask may take in a spectrum, whose metadata has room for a MiB.
const MAX_RECORD_BYTES: usize = 768 << 10;

/// A mask as a spectrum stores it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MaskRecord {
    /// The file's name.
    pub name: String,
    /// Samples along x, y, z.
    pub dims: [usize; 3],
    /// Number of samples inside.
    pub inside: usize,
    /// A bit per sample, x fastest, the lowest bit of a byte first; each byte exclusive or the one a plane of whole bytes
    /// before; zlib, base64.
    bits: String,
}

impl Mask {
    /// The mask as a spectrum stores it.
    ///
    /// # Errors
    ///
    /// [`Error::Input`] if it is larger than the metadata of a spectrum may be.
    pub fn record(&self) -> Result<MaskRecord> {
        let mut bytes: Vec<u8> = self.inside.chunks(8).map(byte_of).collect();
        let plane = (self.dims[0] * self.dims[1] / 8).max(1);
        for i in (plane..bytes.len()).rev() {
            bytes[i] ^= bytes[i - plane];
        }
        let mut encoder = ZlibEncoder::new(Vec::new(), Compression::best());
        let packed = encoder.write_all(&bytes).and_then(|()| encoder.finish());
        let bits = BASE64.encode(packed.map_err(|e| Error::internal(e.to_string()))?);
        if bits.len() > MAX_RECORD_BYTES {
            return Err(Error::input(format!(
                "{}: the mask takes {} bytes in the spectrum, expected at most {MAX_RECORD_BYTES}; use a smoother one, or a part (--crop)",
                self.name,
                bits.len()
            )));
        }
        Ok(MaskRecord { name: self.name.clone(), dims: self.dims, inside: self.n_inside(), bits })
    }
}

impl MaskRecord {
    /// The mask for a volume.
    ///
    /// # Errors
    ///
    /// [`Error::Input`] if it is damaged, or has other dimensions.
    pub fn mask(&self, volume: &Volume) -> Result<Mask> {
        check_dims(&self.name, self.dims, volume)?;
        let damaged = || Error::input(format!("the record of mask {} is damaged", self.name));
        let n: usize = self.dims.iter().product();
        let packed = BASE64.decode(&self.bits).map_err(|_| damaged())?;
        let n_bytes = n.div_ceil(8);
        if n_bytes as u64 > packed.len() as u64 * DEFLATE_RATIO {
            return Err(damaged());
        }
        let mut bytes = Vec::new();
        let decoder = ZlibDecoder::new(&packed[..]);
        decoder.take(n_bytes as u64 + 1).read_to_end(&mut bytes).map_err(|_| damaged())?;
        if bytes.len() != n_bytes {
            return Err(damaged());
        }
        let plane = (self.dims[0] * self.dims[1] / 8).max(1);
        for i in plane..bytes.len() {
            bytes[i] ^= bytes[i - plane];
        }
        let inside = (0..n).map(|i| bytes[i / 8] >> (i % 8) & 1 == 1).collect();
        let mask = Mask { name: self.name.clone(), dims: self.dims, inside };
        if mask.n_inside() == self.inside { Ok(mask) } else { Err(damaged()) }
    }
}

/// Eight bits, the first the lowest.
fn byte_of(bits: &[bool]) -> u8 {
    bits.iter().rev().fold(0, |byte, &bit| byte << 1 | u8::from(bit))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::volume::{Placement, Samples};

    fn volume(dims: [usize; 3], samples: Vec<u8>) -> Volume {
        Volume::new("v", dims, Samples::U8(samples), Placement::default()).expect("a volume")
    }

    #[test]
    fn a_record_is_the_mask() {
        let dims = [7, 5, 6];
        let bits = |i: usize| u8::from(i.wrapping_mul(2_654_435_761) >> 7 & 3 == 0);
        let given = volume(dims, (0..210).map(bits).collect());
        let mask = Mask::of(&given);
        let record = mask.record().expect("small");
        assert_eq!(record.mask(&given).expect("its own"), mask);
        let json = serde_json::to_string(&record).expect("JSON");
        assert_eq!(serde_json::from_str::<MaskRecord>(&json).expect("JSON"), record);
        // Damaged ones are errors.
        for wrong in [
            MaskRecord { inside: record.inside + 1, ..record.clone() },
            MaskRecord { bits: record.bits[4..].to_owned(), ..record.clone() },
            MaskRecord { bits: "?".to_owned(), ..record.clone() },
            MaskRecord { dims: [7, 5, 7], ..record.clone() },
        ] {
            assert!(matches!(wrong.mask(&given), Err(Error::Input(_))), "{wrong:?}");
        }
    }
}
