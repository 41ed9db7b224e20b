//! The page in a browser: writes pages and the values that they must show with the program, and runs `tests/page/*.test.mjs`.
//!
//! The tests need node, Chromium and playwright-core, and an adapter for the pictures of the program. They fail if one of them is
//! missing, and say what to install.

use std::path::Path;
use std::process::Command;

use isospectrum::export::read_ply;
use isospectrum::file;
use isospectrum::page::DEFAULT_STEP;
use isospectrum::render::{Camera, Gpu, Renderer, View};
use isospectrum::spectrum::Spectrum;
use isospectrum::verify::mesh_topology;
use isospectrum::volume::{Histogram, Samples, Statistics, phantom};

use super::{folder_with_spectrum, spectrum};
use crate::common::program::Folder;

/// The isovalues of compared pictures and meshes as shares of the range: closed by caps, before and after the event at which the
/// hole of the torus opens, and near the end.
const SHARES: [f64; 4] = [0.5, 0.6, 0.75, 0.9];

/// The view of compared pictures in the address of the page: [`Camera::default`] at the distance at which the volume fits.
const CAMERA: &str = "35,22,1";

/// Width and height of compared pictures, pixels.
const SIZE: [u32; 2] = [640, 480];

/// Runs `tests/page/NAME.test.mjs` with node, all files if there is no name.
fn run_node(folder: &Folder, name: Option<&str>) {
    let tests = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/page");
    assert!(
        tests.join("node_modules/playwright-core").is_dir(),
        "the page is tested with playwright-core: npm ci --prefix tests/page (scripts/setup does it)"
    );
    let mut files: Vec<String> = std::fs::read_dir(&tests)
        .expect("readable")
        .map(|entry| entry.expect("readable").file_name().to_string_lossy().into_owned())
        .filter(|file| match name {
            Some(name) => *file == format!("{name}.test.mjs"),
            None => file.ends_with(".test.mjs"),
        })
        .collect();
    files.sort();
    assert!(!files.is_empty());
    let output = Command::new("node")
        .args(["--test", "--test-concurrency=2"])
        .args(&files)
        .current_dir(&tests)
        .env("ISOSPECTRUM_PAGE", folder.path())
        .output()
        .unwrap_or_else(|error| {
            panic!(
                "node: {error}; the page is tested with node: apt-get install nodejs npm chromium"
            )
        });
    let stdout = String::from_utf8_lossy(&output.stdout);
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{stdout}\n{stderr}");
    println!("{stdout}");
}

#[test]
fn the_page_works_in_a_browser() {
    let folder = folder_with_pages();
    run_node(&folder, None);
    // The meshes that the page saved pass the checks of the program's own meshes.
    for i in 0..SHARES.len() {
        let read = |name: String| read_ply(folder.path().join(name)).expect("readable");
        let mesh = read(format!("downloaded-{i}.ply"));
        let wanted = read(format!("extracted-{i}.ply"));
        let found = mesh_topology(mesh.positions.len(), &mesh.triangles);
        assert!(found.is_closed_manifold(), "{found:?}");
        assert_eq!(found, mesh_topology(wanted.positions.len(), &wanted.triangles));
    }
}

#[test]
fn normals_in_the_page_face_away_from_the_enclosed_side() {
    const SIDE: usize = 14;
    const CENTER: [f64; 3] = [6.3, 7.1, 6.6];
    const RADIUS: f64 = 4.0;
    let distance = |i: usize| {
        let at = [i % SIDE, i / SIDE % SIDE, i / SIDE / SIDE].map(|x| x as f64);
        at.iter().zip(CENTER).map(|(x, middle)| (x - middle).powi(2)).sum::<f64>().sqrt()
    };
    let folder = Folder::new();
    let mut enclosed = Vec::new();
    // A ball that is high inside, and one that is low inside.
    for (outside, sign) in [("low", -1.0), ("high", 1.0)] {
        let samples = (0..SIDE.pow(3)).flat_map(|i| ((sign * distance(i)) as f32).to_le_bytes());
        let volume = format!("{outside}_{SIDE}x{SIDE}x{SIDE}_float32.raw");
        folder.write(&volume, &samples.collect::<Vec<u8>>());
        let (spectrum, page) = (format!("{outside}.isp"), format!("{outside}.html"));
        let flags = ["--outside", outside, "--backend", "cpu", "-q", "-o", &spectrum];
        folder.run(&[&["compute", &volume][..], &flags].concat());
        folder.run(&["html", &spectrum, "-q", "-o", &page]);
        let isovalue = sign * RADIUS;
        enclosed.push(serde_json::json!({ "name": page, "isovalue": isovalue, "center": CENTER }));
    }
    let expected = serde_json::json!({ "shaded": {}, "enclosed": enclosed });
    folder.write("expected.json", expected.to_string().as_bytes());
    run_node(&folder, Some("normals"));
}

