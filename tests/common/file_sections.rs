//! The sections of spectrum files, taken apart and put together again.

use std::io::Read as _;

/// Lengths of the head of a section, of the head and of the end of the file, bytes.
pub(crate) const SECTION_HEAD: usize = 28;
pub(crate) const FILE_HEAD: usize = 16;
pub(crate) const FOOTER: usize = 16;

/// Offsets of the sections of a valid file: those of its chunks, then the tables.
pub(crate) fn sections(file: &[u8]) -> Vec<usize> {
    let mut starts = vec![];
    let mut at = FILE_HEAD;
    while at < file.len() - FOOTER {
        starts.push(at);
        at += SECTION_HEAD + u64_at(file, at + 8) as usize;
    }
    assert_eq!(at, file.len() - FOOTER);
    starts
}

pub(crate) fn u64_at(file: &[u8], at: usize) -> u64 {
    u64::from_le_bytes(file[at..at + 8].try_into().expect("eight bytes"))
}

/// The tag of the section at an offset.
pub(crate) fn tag(file: &[u8], at: usize) -> &[u8] {
    &file[at..at + 4]
}

pub(crate) fn section(tag: &[u8], method: u32, stored: &[u8], length: u64) -> Vec<u8> {
    let mut section = tag.to_vec();
    section.extend(method.to_le_bytes());
    section.extend((stored.len() as u64).to_le_bytes());
    section.extend(length.to_le_bytes());
    let crc = crc32fast::hash(&[&section[..], stored].concat());
    section.extend(crc.to_le_bytes());
    section.extend(stored);
    section
}

/// An unpacked section: its tag and content; for coded columns, the stored bytes and the number of numbers.
pub(crate) type Unpacked = (Vec<u8>, Vec<u8>, Option<u64>);

/// All sections.
pub(crate) fn unpacked(file: &[u8]) -> Vec<Unpacked> {
    let unpack = |at: usize| {
        let stored = &file[at + SECTION_HEAD..][..u64_at(file, at + 8) as usize];
        let mut content = Vec::new();
        if file[at + 4] == 1 {
            flate2::read::ZlibDecoder::new(stored).read_to_end(&mut content).expect("valid");
        } else {
            content.extend(stored);
        }
        let n_numbers = (file[at + 4] == 2).then(|| u64_at(file, at + 16));
        (tag(file, at).to_vec(), content, n_numbers)
    };
    sections(file).into_iter().map(unpack).collect()
}

/// A file with one chunk, of these sections, not deflated, with correct checksums. Lengths and checksums in an unchanged index follow.
pub(crate) fn assembled(file: &[u8], sections: &[Unpacked]) -> Vec<u8> {
    let original = unpacked(file);
    let mut assembled = file[..FILE_HEAD].to_vec();
    let mut tables = None;
    for (i, (tag, content, n_numbers)) in sections.iter().enumerate() {
        if i == 3 {
            tables = Some(assembled.len());
        }
        let mut content = content.clone();
        if tag == b"INDX" && original.last().is_some_and(|index| index.1 == content) {
            content = with_chunk(&content, &assembled[FILE_HEAD..tables.unwrap_or(FILE_HEAD)]);
        }
        let method = if n_numbers.is_some() { 2 } else { 0 };
        let length = n_numbers.unwrap_or(content.len() as u64);
        assembled.extend(section(tag, method, &content, length));
    }
    let tables = tables.unwrap_or(assembled.len());
    with_footer(assembled, tables)
}

/// An index of one chunk that has these bytes: a count, and columns of one number, each a width and its bytes.
fn with_chunk(index: &[u8], chunk: &[u8]) -> Vec<u8> {
    let mut at = 8;
    for _ in ["pivot", "vertices", "knots", "triangles"] {
        at += 1 + usize::from(index[at]);
    }
    let (length, crc) = ((chunk.len() as u64).to_le_bytes(), crc32fast::hash(chunk).to_le_bytes());
    [&index[..at], &[8], &length, &[4], &crc].concat()
}

/// Appends the end of a file whose tables begin at an offset.
pub(crate) fn with_footer(mut file: Vec<u8>, tables: usize) -> Vec<u8> {
    let position = (tables as u64).to_le_bytes();
    file.extend(position);
    file.extend(crc32fast::hash(&position).to_le_bytes());
    file.extend(b"ISPE");
    file
}
