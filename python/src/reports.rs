//! Tables of a spectrum as columns by name, from which Python builds structured arrays.

use isospectrum::export::place_in_world;
use isospectrum::spectrum::{Component, Components, End, Event, EventKind, Lineage};
use isospectrum::{Mesh, Placement, Result, Spectrum};
use numpy::IntoPyArray;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::rows;

/// Measures of the isosurfaces at evenly spaced isovalues.
#[derive(Default)]
pub(crate) struct Curves {
    isovalue: Vec<f64>,
    components: Vec<u32>,
    euler: Vec<i64>,
    area: Vec<f64>,
    volume: Vec<f64>,
    triangles: Vec<u32>,
}

impl Curves {
    /// Measures at `n` isovalues from the lowest to the highest of `range`.
    pub(crate) fn of(
        spectrum: &Spectrum,
        mesh_at: impl Fn(f64) -> Result<Mesh>,
        n: usize,
        (low, high): (f64, f64),
    ) -> Result<Self> {
        let mut curves = Curves::default();
        for i in 0..n {
            let t = i as f64 / (n - 1).max(1) as f64;
            // A weighted mean gives both ends exactly; clamped against rounding.
            let isovalue = (low * (1.0 - t) + high * t).clamp(low, high);
            let mesh = mesh_at(isovalue)?;
            let found = Components::of(&mesh);
            curves.triangles.push(mesh.triangles.len() as u32);
            let list = found.moved(&place_in_world(mesh, &spectrum.volume().placement)).list;
            curves.isovalue.push(isovalue);
            curves.components.push(list.len() as u32);
            curves.euler.push(list.iter().map(|c| c.euler).sum());
            curves.area.push(list.iter().map(|c| c.area).sum());
            curves.volume.push(list.iter().map(|c| c.volume).sum());
        }
        Ok(curves)
    }

    /// The columns, by name.
    pub(crate) fn columns(self, py: Python<'_>) -> PyResult<Bound<'_, PyDict>> {
        let columns = PyDict::new(py);
        columns.set_item("isovalue", self.isovalue.into_pyarray(py))?;
        columns.set_item("components", self.components.into_pyarray(py))?;
        columns.set_item("euler", self.euler.into_pyarray(py))?;
        columns.set_item("area", self.area.into_pyarray(py))?;
        columns.set_item("volume", self.volume.into_pyarray(py))?;
        columns.set_item("triangles", self.triangles.into_pyarray(py))?;
        Ok(columns)
    }
}

/// The columns of all events: isovalue, position in the world frame, kind, persistence (NaN if it is not known).
pub(crate) fn events<'py>(
    py: Python<'py>,
    events: &[Event],
    placement: &Placement,
) -> PyResult<Bound<'py, PyDict>> {
    let of = |axis: usize| {
        let place = |e: &Event| {
            let size = placement.cell_size();
            placement.world(std::array::from_fn(|a| e.position[a] / size[a]))[axis]
        };
        events.iter().map(place).collect::<Vec<f64>>()
    };
    let columns = PyDict::new(py);
    let isovalues: Vec<f64> = events.iter().map(|e| e.isovalue).collect();
    columns.set_item("isovalue", isovalues.into_pyarray(py))?;
    for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
        columns.set_item(name, of(axis).into_pyarray(py))?;
    }
    let kinds: Vec<&str> = events.iter().map(|e| kind(e.kind)).collect();
    columns.set_item("kind", kinds)?;
    let persistence = events.iter().map(|e| e.persistence.unwrap_or(f64::NAN));
    columns.set_item("persistence", persistence.collect::<Vec<f64>>().into_pyarray(py))?;
    Ok(columns)
}

