//! Exported meshes, read back byte by byte.

use crate::common::program;
use crate::common::random;
use std::collections::BTreeMap;
use std::sync::Arc;

use glam::DVec3;
use isospectrum::Error;
use isospectrum::export::{
    self, Border, Format, parse_ply, place_in_world, without_caps, write_to,
};
use isospectrum::spectrum::{Components, Mesh};
use isospectrum::volume::{Outside, Placement, Samples, Space, Volume};
use isospectrum::{Backend, Choice, Parameters, Silent, compute};

const FORMATS: [Format; 4] = [Format::Ply, Format::Stl, Format::Obj, Format::Glb];

/// A distance from the middle sample, or its negative, squared.
fn squared_distances(outside: Outside) -> Arc<Volume> {
    let square = |i: usize| (i as i16 - 3).pow(2);
    let samples = (0..343).map(|i| square(i % 7) + square(i / 7 % 7) + square(i / 49));
    let sign = if outside == Outside::High { 1 } else { -1 };
    let samples = Samples::I16(samples.map(|x| sign * x).collect());
    let volume = Volume::new("squared distances", [7; 3], samples, Placement::default());
    Arc::new(volume.expect("a valid volume").with_outside(outside))
}

/// The volume that triangles enclose, positive if they are counter-clockwise seen from outside.
fn enclosed(triangles: impl Iterator<Item = [[f32; 3]; 3]>) -> f64 {
    let volume = |t: [[f32; 3]; 3]| {
        let [p, q, r] = t.map(|p| DVec3::from(p.map(f64::from)));
        p.dot(q.cross(r)) / 6.0
    };
    triangles.map(volume).sum()
}

#[test]
fn triangles_and_normals_face_the_side_of_the_layer_in_every_format() {
    for outside in [Outside::Low, Outside::High] {
        let volume = squared_distances(outside);
        let backend = Backend::choose(Choice::Cpu, None).expect("the CPU");
        let spectrum = compute(&volume, &Parameters::default(), &backend, &Silent).expect("one");
        let mesh = spectrum.mesh_at(if outside == Outside::High { 5.0 } else { -5.0 });
        let mesh = mesh.expect("an isovalue of the range");
        let corners = mesh.triangles.iter().map(|t| t.map(|v| mesh.positions[v as usize]));
        let expected = enclosed(corners);
        // A ball of radius 5^0.5 has 46.8; the isosurface between the samples is inside it.
        assert!((35.0..46.8).contains(&expected), "{outside:?}: {expected} enclosed");
        let components = Components::of(&mesh);
        assert_eq!(components.list.len(), 1);
        assert!(components.list[0].volume > 0.0, "{outside:?}: a cavity");
        for (p, n) in mesh.positions.iter().zip(&mesh.normals) {
            let out: f32 = p.iter().zip(n).map(|(p, n)| (p - 3.0) * n).sum();
            assert!(out > 0.0, "{outside:?}: the normal at {p:?} is {n:?}");
        }

        let ply = parse_ply(&plain(&mesh, Format::Ply)).expect("a mesh");
        let of_ply =
            ply.triangles.iter().map(|t| t.map(|v| ply.positions[v as usize].map(|x| x as f32)));
        let stl = plain(&mesh, Format::Stl);
        let of_stl = stl[84..].chunks_exact(50).map(|t| {
            let corners = f32s(&t[12..48]);
            [0, 3, 6].map(|i| [corners[i], corners[i + 1], corners[i + 2]])
        });
        let glb = plain(&mesh, Format::Glb);
        let (head, data) = glb_chunks(&glb);
        let data = data.expect("a buffer");
        let view = |accessor: &serde_json::Value| {
            let i = head["accessors"][accessor.as_u64().expect("an index") as usize]["bufferView"]
                .as_u64()
                .expect("an index");
            let view = &head["bufferViews"][i as usize];
            let number = |key: &str| view[key].as_u64().unwrap_or(0) as usize;
            &data[number("byteOffset")..][..number("byteLength")]
        };
        let primitive = &head["meshes"][0]["primitives"][0];
        let positions = f32s(view(&primitive["attributes"]["POSITION"]));
        let indices = view(&primitive["indices"]);
        let vertex = |i: usize| positions[3 * u32_at(indices, 4 * i) as usize..][..3].to_vec();
        let of_glb = (0..mesh.triangles.len())
            .map(|t| [0, 1, 2].map(|k| vertex(3 * t + k).try_into().expect("three")));
        let found = [enclosed(of_ply), enclosed(of_stl), enclosed(of_glb)];
        for (found, format) in found.into_iter().zip(["PLY", "STL", "GLB"]) {
            // Positions are the same numbers.
            assert!((found - expected).abs() < 1e-9, "{outside:?}: {found} in {format}");
        }
    }
}

