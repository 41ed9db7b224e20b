//! From isovalues to keys without the volume.
//!
//! The topology of a volume outlives its [`ExactField`], but is asked by isovalue.

use super::{ExactField, LevelScale};

/// The map from isovalues to keys of one field, without its samples.
#[derive(Clone, Copy, Debug)]
pub struct IsovalueKeys {
    scale: LevelScale,
    m_bits: u32,
    ramp_range: i128,
}

impl IsovalueKeys {
    /// An isovalue in V units, rounded down, and never among the keys of one level: a vertex is
    /// inside (above the isovalue) iff its key is larger, iff its sample is larger. Monotone.
    pub fn key(&self, isovalue: f64) -> i128 {
        let level = self.scale.level(isovalue);
        let whole = level.floor();
        let m = 1i128 << self.m_bits;
        let fraction = ((level - whole) * m as f64) as i128;
        ((whole as i128) << self.m_bits) + fraction.min(m - self.ramp_range - 1)
    }
}

impl ExactField<'_> {
    /// The map of [`ExactField::isovalue_key`] on its own.
    pub fn isovalue_keys(&self) -> IsovalueKeys {
        IsovalueKeys { scale: self.scale, m_bits: self.m_bits, ramp_range: self.ramp_range }
    }
}
