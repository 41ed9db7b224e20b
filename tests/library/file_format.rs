//! The spectrum file and the layout of the thesis: round trips.

use std::path::Path;

use crate::common::any_spectrum::any_spectrum;
use crate::common::synthetic::{Growth, growing_sphere, on_lattice, small};
use isospectrum::Error;
use isospectrum::file::{self, from_bytes, in_file_order, thesis, to_bytes, write_atomically};
use isospectrum::spectrum::{Metadata, Patch, Spectrum, quantum};
use isospectrum::volume::{Placement, Space, Unit};
use proptest::prelude::*;

/// Some thousand triangles.
const LARGE: Growth =
    Growth { subdivisions: 4, n_steps: 40, splits: 40, flips: 90, knot_distance: 9 };

/// The parts of a spectrum that a file preserves.
fn kept(spectrum: &Spectrum) -> Spectrum {
    in_file_order(&spectrum.clone().quantised()).expect("valid")
}

fn assert_round_trip(spectrum: &Spectrum) {
    let bytes = to_bytes(spectrum).expect("valid");
    let read = from_bytes(&bytes).expect("just written");
    assert!(read == kept(spectrum), "the spectrum read differs from the one written");
    assert!(to_bytes(&read).expect("valid") == bytes, "writing again gives another file");
    assert!(kept(&read) == read, "a file's spectrum changes when it is arranged or quantised");
}

proptest! {
    #[test]
    fn any_spectrum_survives_a_round_trip(spectrum in any_spectrum()) {
        assert_round_trip(&spectrum);
    }
}

#[test]
fn a_growing_sphere_survives_a_round_trip() {
    assert_round_trip(&small());
    assert_round_trip(&growing_sphere(&LARGE));
}

#[test]
fn vertices_on_lattice_edges_survive_a_round_trip_and_are_stored_compactly() {
    let [on, off] = [0.0, 0.25].map(|off| on_lattice(20, off));
    assert_round_trip(&on);
    assert_round_trip(&off);
    let [on, off] = [on, off].map(|s| to_bytes(&s).expect("valid").len());
    assert!(4 * on < 3 * off, "{on} bytes on the lattice, {off} off it");
    // Without lattice vertices all vertices are stored in the general way.
    let elsewhere = on_lattice(20, 0.0).changed(|about, _| about.volume.dims = [11, 128, 128]);
    assert_round_trip(&elsewhere.expect("valid"));
}

/// The spectrum with two coordinates of three of four vertices rounded to multiples of four quanta, as those of a sweep are.
fn facing_axes(spectrum: &Spectrum) -> Spectrum {
    let step = 4.0 * quantum(spectrum.tolerance()) as f32;
    let faced = spectrum.clone().changed(|_, patch| {
        for (v, ends) in patch.first_knot.windows(2).enumerate() {
            let axis = v % 4;
            for knot in &mut patch.knots[ends[0] as usize..ends[1] as usize] {
                for a in (0..3).filter(|&a| axis < 3 && a != axis) {
                    knot.position[a] = (knot.position[a] / step).round() * step;
                }
            }
        }
    });
    faced.expect("valid")
}

#[test]
fn vertices_that_face_axes_survive_a_round_trip_and_are_stored_compactly() {
    let fine = growing_sphere(&LARGE);
    let faced = facing_axes(&fine);
    assert_round_trip(&faced);
    let [faced, fine] = [&faced, &fine].map(|s| to_bytes(s).expect("valid").len());
    assert!(20 * faced < 19 * fine, "{faced} bytes, {fine} without axes");
}

#[test]
fn an_empty_spectrum_survives_a_round_trip() {
    let spectrum = small().changed(|_, patch| {
        let isovalues = std::mem::take(&mut patch.isovalues);
        *patch = Patch { isovalues, first_knot: vec![0], ..Patch::default() };
    });
    let spectrum = spectrum.expect("valid");
    assert_round_trip(&spectrum);
    let spectrum = spectrum.changed(|about, patch| {
        patch.isovalues.clear();
        about.events.clear();
    });
    assert_round_trip(&spectrum.expect("valid"));
}