mod real_volumes {
    use super::{Folder, run_node};
    use crate::common::data;

    #[test]
    #[ignore = "needs $ISOSPECTRUM_DATA"]
    fn shading_normals_in_the_page_of_nucleon_are_those_of_its_mesh() {
        let nucleon = data::file("nucleon_41x41x41_uint8.raw");
        let volume = nucleon.to_str().expect("a name in UTF-8");
        let folder = Folder::new();
        // The trajectories of the extraction at 188.7 reach from 134 to 195.
        let flags = ["--range", "133:196", "--backend", "cpu", "-o", "nucleon.isp"];
        folder.run(&[&["compute", "-q", volume][..], &flags].concat());
        folder.run(&["html", "nucleon.isp", "-o", "nucleon.html"]);
        folder.write("expected.json", br#"{ "shaded": { "nucleon.html": [188.7] } }"#);
        run_node(&folder, Some("normals"));
    }
}

/// Writes the pages, and the values that they must show, into a folder.
fn folder_with_pages() -> Folder {
    let folder = folder_with_spectrum();
    let spectrum = spectrum();
    let volume = phantom("torus:24").expect("a phantom");
    let (low, high) = spectrum.range();
    let isovalues = SHARES.map(|share| low * (1.0 - share) + high * share);
    // Two processes at a time, as many as there are processors on a small machine.
    let (components, bricks, linked) = std::thread::scope(|scope| {
        let others = scope.spawn(|| {
            let bricks = write_noise(&folder);
            write_ball(&folder);
            (components_of_noise(&folder), bricks, write_linked(&folder))
        });
        write_torus(&folder);
        write_tall(&folder);
        write_meshes(&folder, &isovalues);
        write_native_pictures(&folder, &spectrum, &isovalues);
        write_colors(&folder, isovalues[1]);
        write_up(&folder, isovalues[1]);
        write_looks(&folder, isovalues[2], isovalues[1]);
        others.join().expect("pages of the other volumes")
    });
    let events: Vec<f64> = spectrum.events().iter().map(|e| e.isovalue).collect();
    // The event that is farthest from all others can be clicked.
    let distance = |&c: &f64| {
        let others = events.iter().map(|e| (e - c).abs()).filter(|&d| d > 0.0);
        others.fold(f64::INFINITY, f64::min)
    };
    let event = events.iter().copied().max_by(|a, b| distance(a).total_cmp(&distance(b)));
    let statistics = Statistics::of(&volume);
    let expected = serde_json::json!({
        "range": [low, high],
        "isovalues": isovalues,
        "width": SIZE[0],
        "height": SIZE[1],
        "view": CAMERA,
        "first": spectrum.shown_first(),
        "step": DEFAULT_STEP,
        "shaded": { "page.html": [], "noise.html": [] },
        "components": components,
        "bricks": bricks,
        "linked": linked,
        "colors": isovalues[1],
        "events": events,
        "unit": spectrum.volume().placement.voxel(),
        "p90": Histogram::of(&volume).percentile(90.0),
        "sigma": statistics.mean + statistics.deviation,
        "n_events": spectrum.events().len(),
        "event": event.expect("a torus has events"),
    });
    folder.write("expected.json", expected.to_string().as_bytes());
    folder
}

/// The page of the torus with all texts, the same with nearly exact positions, and its spectrum in another format.
fn write_torus(folder: &Folder) {
    let volume = phantom("torus:24").expect("a phantom");
    let Samples::F32(samples) = volume.samples() else { panic!("phantoms are of f32") };
    let bytes: Vec<u8> = samples.iter().flat_map(|x| x.to_le_bytes()).collect();
    folder.write("torus_24x24x24_float32.raw", &bytes);
    let texts = ["--title", "A torus & more", "--caption", "A caption.", "--credit", "A credit."];
    let samples = ["--volume", "torus_24x24x24_float32.raw", "--mark", "top:10%=thin,50%"];
    folder.run(&[&["html", "s.isp", "-o", "page.html"][..], &texts, &samples].concat());
    let slice = ["html", "s.isp", "-o", "slice.html", "--slice"];
    folder.run(&[&slice[..], &["--volume", "torus_24x24x24_float32.raw"]].concat());
    folder.run(&["convert", "s.isp", "s.thesis"]);
}

/// The page of a volume whose samples are three times as far apart along z, with slices.
fn write_tall(folder: &Folder) {
    let header =
        "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 8 8 8\nspacings: 1 1 3\nencoding: raw\n\n";
    let samples: Vec<u8> = (0..512).map(|i| (i % 8 + 20 * (i / 64)) as u8).collect();
    folder.write("tall.nrrd", &[header.as_bytes(), &samples].concat());
    folder.run(&["compute", "-q", "tall.nrrd", "-o", "tall.isp", "--backend", "cpu"]);
    folder.run(&["html", "tall.isp", "-o", "tall.html", "--volume", "tall.nrrd", "--slice"]);
}

/// Meshes of the torus as the program extracts them.
fn write_meshes(folder: &Folder, isovalues: &[f64]) {
    for (i, isovalue) in isovalues.iter().map(f64::to_string).enumerate() {
        let mesh = format!("extracted-{i}.ply");
        folder.run(&["extract", "s.isp", "--isovalue", &isovalue, "-o", &mesh]);
    }
}

/// Pictures of the torus as the program draws them.
fn write_native_pictures(folder: &Folder, spectrum: &Spectrum, isovalues: &[f64]) {
    let gpu = Gpu::new(None).expect("an adapter");
    let mut renderer = Renderer::new(&gpu, spectrum).expect("a spectrum that fits the device");
    let [width, height] = SIZE;
    let view = View::default().with_width(width).with_height(height).with_camera(Camera::default());
    for (i, &isovalue) in isovalues.iter().enumerate() {
        let mut bytes = Vec::new();
        let picture = renderer.draw(isovalue, &view).expect("a picture");
        picture.encode_png(&mut bytes).expect("memory takes every byte");
        folder.write(&format!("native-{i}.png"), &bytes);
    }
}

/// Draws a picture of the torus with the program.
fn render(folder: &Folder, isovalue: f64, picture: &str, flags: &[&str]) {
    let isovalue = isovalue.to_string();
    let size = format!("{}x{}", SIZE[0], SIZE[1]);
    let base = ["render", "s.isp", "-c", &isovalue, "-o", picture, "--size", &size];
    folder.run(&[&base[..], &["--fit", "volume"], flags].concat());
}

/// A page with a second field, x + y^2, and a picture in each colour.
fn write_colors(folder: &Folder, isovalue: f64) {
    let value = |i: usize| (i % 24) as f32 + (i / 24 % 24).pow(2) as f32;
    let samples: Vec<u8> = (0..24usize.pow(3)).flat_map(|i| value(i).to_le_bytes()).collect();
    folder.write("field_24x24x24_float32.raw", &samples);
    let by = ["--color-by", "field_24x24x24_float32.raw"];
    folder.run(&[&["html", "s.isp", "-o", "field.html"][..], &by].concat());
    for color in ["quality", "lifetime", "curvature", "field"] {
        let flags = if color == "field" { by } else { ["--color", color] };
        let picture = format!("color-{color}.png");
        render(folder, isovalue, &picture, &[&flags[..], &["--no-legend"]].concat());
    }
}

/// A page with another axis upwards, and a picture with that axis upwards.
fn write_up(folder: &Folder, isovalue: f64) {
    folder.run(&["html", "s.isp", "-o", "up.html", "--up", "-x"]);
    render(folder, isovalue, "up.png", &["--up", "-x"]);
}

/// Pages and pictures in parallel projection, with occlusion, both, with a transparent background, with silhouettes, and of translucent
/// surfaces, some of them clipped.
fn write_looks(folder: &Folder, isovalue: f64, other: f64) {
    let shells = ["--opacity", "0.4", "-c", &format!("{other}=#5fae84@0.5")];
    let clipped = [&shells[..], &["--clip", "y:50%"]].concat();
    for (name, flags) in [
        ("parallel", &["--orthographic"][..]),
        ("hollows", &["--occlusion"]),
        ("both", &["--orthographic", "--occlusion", "--clip", "y:50%"]),
        ("nothing", &["--background", "transparent"]),
        ("silhouette", &["--silhouette"]),
        ("shells", &shells),
        ("section", &clipped),
        ("behind", &[&shells[..], &["--clip", "-y:50%"]].concat()),
    ] {
        render(folder, isovalue, &format!("look-{name}.png"), flags);
    }
    folder.run(&["html", "s.isp", "-o", "occluded.html", "--orthographic", "--occlusion"]);
    folder.run(&["html", "s.isp", "-o", "studio.html", "--style", "studio", "--light", "right"]);
    folder.run(&["html", "s.isp", "-o", "bright.html", "--occlusion=false"]);
    let also = ["-c", "60%=red@0.9", "-c", "20%@0.3"];
    let look = ["--clip", "-y:25%", "--wireframe", "--background", "dark"];
    folder.run(&[&["html", "s.isp", "-o", "look.html"][..], &also, &look].concat());
}

/// 8-bit samples without structure: nearly all of their mesh is the exact extraction.
fn noise(n: usize) -> Vec<u8> {
    let mut state = 1u32;
    let random = |_| {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 24) as u8
    };
    (0..n).map(random).collect()
}