/// A tetrahedron whose last two faces are caps; vertex 4 is used by a cap only.
fn mesh() -> Mesh {
    let third = 1.0 / 3.0;
    Mesh {
        positions: vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, third], [9.0; 3]],
        normals: vec![
            [0.6, 0.0, 0.8],
            [1.0, 0.0, 0.0],
            [0.0, 1.0, 0.0],
            [0.0, 0.0, 1.0],
            [0.0, 0.0, 1.0],
        ],
        triangles: vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 4]],
        caps: vec![false, false, true, true],
    }
}

fn bytes(mesh: &Mesh, placement: &Placement, border: Border, format: Format) -> Vec<u8> {
    let mut bytes = Vec::new();
    write_to(mesh, placement, border, format, &mut bytes).expect("memory takes every byte");
    bytes
}

fn plain(mesh: &Mesh, format: Format) -> Vec<u8> {
    bytes(mesh, &Placement::default(), Border::Closed, format)
}

fn f32s(bytes: &[u8]) -> Vec<f32> {
    bytes.chunks_exact(4).map(|b| f32::from_le_bytes(b.try_into().expect("four"))).collect()
}

fn u32_at(bytes: &[u8], at: usize) -> u32 {
    u32::from_le_bytes(bytes[at..at + 4].try_into().expect("four bytes"))
}

#[test]
fn ply_has_positions_normals_and_triangles() {
    let mesh = mesh();
    let file = plain(&mesh, Format::Ply);
    let mark = b"end_header\n";
    let head = file.windows(mark.len()).position(|w| w == mark).expect("a header") + mark.len();
    let text = std::str::from_utf8(&file[..head]).expect("the header is text");
    assert!(text.starts_with("ply\nformat binary_little_endian 1.0\n"));
    assert!(text.contains("element vertex 5\nproperty float x\n"));
    assert!(
        text.contains("property float nx\nproperty float ny\nproperty float nz\nelement face 4\n")
    );
    assert!(text.contains("property list uchar int vertex_indices\n"));
    let faces = head + 24 * mesh.positions.len();
    for (row, i) in file[head..faces].chunks_exact(24).zip(0..) {
        assert_eq!(f32s(row), [mesh.positions[i], mesh.normals[i]].concat());
    }
    for (row, triangle) in file[faces..].chunks_exact(13).zip(&mesh.triangles) {
        assert_eq!(row[0], 3);
        assert_eq!([1, 5, 9].map(|at| u32_at(row, at)), *triangle);
    }
    assert_eq!(file.len(), faces + 13 * mesh.triangles.len());
    let read = parse_ply(&file).expect("just written");
    let positions: Vec<_> = mesh.positions.iter().map(|p| p.map(f64::from)).collect();
    assert_eq!((read.positions, read.triangles), (positions, mesh.triangles));
}

#[test]
fn stl_has_every_corner_and_the_plane_s_normal() {
    let mesh = mesh();
    let file = plain(&mesh, Format::Stl);
    assert!(!file.starts_with(b"solid"), "that is how text STL starts");
    assert_eq!(u32_at(&file, 80), 4);
    assert_eq!(file.len(), 84 + 50 * 4);
    for (row, triangle) in file[84..].chunks_exact(50).zip(&mesh.triangles) {
        let corners = triangle.map(|v| mesh.positions[v as usize]);
        assert_eq!(f32s(&row[12..48]), corners.as_flattened());
        assert_eq!(row[48..], [0, 0]);
    }
    assert_eq!(f32s(&file[84..96]), [0.0, 0.0, -1.0], "counter-clockwise seen from below");
}

