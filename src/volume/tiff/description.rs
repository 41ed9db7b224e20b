//! The description of a TIFF file's first page: OME-XML, the lines of ImageJ, or anything.

use std::io;

use super::described::Described;
use super::{imagej, ome};

/// Reads a description.
///
/// # Errors
///
/// `InvalidData` for damaged OME-XML.
pub(super) fn read(bytes: &[u8]) -> io::Result<Described> {
    let text = text(bytes);
    if text.starts_with("ImageJ=") {
        return Ok(imagej::read(&text));
    }
    if text.contains("<OME") { ome::read(&text) } else { Ok(Described::default()) }
}

/// The text of a description, which ends at the first zero: UTF-8, or else Latin-1, in which Java programs write a micro sign.
fn text(bytes: &[u8]) -> String {
    let end = bytes.iter().position(|&b| b == 0).unwrap_or(bytes.len());
    let bytes = &bytes[..end];
    match std::str::from_utf8(bytes) {
        Ok(text) => text.to_owned(),
        Err(_) => bytes.iter().map(|&b| char::from(b)).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ome(attributes: &str, inside: &str) -> Described {
        let text = format!(
            "<OME {attributes}><Image><Pixels DimensionOrder=\"XYZCT\" SizeZ=\"2\" SizeC=\"1\" SizeT=\"1\">{inside}</Pixels></Image></OME>"
        );
        read(text.as_bytes()).expect("OME-XML")
    }

    fn pages(described: &Described, n: usize) -> io::Result<Vec<usize>> {
        let planes = described.planes((0..n).collect(), n, 1)?;
        (0..2).map(|z| planes.page(0, z, 0)).collect()
    }

    #[test]
    fn planes_of_ome_are_in_the_pages_of_their_elements_in_this_file() {
        let own = "<UUID FileName=\"a\">urn:uuid:1</UUID>";
        let other = own.replace(":1", ":2");
        let element = |at: &str, uuid: &str| format!("<TiffData {at}>{uuid}</TiffData>");
        let all = element("IFD=\"1\" FirstZ=\"0\"", own) + &element("IFD=\"0\" FirstZ=\"1\"", own);
        for uuid in ["UUID=\"urn:uuid:1\"", ""] {
            assert_eq!(pages(&ome(uuid, &all), 2).expect("all are here"), [1, 0], "{uuid}");
        }
        let some =
            element("IFD=\"0\" FirstZ=\"0\"", own) + &element("IFD=\"0\" FirstZ=\"1\"", &other);
        let message = pages(&ome("", &some), 1).expect_err("a page elsewhere").to_string();
        assert!(message.contains("slice 1") && message.contains("in other files"), "{message}");
        for bare in ["", "<TiffData/>"] {
            assert_eq!(pages(&ome("", bare), 2).expect("two pages"), [0, 1]);
            let message = pages(&ome("", bare), 3).expect_err("three pages").to_string();
            assert!(message.contains("3 pages"), "{message}");
        }
        let counted = ome("", "<TiffData IFD=\"1\" PlaneCount=\"2\"/>");
        assert_eq!(pages(&counted, 4).expect("two of them"), [1, 2]);
        let huge = ome("", "<TiffData IFD=\"0\" PlaneCount=\"1048576\"/>");
        assert_eq!(pages(&huge, 2).expect("as many as there are"), [0, 1]);
    }

    #[test]
    fn a_description_elsewhere_is_named() {
        let text = b"<OME><BinaryOnly MetadataFile=\"a.companion.ome\" UUID=\"urn:uuid:1\"/></OME>";
        let described = read(text).expect("OME-XML");
        assert_eq!(described.metadata_file.as_deref(), Some("a.companion.ome"));
        assert!(read(b"<OME></OME>").is_err());
    }

    #[test]
    fn texts_are_utf_8_or_latin_1_up_to_a_zero() {
        assert_eq!(text("unit=\u{b5}m".as_bytes()), "unit=\u{b5}m");
        assert_eq!(text(b"unit=\xb5m\0rest"), "unit=\u{b5}m");
    }
}