/// The page of a volume of noise; a file of it in bricks, a page that is linked to that, and meshes of it. Returns their isovalues.
fn write_noise(folder: &Folder) -> serde_json::Value {
    folder.write("noise_9x9x9_uint8.raw", &noise(9 * 9 * 9));
    folder.run(&["compute", "-q", "noise_9x9x9_uint8.raw", "-o", "noise.isp", "--backend", "cpu"]);
    folder.run(&["html", "noise.isp", "-o", "noise.html"]);
    let in_bricks = ["compute", "-q", "noise_9x9x9_uint8.raw", "-o", "bricks.isp", "--brick", "4"];
    folder.run(&[&in_bricks[..], &["--backend", "cpu"]].concat());
    folder.run(&["html", "bricks.isp", "--link", "bricks.isp", "-o", "linked-bricks.html"]);
    let spectrum = file::from_bytes(&folder.read("bricks.isp")).expect("just written");
    let (low, high) = spectrum.range();
    let isovalues = LINKED_SHARES.map(|share| low * (1.0 - share) + high * share);
    for (i, isovalue) in isovalues.iter().map(f64::to_string).enumerate() {
        let mesh = format!("bricks-{i}.ply");
        folder.run(&["extract", "bricks.isp", "-c", &isovalue, "-o", &mesh]);
    }
    serde_json::json!({ "isovalues": isovalues })
}