#[test]
fn obj_has_the_same_numbers_counted_from_one() {
    let mesh = mesh();
    let file = String::from_utf8(plain(&mesh, Format::Obj)).expect("text");
    let rows = |key: &str| -> Vec<Vec<String>> {
        let words =
            file.lines().map(|line| line.split(' ').map(str::to_string).collect::<Vec<_>>());
        words.filter(|words| words[0] == key).map(|words| words[1..].to_vec()).collect()
    };
    let numbers = |key: &str| -> Vec<f32> {
        rows(key).concat().iter().map(|word| word.parse().expect("a number")).collect()
    };
    assert_eq!(numbers("v"), mesh.positions.as_flattened());
    assert_eq!(numbers("vn"), mesh.normals.as_flattened());
    assert_eq!(rows("f")[1], ["1//1", "2//2", "4//4"]);
    assert_eq!(rows("f").len(), 4);
}

/// The JSON and the binary chunk of a GLB file, after checks of the container.
fn glb_chunks(file: &[u8]) -> (serde_json::Value, Option<&[u8]>) {
    assert_eq!(&file[..4], b"glTF");
    assert_eq!(u32_at(file, 4), 2);
    assert_eq!(u32_at(file, 8) as usize, file.len());
    let json_length = u32_at(file, 12) as usize;
    assert_eq!(&file[16..20], b"JSON");
    assert_eq!(json_length % 4, 0);
    let json = serde_json::from_slice(&file[20..20 + json_length]).expect("JSON");
    let rest = &file[20 + json_length..];
    if rest.is_empty() {
        return (json, None);
    }
    assert_eq!(&rest[4..8], b"BIN\0");
    assert_eq!(u32_at(rest, 0) as usize, rest.len() - 8);
    (json, Some(&rest[8..]))
}

#[test]
fn glb_has_accessors_that_fit_its_buffer() {
    let mesh = mesh();
    let file = plain(&mesh, Format::Glb);
    let (json, binary) = glb_chunks(&file);
    let binary = binary.expect("a buffer");
    assert_eq!(json["asset"]["version"], "2.0");
    assert_eq!(json["buffers"][0]["byteLength"], binary.len());
    let primitive = &json["meshes"][0]["primitives"][0];
    let view = |accessor: &serde_json::Value, kind: &str, component: u32, size: usize| {
        let accessor = &json["accessors"][accessor.as_u64().expect("an index") as usize];
        assert_eq!(accessor["type"], kind);
        assert_eq!(accessor["componentType"], component);
        let view =
            &json["bufferViews"][accessor["bufferView"].as_u64().expect("an index") as usize];
        let number = |key: &str| view[key].as_u64().expect("a number") as usize;
        let count = accessor["count"].as_u64().expect("a number") as usize;
        assert_eq!(number("byteLength"), count * size);
        binary[number("byteOffset")..][..number("byteLength")].to_vec()
    };
    let positions = view(&primitive["attributes"]["POSITION"], "VEC3", 5126, 12);
    assert_eq!(f32s(&positions), mesh.positions.as_flattened());
    let normals = view(&primitive["attributes"]["NORMAL"], "VEC3", 5126, 12);
    assert_eq!(f32s(&normals), mesh.normals.as_flattened());
    let indices = view(&primitive["indices"], "SCALAR", 5125, 4);
    let indices: Vec<u32> = (0..indices.len() / 4).map(|i| u32_at(&indices, 4 * i)).collect();
    assert_eq!(indices, mesh.triangles.as_flattened());
    assert_eq!(json["accessors"][0]["min"], serde_json::json!([0.0, 0.0, 0.0]));
    assert_eq!(json["accessors"][0]["max"], serde_json::json!([9.0, 9.0, 9.0]));
}

#[test]
fn empty_meshes_are_valid_files() {
    let empty = Mesh::default();
    let ply = parse_ply(&plain(&empty, Format::Ply)).expect("valid");
    assert!(ply.positions.is_empty() && ply.triangles.is_empty());
    let stl = plain(&empty, Format::Stl);
    assert_eq!((stl.len(), u32_at(&stl, 80)), (84, 0));
    assert!(plain(&empty, Format::Obj).starts_with(b"#"));
    let glb = plain(&empty, Format::Glb);
    let (json, binary) = glb_chunks(&glb);
    assert!(binary.is_none());
    // glTF allows no empty arrays; they must be absent.
    assert_eq!(json.as_object().expect("an object").len(), 3);
    assert_eq!(json["scenes"], serde_json::json!([{}]));
}

