//! What is done to a volume before anything else, as said on the command line.

use std::path::{Path, PathBuf};
use std::str::FromStr;

use clap::Args;
use isospectrum::volume::{
    Mask, MaskRecord, Placement, Preparation, ReadOptions, Volume, files_of, read_volume,
};
use isospectrum::{Error, Result};

use super::report::{number, percent};
use super::terminal;

/// The arguments wherever a volume can be prepared.
#[derive(Args, Debug)]
pub(super) struct PreparationArguments {
    /// Keep a region: samples from the first up to, not including, the second, or lengths from the first sample in the
    /// volume's unit or another (10:60mm); an empty part is the whole axis
    #[arg(long, value_name = "X0:X1,Y0:Y1,Z0:Z1")]
    crop: Option<Region>,
    /// Replace each sample by the median of those up to R samples away
    #[arg(long, value_name = "R", value_parser = clap::value_parser!(u16).range(1..=64))]
    median: Option<u16>,
    /// Smooth with a Gaussian of this standard deviation: in voxels (the smallest spacing), or a length such as 1.5mm
    #[arg(long, value_name = "S")]
    smooth: Option<Length>,
    /// Replace blocks of N samples along every axis by their mean
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(2..))]
    downsample: Option<u16>,
    /// End surfaces where this mask does: a volume of as many samples, of which those that are not zero are inside;
    /// filters see all samples
    #[arg(long, value_name = "FILE")]
    mask: Option<PathBuf>,
}

impl PreparationArguments {
    /// Whether nothing is to be done.
    pub(super) fn is_none(&self) -> bool {
        let PreparationArguments { crop, median, smooth, downsample, mask } = self;
        let is_filter = median.is_some() || smooth.is_some() || downsample.is_some();
        crop.is_none() && !is_filter && mask.is_none()
    }

    /// The volume to go on with, and what was done to it.
    pub(super) fn apply(&self, volume: Volume) -> Result<(Volume, Preparation)> {
        let placement = volume.placement();
        let crop = self.crop.map(|region| region.of(&volume)).transpose()?;
        let sigma = |length: Length| -> Result<[f64; 3]> {
            let voxels = length.of(placement, placement.voxel())?;
            Ok(placement.spacing.map(|s| voxels * placement.voxel() / s))
        };
        let preparation = Preparation {
            crop,
            median: self.median.map(usize::from),
            smooth: self.smooth.map(sigma).transpose()?,
            downsample: self.downsample.map(usize::from),
            mask: self.mask.as_ref().map(|path| mask_of(path, &volume)).transpose()?,
        };
        if preparation.is_none() {
            return Ok((volume, preparation));
        }
        let before = volume.dims();
        let volume = preparation.apply(volume)?;
        let ([a, b, c], [x, y, z]) = (before, volume.dims());
        log::info!("prepared: {}; {a}x{b}x{c} -> {x}x{y}x{z}", sentence(&preparation));
        Ok((volume, preparation))
    }
}

impl PreparationArguments {
    /// The files that are read: none of them may be written to.
    pub(super) fn files(&self) -> Vec<PathBuf> {
        self.mask.as_deref().map_or_else(Vec::new, files_of)
    }
}

/// A mask for a volume, as a spectrum records it.
fn mask_of(path: &Path, volume: &Volume) -> Result<MaskRecord> {
    let mask = read_volume(path, &ReadOptions::default())?;
    Mask::check(&mask, volume)?;
    Mask::of(&mask).record()
}

/// What was done, for people.
pub(super) fn sentence(done: &Preparation) -> String {
    let mut steps = Vec::new();
    if let Some(region) = done.crop {
        let [x, y, z] = region.map(|[first, end]| format!("{first}:{end}"));
        steps.push(format!("samples {x}, {y}, {z}"));
    }
    if let Some(radius) = done.median {
        steps.push(format!("median of {radius} samples around"));
    }
    if let Some(sigma) = done.smooth {
        let [x, y, z] = sigma.map(number);
        steps.push(format!("Gaussian of {x}, {y}, {z} samples"));
    }
    if let Some(n) = done.downsample {
        steps.push(format!("means of {n}x{n}x{n} samples"));
    }
    if let Some(mask) = &done.mask {
        let share = mask.inside as f64 / mask.dims.iter().product::<usize>() as f64;
        let (name, share) = (terminal::name(&mask.name), percent(share));
        steps.push(format!("mask {name}, {share} of the samples"));
    }
    if steps.is_empty() { "-".to_owned() } else { steps.join("; ") }
}

/// A number of samples or voxels, or a length.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Length {
    value: f64,
    /// Without it, samples or voxels.
    unit: Option<isospectrum::volume::Unit>,
}

