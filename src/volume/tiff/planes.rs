//! Slices, channels and frames among the pages of a TIFF file.

use std::collections::BTreeMap;
use std::io;

use crate::volume::data_error::invalid;

/// Most pages that elements of a description may map in all: bounds the time for many that overlap.
const MAX_MAPPED: usize = 1 << 20;

/// The numbers of slices, channels and frames, and the order in which their planes follow each other.
#[derive(Clone, Copy, Debug)]
pub(super) struct PlaneOrder {
    pub(super) n_slices: usize,
    pub(super) n_channels: usize,
    pub(super) n_frames: usize,
    /// The fastest of Z, C and T first.
    pub(super) axes: [char; 3],
}

impl PlaneOrder {
    /// The order of an axis sequence such as `ZCT`, in any case; none for anything else.
    pub(super) fn axes(text: &str) -> Option<[char; 3]> {
        let axes: [char; 3] = text.to_uppercase().chars().collect::<Vec<_>>().try_into().ok()?;
        ['Z', 'C', 'T'].iter().all(|axis| axes.contains(axis)).then_some(axes)
    }

    /// The index of a plane.
    pub(super) fn index(&self, channel: usize, slice: usize, frame: usize) -> usize {
        let mut index = 0usize;
        for axis in self.axes.iter().rev() {
            let (at, of) = match axis {
                'C' => (channel, self.n_channels),
                'T' => (frame, self.n_frames),
                _ => (slice, self.n_slices),
            };
            index = index.saturating_mul(of).saturating_add(at);
        }
        index
    }

    /// The number of planes.
    pub(super) fn n_planes(&self) -> usize {
        self.n_slices.saturating_mul(self.n_channels).saturating_mul(self.n_frames)
    }
}

/// Consecutive planes in consecutive pages: a `TiffData` element of OME-XML.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct MappedPages {
    pub(super) first_page: usize,
    /// Slice, channel and frame of the first page.
    pub(super) first: [usize; 3],
    /// Number of pages; none for all that the file has.
    pub(super) n_pages: Option<usize>,
}

/// The pages of planes by OME-XML, for a file of `n_pages`. Of several pages for a plane the last counts.
///
/// # Errors
///
/// `InvalidData` for more than [`MAX_MAPPED`].
pub(super) fn map_pages(
    order: PlaneOrder,
    mapped: &[MappedPages],
    n_pages: usize,
) -> io::Result<BTreeMap<usize, usize>> {
    let (mut pages, mut n_mapped) = (BTreeMap::new(), 0usize);
    for MappedPages { first_page, first: [slice, channel, frame], n_pages: n } in mapped.iter() {
        let is_inside =
            *slice < order.n_slices && *channel < order.n_channels && *frame < order.n_frames;
        if !is_inside {
            return Err(invalid(format!(
                "OME-XML: a page of slice {slice}, channel {channel}, frame {frame}, expected less than {}, {}, {}",
                order.n_slices, order.n_channels, order.n_frames
            )));
        }
        let start = order.index(*channel, *slice, *frame);
        let n = n.unwrap_or(usize::MAX).min(n_pages.saturating_sub(*first_page));
        let n = n.min(order.n_planes().saturating_sub(start));
        n_mapped = n_mapped.saturating_add(n);
        if n_mapped > MAX_MAPPED {
            return Err(invalid(format!("OME-XML: more than {MAX_MAPPED} mapped pages")));
        }
        pages.extend((0..n).map(|i| (start + i, first_page + i)));
    }
    Ok(pages)
}

#[cfg(test)]
mod tests {
    use super::*;

    const ORDER: PlaneOrder =
        PlaneOrder { n_slices: 3, n_channels: 2, n_frames: 1, axes: ['Z', 'C', 'T'] };

    #[test]
    fn pages_are_mapped_in_the_order_of_planes_from_the_first_on() {
        let one = |first_page, first, n_pages| MappedPages { first_page, first, n_pages };
        let all = map_pages(ORDER, &[one(0, [0; 3], None)], 6).expect("pages");
        assert_eq!(all.into_iter().collect::<Vec<_>>(), (0..6).map(|i| (i, i)).collect::<Vec<_>>());
        // The second channel in the first pages; the slices of the first backwards, and one page beyond the file.
        let mapped = [
            one(0, [0, 1, 0], Some(3)),
            one(5, [0, 0, 0], Some(1)),
            one(4, [1, 0, 0], Some(1)),
            one(6, [2, 0, 0], Some(1)),
        ];
        let some = map_pages(ORDER, &mapped, 6).expect("pages");
        assert_eq!(some.into_iter().collect::<Vec<_>>(), [(0, 5), (1, 4), (3, 0), (4, 1), (5, 2)]);
        assert!(map_pages(ORDER, &[one(0, [3, 0, 0], None)], 6).is_err());
    }

    #[test]
    fn an_order_has_all_three_axes() {
        assert_eq!(PlaneOrder::axes("zct"), Some(['Z', 'C', 'T']));
        for wrong in ["", "zc", "zcc", "zctx"] {
            assert_eq!(PlaneOrder::axes(wrong), None, "{wrong}");
        }
    }
}