/// Largest difference of single-precision results computed in double precision: one rounding of
/// coordinates below 128.
const ROUNDING: f32 = 128.0 / (1 << 23) as f32;

#[test]
fn the_world_is_origin_plus_direction_times_spacing_over_cell_size_times_position() {
    // Axes turned by 90 degrees about z. Along y a voxel is the smallest spacing; along x and z 1.5 voxels are a spacing.
    let placement = Placement {
        origin: [10.0, 20.0, 30.0],
        spacing: [2.0, 0.5, 4.0],
        direction: [[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]],
        ..Placement::default()
    };
    let placed = place_in_world(mesh(), &placement);
    let expected = [
        [10.0, 20.0, 30.0],
        [10.0, 20.0 + 2.0 / 1.5, 30.0],
        [9.5, 20.0, 30.0],
        [10.0, 20.0, 30.0 + 4.0 / 4.5],
    ];
    let file = bytes(&mesh(), &placement, Border::Closed, Format::Ply);
    let written = parse_ply(&file).expect("valid").positions;
    for ((found, around), expected) in written.iter().zip(&placed.positions).zip(expected) {
        for i in 0..3 {
            assert!((found[i] - expected[i]).abs() <= f64::from(ROUNDING), "{found:?}");
            let again = f64::from(around[i]) + placement.origin[i];
            assert!((again - expected[i]).abs() <= f64::from(ROUNDING), "{around:?}");
        }
    }
    // The plane 0.6 x + 0.8 z = 0 of the voxel frame: 0.6 / (2 / 1.5) and 0.8 / (4 / 1.5) along the axes, which is 3 to 2.
    let [x, y, z] = placed.normals[0].map(f64::from);
    let length = 13f64.sqrt();
    assert!(x == 0.0 && (y - 3.0 / length).abs() < 1e-6 && (z - 2.0 / length).abs() < 1e-6);
    assert_eq!(placed.triangles, mesh().triangles, "a rotation keeps the orientation");
}

#[test]
fn a_left_handed_volume_turns_its_triangles_around() {
    let mut placement = Placement::default();
    placement.direction[2] = [0.0, 0.0, -1.0];
    let placed = place_in_world(mesh(), &placement);
    assert_eq!(placed.triangles[0], [0, 1, 2]);
    assert_eq!(placed.normals[3], [0.0, 0.0, -1.0]);
    // The face that pointed down now points up, by its corners and by its reflected normal.
    let stl = bytes(&mesh(), &placement, Border::Closed, Format::Stl);
    assert_eq!(f32s(&stl[84..96]), [0.0, 0.0, 1.0]);
}

/// A patient's volume in voxels of 0.01 mm, 100 m from the origin, with axes at 60 degrees.
fn far_and_sheared() -> Placement {
    let steps = [[0.01, 0.0, 0.0], [0.005, 0.005 * 3f64.sqrt(), 0.0], [0.0, 0.0, 0.02]];
    Placement::from_steps([1e5 + 0.375, -1e5, 7.0], steps).of_patient(Space::Ras)
}

#[test]
fn far_from_the_origin_every_format_but_stl_keeps_the_shape() {
    let placement = far_and_sheared();
    let expected: Vec<[f64; 3]> =
        mesh().positions.iter().map(|&p| placement.world_of_voxel(p)).collect();
    // A step of 32-bit floats is 0.0078 there, three quarters of a voxel.
    let near = |found: [f64; 3], expected: [f64; 3]| {
        (0..3).all(|i| (found[i] - expected[i]).abs() < 1e-4 * placement.voxel())
    };
    let ply = bytes(&mesh(), &placement, Border::Closed, Format::Ply);
    let text = String::from_utf8_lossy(&ply[..300]).into_owned();
    assert!(text.contains("comment SPACE=RAS\ncomment unit mm\n"), "{text}");
    assert!(text.contains("property double x\n") && text.contains("property float nx\n"));
    let read = parse_ply(&ply).expect("valid");
    assert_eq!(read.triangles, mesh().triangles);
    assert!(read.positions.iter().zip(&expected).all(|(&f, &e)| near(f, e)));

    let obj = bytes(&mesh(), &placement, Border::Closed, Format::Obj);
    let obj = String::from_utf8(obj).expect("text");
    assert!(obj.contains("# SPACE=RAS\n# unit mm\n"));
    let rows = obj.lines().filter_map(|line| line.strip_prefix("v ")).map(|row| {
        let numbers: Vec<f64> = row.split(' ').map(|x| x.parse().expect("a number")).collect();
        <[f64; 3]>::try_from(numbers).expect("three")
    });
    assert!(rows.zip(&expected).all(|(f, &e)| near(f, e)));

    let glb = bytes(&mesh(), &placement, Border::Closed, Format::Glb);
    let (json, binary) = glb_chunks(&glb);
    let node = &json["nodes"][0];
    assert_eq!(node["translation"], serde_json::json!(placement.origin));
    assert_eq!(node["extras"], serde_json::json!({ "unit": "mm", "space": "RAS" }));
    let around = f32s(&binary.expect("a buffer")[..12 * expected.len()]);
    for (p, &e) in around.chunks_exact(3).zip(&expected) {
        let found = std::array::from_fn(|i| placement.origin[i] + f64::from(p[i]));
        assert!(near(found, e), "{found:?} {e:?}");
    }

    let stl = bytes(&mesh(), &placement, Border::Closed, Format::Stl);
    assert!(String::from_utf8_lossy(&stl[..80]).contains(" SPACE=RAS "));
}

