//! Arguments from Python, parsed to settings of the library.

use isospectrum::settings::{
    AxisRange, IsovalueRange, Length, PreparationSettings, Region, SweepSettings,
};
use isospectrum::{Choice, Error, Isovalue, Parameters};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::errors::{raised, usage};
use crate::volume::Volume;

/// A part of an axis: a text such as `10:60mm`, or its two ends as texts.
#[derive(FromPyObject)]
pub(crate) enum Axis {
    Text(String),
    Ends(Option<String>, Option<String>),
}

/// A region: a text such as `10:60,:,0:25`, or three axes.
#[derive(FromPyObject)]
pub(crate) enum Crop {
    Text(String),
    Axes([Axis; 3]),
}

/// Steps before the sweep; lengths are texts such as `1.5mm`.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct PreparationArguments<'py> {
    crop: Option<Crop>,
    median: Option<usize>,
    smooth: Option<String>,
    downsample: Option<usize>,
    mask: Option<Bound<'py, Volume>>,
    pub(crate) persistence: Option<String>,
    pub(crate) min_component: Option<u32>,
}

/// Parses an optional argument; an error names it.
pub(crate) fn parsed<T: std::str::FromStr<Err = Error>>(
    name: &str,
    text: Option<&str>,
) -> PyResult<Option<T>> {
    let parse = |text: &str| text.parse::<T>().map_err(|error| usage(format!("{name} {error}")));
    text.map(parse).transpose()
}

/// Settings for the preparation of a volume.
pub(crate) fn preparation_settings(
    arguments: PreparationArguments<'_>,
) -> PyResult<PreparationSettings> {
    let PreparationArguments { crop, median, smooth, downsample, mask, .. } = arguments;
    Ok(PreparationSettings {
        crop: crop.map(region).transpose()?,
        median,
        smooth: parsed("smooth", smooth.as_deref())?,
        downsample,
        mask: mask.map(|mask| mask.get().0.clone()),
    })
}

fn region(crop: Crop) -> PyResult<Region> {
    let length = |text: Option<String>| parsed::<Length>("crop", text.as_deref());
    let axis = |axis: Axis| -> PyResult<AxisRange> {
        match axis {
            Axis::Text(text) => Ok(parsed::<AxisRange>("crop", Some(&text))?.unwrap_or_default()),
            Axis::Ends(from, to) => Ok(AxisRange { from: length(from)?, to: length(to)? }),
        }
    };
    match crop {
        Crop::Text(text) => Ok(parsed::<Region>("crop", Some(&text))?.unwrap_or_default()),
        Crop::Axes([x, y, z]) => Region::new([axis(x)?, axis(y)?, axis(z)?]).map_err(raised),
    }
}

/// Parses the name of a backend.
pub(crate) fn choice_of(backend: &str) -> PyResult<Choice> {
    match backend {
        "auto" => Ok(Choice::Auto),
        "gpu" => Ok(Choice::Gpu),
        "cpu" => Ok(Choice::Cpu),
        _ => Err(usage(format!("backend '{backend}', expected auto, gpu or cpu"))),
    }
}

/// Settings of the sweep: parameters by name, and isovalues as texts.
pub(crate) fn sweep_settings(
    parameters: &Bound<'_, PyDict>,
    range: Option<(String, String)>,
    start: Option<String>,
) -> PyResult<SweepSettings> {
    let range = range.map(|(low, high)| -> PyResult<IsovalueRange> {
        Ok(IsovalueRange { low: isovalue(&low)?, high: isovalue(&high)? })
    });
    Ok(SweepSettings {
        range: range.transpose()?,
        start: start.map(|c| isovalue(&c)).transpose()?,
        parameters: parameters_of(parameters)?,
    })
}

/// The default parameters of a sweep, as JSON: what the package's arguments are checked against.
#[pyfunction]
pub(crate) fn default_parameters() -> PyResult<String> {
    let defaults = serde_json::to_string(&Parameters::default());
    defaults.map_err(|e| raised(Error::internal(e.to_string())))
}

/// Parses an isovalue.
pub(crate) fn isovalue(text: &str) -> PyResult<Isovalue> {
    text.parse().map_err(raised)
}

/// The default parameters with the given ones replaced.
fn parameters_of(given: &Bound<'_, PyDict>) -> PyResult<Parameters> {
    let mut parameters = Parameters::default();
    for (name, value) in given {
        let name: String = name.extract()?;
        let number = || value.extract::<f64>();
        match name.as_str() {
            "step" => parameters.step = Some(number()?),
            "samples" => parameters.samples = Some(value.extract()?),
            "error" => parameters.error = number()?,
            "min_quality" => parameters.min_quality = number()?,
            "min_area" => parameters.min_area = number()?,
            "refine_area" => parameters.refine_area = number()?,
            "max_edge" => parameters.max_edge = number()?,
            "relax" => parameters.relax_strength = number()?,
            "relax_force" => parameters.relax_force = number()?,
            "relax_iterations" => parameters.relax_iterations = value.extract()?,
            "starts" => parameters.starts = Some(value.extract()?),
            "initial_mesh" => parameters.initial_mesh = Some(value.extract()?),
            _ => return Err(usage(format!("unknown parameter '{name}'"))),
        }
    }
    Ok(parameters)
}
