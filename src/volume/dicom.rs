//! DICOM: a series of slices in files of a folder, or frames in one file, as they lie in the patient.
//!
//! Source: DICOM PS3.3, PS3.5 and PS3.10. Read by hand, and only what a volume needs: `dicom-object` and `dicom-parser` take
//! the memory that a length claims before they read, and bring a large tree of crates; the elements needed here are few.
//!
//! The world is LPS in millimetres. Samples are those of the modality (rescaled); which of them are black is not asked, so
//! MONOCHROME1 is read as stored.

mod elements;
mod header;
mod order;
mod packed;
mod pixels;
mod rle;

use std::collections::BTreeMap;
use std::io::{self, Read as _};
use std::path::{Path, PathBuf};

use super::decode::{invalid, read_error};
use super::text::shortened;
use super::tiff::slices::is_picture;
use super::{Grid, ReadOptions};
use crate::error::{Error, Result};
use crate::input;
use elements::{Body, PixelData};
use header::{Header, Plane};
use packed::Codec;

/// A file with an image.
struct Image {
    path: PathBuf,
    length: u64,
    body: Body,
    header: Header,
    pixels: PixelData,
    /// How frames are packed, where they are.
    codec: Option<Codec>,
    /// Where packed frames are, as offsets in the file and lengths.
    fragments: Vec<(u64, u32)>,
}

/// A slice: one of the frames of an image, or all of it.
#[derive(Clone, Copy, Debug)]
struct Slice {
    /// Which of the images.
    image: usize,
    frame: usize,
    plane: Plane,
    /// Number of its volume in time, and of the file among those of its series.
    time: (f64, f64),
}

/// Reads the series of a folder, the frames of a file, or the series that a file with one frame belongs to.
///
/// # Errors
///
/// [`Error::Io`] if a file cannot be read; [`Error::Input`] for damaged ones, packed samples, slices that are missing, double
/// or not evenly apart, and where a series must be chosen.
pub(crate) fn read(path: &Path, options: &ReadOptions) -> Result<Grid> {
    let images = if path.is_dir() { images_of(path)? } else { images_with(path)? };
    let images = chosen(path, images, options.series.as_deref())?;
    let mut slices = Vec::new();
    for (i, image) in images.iter().enumerate() {
        pixels::check(image, &images[0]).map_err(|e| read_error(&image.path, e))?;
        slices.extend(image.slices(i).map_err(|e| read_error(&image.path, e))?);
    }
    order::at_time(&mut slices, options.frame).map_err(|e| read_error(path, e))?;
    let placement = order::sort(&mut slices, &|slice| images[slice.image].shown(slice))
        .map_err(|message| Error::input(format!("{}: {message}", path.display())))?;
    let [x, y] = images[0].header.size;
    let samples = pixels::read(path, &images, &slices, options)?;
    Ok(([x, y, slices.len()], samples, placement))
}

/// The files of the volume beside the one that is named: of a folder all that are DICOM.
pub(crate) fn others(path: &Path) -> Vec<PathBuf> {
    if path.is_dir() {
        return files(path).unwrap_or_default();
    }
    let images = images_with(path).unwrap_or_default();
    images.into_iter().map(|image| image.path).filter(|other| other != path).collect()
}

/// Whether a file begins as DICOM files do, whatever it is called.
pub(crate) fn is_dicom(path: &Path) -> bool {
    let Ok((file, _)) = input::open(path) else { return false };
    let mut head = Vec::new();
    file.take(132).read_to_end(&mut head).is_ok() && elements::begins(&head)
}

/// Whether a folder holds DICOM files.
pub(crate) fn is_folder(folder: &Path) -> bool {
    let Ok(entries) = std::fs::read_dir(folder) else { return false };
    entries.flatten().any(|entry| may_be_slice(&entry.path()) && is_dicom(&entry.path()))
}

