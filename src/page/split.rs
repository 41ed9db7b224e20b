//! A spectrum as a small web page and files beside it, each with the isovalues of an interval: no more is fetched than is looked at.
//!
//! The files hold what a page holds of a spectrum, in the same letters, so the page needs no second reader. Any server of files will do;
//! a page that is opened from a disk may not fetch what lies beside it.

use super::{Field, Isovalues, Page, Sizes, check, data, filled, letters, part};
use crate::error::{Error, Result};
use crate::spectrum::{About, Spectrum, cuts};

/// Fewest triangles of a file, some tens of kilobytes: less is not worth a request.
const LEAST_TRIANGLES: usize = 10_000;

/// How many times as many triangles as live across its end are born in a file.
const TIMES_ACROSS: usize = 2;

/// The name of the page among the files.
const INDEX: &str = "index.html";

/// A page and the files beside it.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Split {
    /// Names and contents; the page comes last.
    pub files: Vec<(String, String)>,
    /// What they are made of.
    pub sizes: Sizes,
}

/// Whether a file may be one of a [`Split`].
pub fn is_split_name(name: &str) -> bool {
    let is_number = |stem: &str| stem.len() >= 3 && stem.bytes().all(|b| b.is_ascii_digit());
    name == INDEX || name.strip_suffix(".txt").is_some_and(is_number)
}

/// The page of a spectrum whose isovalues lie in files beside it.
///
/// # Errors
///
/// As [`html`](super::html); [`Error::Usage`] for a second field, whose numbers stand at the knots of the whole.
pub fn split(spectrum: &Spectrum, page: &Page) -> Result<Split> {
    check(spectrum, page)?;
    if page.field.and_then(|sources| Field::of(sources, page.ends)).is_some() {
        let what = "a page in several files shows no second field, expected one of one file";
        return Err(Error::Usage(what.to_owned()));
    }
    let (low, high) = spectrum.range();
    let (_, patch) = spectrum.clone().into_parts();
    let cuts = cuts(&patch, LEAST_TRIANGLES, TIMES_ACROSS);
    drop(patch);
    // The first and the last interval reach to the ends of the range, where there may be nothing to be seen.
    let inner = cuts.iter().map(|&rank| spectrum.isovalues()[rank as usize]);
    let inner = inner.skip(1).take(cuts.len().saturating_sub(2)).filter(|c| low < *c && *c < high);
    let ends: Vec<f64> = std::iter::once(low).chain(inner).chain([high]).collect();
    let (mut files, mut told, mut n_bytes) = (Vec::new(), Vec::new(), 0);
    for (number, ends) in ends.windows(2).enumerate() {
        let (about, patch) = part(spectrum, (ends[0], ends[1]))?.into_parts();
        // What is said of the range is meant of the whole.
        let about = About { range: (low, high), events: Vec::new(), ..about };
        let bytes = data::compressed(&Spectrum::unchecked(about, patch), page.step, None)?;
        n_bytes += bytes.len();
        let file = format!("{number:03}.txt");
        told.push(serde_json::json!({ "from": ends[0], "to": ends[1], "file": file }));
        files.push((file, letters::letters(&bytes)));
    }
    let (text, sizes) = filled(spectrum, page, None, Isovalues::Beside(told.into(), n_bytes))?;
    files.push((INDEX.to_owned(), text));
    Ok(Split { files, sizes })
}