/// By event, in their order: the components and the Euler characteristic of the isosurface at its isovalue, which is that above it
/// up to the next event. `components` and `euler` are those at `low`, the lowest isovalue.
pub(crate) fn after_events(
    events: &[Event],
    low: f64,
    components: i64,
    euler: i64,
) -> (Vec<i64>, Vec<i64>) {
    // Components and Euler characteristic that an event adds.
    let change = |event: &Event| match event.kind {
        EventKind::Emerge | EventKind::Split => (1, 2),
        EventKind::Merge | EventKind::Vanish => (-1, -2),
        EventKind::HandleOpen => (0, -2),
        EventKind::HandleClose => (0, 2),
    };
    let mut order: Vec<usize> = (0..events.len()).collect();
    order.sort_by(|&a, &b| events[a].isovalue.total_cmp(&events[b].isovalue));
    // What is at `low` includes the events there.
    let there = order.iter().map(|&i| &events[i]).take_while(|event| event.isovalue <= low);
    let mut now = there.map(change).fold((components, euler), |n, d| (n.0 - d.0, n.1 - d.1));
    let mut after = (vec![0; events.len()], vec![0; events.len()]);
    for same in order.chunk_by(|&a, &b| events[a].isovalue == events[b].isovalue) {
        now = same.iter().map(|&i| change(&events[i])).fold(now, |n, d| (n.0 + d.0, n.1 + d.1));
        for &i in same {
            (after.0[i], after.1[i]) = now;
        }
    }
    after
}

/// The name of a kind of event, as in files and reports.
fn kind(kind: EventKind) -> &'static str {
    match kind {
        EventKind::Emerge => "emerge",
        EventKind::Merge => "merge",
        EventKind::HandleOpen => "handle-open",
        EventKind::Split => "split",
        EventKind::HandleClose => "handle-close",
        EventKind::Vanish => "vanish",
    }
}

/// The columns of the components of one isosurface: those of `isospectrum components --csv`. A missing isovalue is NaN, a missing
/// component number 0.
pub(crate) fn components<'py>(
    py: Python<'py>,
    rows_: &[(usize, Component, Lineage)],
    origin: [f64; 3],
) -> PyResult<Bound<'py, PyDict>> {
    let columns = PyDict::new(py);
    let floats = |of: &dyn Fn(&Component) -> f64| {
        rows_.iter().map(|(_, c, _)| of(c)).collect::<Vec<f64>>().into_pyarray(py)
    };
    let isovalue = |end: Option<End>| end.map_or(f64::NAN, |end| end.isovalue);
    let other = |end: Option<End>| end.and_then(|end| end.joins).map_or(0, |i| i + 1);
    let ends = |of: &dyn Fn(&Lineage) -> Option<End>| {
        let ends: Vec<Option<End>> = rows_.iter().map(|(.., l)| of(l)).collect();
        let isovalues: Vec<f64> = ends.iter().map(|&end| isovalue(end)).collect();
        let others: Vec<u32> = ends.iter().map(|&end| other(end)).collect();
        (isovalues.into_pyarray(py), others.into_pyarray(py))
    };
    let numbers: Vec<u32> = rows_.iter().map(|&(i, ..)| i as u32 + 1).collect();
    columns.set_item("number", numbers.into_pyarray(py))?;
    let cavities: Vec<bool> = rows_.iter().map(|(_, c, _)| c.volume < 0.0).collect();
    columns.set_item("is_cavity", cavities.into_pyarray(py))?;
    columns.set_item("volume", floats(&|c| c.volume.abs()))?;
    columns.set_item("area", floats(&|c| c.area))?;
    let euler: Vec<i64> = rows_.iter().map(|(_, c, _)| c.euler).collect();
    columns.set_item("euler", euler.into_pyarray(py))?;
    let triangles: Vec<u32> = rows_.iter().map(|(_, c, _)| c.n_triangles as u32).collect();
    columns.set_item("triangles", triangles.into_pyarray(py))?;
    let (birth, splits_from) = ends(&|l| l.birth);
    let (death, merges_into) = ends(&|l| l.death);
    columns.set_item("birth", birth)?;
    columns.set_item("splits_from", splits_from)?;
    columns.set_item("death", death)?;
    columns.set_item("merges_into", merges_into)?;
    for (side, name) in ["min", "max"].into_iter().enumerate() {
        let corner = |c: &Component| std::array::from_fn(|a| c.bounds[side][a] + origin[a]);
        let corners: Vec<[f64; 3]> = rows_.iter().map(|(_, c, _)| corner(c)).collect();
        columns.set_item(name, rows(py, corners))?;
    }
    Ok(columns)
}
