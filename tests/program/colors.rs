//! Colours by a second field and by properties of the mesh, in exports, pictures and pages.

use crate::common::program::{Folder, stderr};

/// Side of the phantoms.
const SIDE: usize = 16;

/// A folder with the spectrum of a sphere, `s.isp`, and volumes of as many samples: x, and x less the middle.
fn folder() -> Folder {
    let folder = Folder::with_phantom("sphere:16");
    for (name, shift) in [("x", 0.0), ("centered", 7.5)] {
        let x = (0..SIDE.pow(3)).map(|i| (i % SIDE) as f32 - shift);
        let bytes: Vec<u8> = x.flat_map(f32::to_le_bytes).collect();
        folder.write(&format!("{name}_{SIDE}x{SIDE}x{SIDE}_float32.raw"), &bytes);
    }
    folder
}

/// The rows of an OBJ's vertices.
fn vertices(folder: &Folder, name: &str) -> Vec<Vec<f64>> {
    let text = String::from_utf8(folder.read(name)).expect("text");
    let rows = text.lines().filter_map(|line| line.strip_prefix("v "));
    rows.map(|row| row.split(' ').map(|x| x.parse().expect("a number")).collect()).collect()
}

/// The header and the body of a PLY file.
fn ply(folder: &Folder, name: &str) -> (String, Vec<u8>) {
    let file = folder.read(name);
    let mark = b"end_header\n";
    let end = file.windows(mark.len()).position(|w| w == mark).expect("a header") + mark.len();
    (String::from_utf8(file[..end].to_vec()).expect("text"), file[end..].to_vec())
}

/// The number of vertices in the header of a PLY.
fn n_vertices(head: &str) -> usize {
    let line = head.lines().find_map(|line| line.strip_prefix("element vertex ")).expect("a line");
    line.parse().expect("a number")
}

fn float(bytes: &[u8], at: usize) -> f32 {
    f32::from_le_bytes(bytes[at..at + 4].try_into().expect("four bytes"))
}

#[test]
fn a_linear_field_is_exact_at_every_vertex_between_knots_too() {
    let folder = folder();
    folder.run(&[
        "extract",
        "s.isp",
        "-c",
        "83.21%",
        "-o",
        "m.ply",
        "--color-by",
        "x_16x16x16_float32.raw",
    ]);
    let (head, body) = ply(&folder, "m.ply");
    let n = n_vertices(&head);
    assert!(
        head.contains("property uchar blue\nproperty float x_16x16x16_float32_raw\nelement face"),
        "{head}"
    );
    for row in body[..31 * n].chunks_exact(31) {
        let (x, value) = (float(row, 0), float(row, 27));
        // Both are interpolated and rounded apart; coordinates are below 16.
        assert!((x - value).abs() < 1e-5, "{value} at x = {x}");
    }
}

#[test]
fn the_ends_of_a_scale_are_the_ends_of_the_map_and_a_center_its_middle() {
    let folder = folder();
    let by = [
        "extract",
        "s.isp",
        "-c",
        "50%",
        "-o",
        "m.obj",
        "--color-by",
        "centered_16x16x16_float32.raw",
    ];
    folder.run(&[&by[..], &["--color-range", "-2:2", "--color-map", "viridis"]].concat());
    let close = |row: &[f64], color: [u8; 3]| {
        row[3..6].iter().zip(color).all(|(&x, byte)| (255.0 * x - f64::from(byte)).abs() < 6.0)
    };
    let (mut low, mut high) = (0, 0);
    for row in vertices(&folder, "m.obj") {
        if row[0] < 5.5 {
            assert!(close(&row, [0x44, 0x01, 0x54]), "{row:?}");
            low += 1;
        }
        if row[0] > 9.5 {
            assert!(close(&row, [0xfd, 0xe7, 0x25]), "{row:?}");
            high += 1;
        }
    }
    assert!(low > 10 && high > 10);
    // By default, a field of both signs has its zero in the middle of a diverging map.
    folder.run(&by);
    let middle = vertices(&folder, "m.obj").into_iter().filter(|row| (row[0] - 7.5).abs() < 0.05);
    let middle: Vec<_> = middle.collect();
    assert!(middle.iter().all(|row| close(row, [0xec, 0xe5, 0xe1])), "{middle:?}");
}

#[test]
fn numbers_of_triangles_are_in_ply_by_face_and_vtp_by_cell_and_stl_has_none() {
    let folder = folder();
    folder.run(&["extract", "s.isp", "-c", "50%", "-o", "q.ply", "--color", "quality"]);
    let (head, _) = ply(&folder, "q.ply");
    assert!(head.ends_with("vertex_indices\nproperty float radius_ratio\nend_header\n"), "{head}");
    folder.run(&["extract", "s.isp", "-c", "50%", "-o", "q.vtp", "--color", "quality"]);
    let vtp = folder.read("q.vtp");
    let text = String::from_utf8_lossy(&vtp);
    let cells = text.find("<CellData>").expect("cells");
    assert!(text.find("Name=\"radius_ratio\"").expect("an array") > cells);
    let output =
        folder.run_for(&["extract", "s.isp", "-c", "50%", "-o", "q.stl", "--color", "quality"], 2);
    assert!(stderr(&output).contains("STL"), "{}", stderr(&output));
    assert!(!folder.names().contains(&"q.stl".to_owned()));
}