/// The components of the noise as the program lists them, and a mesh of the largest ones.
fn components_of_noise(folder: &Folder) -> serde_json::Value {
    const KEEP: usize = 3;
    let isovalue = ["-c", "88%"];
    let output = folder.run(&[&["components", "noise.isp", "--json"][..], &isovalue].concat());
    let table: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let keep = ["--keep", "3", "-o", "kept.ply"];
    folder.run(&[&["extract", "noise.isp"][..], &isovalue, &keep].concat());
    let rows = table["components"].as_array().expect("rows");
    let volume = |row: &serde_json::Value| {
        let size = row["volume"].as_f64().expect("a number");
        if row["is_cavity"] == true { -size } else { size }
    };
    let volumes: Vec<f64> = rows.iter().map(volume).collect();
    assert!(volumes.len() > 2 * KEEP, "noise has many components");
    // A volume between two components that differ by more than rounding.
    let middle = volumes.len() / 3;
    let gap = |i: usize| volumes[i].abs() - volumes[i + 1].abs();
    let widest = (1..middle).max_by(|&a, &b| gap(a).total_cmp(&gap(b))).expect("some");
    let between = 0.5 * (volumes[widest].abs() + volumes[widest + 1].abs());
    serde_json::json!({
        "isovalue": table["isovalue"],
        "keep": KEEP,
        "min_volume": between,
        "volumes": volumes,
        "far": 20.0,
    })
}