#[test]
fn normals_of_a_sheared_world_are_those_of_its_triangles() {
    let placement = Placement { origin: [0.0; 3], ..far_and_sheared() };
    // The face through the first three vertices points down, as does its normal in the voxel frame.
    let mut flat = mesh();
    flat.triangles = vec![[0, 1, 3]];
    flat.normals = vec![[0.0, -1.0, 0.0]; 5];
    let placed = place_in_world(flat, &placement);
    let [a, b, c] = placed.triangles[0]
        .map(|v| glam::DVec3::from_array(placed.positions[v as usize].map(f64::from)));
    let normal = (b - a).cross(c - a).normalize();
    let kept = glam::DVec3::from_array(placed.normals[0].map(f64::from));
    assert!(normal.dot(kept) > 1.0 - 1e-6, "{normal} {kept}");
}

#[test]
fn near_the_origin_positions_are_32_bit_floats() {
    let placement = Placement { origin: [-120.0, 80.0, 40.0], ..far_and_sheared() };
    let placement = Placement { spacing: [1.0; 3], ..placement };
    let ply = bytes(&mesh(), &placement, Border::Closed, Format::Ply);
    assert!(String::from_utf8_lossy(&ply).contains("property float x\n"));
    let plain = plain(&mesh(), Format::Ply);
    assert_eq!(ply.len(), plain.len() + "comment SPACE=RAS\ncomment unit mm\n".len());
}

#[test]
fn an_open_mesh_has_no_caps_and_no_vertices_of_caps_alone() {
    let open = without_caps(&mesh());
    assert_eq!(open.triangles, [[0, 1, 2], [0, 2, 3]]);
    assert_eq!(open.positions, [[0.0; 3], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0 / 3.0]]);
    assert_eq!(open.normals.len(), 4);
    let file = bytes(&mesh(), &Placement::default(), Border::Open, Format::Ply);
    assert_eq!(parse_ply(&file).expect("valid").triangles, open.triangles);
}

#[test]
fn the_extension_chooses_the_format() {
    let folder = tempfile::tempdir().expect("a folder");
    let names = ["a.ply", "a.STL", "b.obj", "c.Glb"];
    for (name, format) in names.into_iter().zip(FORMATS) {
        let path = folder.path().join(name);
        export::write(&mesh(), &Placement::default(), Border::Closed, &path).expect("writable");
        assert_eq!(std::fs::read(&path).expect("there"), plain(&mesh(), format));
    }
    for name in ["a.vtk", "a", ".ply"] {
        let path = folder.path().join(name);
        let result = export::write(&mesh(), &Placement::default(), Border::Closed, &path);
        assert!(matches!(result, Err(Error::Usage(_))), "{name}");
        assert!(!path.exists());
    }
}

#[test]
fn a_full_writer_is_an_error() {
    for format in FORMATS {
        let mut full = [0; 20];
        let placement = Placement::default();
        let result = write_to(&mesh(), &placement, Border::Closed, format, &mut &mut full[..]);
        assert!(matches!(result, Err(Error::Io { .. })), "{format:?}");
    }
}

