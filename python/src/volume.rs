//! Volumes from arrays and files.

use std::path::PathBuf;

use isospectrum::Samples;
use isospectrum::volume::{
    Outside, Placement, ReadOptions, Space, Unit, phantom, read_volume, replace_not_finite,
};
use numpy::ndarray::ArrayViewD;
use numpy::{Element, PyArrayDyn, PyArrayMethods, PyReadonlyArrayDyn};
use pyo3::prelude::*;

use crate::errors::{raised, usage};
use crate::watch::{detached, watched};

/// A scalar field on a regular grid.
#[pyclass(frozen, module = "isospectrum._native")]
pub(crate) struct Volume(pub(crate) isospectrum::Volume);

/// How to read a file.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct ReadArguments {
    dims: Option<[usize; 3]>,
    r#type: Option<String>,
    endian: Option<String>,
    frame: Option<usize>,
    channel: Option<usize>,
    array: Option<String>,
    series: Option<String>,
    slices: Option<String>,
    spacing: Option<[f64; 3]>,
    origin: Option<[f64; 3]>,
    nan_as: Option<f64>,
    outside: String,
    name: Option<String>,
}

impl ReadArguments {
    fn options(self) -> PyResult<ReadOptions> {
        let slices = self.slices.as_deref().map(str::parse).transpose().map_err(raised)?;
        let big_endian = match self.endian.as_deref() {
            None | Some("little") => false,
            Some("big") => true,
            Some(endian) => {
                return Err(usage(format!("endian '{endian}', expected little or big")));
            }
        };
        Ok(ReadOptions {
            dims: self.dims,
            sample_type: self.r#type,
            big_endian,
            frame: self.frame,
            channel: self.channel,
            array: self.array,
            series: self.series,
            slices,
            spacing: self.spacing,
            origin: self.origin,
            nan_as: self.nan_as,
        })
    }
}

/// A number as reports and labels show it: five significant digits.
#[pyfunction]
pub(crate) fn short_number(x: f64) -> String {
    isospectrum::settings::short_number(x)
}

/// Length of a unit in millimetres, by its name or symbol; `None` for an unknown name.
#[pyfunction]
pub(crate) fn unit_in_mm(name: &str) -> Option<f64> {
    Unit::from_name(name).and_then(Unit::in_mm)
}

#[pymethods]
impl Volume {
    /// A volume from `array[z, y, x]` of one of the eight sample types. `direction` holds the unit vectors of x, y, z.
    #[new]
    #[pyo3(signature = (array, name, origin, spacing, direction, space, unit, nan_as, outside))]
    #[allow(clippy::too_many_arguments, reason = "passed by name in Python")]
    fn new(
        py: Python<'_>,
        array: &Bound<'_, PyAny>,
        name: String,
        origin: [f64; 3],
        spacing: [f64; 3],
        direction: [[f64; 3]; 3],
        space: &str,
        unit: &str,
        nan_as: Option<f64>,
        outside: &str,
    ) -> PyResult<Self> {
        let outside = outside_of(outside)?;
        let placement = placement(origin, spacing, direction, space, unit)?;
        let (dims, mut samples) = samples_of(py, array)?;
        detached(py, || {
            if let Some(value) = nan_as {
                replace_not_finite(&mut samples, value)?;
            }
            Ok(isospectrum::Volume::new(name, dims, samples, placement)?.with_outside(outside))
        })
        .map(Volume)
    }

    /// Reads a file or a folder of slices.
    #[staticmethod]
    fn read(py: Python<'_>, path: PathBuf, options: ReadArguments) -> PyResult<Self> {
        let (outside, name) = (outside_of(&options.outside)?, options.name.clone());
        let options = options.options()?;
        let read = move |_: &_| {
            let volume = read_volume(&path, &options)?.with_outside(outside);
            Ok(match name {
                Some(name) => volume.with_name(name),
                None => volume,
            })
        };
        watched(py, None, read).map(Volume)
    }

    /// A built-in volume, such as `hydrogen:48`.
    #[staticmethod]
    fn phantom(py: Python<'_>, name: &str, outside: &str) -> PyResult<Self> {
        let outside = outside_of(outside)?;
        detached(py, || Ok(phantom(name)?.with_outside(outside))).map(Volume)
    }

    /// Number of samples along x, y, z.
    #[getter]
    fn dims(&self) -> [usize; 3] {
        self.0.dims()
    }

    /// Distance between samples along x, y, z.
    #[getter]
    fn spacing(&self) -> [f64; 3] {
        self.0.placement().spacing
    }

    /// Name of the unit.
    #[getter]
    fn unit(&self) -> String {
        self.0.placement().unit.to_string()
    }

    /// Smallest and largest sample.
    #[getter]
    fn range(&self) -> (f64, f64) {
        self.0.range()
    }
}

/// A placement. A patient's space is in millimetres; other units are converted.
pub(crate) fn placement(
    origin: [f64; 3],
    spacing: [f64; 3],
    direction: [[f64; 3]; 3],
    space: &str,
    unit: &str,
) -> PyResult<Placement> {
    let unit = match unit {
        "" => Unit::Unknown,
        name => Unit::from_name(name).ok_or_else(|| {
            usage(format!("unit '{name}', expected m, cm, mm, um, nm or angstrom"))
        })?,
    };
    let in_unit = Placement { origin, spacing, direction, unit, space: Space::Unknown };
    match space.to_ascii_uppercase().as_str() {
        "" => Ok(in_unit),
        "LPS" => Ok(in_unit.of_patient(Space::Lps)),
        "RAS" => Ok(in_unit.of_patient(Space::Ras)),
        _ => Err(usage(format!("space '{space}', expected LPS or RAS"))),
    }
}

/// Parses the side of the layer around a volume.
pub(crate) fn outside_of(side: &str) -> PyResult<Outside> {
    match side {
        "low" => Ok(Outside::Low),
        "high" => Ok(Outside::High),
        _ => Err(usage(format!("outside '{side}', expected low or high"))),
    }
}

/// A copy of the samples of an array, x fastest, for any memory order of the array.
pub(crate) fn samples_of(
    py: Python<'_>,
    array: &Bound<'_, PyAny>,
) -> PyResult<([usize; 3], Samples)> {
    macro_rules! first_of {
        ($($number:ty),*) => {
            $(if let Ok(array) = array.cast::<PyArrayDyn<$number>>() {
                return copy(py, &array.try_readonly().map_err(|_| usage("the array is being written to"))?);
            })*
        };
    }
    first_of!(u8, i8, u16, i16, u32, i32, f32, f64);
    Err(usage("expected an array of numbers"))
}

fn copy<T: Element + Copy + Send + Sync>(
    py: Python<'_>,
    array: &PyReadonlyArrayDyn<'_, T>,
) -> PyResult<([usize; 3], Samples)>
where
    Samples: From<Vec<T>>,
{
    let view: ArrayViewD<'_, T> = array.as_array();
    let [nz, ny, nx] = *view.shape() else {
        return Err(usage(format!("an array of {} axes, expected 3: z, y, x", view.ndim())));
    };
    let samples = py.detach(|| match view.as_slice() {
        Some(slice) => slice.to_vec(),
        // `outer_iter` yields views, so nothing else is copied.
        None => {
            let mut all = Vec::with_capacity(nx * ny * nz);
            for slice in view.outer_iter() {
                all.extend(slice.iter().copied());
            }
            all
        }
    });
    Ok(([nx, ny, nz], Samples::from(samples)))
}