/// The page of a ball with a radius of at most 6.5 voxels, away from the middle of a volume of 40^3 samples.
fn write_ball(folder: &Folder) {
    const SIDE: usize = 40;
    let sample = |i: usize| {
        let at = [i % SIDE, i / SIDE % SIDE, i / SIDE / SIDE].map(|x| x as f64);
        let squares = at.iter().zip([28.0, 29.0, 12.0]).map(|(x, middle)| (x - middle).powi(2));
        (255.0 - 30.0 * squares.sum::<f64>().sqrt()).max(0.0).round() as u8
    };
    let samples: Vec<u8> = (0..SIDE.pow(3)).map(sample).collect();
    folder.write("ball_40x40x40_uint8.raw", &samples);
    let flags = ["--range", "60:200", "--backend", "cpu"];
    folder.run(
        &[&["compute", "-q", "ball_40x40x40_uint8.raw", "-o", "ball.isp"][..], &flags].concat(),
    );
    folder.run(&["html", "ball.isp", "-o", "ball.html"]);
}

/// The shares of the range at which meshes of a linked page are compared with those of the program.
const LINKED_SHARES: [f64; 3] = [0.03, 0.45, 0.99];

/// A page that is linked to a file of several chunks, and the same in one file: noise whose values rise along z, so that few triangles are alive
/// at any isovalue, in the middle of a volume that is so large that rounding moves no vertex by a pixel. Returns what is compared.
fn write_linked(folder: &Folder) -> serde_json::Value {
    const SIDE: usize = 33;
    const NOISE: usize = 26;
    const START: usize = (SIDE - NOISE) / 2;
    let mut samples = vec![0; SIDE.pow(3)];
    for (i, row) in noise(NOISE.pow(3)).chunks(NOISE).enumerate() {
        let (z, y) = (i / NOISE, i % NOISE);
        let start = ((START + z) * SIDE + START + y) * SIDE + START;
        for (sample, noise) in samples[start..start + NOISE].iter_mut().zip(row) {
            *sample = (8 + 8 * z) as u8 + noise / 8;
        }
    }
    folder.write("large_33x33x33_uint8.raw", &samples);
    let compute = ["compute", "-q", "large_33x33x33_uint8.raw", "-o", "large.isp"];
    folder.run(&[&compute[..], &["--backend", "cpu"]].concat());
    folder.run(&["html", "large.isp", "--link", "large.isp", "-o", "linked.html"]);
    folder.run(&["html", "large.isp", "--link", "lost.isp", "-o", "lost.html"]);
    // There is no surface at the end of the range, so this page has no isovalues of its own.
    folder.run(&["html", "large.isp", "--link", "large.isp", "-c", "100%", "-o", "top.html"]);
    folder.run(&["html", "large.isp", "-o", "unlinked.html"]);
    folder.run(&["convert", "large.isp", "large.thesis"]);
    let spectrum = file::from_bytes(&folder.read("large.isp")).expect("just written");
    let (low, high) = spectrum.range();
    let isovalues = LINKED_SHARES.map(|share| low * (1.0 - share) + high * share);
    for (i, isovalue) in isovalues.iter().map(f64::to_string).enumerate() {
        let mesh = format!("linked-{i}.ply");
        folder.run(&["extract", "large.isp", "-c", &isovalue, "-o", &mesh]);
    }
    serde_json::json!({ "isovalues": isovalues })
}
