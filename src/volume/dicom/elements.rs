//! Walks the data elements of a DICOM file: tag, type, length, value; sequences of items of elements.
//!
//! # Theory
//!
//! DICOM PS3.5, sections 7 (data elements and sequences) and 10 (transfer syntaxes), and PS3.10, section 7 (preamble and
//! meta information). Values of unknown type and undefined length hold implicit elements (PS3.5, 6.2.2).
//!
//! # Invariants
//!
//! Only values that the caller wants are kept, each at most [`MOST_OF_A_VALUE`] long; what else is there is passed over, so a
//! length that the file claims costs nothing.

use std::fs::File;
use std::io::{self, BufReader, Read, Seek as _, SeekFrom};

use flate2::bufread::DeflateDecoder;

use crate::volume::decode::invalid;

/// Most bytes of a value that is kept: 65 thousand offsets of frames.
const MOST_OF_A_VALUE: u32 = 1 << 20;

/// Most sequences within each other; files have four or five.
const DEEPEST: usize = 32;

/// The length that stands for "until the delimiter".
const UNDEFINED: u32 = u32::MAX;

const ITEM: u32 = 0xfffe_e000;
const ITEM_END: u32 = 0xfffe_e00d;
const SEQUENCE_END: u32 = 0xfffe_e0dd;
const TRANSFER_SYNTAX: u32 = 0x0002_0010;
/// The samples.
pub(super) const PIXEL_DATA: u32 = 0x7fe0_0010;

/// How elements are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Encoding {
    /// Whether elements tell their types.
    explicit: bool,
    pub(super) big_endian: bool,
    /// Whether all behind the meta information is deflated.
    pub(super) deflated: bool,
}

/// The bytes of a file behind its meta information.
#[derive(Clone, Debug)]
pub(super) struct Body {
    pub(super) encoding: Encoding,
    /// The identifier of the transfer syntax; empty where the file tells none.
    pub(super) syntax: String,
    /// Where it begins in the file.
    pub(super) start: u64,
}

/// Where the samples are: bytes from the beginning of the (inflated) body.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct PixelData {
    pub(super) offset: u64,
    /// None where they are in fragments, as packed ones are.
    pub(super) length: Option<u32>,
    /// Whether they are 16-bit words whatever a sample is.
    pub(super) is_words: bool,
}

/// Takes the values that are wanted. `path` has the tags of the sequences that an element lies in.
pub(super) trait Visitor {
    /// Whether a value (or a sequence that has it) is wanted.
    fn wants(&self, path: &[u32], tag: u32) -> bool;
    /// The next item of a sequence begins.
    fn item(&mut self, path: &[u32]) -> io::Result<()>;
    /// A value.
    fn value(&mut self, path: &[u32], tag: u32, bytes: &[u8], big_endian: bool) -> io::Result<()>;
}

/// Whether a file may be DICOM by its first bytes: 132 with a preamble, else the first element of a body.
pub(super) fn begins(head: &[u8]) -> bool {
    has_preamble(head) || head.get(..8).is_some_and(|b| guess(b).is_some() || b[..2] == [2, 0])
}

fn has_preamble(head: &[u8]) -> bool {
    head.get(128..132) == Some(b"DICM")
}

/// How a body without meta information is written, by its first element, which is of group 8 and of few bytes.
fn guess(first: &[u8]) -> Option<Encoding> {
    let big_endian = match first[..2] {
        [8, 0] => false,
        [0, 8] => true,
        _ => return None,
    };
    let explicit = is_type([first[4], first[5]]);
    let element = if big_endian { first[2] } else { first[3] };
    let is_short = explicit || (!big_endian && first[6] == 0 && first[7] == 0);
    (element == 0 && is_short).then_some(Encoding { explicit, big_endian, deflated: false })
}

fn is_type(code: [u8; 2]) -> bool {
    code.iter().all(u8::is_ascii_uppercase)
}

