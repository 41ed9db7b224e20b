//! The samples of a volume in the type of their file.

use num_traits::AsPrimitive;

use super::data_error::invalid;
use super::placement::Placement;
use crate::error::{Error, Result};

/// The samples in the type of their file, x fastest, then y, then z.
///
/// ```
/// use isospectrum::Samples;
///
/// let samples = Samples::from(vec![-1i16, 7]);
/// assert_eq!((samples.type_name(), samples.get(1)), ("int16", 7.0));
/// ```
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Samples {
    /// 8 bit unsigned.
    U8(Vec<u8>),
    /// 8 bit signed.
    I8(Vec<i8>),
    /// 16 bit unsigned.
    U16(Vec<u16>),
    /// 16 bit signed.
    I16(Vec<i16>),
    /// 32 bit unsigned.
    U32(Vec<u32>),
    /// 32 bit signed.
    I32(Vec<i32>),
    /// 32 bit floating point.
    F32(Vec<f32>),
    /// 64 bit floating point.
    F64(Vec<f64>),
}

/// Evaluates an expression with the samples as `Vec` of their type.
macro_rules! with_samples {
    ($samples:expr, $name:ident => $body:expr) => {
        match $samples {
            $crate::volume::samples::Samples::U8($name) => $body,
            $crate::volume::samples::Samples::I8($name) => $body,
            $crate::volume::samples::Samples::U16($name) => $body,
            $crate::volume::samples::Samples::I16($name) => $body,
            $crate::volume::samples::Samples::U32($name) => $body,
            $crate::volume::samples::Samples::I32($name) => $body,
            $crate::volume::samples::Samples::F32($name) => $body,
            $crate::volume::samples::Samples::F64($name) => $body,
        }
    };
}

pub(crate) use with_samples;

/// Samples from the numbers of their type.
macro_rules! from_numbers {
    ($($number:ty => $variant:ident),*) => {
        $(impl From<Vec<$number>> for Samples {
            fn from(numbers: Vec<$number>) -> Self {
                Samples::$variant(numbers)
            }
        })*
    };
}

from_numbers!(u8 => U8, i8 => I8, u16 => U16, i16 => I16, u32 => U32, i32 => I32, f32 => F32, f64 => F64);

impl Samples {
    /// Number of samples.
    pub fn len(&self) -> usize {
        with_samples!(self, s => s.len())
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The sample at flat index `i` as f64 (exact for every type).
    #[inline]
    pub fn get(&self, i: usize) -> f64 {
        #[allow(clippy::unnecessary_cast, reason = "the macro serves every type, f64 among them")]
        {
            with_samples!(self, s => s[i] as f64)
        }
    }

    /// Size in bytes.
    pub fn n_bytes(&self) -> usize {
        with_samples!(self, s => std::mem::size_of_val(&s[..]))
    }

    /// Whether float32 cannot represent all values of the type.
    pub(super) fn is_wide(&self) -> bool {
        matches!(self, Samples::U32(_) | Samples::I32(_) | Samples::F64(_))
    }

    /// `n` samples from index `first` on, which exist.
    pub(super) fn part(&self, first: usize, n: usize) -> Samples {
        with_samples!(self, s => Samples::from(s[first..first + n].to_vec()))
    }

    /// Appends samples of the same type.
    pub(super) fn append(&mut self, more: Samples) -> std::io::Result<()> {
        match (self, more) {
            (Samples::U8(all), Samples::U8(more)) => all.extend(more),
            (Samples::I8(all), Samples::I8(more)) => all.extend(more),
            (Samples::U16(all), Samples::U16(more)) => all.extend(more),
            (Samples::I16(all), Samples::I16(more)) => all.extend(more),
            (Samples::U32(all), Samples::U32(more)) => all.extend(more),
            (Samples::I32(all), Samples::I32(more)) => all.extend(more),
            (Samples::F32(all), Samples::F32(more)) => all.extend(more),
            (Samples::F64(all), Samples::F64(more)) => all.extend(more),
            (all, more) => {
                let (a, b) = (all.type_name(), more.type_name());
                return Err(invalid(format!("samples of {b} after {a}")));
            }
        }
        Ok(())
    }

    /// Appends to `all` the samples of another part of a file.
    pub(super) fn append_to(
        all: &mut Option<Samples>,
        part: std::io::Result<Samples>,
    ) -> std::io::Result<()> {
        match all {
            Some(all) => all.append(part?),
            None => {
                *all = Some(part?);
                Ok(())
            }
        }
    }

    /// Whether the type holds integers only.
    pub fn is_integer(&self) -> bool {
        !matches!(self, Samples::F32(_) | Samples::F64(_))
    }

    /// The samples as bytes, little endian, as in a RAW file.
    pub fn to_le_bytes(&self) -> Vec<u8> {
        with_samples!(self, s => s.iter().flat_map(|v| v.to_le_bytes()).collect())
    }

    /// The name of the type in flags and file names: `uint8`, `float32`, ...
    pub fn type_name(&self) -> &'static str {
        match self {
            Samples::U8(_) => "uint8",
            Samples::I8(_) => "int8",
            Samples::U16(_) => "uint16",
            Samples::I16(_) => "int16",
            Samples::U32(_) => "uint32",
            Samples::I32(_) => "int32",
            Samples::F32(_) => "float32",
            Samples::F64(_) => "float64",
        }
    }
}

/// The result of a reader.
#[derive(Clone, Debug)]
pub(super) struct SampleGrid {
    /// Samples along x, y, z.
    pub(super) dims: [usize; 3],
    /// x fastest.
    pub(super) samples: Samples,
    pub(super) placement: Placement,
}

/// Smallest and largest sample, or the index of the first that is not finite.
///
/// The comparisons stay in the samples' own type and without early exit inside a chunk, so the
/// compiler can use vector instructions: a volume of 1024^3 samples is scanned at memory speed.
pub(super) fn range_of<T: Copy + PartialOrd + AsPrimitive<f64>>(
    samples: &[T],
) -> std::result::Result<(f64, f64), usize> {
    const CHUNK: usize = 4096;
    let Some(&first) = samples.first() else { return Err(0) };
    let (mut low, mut high) = (first, first);
    for (n, chunk) in samples.chunks(CHUNK).enumerate() {
        let mut all_finite = true;
        for &v in chunk {
            low = if v < low { v } else { low };
            high = if v > high { v } else { high };
            all_finite &= v.as_().is_finite();
        }
        if !all_finite {
            let in_chunk = chunk.iter().position(|v| !v.as_().is_finite());
            return Err(n * CHUNK + in_chunk.unwrap_or(0));
        }
    }
    Ok((low.as_(), high.as_()))
}

/// Replaces NaN and infinities by `value`; integers have none.
///
/// # Errors
///
/// [`Error::Usage`] if the value is not finite in the type of the samples.
pub fn replace_not_finite(samples: &mut Samples, value: f64) -> Result<()> {
    let is_usable = match samples {
        Samples::F32(_) => (value as f32).is_finite(),
        _ => value.is_finite(),
    };
    if !is_usable {
        return Err(Error::Usage(format!(
            "{value} as replacement of NaN and infinity, expected a finite {}",
            samples.type_name()
        )));
    }
    match samples {
        Samples::F32(s) => s.iter_mut().filter(|v| !v.is_finite()).for_each(|v| *v = value as f32),
        Samples::F64(s) => s.iter_mut().filter(|v| !v.is_finite()).for_each(|v| *v = value),
        _ => {}
    }
    Ok(())
}
