//! What the decoder of TIFF returns: samples, and errors in one line.

use std::io::{self, Read, Seek, SeekFrom};

use ::tiff::TiffError;
use ::tiff::decoder::{Decoder, DecodingResult};
use ::tiff::tags::Tag;

use crate::volume::data_error::invalid;
use crate::volume::decode::exact_f64;
use crate::volume::samples::Samples;
use crate::volume::text::shortened;

/// The value of the tag Compression.
const LZW: u16 = 5;

/// The samples of a page, with types that `Samples` does not have widened.
pub(super) fn samples_of(decoded: DecodingResult) -> io::Result<Samples> {
    Ok(match decoded {
        DecodingResult::U8(v) => Samples::U8(v),
        DecodingResult::I8(v) => Samples::I8(v),
        DecodingResult::U16(v) => Samples::U16(v),
        DecodingResult::I16(v) => Samples::I16(v),
        DecodingResult::U32(v) => Samples::U32(v),
        DecodingResult::I32(v) => Samples::I32(v),
        DecodingResult::F16(v) => Samples::F32(v.into_iter().map(|v| v.to_f32()).collect()),
        DecodingResult::F32(v) => Samples::F32(v),
        DecodingResult::F64(v) => Samples::F64(v),
        DecodingResult::U64(v) => {
            Samples::F64(v.into_iter().map(|v| exact_f64(v.into())).collect::<io::Result<_>>()?)
        }
        DecodingResult::I64(v) => {
            Samples::F64(v.into_iter().map(|v| exact_f64(v.into())).collect::<io::Result<_>>()?)
        }
    })
}

/// The error of the decoder in one line.
pub(super) fn wrong(e: TiffError) -> io::Error {
    match e {
        TiffError::IoError(e) if e.kind() != io::ErrorKind::UnexpectedEof => e,
        TiffError::IoError(_) => invalid("the file ends inside a page"),
        other => {
            let text: String = other.to_string().chars().filter(|c| !c.is_control()).collect();
            invalid(format!("unsupported or damaged TIFF: {}", shortened(&text)))
        }
    }
}

/// The error of decoding a page in one line; a compression that only files before TIFF 6.0 have is named.
pub(super) fn explained<R: Read + Seek>(decoder: &mut Decoder<R>, error: TiffError) -> io::Error {
    if has_old_lzw(decoder).unwrap_or(false) {
        return invalid(
            "LZW with the lowest bit first, as before TIFF 6.0, expected the highest first",
        );
    }
    wrong(error)
}

/// Whether the codes of LZW have the lowest bit first: the first code, 256 in nine bits, begins with a byte of zeros.
fn has_old_lzw<R: Read + Seek>(decoder: &mut Decoder<R>) -> io::Result<bool> {
    let compression: Option<u16> = decoder.find_tag_unsigned(Tag::Compression).map_err(wrong)?;
    let mut offsets = None;
    for tag in [Tag::StripOffsets, Tag::TileOffsets] {
        let found: Option<Vec<u64>> = decoder.find_tag_unsigned_vec(tag).map_err(wrong)?;
        offsets = offsets.or(found);
    }
    let (Some(LZW), Some(&[first, ..])) = (compression, offsets.as_deref()) else {
        return Ok(false);
    };
    let (reader, mut bytes) = (decoder.inner(), [0; 2]);
    reader.seek(SeekFrom::Start(first))?;
    reader.read_exact(&mut bytes)?;
    Ok(bytes[0] == 0 && bytes[1] & 1 == 1)
}