impl Length {
    /// How many steps of a length in the volume's unit it is.
    fn of(self, placement: &Placement, step: f64) -> Result<f64> {
        let Some(unit) = self.unit else { return Ok(self.value) };
        let (Some(own), Some(mm)) = (placement.unit.in_mm(), unit.in_mm()) else {
            return Err(Error::Usage(format!(
                "a length in {unit}, but the volume tells no unit, expected a number without one"
            )));
        };
        Ok(self.value * mm / (own * step))
    }
}

impl FromStr for Length {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let end = text.trim_end_matches(|c: char| c.is_alphabetic());
        let unit =
            match text[end.len()..].trim() {
                "" => None,
                name => Some(isospectrum::volume::Unit::from_name(name).ok_or_else(|| {
                    format!("'{text}', expected a unit such as mm, um or angstrom")
                })?),
            };
        let value: Option<f64> = end.trim().parse().ok();
        let value = value.filter(|v: &f64| v.is_finite() && *v >= 0.0);
        let value =
            value.ok_or_else(|| format!("'{text}', expected a number such as 1.5 or 2mm"))?;
        Ok(Length { value, unit })
    }
}

/// `10:60,20:80,:`, each part of an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Region([[Option<Length>; 2]; 3]);

impl Region {
    /// First samples and those behind the last.
    fn of(self, volume: &Volume) -> Result<[[usize; 2]; 3]> {
        let (placement, dims) = (volume.placement(), volume.dims());
        let mut region = [[0; 2]; 3];
        for (a, [from, to]) in self.0.into_iter().enumerate() {
            let samples = |length: Length| length.of(placement, placement.spacing[a]);
            // A sample at either end of a length is inside.
            let first = from.map(samples).transpose()?.map_or(0.0, f64::ceil);
            let end = match to {
                None => dims[a] as f64,
                Some(to) if to.unit.is_some() => (samples(to)?.floor() + 1.0).min(dims[a] as f64),
                Some(to) => to.value,
            };
            region[a] = [first as usize, end as usize];
        }
        Ok(region)
    }
}

impl FromStr for Region {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let expected =
            || format!("'{text}', expected three parts such as 10:60,:,0:25 or 5:30mm,:,:");
        let parts: Vec<&str> = text.split(',').collect();
        let parts: [&str; 3] = parts.try_into().map_err(|_| expected())?;
        let mut region = [[None; 2]; 3];
        for (ends, part) in region.iter_mut().zip(parts) {
            let (from, to) = part.trim().split_once(':').ok_or_else(expected)?;
            let read = |text: &str| -> Result<Option<Length>, String> {
                if text.is_empty() { Ok(None) } else { text.parse().map(Some) }
            };
            let (mut from, to) = (read(from)?, read(to)?);
            // `10:60mm` is 10 mm to 60 mm.
            if let (Some(from), Some(to)) = (&mut from, to) {
                from.unit = from.unit.or(to.unit);
            }
            let is_whole = |end: &Length| end.unit.is_some() || end.value.fract() == 0.0;
            if ![from, to].iter().flatten().all(is_whole) {
                return Err(expected());
            }
            *ends = [from, to];
        }
        Ok(Region(region))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use isospectrum::volume::{Samples, Unit};

    fn volume() -> Volume {
        let placement =
            Placement { spacing: [0.5, 1.0, 2.0], unit: Unit::Mm, ..Placement::default() };
        let samples = Samples::U16((0..10 * 8 * 6).collect());
        Volume::new("v", [10, 8, 6], samples, placement).expect("a valid volume")
    }

    #[test]
    fn regions_are_samples_or_lengths() {
        let of = |text: &str| {
            let region: Region = text.parse().expect("a region");
            region.of(&volume()).expect("a length")
        };
        assert_eq!(of("2:7,:,1:"), [[2, 7], [0, 8], [1, 6]]);
        // 1 mm to 3 mm: samples 2 to 6; 500 um to 3 mm: 1 to 3; up to 99 mm: all.
        assert_eq!(of("1:3mm,500um:3mm,:99mm"), [[2, 7], [1, 4], [0, 6]]);
        for wrong in ["", "1:2", "1,2,3", "a:2,:,:", "1.5:3,:,:", "1:2ft,:,:", "-1:3,:,:"] {
            assert!(wrong.parse::<Region>().is_err(), "{wrong}");
        }
    }

    #[test]
    fn lengths_need_a_unit_of_the_volume() {
        let length: Length = "2mm".parse().expect("a length");
        assert_eq!(length.of(volume().placement(), 0.5).expect("mm"), 4.0);
        assert!(matches!(length.of(&Placement::default(), 1.0), Err(Error::Usage(_))));
        assert_eq!("1.5".parse(), Ok(Length { value: 1.5, unit: None }));
        for wrong in ["", "mm", "-1", "nan", "1 parsec"] {
            assert!(wrong.parse::<Length>().is_err(), "{wrong}");
        }
    }
}