#[test]
fn numbers_of_the_description_survive_a_round_trip_exactly() {
    let metadata = serde_json::json!({ "step": 2.0 / 3.0, "adapter": "naïve \"GPU\"" });
    let spectrum = small().changed(|about, patch| {
        about.tolerance = 0.1 + 0.2;
        about.volume.placement.origin = [1e-300, -5.0 / 3.0, 123_456_789.123_456_78];
        about.parameters = Metadata::from_json(&metadata.to_string()).expect("JSON");
        patch.isovalues[0] = -0.1 - 0.2;
        about.range.0 = patch.isovalues[0];
    });
    assert_round_trip(&spectrum.expect("valid"));
}

#[test]
fn positions_are_rounded_to_the_quantum_and_meshes_stay_the_same_surface() {
    let spectrum = small();
    let read = from_bytes(&to_bytes(&spectrum).expect("valid")).expect("just written");
    for i in 0..100 {
        let c =
            spectrum.range().0 + (spectrum.range().1 - spectrum.range().0) * f64::from(i) / 100.0;
        let (before, after) =
            (spectrum.mesh_at(c).expect("inside"), read.mesh_at(c).expect("inside"));
        let corners = |mesh: &isospectrum::spectrum::Mesh| {
            let corner = |&v: &u32| mesh.positions[v as usize].map(f64::from);
            let mut all: Vec<[f64; 3]> = mesh.triangles.as_flattened().iter().map(corner).collect();
            all.sort_by(|a, b| a.partial_cmp(b).expect("finite"));
            all
        };
        let (before, after) = (corners(&before), corners(&after));
        assert_eq!(before.len(), after.len());
        let sum = |corners: &[[f64; 3]], a: usize| corners.iter().map(|p| p[a]).sum::<f64>();
        for a in 0..3 {
            // Each corner moves by half a quantum at most, and f32 rounds below that.
            let moved = (sum(&before, a) - sum(&after, a)).abs() / before.len() as f64;
            assert!(moved <= 0.5 * quantum(spectrum.tolerance()) + 1e-5, "{moved} at {c}");
        }
    }
}

#[test]
fn a_triangle_takes_less_than_two_bytes_and_a_knot_less_than_eight() {
    // The bound that keeps a spectrum of a million triangles below 18 MB, on a mesh a tenth as large.
    let growth =
        Growth { subdivisions: 5, n_steps: 80, splits: 100, flips: 250, knot_distance: 25 };
    let spectrum = growing_sphere(&growth);
    let bytes = to_bytes(&spectrum).expect("valid").len();
    let bound = 2 * spectrum.triangles().len() + 8 * spectrum.knots().len();
    println!(
        "{} triangles, {} vertices, {} knots: {bytes} bytes",
        spectrum.triangles().len(),
        spectrum.n_vertices(),
        spectrum.knots().len()
    );
    assert!(bytes < bound, "{bytes} bytes, expected fewer than {bound}");
}

/// A spectrum of a sheared volume, far from the origin of a patient's space.
fn in_a_sheared_world() -> Spectrum {
    let steps = [[0.1, 0.0, 0.0], [0.05, 0.05 * 3f64.sqrt(), 0.0], [0.0, 0.06, 0.3]];
    let placement = Placement::from_steps([1e7 + 0.015625, -3.5, 1e-7], steps);
    let placed = on_lattice(5, 0.0)
        .changed(|about, _| about.volume.placement = placement.of_patient(Space::Lps));
    placed.expect("valid")
}
#[test]
fn a_sheared_world_survives_a_round_trip() {
    assert_round_trip(&in_a_sheared_world());
    let read = from_bytes(&to_bytes(&in_a_sheared_world()).expect("valid")).expect("just written");
    assert!(read.volume().placement.is_sheared());
    assert_eq!(read.volume().placement.unit, Unit::Mm);
}

#[test]
fn the_golden_file_is_still_read() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden/version_1.isp");
    let written = facing_axes(&small());
    assert_golden(&file::read(&path).expect("the file is checked in"), &written);
}

/// The spectrum read equals the one written.
fn assert_golden(read: &Spectrum, written: &Spectrum) {
    // Sines may differ in the last digit between systems, and by a quantum after rounding.
    let expected = kept(written);
    assert_eq!(read.triangles(), expected.triangles());
    assert_eq!(read.isovalues(), expected.isovalues());
    assert_eq!(read.first_knot(), expected.first_knot());
    assert_eq!(read.events(), expected.events());
    assert_eq!(read.collapses(), expected.collapses());
    assert_eq!(read.volume(), expected.volume());
    let step = quantum(written.tolerance());
    for (a, b) in read.knots().iter().zip(expected.knots()) {
        assert_eq!(a.rank, b.rank);
        for i in 0..3 {
            let [found, expected] = [a, b].map(|knot| f64::from(knot.position[i]));
            assert!((found - expected).abs() <= step);
        }
    }
}