/// Pictures beside slices are previews; hidden files are those of a system.
fn may_be_slice(path: &Path) -> bool {
    let is_hidden = path.file_name().is_some_and(|name| name.to_string_lossy().starts_with('.'));
    !is_hidden && !is_picture(path)
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

/// The files of a folder that have an image.
fn images_of(folder: &Path) -> Result<Vec<Image>> {
    let images = files(folder)?.into_iter().map(|path| Image::of(&path));
    images.filter_map(Result::transpose).collect()
}

/// The image of a file, and of the files beside it that are of its series; of frames only its own.
fn images_with(path: &Path) -> Result<Vec<Image>> {
    let image = Image::of(path)?.ok_or_else(|| {
        Error::input(format!(
            "{}: a DICOM file without samples, expected one of a series or their folder",
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
            && let Some(other) = Image::of(&other)?
            && other.header.series == image.header.series
        {
            images.push(other);
        }
    }
    images.push(image);
    images.sort_by(|a, b| a.path.cmp(&b.path));
    Ok(images)
}

/// The images of the one series, or of that which is asked for by its number, from 0, or its identifier.
fn chosen(path: &Path, images: Vec<Image>, given: Option<&str>) -> Result<Vec<Image>> {
    // By the numbers that the scanner gave, then by identifier.
    let mut all: Vec<(f64, String, Vec<Image>)> = Vec::new();
    let mut places: BTreeMap<String, usize> = BTreeMap::new();
    for image in images {
        let header = &image.header;
        let place = *places.entry(header.series.clone()).or_insert_with(|| {
            all.push((header.series_number, header.series.clone(), Vec::new()));
            all.len() - 1
        });
        all[place].2.push(image);
    }
    all.sort_by(|a, b| a.0.total_cmp(&b.0).then_with(|| a.1.cmp(&b.1)));
    let n = all.len();
    let by_number = given.and_then(|given| given.parse::<usize>().ok());
    let index = match given {
        None if n == 1 => Some(0),
        None => None,
        Some(uid) => all.iter().position(|series| series.1 == uid).or(by_number),
    };
    let shown = path.display();
    match index.filter(|&i| i < n) {
        Some(i) => Ok(all.swap_remove(i).2),
        None if n == 0 => Err(Error::input(format!("{shown}: no DICOM file with samples"))),
        None => {
            let list: Vec<String> = all.iter().enumerate().take(8).map(told).collect();
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
    }
}

/// A series in words. Identifiers are told in full, which is 64 characters at most: many differ in their ends only.
fn told((i, (_, uid, images)): (usize, &(f64, String, Vec<Image>))) -> String {
    let n: usize = images.iter().map(|image| image.header.n_frames.unwrap_or(1)).sum();
    let Header { size: [x, y], description, .. } = &images[0].header;
    let uid: String = uid.chars().take(64).flat_map(char::escape_default).collect();
    format!("{i} ('{}', {n} slices of {x}x{y}, {uid})", shortened(description))
}

impl Image {
    /// What a file tells of its image; none where it has none.
    fn of(path: &Path) -> Result<Option<Image>> {
        let (file, length) = input::open(path)?;
        let wrong = |e: io::Error| match e.kind() {
            io::ErrorKind::UnexpectedEof => {
                Error::input(format!("{}: the file ends inside an element", path.display()))
            }
            _ => read_error(path, e),
        };
        let body = Body::of(&file, length).map_err(wrong)?;
        let mut header = Header { n_channels: 1, ..Header::default() };
        let pixels = body.walk(file, length, &mut header).map_err(wrong)?;
        let Some(pixels) = pixels else { return Ok(None) };
        let codec = Codec::of(&body.syntax);
        let mut fragments = Vec::new();
        if codec.is_some() && pixels.length.is_none() {
            let at = body.start + pixels.offset;
            fragments = rle::fragments(input::open(path)?.0, at).map_err(wrong)?;
        }
        Ok(Some(Image { path: path.to_owned(), length, body, header, pixels, codec, fragments }))
    }

    /// The slices of the image, which is the `image`th of its series.
    fn slices(&self, image: usize) -> io::Result<Vec<Slice>> {
        let Header { frames, offsets, image: whole, shared, .. } = &self.header;
        let n = self.header.n_frames.unwrap_or(1).max(1);
        for (what, found) in [("groups of frames", frames.len()), ("offsets", offsets.len())] {
            if n > 1 && found != n && found > 0 {
                return Err(invalid(format!("{found} {what}, expected {n} as there are frames")));
            }
        }
        let time = (self.header.time, self.header.instance);
        let slice = |frame: usize| {
            let own = frames.get(frame).copied().unwrap_or_default();
            let mut plane = own.or(*shared).or(*whole);
            if let (Some(offset), Some(position)) = (offsets.get(frame), plane.position) {
                let normal = order::normal(&plane.orientation.unwrap_or_default());
                let along = offset - offsets[0];
                plane.position = Some([0, 1, 2].map(|i| position[i] + along * normal[i]));
            }
            Slice { image, frame, plane, time }
        };
        Ok((0..n).map(slice).collect())
    }

    /// How a slice is called.
    fn shown(&self, slice: &Slice) -> String {
        match self.header.n_frames {
            Some(n) if n > 1 => format!("frame {}", slice.frame),
            _ => self.path.file_name().unwrap_or_default().to_string_lossy().into_owned(),
        }
    }
}