#[test]
fn a_series_lists_its_meshes_with_their_isovalues() {
    let folder = folder();
    folder.run(&[
        "extract",
        "s.isp",
        "--sweep",
        "40%:80%:3",
        "-o",
        "s & s.pvd",
        "--color",
        "quality",
    ]);
    let list = String::from_utf8(folder.read("s & s.pvd")).expect("text");
    let output = folder.run(&["info", "s.isp", "--json"]);
    let report: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let end = |i: usize| report["range"][i].as_f64().expect("a number");
    for i in 0..3 {
        assert!(folder.names().contains(&format!("s & s-000{i}.vtp")), "{:?}", folder.names());
        let row = list.lines().find(|row| row.contains(&format!("file=\"s &amp; s-000{i}.vtp\"")));
        let time = row.and_then(|row| row.split('"').nth(1)).expect("a time");
        let share = 0.4 + 0.2 * i as f64;
        let expected = end(0) * (1.0 - share) + end(1) * share;
        let off = time.parse::<f64>().expect("a number") - expected;
        assert!(off.abs() < 1e-9, "{time}, expected {expected}");
    }
    // A sign that stands for a number elsewhere.
    folder.run(&["extract", "s.isp", "--sweep", "40%:80%:2", "-o", "50% <d>.pvd"]);
    assert!(folder.names().contains(&"50% <d>-0001.vtp".to_owned()), "{:?}", folder.names());
    let list = String::from_utf8(folder.read("50% <d>.pvd")).expect("text");
    assert!(list.contains("file=\"50% &lt;d&gt;-0001.vtp\""), "{list}");
    // Numbered files of any format.
    folder.run(&["extract", "s.isp", "--sweep", "40%:80%:2", "-o", "m-%02d.ply"]);
    assert!(folder.names().contains(&"m-01.ply".to_owned()));
}

#[test]
fn glb_has_linear_colors_and_the_numbers() {
    let folder = folder();
    folder.run(&[
        "extract",
        "s.isp",
        "-c",
        "50%",
        "-o",
        "m.glb",
        "--color-by",
        "x_16x16x16_float32.raw",
    ]);
    let file = folder.read("m.glb");
    let length = u32::from_le_bytes(file[12..16].try_into().expect("four bytes")) as usize;
    let json: serde_json::Value = serde_json::from_slice(&file[20..20 + length]).expect("JSON");
    let attributes = &json["meshes"][0]["primitives"][0]["attributes"];
    assert_eq!(attributes["COLOR_0"], 3);
    assert_eq!(attributes["_X_16X16X16_FLOAT32_RAW"], 4);
    let views = json["bufferViews"].as_array().expect("views");
    let end = |view: &serde_json::Value| {
        view["byteOffset"].as_u64().expect("an offset")
            + view["byteLength"].as_u64().expect("a length")
    };
    assert_eq!(end(&views[4]), json["buffers"][0]["byteLength"].as_u64().expect("a length"));
    let start = 28 + length;
    let offset = |i: usize| start + views[i]["byteOffset"].as_u64().expect("an offset") as usize;
    let n = json["accessors"][0]["count"].as_u64().expect("a count") as usize;
    for v in 0..n {
        let (x, value) = (float(&file, offset(0) + 12 * v), float(&file, offset(4) + 4 * v));
        assert!((x - value).abs() < 1e-5, "{value} at x = {x}");
    }
}

#[test]
fn the_distance_needs_the_volume_and_is_small() {
    let folder = folder();
    let output =
        folder.run_for(&["extract", "s.isp", "-c", "50%", "-o", "d.ply", "--color", "distance"], 2);
    assert!(stderr(&output).contains("--volume VOLUME"), "{}", stderr(&output));
    let samples = isospectrum::volume::phantom("sphere:16").expect("a phantom");
    folder.write("sphere_16x16x16_float32.raw", &samples.samples().to_le_bytes());
    folder.run(&[
        "extract",
        "s.isp",
        "-c",
        "83.21%",
        "-o",
        "d.ply",
        "--color",
        "distance",
        "--volume",
        "sphere_16x16x16_float32.raw",
    ]);
    let (head, body) = ply(&folder, "d.ply");
    let n = n_vertices(&head);
    let values: Vec<f32> = body[..31 * n].chunks_exact(31).map(|row| float(row, 27)).collect();
    let most = values.iter().copied().fold(0.0, f32::max);
    // The tolerance is 0.1 voxel; a sphere's vertices are nearer, and not all on it.
    assert!(values.iter().all(|x| x.is_finite()) && most < 0.1 && most > 1e-6, "{most}");
}