#[test]
fn another_version_is_named() {
    let mut bytes = to_bytes(&small()).expect("valid");
    bytes[8] = 3;
    let crc = crc32fast::hash(&bytes[..12]);
    bytes[12..16].copy_from_slice(&crc.to_le_bytes());
    let error = from_bytes(&bytes).expect_err("a later version").to_string();
    assert_eq!(error, "format version 3, expected 1; a newer isospectrum may read it");
}

#[test]
fn a_file_is_written_to_a_temporary_sibling_and_renamed() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("s.isp");
    file::write(&small(), &path).expect("writable");
    assert_eq!(file::read(&path).expect("just written"), kept(&small()));
    let result = write_atomically(&path, |writer| {
        writer.write_all(b"half")?;
        Err(std::io::ErrorKind::StorageFull.into())
    });
    assert!(matches!(result, Err(Error::Io { .. })));
    assert_eq!(file::read(&path).expect("left alone"), kept(&small()));
    let names: Vec<_> = std::fs::read_dir(folder.path()).expect("readable").collect();
    assert_eq!(names.len(), 1, "files were left behind: {names:?}");
}

#[test]
fn a_path_that_cannot_be_written_is_an_error_of_one_line() {
    let folder = tempfile::tempdir().expect("a folder");
    for path in [folder.path().join("missing/s.isp"), folder.path().to_path_buf()] {
        let error = file::write(&small(), &path).expect_err("not writable").to_string();
        assert!(error.starts_with(&path.display().to_string()) && !error.contains('\n'), "{error}");
    }
    let error = file::read(folder.path().join("missing.isp")).expect_err("no such file");
    assert!(matches!(error, isospectrum::Error::Io { .. }), "{error}");
}

#[cfg(unix)]
#[test]
fn links_are_followed_and_devices_are_written_to() {
    use std::os::unix::fs::{PermissionsExt as _, symlink};
    let folder = tempfile::tempdir().expect("a folder");
    let (path, link) = (folder.path().join("s.isp"), folder.path().join("link.isp"));
    file::write(&small(), &path).expect("writable");
    let plain = folder.path().join("plain");
    std::fs::write(&plain, b"").expect("writable");
    let mode = |path: &Path| std::fs::metadata(path).expect("there").permissions().mode();
    assert_eq!(mode(&path), mode(&plain), "permissions differ from those of any new file");
    std::fs::write(&path, b"old").expect("writable");
    symlink(&path, &link).expect("links exist here");
    file::write(&small(), &link).expect("writable");
    assert!(link.is_symlink());
    assert_eq!(file::read(&path).expect("just written"), kept(&small()));
    file::write(&small(), "/dev/null").expect("takes everything");
    #[cfg(target_os = "linux")]
    assert!(matches!(file::write(&small(), "/dev/full"), Err(Error::Io { .. })));
}

/// The spectrum with isovalues that f32 holds and without caps, as the thesis's layout has them.
fn with_short_isovalues(spectrum: Spectrum) -> Spectrum {
    let short = spectrum.changed(|about, patch| {
        patch.isovalues.iter_mut().for_each(|c| *c = f64::from(*c as f32));
        patch.triangles.iter_mut().for_each(|t| t.cap = false);
        about.range.0 = f64::from(about.range.0 as f32);
        about.range.1 = f64::from(about.range.1 as f32);
    });
    short.expect("valid")
}

#[test]
fn the_layout_of_the_thesis_survives_a_round_trip() {
    let spectrum = with_short_isovalues(small());
    let bytes = thesis::to_bytes(&spectrum).expect("valid");
    let read = thesis::from_bytes(&bytes).expect("just written");
    assert_eq!(read.isovalues(), spectrum.isovalues());
    assert_eq!(read.first_knot(), spectrum.first_knot());
    assert_eq!(read.knots(), spectrum.knots());
    assert_eq!(read.range(), spectrum.range());
    let without_caps = spectrum.triangles().iter().map(|t| (t.vertices, t.birth, t.death));
    assert!(without_caps.eq(read.triangles().iter().map(|t| (t.vertices, t.birth, t.death))));
    let pairs =
        |s: &Spectrum| s.collapses().iter().map(|c| (c.vertex, c.target)).collect::<Vec<_>>();
    assert_eq!(pairs(&read), pairs(&spectrum));
    assert_eq!(thesis::to_bytes(&read).expect("valid"), bytes);
}

