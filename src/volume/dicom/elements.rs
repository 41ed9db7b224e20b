//! Walks the data elements of a DICOM file: tag, type, length, value; sequences of items of elements.
//!
//! # Theory
//!
//! DICOM PS3.5, sections 7 (data elements and sequences) and 10 (transfer syntaxes), and PS3.10, section 7 (preamble and
//! meta information). Values of unknown type and undefined length hold implicit elements (PS3.5, 6.2.2).
//!
//! # Invariants
//!
//! Only values that the visitor wants are kept, of at most [`MAX_VALUE_BYTES`] each. All others are skipped, so a
//! wrong length allocates no memory.

use std::fs::File;
use std::io::{self, BufReader, Read, Seek as _, SeekFrom};

use flate2::bufread::DeflateDecoder;

use super::tags::{
    DOUBLE_PIXEL_DATA, FLOAT_PIXEL_DATA, FUNCTIONAL_GROUPS, GROUP_MACROS, ITEM, ITEM_END,
    PIXEL_DATA, SEQUENCE_END, TRANSFER_SYNTAX, format_tag,
};
use crate::volume::data_error::invalid;

/// Most bytes of a value that is kept: 65 thousand frame offsets.
const MAX_VALUE_BYTES: u32 = 1 << 20;

/// Most nested sequences; files have four or five.
const MAX_DEPTH: usize = 32;

/// The length that means "until the delimiter".
const UNDEFINED: u32 = u32::MAX;

/// The encoding of elements.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct ElementEncoding {
    /// Whether elements have a type (value representation).
    explicit: bool,
    pub(super) big_endian: bool,
    /// Whether everything after the meta information is deflated.
    pub(super) deflated: bool,
}

/// The data set of a file: the bytes after its meta information.
#[derive(Clone, Debug)]
pub(super) struct DataSet {
    pub(super) encoding: ElementEncoding,
    /// UID of the transfer syntax; empty if the file has none.
    pub(super) syntax: String,
    /// First byte in the file.
    pub(super) start: u64,
}

/// The position of the samples, in bytes from the start of the (decompressed) data set.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct PixelData {
    pub(super) offset: u64,
    /// None if they are in fragments, as compressed samples are.
    pub(super) length: Option<u32>,
    /// Whether they are 16-bit words, whatever the size of a sample.
    pub(super) is_words: bool,
    /// Whether they are floating point.
    pub(super) is_float: bool,
}

/// Receives the values that it wants. `path` has the tags of the sequences around an element.
pub(super) trait Visitor {
    /// Whether it wants a value (or a sequence).
    fn wants(&self, path: &[u32], tag: u32) -> bool;
    /// An item of a sequence starts.
    fn item(&mut self, path: &[u32]) -> io::Result<()>;
    /// A value.
    fn value(&mut self, path: &[u32], tag: u32, bytes: &[u8], big_endian: bool) -> io::Result<()>;
}

/// Whether the first 132 bytes of a file are a DICOM preamble, or start with an element.
pub(super) fn starts_like_dicom(head: &[u8]) -> bool {
    has_preamble(head)
        || head.get(..8).is_some_and(|b| guess_encoding(b).is_some() || b[..2] == [2, 0])
}

fn has_preamble(head: &[u8]) -> bool {
    head.get(128..132) == Some(b"DICM")
}

/// The encoding of a data set without meta information, by its first element, which is short and of group 8.
fn guess_encoding(first: &[u8]) -> Option<ElementEncoding> {
    let big_endian = match first[..2] {
        [8, 0] => false,
        [0, 8] => true,
        _ => return None,
    };
    let explicit = is_type([first[4], first[5]]);
    let element = if big_endian { first[2] } else { first[3] };
    let is_short = explicit || (!big_endian && first[6] == 0 && first[7] == 0);
    (element == 0 && is_short).then_some(ElementEncoding { explicit, big_endian, deflated: false })
}

fn is_type(code: [u8; 2]) -> bool {
    code.iter().all(u8::is_ascii_uppercase)
}

