//! What the description of a TIFF file says: spacing, and the page of each slice, channel and frame.

use std::io;

use super::planes::{MappedPages, PlaneOrder, map_pages};
use crate::volume::data_error::invalid;
use crate::volume::placement::Unit;

/// Who wrote a description.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Writer {
    #[default]
    Other,
    ImageJ,
    Ome,
}

/// Pages and spacing by the description.
#[derive(Debug, Default)]
pub(super) struct Described {
    pub(super) writer: Writer,
    /// Number of pages, if all belong to the image.
    pub(super) n_pages: Option<usize>,
    /// Slices, channels and frames; without a description all pages are slices. ImageJ gives no number of slices.
    pub(super) order: Option<PlaneOrder>,
    /// The pages of planes in OME-XML; without any they follow each other.
    pub(super) mapped: Vec<MappedPages>,
    /// Whether planes of the image are in other files.
    pub(super) is_in_parts: bool,
    /// Along x, y, z.
    pub(super) spacing: [Option<f64>; 3],
    pub(super) unit: Unit,
    /// Slope and intercept from stored to measured values, for integers without a sign.
    pub(super) calibration: Option<(f64, f64)>,
    /// The file with the OME-XML, if it is another one.
    pub(super) metadata_file: Option<String>,
}

/// The page of each slice, channel and frame.
#[derive(Debug)]
pub(super) struct Planes {
    pub(super) order: PlaneOrder,
    pages: Pages,
    is_in_parts: bool,
}

#[derive(Debug)]
enum Pages {
    /// Of all pages without thumbnails, in the order of planes.
    InOrder(Vec<usize>),
    /// Contiguous pages, which have one directory.
    Contiguous,
    /// By plane.
    Mapped(std::collections::BTreeMap<usize, usize>),
}

impl Planes {
    /// The page of a plane.
    ///
    /// # Errors
    ///
    /// `InvalidData` if the description maps none to it.
    pub(super) fn page(&self, channel: usize, slice: usize, frame: usize) -> io::Result<usize> {
        let plane = self.order.index(channel, slice, frame);
        let page = match &self.pages {
            Pages::InOrder(pages) => pages.get(plane).copied(),
            Pages::Contiguous => Some(plane),
            Pages::Mapped(pages) => pages.get(&plane).copied(),
        };
        let rest = if self.is_in_parts {
            "others are in other files, which are not supported, but a folder of numbered slices is"
        } else {
            "expected one of each plane"
        };
        page.ok_or_else(|| {
            invalid(format!(
                "no page for slice {slice}, channel {channel}, frame {frame} in the OME-XML ({rest})"
            ))
        })
    }

    /// Whether one directory stands for all pages.
    pub(super) fn is_contiguous(&self) -> bool {
        matches!(self.pages, Pages::Contiguous)
    }
}

impl Described {
    /// The pages of all planes: `pages` are those of full resolution among `n_pages`, with `n_colours` numbers per pixel.
    ///
    /// # Errors
    ///
    /// `InvalidData` if channels and frames do not divide the pages, or the description has another number.
    pub(super) fn planes(
        &self,
        pages: Vec<usize>,
        n_pages: usize,
        n_colours: usize,
    ) -> io::Result<Planes> {
        let n = pages.len();
        let Some(mut order) = self.order else {
            let (axes, n_slices) = (['Z', 'C', 'T'], n);
            let order = PlaneOrder { n_slices, n_channels: 1, n_frames: 1, axes };
            return Ok(Planes { order, pages: Pages::InOrder(pages), is_in_parts: false });
        };
        if self.writer == Writer::ImageJ {
            let n_images = self.n_pages.unwrap_or(1);
            let is_contiguous = n_pages == 1 && n_images > 1;
            let n = if is_contiguous { n_images } else { n };
            let each = order.n_channels.saturating_mul(order.n_frames);
            if n != n_images || !n.is_multiple_of(each) {
                return Err(wrong_number(n, &order, Some(n_images)));
            }
            order.n_slices = n / each;
            let pages = if is_contiguous { Pages::Contiguous } else { Pages::InOrder(pages) };
            return Ok(Planes { order, pages, is_in_parts: false });
        }
        // Colours of a page are channels of the image.
        if order.n_channels.is_multiple_of(n_colours) {
            order.n_channels /= n_colours;
        }
        if self.mapped.is_empty() {
            if self.is_in_parts || n != order.n_planes() {
                return Err(wrong_number(n, &order, Some(order.n_planes())));
            }
            return Ok(Planes { order, pages: Pages::InOrder(pages), is_in_parts: false });
        }
        let mut mapped = self.mapped.clone();
        for one in &mut mapped {
            // Some writers count colours as channels.
            if one.first[1] >= order.n_channels {
                one.first[1] /= n_colours;
            }
        }
        let pages = Pages::Mapped(map_pages(order, &mapped, n_pages)?);
        Ok(Planes { order, pages, is_in_parts: self.is_in_parts })
    }
}

/// The error for a number of pages that is not that of the description.
fn wrong_number(n: usize, order: &PlaneOrder, expected: Option<usize>) -> io::Error {
    let in_all = expected.map_or(String::new(), |n| format!(", {n} in all"));
    invalid(format!(
        "{n} pages, expected {} channels of {} frames{in_all} by the description (files in several parts are not supported)",
        order.n_channels, order.n_frames
    ))
}
