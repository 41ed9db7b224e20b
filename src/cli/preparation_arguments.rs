//! What is done to a volume before anything else, as said on the command line.

use std::path::PathBuf;

use clap::Args;
use isospectrum::Result;
use isospectrum::settings::{Length, PreparationSettings, Region};
use isospectrum::volume::{Preparation, ReadOptions, Volume, files_of, read_volume};

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
    /// True if the volume is left as it is.
    pub(super) fn is_none(&self) -> bool {
        let PreparationArguments { crop, median, smooth, downsample, mask } = self;
        let is_filter = median.is_some() || smooth.is_some() || downsample.is_some();
        crop.is_none() && !is_filter && mask.is_none()
    }

    /// The settings that the flags give; the mask is read.
    fn settings(&self) -> Result<PreparationSettings> {
        let read = |path: &PathBuf| read_volume(path, &ReadOptions::default());
        Ok(PreparationSettings {
            crop: self.crop,
            median: self.median.map(usize::from),
            smooth: self.smooth,
            downsample: self.downsample.map(usize::from),
            mask: self.mask.as_ref().map(read).transpose()?,
        })
    }

    /// The prepared volume, and how it was prepared.
    pub(super) fn apply(&self, volume: Volume) -> Result<(Volume, Preparation)> {
        let preparation = self.settings()?.resolve(&volume)?;
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