impl DataSet {
    /// Finds the data set of a file and its encoding.
    pub(super) fn of(file: &File, length: u64) -> io::Result<DataSet> {
        let mut reader = BufReader::new(file);
        let mut head = Vec::new();
        reader.by_ref().take(132).read_to_end(&mut head)?;
        if !starts_like_dicom(&head) {
            return Err(invalid(
                "not a DICOM file: it starts neither with DICM nor with an element",
            ));
        }
        let start = if has_preamble(&head) { 132 } else { 0 };
        reader.seek(SeekFrom::Start(start))?;
        let meta = ElementEncoding { explicit: true, big_endian: false, deflated: false };
        let mut meta = Elements::new(ByteSource::Plain(reader, length), start, meta);
        let mut syntax = String::new();
        loop {
            let start = meta.at;
            let mut first = [0; 8];
            meta.read(&mut first)?;
            meta.back(8)?;
            if first[..2] != [2, 0] {
                let encoding =
                    if syntax.is_empty() { guess_encoding(&first) } else { encoding_of(&syntax) };
                let encoding =
                    encoding.ok_or_else(|| invalid("no DICOM element after the first bytes"))?;
                return Ok(DataSet { encoding, syntax, start });
            }
            let element = meta.next()?.ok_or(io::ErrorKind::UnexpectedEof)?;
            if element.tag == TRANSFER_SYNTAX {
                let bytes = meta.bytes(element.length)?;
                syntax = String::from_utf8_lossy(&bytes).trim_end_matches(['\0', ' ']).to_owned();
            } else {
                meta.skip(u64::from(element.length))?;
            }
        }
    }

    /// Opens the data set at a byte.
    pub(super) fn open(
        &self,
        file: File,
        length: u64,
        offset: u64,
    ) -> io::Result<impl Read + use<>> {
        let mut elements = Elements::new(self.source(file, length)?, 0, self.encoding);
        elements.skip(offset)?;
        Ok(elements.source)
    }

    /// Passes the visitor its values up to the samples of the image, and returns the position of these.
    pub(super) fn walk(
        &self,
        file: File,
        length: u64,
        visitor: &mut impl Visitor,
    ) -> io::Result<Option<PixelData>> {
        let source = self.source(file, length)?;
        Elements::new(source, 0, self.encoding).walk(visitor)
    }

    fn source<F: Read + io::Seek>(&self, mut file: F, length: u64) -> io::Result<ByteSource<F>> {
        file.seek(SeekFrom::Start(self.start))?;
        let reader = BufReader::new(file);
        Ok(if self.encoding.deflated {
            ByteSource::Deflated(DeflateDecoder::new(reader))
        } else {
            ByteSource::Plain(reader, length.saturating_sub(self.start))
        })
    }
}

/// The encoding of a transfer syntax. Compressed ones differ in their samples only.
fn encoding_of(syntax: &str) -> Option<ElementEncoding> {
    let (explicit, big_endian, deflated) = match syntax {
        "1.2.840.10008.1.2" => (false, false, false),
        "1.2.840.10008.1.2.1.99" => (true, false, true),
        "1.2.840.10008.1.2.2" => (true, true, false),
        _ => (true, false, false),
    };
    Some(ElementEncoding { explicit, big_endian, deflated })
}

/// Bytes of a file, plain (with their number) or inflated.
enum ByteSource<F> {
    Plain(BufReader<F>, u64),
    Deflated(DeflateDecoder<BufReader<F>>),
}

impl<F: Read> Read for ByteSource<F> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        match self {
            ByteSource::Plain(reader, _) => reader.read(buffer),
            ByteSource::Deflated(reader) => reader.read(buffer),
        }
    }
}

/// Tag, type and length of an element. Delimiters and implicit elements have no type.
struct ElementHeader {
    tag: u32,
    kind: [u8; 2],
    length: u32,
}

