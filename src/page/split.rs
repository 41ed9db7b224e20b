//! Writes a spectrum as a small web page and files with intervals of isovalues, which the page fetches when they are needed.
//!
//! A file is the raw deflate stream that a page of one file has in base64 (`data`). Any static server can deliver the files; a page
//! that is opened from a disk may not fetch them. The page lists the files with their checksums: the script refuses a file of another
//! page, and the program replaces a folder only if it knows all files in it by this list.

use std::path::Path;

use serde::Deserialize;

use super::data;
use super::document::{Isovalues, Sizes, assemble};
use super::field::PageField;
use super::options::Page;
use super::range::with_range;
use super::template::{ABOUT, GENERATOR};
use crate::error::{Error, Result};
use crate::input;
use crate::spectrum::{About, Spectrum, cuts};

/// The least number of triangles in a file, some tens of kilobytes: fewer are not worth a request.
const MIN_TRIANGLES: usize = 10_000;

/// A file ends where at least this many times as many triangles are born in it as are alive at its end.
const BIRTHS_PER_CUT: usize = 2;

/// The name of the page among the files.
const INDEX: &str = "index.html";

/// The extension of the other files.
const EXTENSION: &str = ".bin";

/// A page and its files.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Split {
    /// Names and contents; the page comes last.
    pub files: Vec<(String, Vec<u8>)>,
    /// The sizes of their parts.
    pub sizes: Sizes,
}

/// The names of the files that [`split`] wrote into a folder, from its page; none for an empty folder.
///
/// # Errors
///
/// [`Error::Io`] and [`Error::Input`] if the folder has no page of this program with a list of files.
pub fn split_files(folder: &Path) -> Result<Vec<String>> {
    if std::fs::read_dir(folder).is_ok_and(|mut entries| entries.next().is_none()) {
        return Ok(Vec::new());
    }
    let path = folder.join(INDEX);
    let text = input::read(&path)?;
    let listed = String::from_utf8(text).ok().and_then(|text| listed_files(&text));
    listed.ok_or_else(|| {
        Error::input(format!("{}: not a page that `html --split` wrote", path.display()))
    })
}

/// The names of a page and of the files that it lists.
fn listed_files(text: &str) -> Option<Vec<String>> {
    /// What the list is in.
    #[derive(Deserialize)]
    struct About {
        chunks: Vec<Chunk>,
    }
    /// An entry of the list.
    #[derive(Deserialize)]
    struct Chunk {
        file: String,
    }
    let (_, rest) = text.split_once(GENERATOR)?;
    let (about, _) = rest.split_once(ABOUT[0])?.1.split_once(ABOUT[1])?;
    let About { chunks } = serde_json::from_str(about).ok()?;
    let files = chunks.into_iter().map(|chunk| chunk.file).chain([INDEX.to_owned()]);
    let files: Vec<String> = files.collect();
    files.iter().all(|name| is_split_name(name)).then_some(files)
}

/// Whether a [`Split`] can have a file of this name.
fn is_split_name(name: &str) -> bool {
    let is_number = |stem: &str| stem.len() >= 3 && stem.bytes().all(|b| b.is_ascii_digit());
    name == INDEX || name.strip_suffix(EXTENSION).is_some_and(is_number)
}

/// Writes a spectrum as a page and files with intervals of isovalues.
///
/// # Errors
///
/// As [`html`](super::html); [`Error::Usage`] for a second field, whose numbers belong to the knots of the whole spectrum.
pub fn split(spectrum: &Spectrum, page: &Page) -> Result<Split> {
    page.check(spectrum)?;
    if page.field.and_then(|sources| PageField::new(sources, page.ends)).is_some() {
        let message = "a page in several files shows no second field, expected one of one file";
        return Err(Error::Usage(message.to_owned()));
    }
    let (mut files, mut chunks, mut n_bytes) = (Vec::new(), Vec::new(), 0);
    for (number, ends) in interval_ends(spectrum).windows(2).enumerate() {
        let (about, patch) = with_range(spectrum, (ends[0], ends[1]))?.into_parts();
        // Rounding and colours depend on the range of the whole.
        let about = About { range: spectrum.range(), events: Vec::new(), ..about };
        let bytes = data::compressed(&Spectrum::unchecked(about, patch), page.step, None)?;
        n_bytes += bytes.len();
        let file = format!("{number:03}{EXTENSION}");
        let crc32 = crc32fast::hash(&bytes);
        let [from, to] = [ends[0], ends[1]];
        chunks.push(serde_json::json!({ "from": from, "to": to, "file": file, "crc32": crc32 }));
        files.push((file, bytes));
    }
    let (text, sizes) = assemble(spectrum, page, None, Isovalues::Files(chunks.into(), n_bytes))?;
    files.push((INDEX.to_owned(), text.into_bytes()));
    Ok(Split { files, sizes })
}

/// The isovalues that separate the files, with both ends of the range.
fn interval_ends(spectrum: &Spectrum) -> Vec<f64> {
    let (low, high) = spectrum.range();
    let (_, patch) = spectrum.clone().into_parts();
    let cuts = cuts(&patch, MIN_TRIANGLES, BIRTHS_PER_CUT);
    // The first and the last interval reach to the ends of the range, where there may be no surface.
    let inner = cuts.iter().map(|&rank| spectrum.isovalues()[rank as usize]);
    let inner = inner.skip(1).take(cuts.len().saturating_sub(2)).filter(|c| low < *c && *c < high);
    std::iter::once(low).chain(inner).chain([high]).collect()
}