/// The promise about vertices: 99 of 100 within 2.5 times the tolerance of 0.1 voxel.
const NEAR: f32 = 0.25;

#[test]
fn the_distance_is_that_to_the_volume_without_its_noise() {
    let folder = folder();
    // A ball with noise on it that moves the surface by up to half a voxel and more.
    let sample = |i: usize| {
        let p = [i % 16, i / 16 % 16, i / 256].map(|p| p as f64 - 7.5);
        let distance = p.iter().map(|x| x * x).sum::<f64>().sqrt();
        let noise = i.wrapping_mul(2_654_435_761) >> 9 & 31;
        (230.0 - 20.0 * distance).max(0.0) as u8 + (noise as u8).min(25)
    };
    folder.write("noisy_16x16x16_uint8.raw", &(0..4096).map(sample).collect::<Vec<u8>>());
    let noisy = "noisy_16x16x16_uint8.raw";
    let compute = ["compute", noisy, "-o", "n.isp", "--backend", "cpu", "--persistence", "15%"];
    folder.run(&compute);
    let extract = ["extract", "n.isp", "-c", "120", "-o", "n.ply", "--color", "distance"];
    folder.run(&[&extract[..], &["--open", "--volume", noisy]].concat());
    let (head, body) = ply(&folder, "n.ply");
    let n = n_vertices(&head);
    let values = body[..31 * n].chunks_exact(31).map(|row| float(row, 27));
    let n_near = values.filter(|x| x.abs() <= NEAR).count();
    assert!(n > 200 && n_near * 100 >= n * 99, "{n_near} of {n} vertices are near");
}

/// The commands that colour by a second volume without a window.
const COLORING: [&[&str]; 3] = [
    &["render", "s.isp", "-c", "50%", "-o", "p.png"],
    &["extract", "s.isp", "-c", "50%", "-o", "p.ply"],
    &["html", "s.isp", "-o", "p.html"],
];

#[test]
fn a_field_outside_the_surface_and_invalid_scales_are_refused() {
    let folder = folder();
    let header = "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 3 3 3\nspace origin: (500,0,0)\n\
                  space dimension: 3\nspace directions: (1,0,0) (0,1,0) (0,0,1)\nencoding: raw\n\n";
    let samples: Vec<u8> = (0..27).collect();
    folder.write("far.nrrd", &[header.as_bytes(), &samples].concat());
    for command in COLORING {
        let output = folder.run_for(&[command, &["--color-by", "far.nrrd"]].concat(), 3);
        assert!(stderr(&output).contains("contains none of the surfaces"), "{}", stderr(&output));
    }
    for wrong in [["--color-range", "5:1"], ["--color-map", "jet"], ["--color-center", "x"]] {
        let base = ["render", "s.isp", "-c", "50%", "-o", "p.png", "--color", "quality"];
        folder.run_for(&[&base[..], &wrong].concat(), 2);
    }
    for command in COLORING {
        let output = command[command.len() - 1];
        assert!(!folder.names().contains(&output.to_owned()), "{output}");
    }
}

#[test]
fn a_field_of_other_dimensions_without_a_world_is_warned_of() {
    let folder = folder();
    folder.write("other_9x9x9_uint8.raw", &(0..729).map(|i| i as u8).collect::<Vec<u8>>());
    for command in COLORING {
        let output = folder.run(&[command, &["--color-by", "other_9x9x9_uint8.raw"]].concat());
        let text = stderr(&output);
        let warnings: Vec<&str> = text.lines().filter(|line| line.contains("[9, 9, 9]")).collect();
        let [line] = warnings[..] else { panic!("{text}") };
        assert!(line.contains("other_9x9x9_uint8.raw") && line.contains("[16, 16, 16]"), "{line}");
        // The same dimensions are taken to be the same place.
        let output = folder.run(&[command, &["--color-by", "x_16x16x16_float32.raw"]].concat());
        assert!(!stderr(&output).contains("[16, 16, 16]"), "{}", stderr(&output));
    }
}

#[test]
fn a_field_takes_less_than_a_byte_per_knot_of_a_page() {
    let folder = folder();
    folder.run(&["html", "s.isp", "-o", "plain.html"]);
    folder.run(&["html", "s.isp", "-o", "field.html", "--color-by", "x_16x16x16_float32.raw"]);
    let output = folder.run(&["info", "s.isp", "--json"]);
    let report: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let n_knots = report["n_knots"].as_u64().expect("a number") as usize;
    let more = folder.read("field.html").len() - folder.read("plain.html").len();
    // The text of the page holds 6.9 bits per byte; the still picture has a legend and colours.
    assert!(more < n_knots + 60_000, "{more} bytes for {n_knots} knots");
    let output = folder.run_for(&["html", "s.isp", "-o", "n.html", "--color", "normal"], 2);
    assert!(stderr(&output).contains("normal"), "{}", stderr(&output));
}