/// A sequence or an item around the current element.
struct Level {
    /// The tag of a sequence; of an item that of its sequence.
    tag: u32,
    kind: LevelKind,
    end: Option<u64>,
    /// Whether elements outside have a type.
    explicit_outside: bool,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum LevelKind {
    Sequence,
    Item,
    /// Compressed samples: their items have no elements.
    Fragments,
}

struct Elements<F> {
    source: ByteSource<F>,
    at: u64,
    encoding: ElementEncoding,
}

impl<F: Read + io::Seek> Elements<F> {
    fn new(source: ByteSource<F>, at: u64, encoding: ElementEncoding) -> Self {
        Elements { source, at, encoding }
    }

    fn read(&mut self, buffer: &mut [u8]) -> io::Result<()> {
        self.source.read_exact(buffer)?;
        self.at += buffer.len() as u64;
        Ok(())
    }

    /// Goes back in a plain file.
    fn back(&mut self, n: i64) -> io::Result<()> {
        if let ByteSource::Plain(reader, _) = &mut self.source {
            reader.seek_relative(-n)?;
            self.at -= n.unsigned_abs();
        }
        Ok(())
    }

    /// Skips bytes that exist.
    fn skip(&mut self, n: u64) -> io::Result<()> {
        match &mut self.source {
            ByteSource::Plain(reader, length) => {
                let is_there = self.at.checked_add(n).is_some_and(|end| end <= *length);
                let n = i64::try_from(n).ok().filter(|_| is_there);
                reader.seek_relative(n.ok_or(io::ErrorKind::UnexpectedEof)?)?;
            }
            ByteSource::Deflated(reader) => {
                if io::copy(&mut reader.take(n), &mut io::sink())? < n {
                    return Err(io::ErrorKind::UnexpectedEof.into());
                }
            }
        }
        self.at += n;
        Ok(())
    }

    /// Reads a value. Memory grows with the bytes that exist.
    fn bytes(&mut self, length: u32) -> io::Result<Vec<u8>> {
        if length > MAX_VALUE_BYTES {
            return Err(invalid(format!(
                "a value of {length} bytes, expected at most {MAX_VALUE_BYTES}"
            )));
        }
        let mut bytes = Vec::new();
        let n = self.source.by_ref().take(u64::from(length)).read_to_end(&mut bytes)?;
        self.at += n as u64;
        if n < length as usize {
            return Err(io::ErrorKind::UnexpectedEof.into());
        }
        Ok(bytes)
    }

    /// Reads tag, type and length of the next element; none at the end of the file.
    fn next(&mut self) -> io::Result<Option<ElementHeader>> {
        let mut head = [0; 8];
        if self.source.read(&mut head[..1])? == 0 {
            return Ok(None);
        }
        self.at += 1;
        self.read(&mut head[1..])?;
        let big_endian = self.encoding.big_endian;
        let short = |b: [u8; 2]| {
            if big_endian { u16::from_be_bytes(b) } else { u16::from_le_bytes(b) }
        };
        let long = |b: [u8; 4]| {
            if big_endian { u32::from_be_bytes(b) } else { u32::from_le_bytes(b) }
        };
        let [a, b, c, d, e, f, g, h] = head;
        let tag = u32::from(short([a, b])) << 16 | u32::from(short([c, d]));
        if !self.encoding.explicit || tag >> 16 == 0xfffe {
            return Ok(Some(ElementHeader { tag, kind: [0; 2], length: long([e, f, g, h]) }));
        }
        let kind = [e, f];
        if !is_type(kind) {
            return Err(invalid(format!("element {} has no type", format_tag(tag))));
        }
        let length = match &kind {
            b"OB" | b"OD" | b"OF" | b"OL" | b"OV" | b"OW" | b"SQ" | b"SV" | b"UC" | b"UN"
            | b"UR" | b"UT" | b"UV" => {
                let mut bytes = [0; 4];
                self.read(&mut bytes)?;
                long(bytes)
            }
            _ => u32::from(short([g, h])),
        };
        Ok(Some(ElementHeader { tag, kind, length }))
    }

