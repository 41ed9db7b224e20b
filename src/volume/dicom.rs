//! DICOM: a series of slices in the files of a folder, or frames in one file, with their positions in the patient.
//!
//! Source: DICOM PS3.3, PS3.5 and PS3.10. This parser reads only the elements that a volume needs. `dicom-object` and
//! `dicom-parser` allocate the length of an element before they read it, and have many dependencies.
//!
//! The world is LPS in millimetres. Samples are modality values (rescaled). The photometric interpretation is ignored, so
//! MONOCHROME1 is read as stored.

mod codec;
mod elements;
mod fragments;
mod header;
mod image;
mod order;
mod pixels;
mod rle;
mod tags;

use std::collections::BTreeMap;
use std::io::Read as _;
use std::path::{Path, PathBuf};

use super::data_error::read_error;
use super::format::is_slice_image;
use super::read_options::ReadOptions;
use super::samples::SampleGrid;
use super::text::shortened;
use crate::error::{Error, Result};
use crate::input;
use header::DicomHeader;
use image::DicomImage;

/// Reads the series of a folder, the frames of a file, or the series that a file with one frame belongs to.
///
/// # Errors
///
/// [`Error::Io`] if a file cannot be read; [`Error::Input`] for damaged ones, unsupported compression, slices that are
/// missing, duplicate or unevenly spaced, and if a series must be chosen.
pub(crate) fn read(path: &Path, options: &ReadOptions) -> Result<SampleGrid> {
    let images = if path.is_dir() { images_in_folder(path)? } else { series_of_file(path)? };
    let images = select_series(path, images, options.series.as_deref())?;
    let images = without_localizers(images);
    let mut slices = Vec::new();
    for (i, image) in images.iter().enumerate() {
        pixels::check(image, &images[0]).map_err(|e| read_error(&image.path, e))?;
        slices.extend(image.slices(i).map_err(|e| read_error(&image.path, e))?);
    }
    order::select_frame(&mut slices, options.frame).map_err(|e| read_error(path, e))?;
    let placement = order::sort(&mut slices, &|slice| images[slice.image].name_of(slice))
        .map_err(|message| Error::input(format!("{}: {message}", path.display())))?;
    let [x, y] = images[0].header.size;
    let samples = pixels::read(path, &images, &slices, options)?;
    Ok(SampleGrid { dims: [x, y, slices.len()], samples, placement })
}

/// The other files of the series of a file; all DICOM files of a folder.
pub(crate) fn companion_files(path: &Path) -> Vec<PathBuf> {
    if path.is_dir() {
        return files(path).unwrap_or_default();
    }
    let images = series_of_file(path).unwrap_or_default();
    images.into_iter().map(|image| image.path).filter(|other| other != path).collect()
}

/// Whether a file starts like a DICOM file, whatever its name.
pub(crate) fn is_dicom(path: &Path) -> bool {
    let Ok((file, _)) = input::open(path) else { return false };
    let mut start = Vec::new();
    file.take(132).read_to_end(&mut start).is_ok() && elements::starts_like_dicom(&start)
}

/// Whether a folder has DICOM files.
pub(crate) fn is_folder(folder: &Path) -> bool {
    let Ok(entries) = std::fs::read_dir(folder) else { return false };
    entries.flatten().any(|entry| may_be_slice(&entry.path()) && is_dicom(&entry.path()))
}

/// Images next to slices are previews; hidden files belong to the system.
fn may_be_slice(path: &Path) -> bool {
    let is_hidden = path.file_name().is_some_and(|name| name.to_string_lossy().starts_with('.'));
    !is_hidden && !is_slice_image(path)
}

/// The DICOM files of a folder, by name.
fn files(folder: &Path) -> Result<Vec<PathBuf>> {
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(|e| Error::io(folder, e))? {
        let path = entry.map_err(|e| Error::io(folder, e))?.path();
        if may_be_slice(&path) && is_dicom(&path) {
            files.push(path);
        }
    }
    files.sort();
    Ok(files)
}

/// The images in the DICOM files of a folder.
fn images_in_folder(folder: &Path) -> Result<Vec<DicomImage>> {
    let images = files(folder)?.into_iter().map(|path| DicomImage::of(&path));
    images.filter_map(Result::transpose).collect()
}