/// A file of the thesis, number by number.
struct Words(Vec<u8>);

impl Words {
    fn integers(mut self, numbers: &[u32]) -> Self {
        numbers.iter().for_each(|n| self.0.extend(n.to_le_bytes()));
        self
    }

    fn floats(mut self, numbers: &[f32]) -> Self {
        numbers.iter().for_each(|x| self.0.extend(x.to_le_bytes()));
        self
    }

    fn vertex(self, x: f32, isovalues: &[f32]) -> Self {
        let rows = self.integers(&[isovalues.len() as u32]);
        isovalues.iter().fold(rows, |words, &c| words.floats(&[x, x * x, c, 0.0, 0.0, 1.0, c]))
    }
}

#[test]
fn the_layout_of_the_thesis_is_that_of_section_4_4() {
    let words = Words(vec![]).integers(&[3]);
    let words =
        words.vertex(0.0, &[1.0, 4.0]).vertex(1.0, &[1.0, 4.0]).vertex(2.0, &[1.0, 2.0, 4.0]);
    let words = words.integers(&[1]).floats(&[1.0, 4.0]).integers(&[0, 1, 2]);
    let bytes = words.integers(&[1, 2, 1]).0;
    assert_eq!(bytes.len(), 4 + 3 * 4 + 7 * 28 + 4 + 20 + 4 + 8);
    let spectrum = thesis::from_bytes(&bytes).expect("valid");
    assert_eq!(spectrum.isovalues(), [1.0, 2.0, 4.0]);
    assert_eq!(spectrum.mesh_at(2.5).expect("inside").positions[2], [2.0, 4.0, 2.5]);
    assert_eq!(thesis::to_bytes(&spectrum).expect("valid"), bytes);
}

#[test]
fn triangles_of_the_thesis_continue_with_the_vertex_of_a_collapse() {
    // Vertex 2 ends at 3 and is replaced by 3, which ends at 5 and is replaced by 4.
    let words = Words(vec![]).integers(&[5]).vertex(0.0, &[1.0, 9.0]).vertex(1.0, &[1.0, 9.0]);
    let words = words.vertex(2.0, &[1.0, 3.0]).vertex(3.0, &[1.0, 5.0]).vertex(4.0, &[1.0, 9.0]);
    let words = words.integers(&[1]).floats(&[1.0, 9.0]).integers(&[0, 1, 2]);
    let spectrum = thesis::from_bytes(&words.integers(&[2, 2, 3, 3, 4]).0).expect("valid");
    for (c, x) in [(1.0, 2.0), (2.9, 2.0), (3.0, 3.0), (4.9, 3.0), (5.0, 4.0), (8.9, 4.0)] {
        let mesh = spectrum.mesh_at(c).expect("inside");
        assert_eq!(mesh.triangles, [[0, 1, 2]], "at {c}");
        assert_eq!(mesh.positions[2][0], x, "at {c}");
    }
    let ranks: Vec<_> =
        spectrum.collapses().iter().map(|c| spectrum.isovalues()[c.rank as usize]).collect();
    assert_eq!(ranks, [3.0, 5.0]);
    assert!(spectrum.collapses().iter().all(|c| c.upward));
}

#[test]
fn cyclic_collapses_are_an_error() {
    let words = Words(vec![]).integers(&[4]).vertex(0.0, &[1.0, 9.0]).vertex(1.0, &[1.0, 9.0]);
    let words = words.vertex(2.0, &[1.0, 3.0]).vertex(3.0, &[1.0, 3.0]);
    let words = words.integers(&[1]).floats(&[1.0, 9.0]).integers(&[0, 1, 2]);
    let error = thesis::from_bytes(&words.integers(&[2, 2, 3, 3, 2]).0).expect_err("a circle");
    assert_eq!(error.to_string(), "collapses replace vertices without end, expected chains");
}
