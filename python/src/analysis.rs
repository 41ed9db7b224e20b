//! What is known of a volume without computing its spectrum: events, isovalues of interest, the expected size.

use isospectrum::settings::IsovalueRange;
use isospectrum::volume::Statistics;
use isospectrum::{Forecast, suggestions};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arguments::isovalue;
use crate::reports;
use crate::volume::Volume;
use crate::watch::watched;

/// Isovalues of interest, with the reason and the number of branches of the contour tree that it counts.
type Suggested = Vec<(f64, &'static str, Option<usize>)>;

/// Isovalues of interest of a volume, and the columns of its events.
#[pyfunction]
pub(crate) fn analyze<'py>(
    py: Python<'py>,
    volume: &Bound<'py, Volume>,
) -> PyResult<(Suggested, Bound<'py, PyDict>)> {
    let volume = volume.get().0.clone();
    let placement = *volume.placement();
    let found = watched(py, None, move |_| suggestions(&volume))?;
    let rows = found.suggested.into_iter().map(|s| (s.isovalue, s.by, s.n_branches));
    Ok((rows.collect(), reports::events(py, &found.events, &placement)?))
}

/// The expected triangles of a spectrum, the memory of its computation (bytes), and its events.
#[pyfunction]
pub(crate) fn forecast(
    py: Python<'_>,
    volume: &Bound<'_, Volume>,
    range: Option<(String, String)>,
    error: f64,
) -> PyResult<(f64, f64, usize)> {
    let volume = volume.get().0.clone();
    let range = range.map(|(low, high)| -> PyResult<IsovalueRange> {
        Ok(IsovalueRange { low: isovalue(&low)?, high: isovalue(&high)? })
    });
    let range = range.transpose()?;
    let found = watched(py, None, move |_| {
        let of = volume.range();
        let range = range.map(|range| range.resolve(of, Some(&Statistics::of(&volume))));
        Forecast::of_volume(&volume, range.transpose()?.unwrap_or(of), error)
    })?;
    Ok((found.triangles, found.memory, found.events))
}