/// The image of a file, with those of the same series in its folder unless it has several frames.
fn series_of_file(path: &Path) -> Result<Vec<DicomImage>> {
    let image = DicomImage::of(path)?.ok_or_else(|| {
        Error::input(format!(
            "{}: a DICOM file without samples, expected a file of a series or its folder",
            path.display()
        ))
    })?;
    if image.header.n_frames.is_some_and(|n| n > 1) || image.header.series.is_empty() {
        return Ok(vec![image]);
    }
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
    let name = path.file_name();
    let mut images = Vec::new();
    for other in files(folder.unwrap_or(Path::new(".")))? {
        if other.file_name() != name
            && let Some(other) = DicomImage::of(&other)?
            && other.header.series == image.header.series
        {
            images.push(other);
        }
    }
    images.push(image);
    images.sort_by(|a, b| a.path.cmp(&b.path));
    Ok(images)
}

/// The images of the chosen series (by number, from 0, or UID), or of the only one.
fn select_series(
    path: &Path,
    images: Vec<DicomImage>,
    given: Option<&str>,
) -> Result<Vec<DicomImage>> {
    let mut by_uid: BTreeMap<String, Vec<DicomImage>> = BTreeMap::new();
    for image in images {
        by_uid.entry(image.header.series.clone()).or_default().push(image);
    }
    // By the series number of the scanner, then by UID.
    let mut all: Vec<Vec<DicomImage>> = by_uid.into_values().collect();
    all.sort_by(|a, b| a[0].header.series_number.total_cmp(&b[0].header.series_number));
    let n = all.len();
    let index = match given {
        None => (n == 1).then_some(0),
        Some(given) => {
            let by_uid = all.iter().position(|images| images[0].header.series == given);
            by_uid.or_else(|| given.parse().ok())
        }
    };
    if let Some(i) = index.filter(|&i| i < n) {
        return Ok(all.swap_remove(i));
    }
    let shown = path.display();
    if n == 0 {
        return Err(Error::input(format!("{shown}: no DICOM file with samples")));
    }
    let list: Vec<String> = all.iter().enumerate().take(8).map(describe_series).collect();
    let found = given.map_or_else(
        || format!("{n} series"),
        |given| format!("no series '{}' of {n}", shortened(given)),
    );
    let more = if n > 8 { ", ..." } else { "" };
    Err(Error::input(format!(
        "{shown}: {found}, expected one chosen by --series: {}{more}",
        list.join(", ")
    )))
}

/// Largest share of a series that is left out because it is turned against the others.
const MAX_TURNED: f64 = 0.25;

/// Fewest parallel slices of a series from which others are left out.
const MIN_PARALLEL: usize = 4;

/// Most orientations in a series with localizers.
const MAX_ORIENTATIONS: usize = 16;

/// The images of a series without a few that are turned against all others, which are parallel: localizers.
fn without_localizers(images: Vec<DicomImage>) -> Vec<DicomImage> {
    let mut groups: Vec<([f64; 6], usize)> = Vec::new();
    for image in &images {
        let Some(orientation) = image.orientation() else { return images };
        match groups.iter().position(|(other, _)| order::is_parallel(&orientation, other)) {
            Some(i) => groups[i].1 += 1,
            None if groups.len() < MAX_ORIENTATIONS => groups.push((orientation, 1)),
            None => return images,
        }
    }
    let largest = groups.iter().copied().max_by_key(|&(_, n)| n);
    let Some((orientation, n)) = largest.filter(|_| groups.len() > 1) else { return images };
    let n_turned = images.len() - n;
    if n < MIN_PARALLEL || n_turned as f64 > MAX_TURNED * images.len() as f64 {
        return images;
    }
    let is_kept = |image: &DicomImage| {
        image.orientation().is_some_and(|own| order::is_parallel(&own, &orientation))
    };
    let (kept, turned): (Vec<_>, Vec<_>) = images.into_iter().partition(is_kept);
    if let Some(first) = turned.first() {
        let name = first.path.file_name().unwrap_or_default().to_string_lossy();
        log::warn!(
            "{n_turned} of {} slices are left out, which are turned against the others, such as {name}",
            n + n_turned
        );
    }
    kept
}

/// A series for messages. UIDs, of at most 64 characters, are shown in full: many differ at their end only.
fn describe_series((i, images): (usize, &Vec<DicomImage>)) -> String {
    let n: usize = images.iter().map(|image| image.header.n_frames.unwrap_or(1)).sum();
    let DicomHeader { size: [x, y], description, series, .. } = &images[0].header;
    let uid: String = series.chars().take(64).flat_map(char::escape_default).collect();
    format!("{i} ('{}', {n} slices of {x}x{y}, {uid})", shortened(description))
}