impl Body {
    /// Finds the body of a file, and how it is written.
    pub(super) fn of(file: &File, length: u64) -> io::Result<Body> {
        let mut reader = BufReader::new(file);
        let mut head = Vec::new();
        reader.by_ref().take(132).read_to_end(&mut head)?;
        if !begins(&head) {
            return Err(invalid("no DICOM file: it begins neither with DICM nor with an element"));
        }
        let start = if has_preamble(&head) { 132 } else { 0 };
        reader.seek(SeekFrom::Start(start))?;
        let meta = Encoding { explicit: true, big_endian: false, deflated: false };
        let mut meta = Elements::new(Source::Plain(reader, length), start, meta);
        let mut syntax = String::new();
        loop {
            let start = meta.at;
            let mut first = [0; 8];
            meta.read(&mut first)?;
            meta.back(8)?;
            if first[..2] != [2, 0] {
                let encoding = if syntax.is_empty() { guess(&first) } else { encoding_of(&syntax) };
                let encoding =
                    encoding.ok_or_else(|| invalid("no DICOM element behind the first bytes"))?;
                return Ok(Body { encoding, syntax, start });
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

    /// The body of the file from a byte on.
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

    /// Hands the visitor its values up to the samples of the image, and tells where these are.
    pub(super) fn walk(
        &self,
        file: File,
        length: u64,
        visitor: &mut impl Visitor,
    ) -> io::Result<Option<PixelData>> {
        let source = self.source(file, length)?;
        Elements::new(source, 0, self.encoding).walk(visitor)
    }

    fn source<F: Read + io::Seek>(&self, mut file: F, length: u64) -> io::Result<Source<F>> {
        file.seek(SeekFrom::Start(self.start))?;
        let reader = BufReader::new(file);
        Ok(if self.encoding.deflated {
            Source::Deflated(DeflateDecoder::new(reader))
        } else {
            Source::Plain(reader, length.saturating_sub(self.start))
        })
    }
}

/// What a transfer syntax says of the elements; packed ones differ in their samples only.
fn encoding_of(syntax: &str) -> Option<Encoding> {
    let (explicit, big_endian, deflated) = match syntax {
        "1.2.840.10008.1.2" => (false, false, false),
        "1.2.840.10008.1.2.1.99" => (true, false, true),
        "1.2.840.10008.1.2.2" => (true, true, false),
        _ => (true, false, false),
    };
    Some(Encoding { explicit, big_endian, deflated })
}

/// Bytes of a file, as they are (with how many there are) or inflated.
enum Source<F> {
    Plain(BufReader<F>, u64),
    Deflated(DeflateDecoder<BufReader<F>>),
}

impl<F: Read> Read for Source<F> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        match self {
            Source::Plain(reader, _) => reader.read(buffer),
            Source::Deflated(reader) => reader.read(buffer),
        }
    }
}

/// Tag, type and length of an element. Delimiters have no type, nor have implicit elements.
struct Element {
    tag: u32,
    kind: [u8; 2],
    length: u32,
}

/// What the walk is inside of.
struct Level {
    /// The tag of a sequence; of an item that of its sequence.
    tag: u32,
    is: Is,
    end: Option<u64>,
    /// Whether elements outside tell their types.
    explicit_outside: bool,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Is {
    Sequence,
    Item,
    /// Packed samples: their items hold no elements.
    Fragments,
}

struct Elements<F> {
    source: Source<F>,
    at: u64,
    encoding: Encoding,
}

impl<F: Read + io::Seek> Elements<F> {
    fn new(source: Source<F>, at: u64, encoding: Encoding) -> Self {
        Elements { source, at, encoding }
    }

    fn read(&mut self, buffer: &mut [u8]) -> io::Result<()> {
        self.source.read_exact(buffer)?;
        self.at += buffer.len() as u64;
        Ok(())
    }

    /// Goes back in a plain file.
    fn back(&mut self, n: i64) -> io::Result<()> {
        if let Source::Plain(reader, _) = &mut self.source {
            reader.seek_relative(-n)?;
            self.at -= n.unsigned_abs();
        }
        Ok(())
    }

    /// Passes over bytes that are there.
    fn skip(&mut self, n: u64) -> io::Result<()> {
        match &mut self.source {
            Source::Plain(reader, length) => {
                let is_there = self.at.checked_add(n).is_some_and(|end| end <= *length);
                let n = i64::try_from(n).ok().filter(|_| is_there);
                reader.seek_relative(n.ok_or(io::ErrorKind::UnexpectedEof)?)?;
            }
            Source::Deflated(reader) => {
                if io::copy(&mut reader.take(n), &mut io::sink())? < n {
                    return Err(io::ErrorKind::UnexpectedEof.into());
                }
            }
        }
        self.at += n;
        Ok(())
    }