    fn walk(&mut self, visitor: &mut impl Visitor) -> io::Result<Option<PixelData>> {
        let mut levels: Vec<Level> = Vec::new();
        loop {
            self.pop_finished_levels(&mut levels)?;
            let Some(element) = self.next()? else {
                return if levels.is_empty() {
                    Ok(None)
                } else {
                    Err(io::ErrorKind::UnexpectedEof.into())
                };
            };
            match element.tag {
                ITEM => self.enter_item(&element, &mut levels, visitor)?,
                ITEM_END | SEQUENCE_END => {
                    let level =
                        levels.pop().ok_or_else(|| invalid("an end outside of a sequence"))?;
                    self.encoding.explicit = level.explicit_outside;
                }
                PIXEL_DATA | FLOAT_PIXEL_DATA | DOUBLE_PIXEL_DATA if levels.is_empty() => {
                    let length = Some(element.length).filter(|&n| n != UNDEFINED);
                    let is_words = element.kind != *b"OB";
                    let is_float = element.tag != PIXEL_DATA;
                    return Ok(Some(PixelData { offset: self.at, length, is_words, is_float }));
                }
                _ => self.enter_or_skip(&element, &mut levels, visitor)?,
            }
        }
    }

    /// Leaves sequences and items that end here.
    fn pop_finished_levels(&mut self, levels: &mut Vec<Level>) -> io::Result<()> {
        while let Some(end) = levels.last().and_then(|level| level.end) {
            if self.at < end {
                break;
            }
            if self.at > end {
                return Err(invalid("an element that is longer than the sequence it is in"));
            }
            if let Some(level) = levels.pop() {
                self.encoding.explicit = level.explicit_outside;
            }
        }
        Ok(())
    }

    fn enter_item(
        &mut self,
        element: &ElementHeader,
        levels: &mut Vec<Level>,
        visitor: &mut impl Visitor,
    ) -> io::Result<()> {
        let explicit_outside = self.encoding.explicit;
        match levels.last() {
            Some(&Level { kind: LevelKind::Fragments, .. }) => self.skip(u64::from(element.length)),
            Some(&Level { kind: LevelKind::Sequence, tag, .. }) => {
                visitor.item(&path(levels))?;
                let end = self.end(element.length);
                levels.push(Level { tag, kind: LevelKind::Item, end, explicit_outside });
                Ok(())
            }
            _ => Err(invalid("an item outside of a sequence")),
        }
    }

    /// Reads a value or enters a sequence if the visitor wants it, else skips it. A sequence without a length is entered to
    /// find its end.
    fn enter_or_skip(
        &mut self,
        element: &ElementHeader,
        levels: &mut Vec<Level>,
        visitor: &mut impl Visitor,
    ) -> io::Result<()> {
        let &ElementHeader { tag, kind, length } = element;
        let path = path(levels);
        let is_sequence = &kind == b"SQ" || length == UNDEFINED || is_functional_group(tag);
        let wanted = visitor.wants(&path, tag);
        if is_sequence && (wanted || length == UNDEFINED) {
            if levels.len() >= 2 * MAX_DEPTH {
                return Err(invalid(format!("more than {MAX_DEPTH} nested sequences")));
            }
            let level_kind =
                if tag == PIXEL_DATA { LevelKind::Fragments } else { LevelKind::Sequence };
            let explicit_outside = self.encoding.explicit;
            levels.push(Level { tag, kind: level_kind, end: self.end(length), explicit_outside });
            if &kind == b"UN" {
                self.encoding.explicit = false;
            }
            return Ok(());
        }
        if !wanted || is_sequence {
            return self.skip(u64::from(length));
        }
        let bytes = self.bytes(length)?;
        visitor.value(&path, tag, &bytes, self.encoding.big_endian)
    }

    fn end(&self, length: u32) -> Option<u64> {
        (length != UNDEFINED).then(|| self.at + u64::from(length))
    }
}

/// Whether an element is a sequence by its tag: implicit elements have no type.
fn is_functional_group(tag: u32) -> bool {
    FUNCTIONAL_GROUPS.contains(&tag) || GROUP_MACROS.contains(&tag)
}

/// The tags of the sequences around the current element.
fn path(levels: &[Level]) -> Vec<u32> {
    levels.iter().filter(|level| level.kind == LevelKind::Sequence).map(|level| level.tag).collect()
}
