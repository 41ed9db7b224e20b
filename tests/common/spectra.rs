//! Volumes of phantoms, their spectra, and a shared check: the mesh at an isovalue is a closed manifold with
//! the topology of the isosurface.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use isospectrum::spectrum::{Mesh, Query, Spectrum};
use isospectrum::unstable::extract::count::count;
use isospectrum::unstable::topology::exact::ExactField;
use isospectrum::verify::mesh_topology;
use isospectrum::volume::{Placement, Samples, Volume, phantom};
use isospectrum::{Backend, Choice, Parameters, Silent, compute};

use super::random::Random;

pub(crate) fn phantom_volume(name: &str) -> Arc<Volume> {
    Arc::new(phantom(name).expect("a phantom"))
}

pub(crate) fn cpu() -> Backend {
    Backend::choose(Choice::Cpu, None).expect("the CPU is always there")
}

/// The spectrum of a volume, swept on the CPU.
pub(crate) fn swept_with(volume: &Arc<Volume>, parameters: &Parameters) -> Spectrum {
    let swept = compute(volume, parameters, &cpu(), &Silent);
    swept.unwrap_or_else(|error| panic!("{}: {error}", volume.name()))
}

/// The spectrum of a volume with the default parameters.
pub(crate) fn swept(volume: &Arc<Volume>) -> Spectrum {
    swept_with(volume, &Parameters::default())
}

/// A phantom and its spectrum with the default parameters; computed once for all tests of a binary.
pub(crate) fn phantom_spectrum(name: &str) -> (Arc<Volume>, Arc<Spectrum>) {
    type Entry = Arc<OnceLock<(Arc<Volume>, Arc<Spectrum>)>>;
    static ENTRIES: Mutex<BTreeMap<String, Entry>> = Mutex::new(BTreeMap::new());
    let entry = {
        let mut entries = ENTRIES.lock().unwrap_or_else(PoisonError::into_inner);
        entries.entry(name.to_owned()).or_default().clone()
    };
    let compute = || {
        let volume = phantom_volume(name);
        let spectrum = Arc::new(swept(&volume));
        (volume, spectrum)
    };
    entry.get_or_init(compute).clone()
}

/// A volume rounded to whole numbers from 0 to `n_levels`: many samples are equal, and many events share an isovalue.
pub(crate) fn in_grey_levels(volume: &Volume, n_levels: f64) -> Volume {
    let (low, high) = volume.range();
    let samples = volume.samples();
    let level = |x: f64| (n_levels * (x - low) / (high - low)).round() as u8;
    let samples = (0..samples.len()).map(|i| level(samples.get(i))).collect();
    let volume = Volume::new("levels", volume.dims(), Samples::U8(samples), Placement::default());
    volume.expect("a valid volume")
}

/// Random isovalues of a range.
pub(crate) fn random_isovalues((low, high): (f64, f64), n: usize, seed: u64) -> Vec<f64> {
    let mut random = Random(seed);
    (0..n).map(|_| low + random.unit() * (high - low)).collect()
}

/// Asserts that a mesh is a closed oriented manifold with the components and the Euler characteristic of the isosurface. These
/// are counted on the grid, without a mesh.
#[track_caller]
pub(crate) fn assert_topology(field: &ExactField, isovalue: f64, mesh: &Mesh, what: &str) {
    let found = mesh_topology(mesh.positions.len(), &mesh.triangles);
    assert!(found.is_closed_manifold(), "{what} at {isovalue}: {found:?}");
    let counted = count(field, isovalue);
    let euler: i64 = counted.iter().map(|component| component.euler).sum();
    let expected = (counted.len(), euler);
    assert_eq!((found.components, found.euler), expected, "{what} at {isovalue}");
}

/// Asserts that the meshes of a spectrum have the topology of the volume's isosurfaces, with finite positions and normals.
/// Returns the number of vertices of the largest.
#[track_caller]
pub(crate) fn assert_isosurfaces(
    volume: &Volume,
    spectrum: &Spectrum,
    isovalues: &[f64],
    what: &str,
) -> usize {
    let field = ExactField::new(volume).expect("a field");
    let mut query = Query::new(spectrum);
    let mut largest = 0;
    for &isovalue in isovalues {
        let mesh = query.mesh_at(isovalue).expect("inside the range");
        assert_topology(&field, isovalue, &mesh, what);
        assert_eq!(mesh.normals.len(), mesh.positions.len(), "{what} at {isovalue}");
        let numbers = mesh.positions.iter().chain(&mesh.normals).flatten();
        assert!(numbers.copied().all(f32::is_finite), "{what} at {isovalue}");
        largest = largest.max(mesh.positions.len());
    }
    largest
}