    /// A value; memory grows with what is there.
    fn bytes(&mut self, length: u32) -> io::Result<Vec<u8>> {
        if length > MOST_OF_A_VALUE {
            return Err(invalid(format!(
                "a value of {length} bytes, expected at most {MOST_OF_A_VALUE}"
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

    /// The head of the next element; none at the end of the file.
    fn next(&mut self) -> io::Result<Option<Element>> {
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
            return Ok(Some(Element { tag, kind: [0; 2], length: long([e, f, g, h]) }));
        }
        let kind = [e, f];
        if !is_type(kind) {
            return Err(invalid(format!("element {} has no type", shown(tag))));
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
        Ok(Some(Element { tag, kind, length }))
    }

    fn walk(&mut self, visitor: &mut impl Visitor) -> io::Result<Option<PixelData>> {
        let mut levels: Vec<Level> = Vec::new();
        loop {
            self.leave_what_has_ended(&mut levels)?;
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
                    let level = levels.pop().ok_or_else(|| invalid("an end of no sequence"))?;
                    self.encoding.explicit = level.explicit_outside;
                }
                PIXEL_DATA if levels.is_empty() => {
                    let length = Some(element.length).filter(|&n| n != UNDEFINED);
                    let is_words = element.kind != *b"OB";
                    return Ok(Some(PixelData { offset: self.at, length, is_words }));
                }
                _ => self.enter_or_pass(&element, &mut levels, visitor)?,
            }
        }
    }

    /// Leaves sequences and items whose length has been walked.
    fn leave_what_has_ended(&mut self, levels: &mut Vec<Level>) -> io::Result<()> {
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
        element: &Element,
        levels: &mut Vec<Level>,
        visitor: &mut impl Visitor,
    ) -> io::Result<()> {
        let explicit_outside = self.encoding.explicit;
        match levels.last() {
            Some(&Level { is: Is::Fragments, .. }) => self.skip(u64::from(element.length)),
            Some(&Level { is: Is::Sequence, tag, .. }) => {
                visitor.item(&path(levels))?;
                let end = self.end(element.length);
                levels.push(Level { tag, is: Is::Item, end, explicit_outside });
                Ok(())
            }
            _ => Err(invalid("an item of no sequence")),
        }
    }

    /// Takes a value, or enters a sequence, where they are wanted; passes over others. Of sequences without a length the end
    /// must be looked for.
    fn enter_or_pass(
        &mut self,
        element: &Element,
        levels: &mut Vec<Level>,
        visitor: &mut impl Visitor,
    ) -> io::Result<()> {
        let &Element { tag, kind, length } = element;
        let path = path(levels);
        let is_sequence = &kind == b"SQ" || length == UNDEFINED || is_group_of_frames(tag);
        let wanted = visitor.wants(&path, tag);
        if is_sequence && (wanted || length == UNDEFINED) {
            if levels.len() >= 2 * DEEPEST {
                return Err(invalid(format!("more than {DEEPEST} sequences within each other")));
            }
            let is = if tag == PIXEL_DATA { Is::Fragments } else { Is::Sequence };
            let explicit_outside = self.encoding.explicit;
            levels.push(Level { tag, is, end: self.end(length), explicit_outside });
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

/// Whether an element is a sequence that implicit files may give a length: theirs do not tell types.
fn is_group_of_frames(tag: u32) -> bool {
    use super::header::{GROUPS_OF_FRAMES, PARTS_OF_GROUPS};
    GROUPS_OF_FRAMES.contains(&tag) || PARTS_OF_GROUPS.contains(&tag)
}

/// The tags of the sequences.
fn path(levels: &[Level]) -> Vec<u32> {
    levels.iter().filter(|level| level.is == Is::Sequence).map(|level| level.tag).collect()
}

/// A tag as the standard writes it.
pub(super) fn shown(tag: u32) -> String {
    format!("({:04x},{:04x})", tag >> 16, tag & 0xffff)
}
