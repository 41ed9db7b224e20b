//! From isovalues to keys without the volume.
//!
//! The topology of a volume outlives its exact field, but is queried by isovalue.

/// Most steps between the minimum and the maximum of floating point samples, as a power of two; at least half of them
/// are used.
const FLOAT_LEVEL_BITS: u32 = 44;

/// From volume values to levels and back: `level = (value - origin) / step`.
#[derive(Clone, Copy, Debug)]
pub(super) enum LevelScale {
    /// Levels are the samples.
    Identity,
    /// Levels are whole steps of 2^-[`FLOAT_LEVEL_BITS`] times four `quarters` above `low`, which is a multiple of the step.
    Steps { low: f64, quarters: f64 },
}

impl LevelScale {
    /// For floating point samples with a minimum and a quarter of the range, rounded up to a power of two. Samples that are
    /// multiples of the step, such as 32-bit ones that are not tiny, are whole levels.
    pub(super) fn steps(minimum: f64, quarters: f64) -> LevelScale {
        let step = quarters / (1u64 << (FLOAT_LEVEL_BITS - 2)) as f64;
        let low = Some((minimum / step).floor() * step).filter(|low| low.is_finite());
        LevelScale::Steps { low: low.unwrap_or(minimum), quarters }
    }

    /// The level of a volume value with its fraction. Monotone, so order is kept.
    pub(super) fn level(self, value: f64) -> f64 {
        let level = match self {
            LevelScale::Identity => value,
            // Quartered, so that no difference of finite numbers overflows.
            LevelScale::Steps { low, quarters } => {
                (value * 0.25 - low * 0.25) / quarters * (1u64 << FLOAT_LEVEL_BITS) as f64
            }
        };
        let bound = (1u64 << 52) as f64;
        level.clamp(-bound, bound)
    }

    /// The volume value of a level.
    pub(super) fn value(self, level: f64) -> f64 {
        match self {
            LevelScale::Identity => level,
            LevelScale::Steps { low, quarters } => {
                low + level / (1u64 << FLOAT_LEVEL_BITS) as f64 * quarters * 4.0
            }
        }
    }
}

/// The map from isovalues to keys of one field, without its samples.
#[derive(Clone, Copy, Debug)]
pub struct IsovalueKeys {
    pub(super) scale: LevelScale,
    pub(super) m_bits: u32,
    pub(super) ramp_range: i128,
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

    /// The ramp's largest magnitude in V units: keys of one level differ by less.
    pub fn ramp_range(&self) -> i128 {
        self.ramp_range
    }
}