#[test]
fn ply_of_other_programs_is_read() {
    let body = "ply\r\nformat ascii 1.0\r\ncomment by hand\r\nelement vertex 3\r\nproperty double x\r\n\
                property double y\r\nproperty double z\r\nproperty uchar red\r\nelement face 1\r\n\
                property list uchar uint vertex_index\r\nproperty list uchar float uv\r\n\
                element edge 1\r\nproperty int a\r\nend_header\r\n\
                0 0 0 255\r\n1e0 0 0 255\r\n0 1.5 0 0\r\n3 2 1 0 2 .5 .5\r\n7\r\n";
    let mesh = parse_ply(body.as_bytes()).expect("valid");
    assert_eq!(mesh.positions[2], [0.0, 1.5, 0.0]);
    assert_eq!(mesh.triangles, [[2, 1, 0]]);
    for (from, to, what) in [
        ("3 2 1 0", "3 2 1 9", "face 0: vertices [2, 1, 9], expected numbers below 3"),
        ("3 2 1 0", "4 2 1 0 0", "face 0: 4 corners, expected triangles"),
        ("1e0 0 0", "nan 0 0", "vertex 1: expected finite x, y and z"),
        ("double y", "double w", "vertex 0: expected finite x, y and z"),
        ("format ascii 1.0", "comment", "the header has no format line"),
        ("vertex_index", "corners", "face 0: expected a list vertex_indices"),
        ("property int a", "property quad a", "header line 'property quad a' is not PLY"),
    ] {
        let error = parse_ply(body.replacen(from, to, 1).as_bytes()).expect_err(what);
        assert_eq!(error.to_string(), what);
    }
}

/// The number of triangles of an STL file, of those without area, and of edges (after welding equal corners) that do not have
/// exactly one triangle in each direction.
fn welded(file: &[u8]) -> [usize; 3] {
    let mut sides: BTreeMap<[[u32; 3]; 2], [u32; 2]> = BTreeMap::new();
    let mut n_flat = 0;
    let rows = file[84..].chunks_exact(50);
    let n = rows.len();
    for row in rows {
        let numbers = f32s(&row[12..48]);
        let corner = |i: usize| [0, 1, 2].map(|k| numbers[3 * i + k]);
        let [a, b, c] = [0, 1, 2].map(|i| glam::DVec3::from_array(corner(i).map(f64::from)));
        n_flat += usize::from((b - a).cross(c - a) == glam::DVec3::ZERO);
        let places = [0, 1, 2].map(|i| corner(i).map(|x| (x + 0.0).to_bits()));
        for i in 0..3 {
            let (p, q) = (places[i], places[(i + 1) % 3]);
            sides.entry([p.min(q), p.max(q)]).or_default()[usize::from(p < q)] += 1;
        }
    }
    [n, n_flat, sides.values().filter(|&&n| n != [1, 1]).count()]
}

#[test]
fn an_stl_of_a_mesh_that_meets_samples_is_closed_when_corners_are_welded() {
    let folder = program::Folder::new();
    // Small whole numbers: at each, the isosurface runs through many samples, and touches itself.
    let mut random = random::Random(7);
    let samples: Vec<u8> = (0..512).map(|_| random.below(6) as u8).collect();
    folder.write("v_8x8x8_uint8.raw", &samples);
    folder.run(&["compute", "-q", "v_8x8x8_uint8.raw", "--backend", "cpu", "-o", "s.isp"]);
    let mut n_merged = 0;
    for isovalue in ["1", "2", "2.5", "3", "4"] {
        folder.run(&["extract", "s.isp", "-c", isovalue, "-o", "m.ply"]);
        let output = folder.run(&["extract", "s.isp", "-c", isovalue, "-o", "m.stl", "--json"]);
        let report: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
        let [n, n_flat, n_bad] = welded(&folder.read("m.stl"));
        assert_eq!(report["n_triangles"], n, "the report has the triangles of the file");
        assert_eq!([n_flat, n_bad], [0, 0], "{n} triangles at {isovalue}");
        let mesh = parse_ply(&folder.read("m.ply")).expect("just written");
        assert!(n > 0 && n <= mesh.triangles.len());
        n_merged += mesh.triangles.len() - n;
    }
    assert!(n_merged > 0, "some vertices are merged");
}
