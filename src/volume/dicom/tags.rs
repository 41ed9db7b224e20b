//! Tags of the DICOM elements that are read.

/// Begin and end of an item, end of a sequence.
pub(super) const ITEM: u32 = 0xfffe_e000;
pub(super) const ITEM_END: u32 = 0xfffe_e00d;
pub(super) const SEQUENCE_END: u32 = 0xfffe_e0dd;

pub(super) const TRANSFER_SYNTAX: u32 = 0x0002_0010;
/// The samples.
pub(super) const PIXEL_DATA: u32 = 0x7fe0_0010;
/// Samples of 32 and 64 bit floating point.
pub(super) const FLOAT_PIXEL_DATA: u32 = 0x7fe0_0008;
pub(super) const DOUBLE_PIXEL_DATA: u32 = 0x7fe0_0009;
/// Offsets of compressed frames, 64 bits each.
pub(super) const EXTENDED_OFFSETS: u32 = 0x7fe0_0001;

/// Functional groups (PS3.3, C.7.6.16): sequences with the properties that all frames share, and those of each frame.
pub(super) const FUNCTIONAL_GROUPS: [u32; 2] = [SHARED_GROUPS, PER_FRAME_GROUPS];
pub(super) const SHARED_GROUPS: u32 = 0x5200_9229;
pub(super) const PER_FRAME_GROUPS: u32 = 0x5200_9230;
/// Sequences in these: plane position, plane orientation, pixel measures, pixel value transformation.
pub(super) const GROUP_MACROS: [u32; 4] = [0x0020_9113, 0x0020_9116, 0x0028_9110, 0x0028_9145];

pub(super) const SERIES_DESCRIPTION: u32 = 0x0008_103e;
pub(super) const SPACING_BETWEEN_SLICES: u32 = 0x0018_0088;
pub(super) const SERIES_UID: u32 = 0x0020_000e;
pub(super) const SERIES_NUMBER: u32 = 0x0020_0011;
pub(super) const INSTANCE_NUMBER: u32 = 0x0020_0013;
pub(super) const IMAGE_POSITION: u32 = 0x0020_0032;
pub(super) const IMAGE_ORIENTATION: u32 = 0x0020_0037;
pub(super) const TEMPORAL_POSITION: u32 = 0x0020_0100;
pub(super) const SAMPLES_PER_PIXEL: u32 = 0x0028_0002;
pub(super) const PHOTOMETRIC_INTERPRETATION: u32 = 0x0028_0004;
pub(super) const PLANAR_CONFIGURATION: u32 = 0x0028_0006;
pub(super) const NUMBER_OF_FRAMES: u32 = 0x0028_0008;
pub(super) const ROWS: u32 = 0x0028_0010;
pub(super) const COLUMNS: u32 = 0x0028_0011;
pub(super) const PIXEL_SPACING: u32 = 0x0028_0030;
pub(super) const BITS_ALLOCATED: u32 = 0x0028_0100;
pub(super) const BITS_STORED: u32 = 0x0028_0101;
pub(super) const HIGH_BIT: u32 = 0x0028_0102;
pub(super) const PIXEL_REPRESENTATION: u32 = 0x0028_0103;
pub(super) const RESCALE_INTERCEPT: u32 = 0x0028_1052;
pub(super) const RESCALE_SLOPE: u32 = 0x0028_1053;
pub(super) const GRID_FRAME_OFFSETS: u32 = 0x3004_000c;
pub(super) const DOSE_SCALING: u32 = 0x3004_000e;

/// A tag as the standard writes it.
pub(super) fn format_tag(tag: u32) -> String {
    format!("({:04x},{:04x})", tag >> 16, tag & 0xffff)
}
