//! Flags for the region of a volume, its filters and its mask.

use std::path::PathBuf;

use clap::Args;
use isospectrum::Result;
use isospectrum::settings::{Length, PreparationSettings, Region};
use isospectrum::volume::{Preparation, ReadOptions, Volume, files_of, read_volume};

use super::report::{number, percent};
use super::{heading, terminal};

/// The flags of every command that can prepare a volume.
#[derive(Args, Debug)]
#[command(next_help_heading = heading::REGION)]
pub(super) struct PreparationArguments {
    /// Keep a region, e.g. 10:60,:,0:25 or 5:30mm,:,:
    ///
    /// X0:X1,Y0:Y1,Z0:Z1. Each axis takes samples, the first included and the second not, or lengths from the first sample,
    /// in the unit of the volume or another (10:60mm). An empty end is that of the axis.
    #[arg(long, value_name = "REGION")]
    crop: Option<Region>,
    /// Replace samples by the median within R samples
    #[arg(long, value_name = "R", value_parser = clap::value_parser!(u16).range(1..=64))]
    median: Option<u16>,
    /// Smooth with a Gaussian of this standard deviation
    ///
    /// In voxels (the smallest spacing), or a length such as 1.5mm.
    #[arg(long, value_name = "S", allow_hyphen_values = true)]
    smooth: Option<Length>,
    /// Replace blocks of N^3 samples by their mean
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(2..))]
    downsample: Option<u16>,
    /// End surfaces at the border of this mask
    ///
    /// The mask is a volume of the same dimensions. Samples that are not 0 are inside. Filters see all samples.
    #[arg(long, value_name = "FILE")]
    mask: Option<PathBuf>,
}

impl PreparationArguments {
    /// True if no flag is given.
    pub(super) fn is_none(&self) -> bool {
        let PreparationArguments { crop, median, smooth, downsample, mask } = self;
        let is_filter = median.is_some() || smooth.is_some() || downsample.is_some();
        crop.is_none() && !is_filter && mask.is_none()
    }

    /// Returns the settings; reads the mask.
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

    /// Returns the prepared volume and the record of the preparation.
    pub(super) fn apply(&self, volume: Volume) -> Result<(Volume, Preparation)> {
        let preparation = self.settings()?.resolve(&volume)?;
        if preparation.is_none() {
            return Ok((volume, preparation));
        }
        let before = volume.dims();
        let volume = preparation.apply(volume)?;
        let ([a, b, c], [x, y, z]) = (before, volume.dims());
        log::info!("prepared: {}; {a}x{b}x{c} -> {x}x{y}x{z}", describe(&preparation));
        Ok((volume, preparation))
    }

    /// Returns the files that are read, which no output may replace.
    pub(super) fn files(&self) -> Vec<PathBuf> {
        self.mask.as_deref().map_or_else(Vec::new, files_of)
    }
}

/// Describes a preparation for people.
pub(super) fn describe(done: &Preparation) -> String {
    let mut steps = Vec::new();
    if let Some(region) = done.crop {
        let [x, y, z] = region.map(|[first, end]| format!("{first}:{end}"));
        steps.push(format!("samples {x}, {y}, {z}"));
    }
    if let Some(radius) = done.median {
        steps.push(format!("median within {radius} samples"));
    }
    if let Some(sigma) = done.smooth {
        let [x, y, z] = sigma.map(number);
        steps.push(format!("Gaussian of {x}, {y}, {z} samples"));
    }
    if let Some(n) = done.downsample {
        steps.push(format!("mean of {n}x{n}x{n} samples"));
    }
    if let Some(mask) = &done.mask {
        let share = mask.inside as f64 / mask.dims.iter().product::<usize>() as f64;
        let (name, share) = (terminal::name(&mask.name), percent(share));
        steps.push(format!("mask {name}, {share} of the samples"));
    }
    if steps.is_empty() { "-".to_owned() } else { steps.join("; ") }
}
