//! The page that `html` writes: its bytes, and the page itself in a browser (`tests/page/`).
//!
//! The browser test needs node, Chromium and playwright-core, and an adapter for the native
//! pictures; it fails where one of them is missing and says what to install.

#[path = "common/mod.rs"]
mod common;

use common::data;
use std::path::Path;
use std::process::Command;
use std::sync::OnceLock;

use common::program::{self, Folder};
use isospectrum::Error;
use isospectrum::color::{Color, ScaleEnds};
use isospectrum::export::read_ply;
use isospectrum::file;
use isospectrum::page::{DEFAULT_STEP, Look, Page, html, part, script, with_fewer_knots};
use isospectrum::render::Gpu;
use isospectrum::render::{Camera, Renderer, View};
use isospectrum::spectrum::{Keep, Query, Spectrum};
use isospectrum::verify::mesh_topology;
use isospectrum::volume::{Histogram, Samples, Statistics, phantom};

/// Most bytes of scripts in a page.
const LARGEST_SCRIPT: usize = 135_000;

/// Where in the range pictures and meshes are compared, as shares: closed by caps, on both sides of
/// the isovalue where the hole of the torus opens, and near the end.
const SHARES: [f64; 4] = [0.5, 0.6, 0.75, 0.9];

/// Where they are seen from, as the address of the page says it: [`Camera::default`], from where the volume fits.
const CAMERA: &str = "35,22,1";

/// Width and height of the pictures that are compared.
const SIZE: [u32; 2] = [640, 480];

fn spectrum_bytes() -> &'static [u8] {
    static BYTES: OnceLock<Vec<u8>> = OnceLock::new();
    BYTES.get_or_init(|| {
        let folder = Folder::new();
        folder.run(&["compute", "--phantom", "torus:24", "--backend", "cpu", "-o", "s.isp"]);
        folder.read("s.isp")
    })
}

fn spectrum() -> Spectrum {
    file::from_bytes(spectrum_bytes()).expect("just written")
}

fn page<'a>(spectrum: &Spectrum, title: &'a str) -> Page<'a> {
    Page::new(title, spectrum.range().0)
}

fn folder_with_spectrum() -> Folder {
    let folder = Folder::new();
    folder.write("s.isp", spectrum_bytes());
    folder
}

#[test]
fn sizes_are_told_and_equal_input_gives_equal_bytes() {
    let spectrum = spectrum();
    let (text, sizes) = html(&spectrum, &page(&spectrum, "torus")).expect("a page");
    assert_eq!(sizes.page, text.len());
    assert_eq!(sizes.script, script().len());
    let (_, rest) = text.split_once("id=\"data\">").expect("data");
    let letters = rest.split_once("</script>").expect("an end").0.len();
    // Between 13 and 14 bits in two letters.
    assert!(16 * sizes.data / 14 <= letters && letters <= 16 * sizes.data / 13 + 2);
    assert_eq!(sizes.still, 0);
    let again = html(&spectrum, &page(&spectrum, "torus")).expect("a page").0;
    assert!(text == again);
    let coarse = page(&spectrum, "torus").with_step(0.25);
    assert!(html(&spectrum, &coarse).expect("a page").1.data < sizes.data);
}

#[test]
fn texts_are_text_and_nothing_is_asked_of_the_network() {
    let spectrum = spectrum();
    let evil = "</title></script><img src=x onerror=alert(1)> & \"quotes\" {{data}}";
    let with_texts = page(&spectrum, evil).with_caption(Some(evil)).with_credit(Some(evil));
    let (text, _) = html(&spectrum, &with_texts).expect("a page");
    assert!(!text.contains("<img src=x"));
    let escaped = "&lt;/title&gt;&lt;/script&gt;&lt;img src=x onerror=alert(1)&gt; &amp; \
                   &quot;quotes&quot; {{data}}";
    for place in [
        format!("<title>{escaped}</title>"),
        format!("<h1>{escaped}</h1>"),
        format!("<p class=\"caption\">{escaped}</p>"),
        format!("<p class=\"credit\">{escaped}</p>"),
    ] {
        assert!(text.contains(&place), "{place}");
    }
    assert!(text.contains("content=\"default-src 'none';"), "the policy forbids requests");
    // The one address is the name of SVG's elements. A shorter text could stand among the data's letters.
    let addresses = text.matches("http:").count() + text.matches("https:").count();
    assert_eq!(addresses, text.matches("\"http://www.w3.org/2000/svg\"").count());
    for way in ["fetch(", "XMLHttpRequest", "WebSocket", "EventSource", "import(", "sendBeacon"] {
        assert!(!text.contains(way), "{way}");
    }
}

#[test]
fn the_script_is_small() {
    let n = script().len();
    assert!(n < LARGEST_SCRIPT, "{n} bytes");
    assert!(
        script().lines().all(|line| !line.trim_start().starts_with("//")),
        "comments stay here"
    );
}

#[test]
fn a_part_has_the_isosurfaces_of_the_whole_in_its_range_and_no_others() {
    let whole = spectrum();
    let (low, high) = whole.range();
    let at = |share: f64| low * (1.0 - share) + high * share;
    let some = part(&whole, (at(0.3), at(0.7))).expect("a part");
    assert_eq!(some.range(), (at(0.3), at(0.7)));
    assert!(some.knots().len() < whole.knots().len());
    assert!(some.events().iter().all(|e| at(0.3) <= e.isovalue && e.isovalue <= at(0.7)));
    let (mut query, mut expected) = (Query::new(&some), Query::new(&whole));
    for share in [0.3, 0.31, 0.45, 0.5, 0.613, 0.7] {
        let mesh = query.mesh_at(at(share)).expect("inside");
        let wanted = expected.mesh_at(at(share)).expect("inside");
        assert_eq!(mesh.triangles.len(), wanted.triangles.len(), "{share}");
        assert_eq!(mesh.caps, wanted.caps);
        for (a, b) in mesh.triangles.iter().flatten().zip(wanted.triangles.iter().flatten()) {
            let (p, q) = (mesh.positions[*a as usize], wanted.positions[*b as usize]);
            // Cutting a step of a trajectory rounds its end to single precision, below 2e-6 voxels
            // at coordinates of 24.
            assert!((0..3).all(|i| (p[i] - q[i]).abs() < 4e-6), "{p:?}, expected {q:?}");
        }
    }
    assert!(matches!(query.mesh_at(at(0.2)), Err(Error::Range { .. })));
    assert!(matches!(part(&whole, (low - 1.0, high)), Err(Error::Range { .. })));
    assert!(matches!(part(&whole, (high, low)), Err(Error::Usage(_))));
    let all = part(&whole, whole.range()).expect("the whole");
    assert_eq!(all.triangles().len(), whole.triangles().len());
}

#[test]
fn fewer_knots_stay_within_the_distance() {
    const DISTANCE: f64 = 0.02;
    let whole = spectrum();
    let fewer = with_fewer_knots(&whole, DISTANCE);
    fewer.check().expect("lifetimes are still covered");
    assert!(fewer.knots().len() < whole.knots().len());
    for v in 0..whole.n_vertices() as u32 {
        for knot in whole.trajectory(v) {
            let p = fewer.vertex_at(v, knot.rank, whole.isovalues()[knot.rank as usize]);
            let squares = (0..3).map(|i| f64::from(p[i] - knot.position[i]).powi(2));
            // Single precision.
            assert!(squares.sum::<f64>().sqrt() <= DISTANCE + 1e-5);
        }
    }
    let same = with_fewer_knots(&whole, 0.0);
    assert!(same.knots().len() <= whole.knots().len());
}

#[test]
fn bad_requests_are_errors_of_one_line() {
    let folder = folder_with_spectrum();
    folder.write("v_2x2x2_uint8.raw", &[0, 1, 2, 3, 4, 5, 6, 7]);
    for (arguments, code, says) in [
        (&["html", "s.isp", "-o", "page.txt"][..], 2, "expected a name that ends in .html"),
        (&["html", "s.isp", "-o", "p.html", "--range", "-5:9000"], 4, "outside the range"),
        (&["html", "s.isp", "-o", "p.html", "--range", "60%:40%"], 2, "lower isovalue first"),
        (&["html", "s.isp", "-o", "p.html", "--isovalue", "9000"], 4, "outside the range"),
        (&["html", "s.isp", "-o", "p.html", "--step", "1e-9"], 2, "expected more"),
        (
            &["html", "s.isp", "-o", "p.html", "--volume", "v_2x2x2_uint8.raw"],
            3,
            "expected [24, 24, 24]",
        ),
        (&["html", "none.isp", "-o", "p.html"], 3, "none.isp"),
        (&["html", "s.isp", "-o", "none/p.html"], 3, "none/p.html"),
    ] {
        // What is packed is told before it is known whether that can be.
        let line = folder.fails(&[arguments, &["-q"]].concat(), code);
        assert!(line.contains(says), "{line}");
    }
}

#[cfg(target_os = "linux")]
#[test]
fn without_an_adapter_there_is_a_page_without_a_still_picture() {
    let folder = folder_with_spectrum();
    let output = Command::new(program::path())
        .args(["html", "s.isp", "-o", "page.html"])
        .current_dir(folder.path())
        .env("VK_DRIVER_FILES", "/nonexistent")
        .env("VK_ICD_FILENAMES", "/nonexistent")
        .output()
        .expect("the program runs");
    let said = program::stderr(&output);
    assert!(output.status.success(), "{said}");
    assert!(said.contains("the page has no still picture: "), "{said}");
    let page = String::from_utf8(folder.read("page.html")).expect("text");
    assert!(page.contains("<title>") && !page.contains("<img"));
}

/// A volume of 8-bit samples without structure: its mesh is the exact extraction nearly everywhere.
fn noise(n: usize) -> Vec<u8> {
    let mut state = 1u32;
    let random = |_| {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 24) as u8
    };
    (0..n).map(random).collect()
}

/// Pages of volumes whose meshes are exact extractions in places, each with isovalues to look at.
fn shaded_pages(folder: &Folder) -> serde_json::Value {
    folder.write("noise_9x9x9_uint8.raw", &noise(9 * 9 * 9));
    folder.run(&["compute", "noise_9x9x9_uint8.raw", "-o", "noise.isp", "--backend", "cpu"]);
    folder.run(&["html", "noise.isp", "-o", "noise.html"]);
    let mut pages = serde_json::json!({ "page.html": [], "noise.html": [] });
    if let Some(nucleon) = data::find("nucleon_41x41x41_uint8.raw") {
        let volume = nucleon.to_str().expect("a name in UTF-8");
        // The trajectories of the extraction at 188.7 reach from 134 to 195.
        let flags = ["--range", "133:196", "--backend", "cpu"];
        folder.run(&[&["compute", volume, "-o", "nucleon.isp"][..], &flags].concat());
        folder.run(&["html", "nucleon.isp", "-o", "nucleon.html"]);
        pages["nucleon.html"] = serde_json::json!([188.7]);
    }
    pages
}

/// What the program tells of the components of the noise, and keeps of them.
fn components_of_noise(folder: &Folder) -> serde_json::Value {
    const KEEP: usize = 3;
    let isovalue = ["-c", "88%"];
    let told = folder.run(&[&["components", "noise.isp", "--json"][..], &isovalue].concat());
    let told: serde_json::Value = serde_json::from_slice(&told.stdout).expect("JSON");
    let keep = ["--keep", "3", "-o", "kept.ply"];
    folder.run(&[&["extract", "noise.isp"][..], &isovalue, &keep].concat());
    let rows = told["components"].as_array().expect("rows");
    let volume = |row: &serde_json::Value| {
        let size = row["volume"].as_f64().expect("a number");
        if row["is_cavity"] == true { -size } else { size }
    };
    let volumes: Vec<f64> = rows.iter().map(volume).collect();
    assert!(volumes.len() > 2 * KEEP, "noise has many components");
    // Between two sizes that rounding does not bring past each other.
    let middle = volumes.len() / 3;
    let gap = |i: usize| volumes[i].abs() - volumes[i + 1].abs();
    let widest = (1..middle).max_by(|&a, &b| gap(a).total_cmp(&gap(b))).expect("some");
    let between = 0.5 * (volumes[widest].abs() + volumes[widest + 1].abs());
    serde_json::json!({
        "isovalue": told["isovalue"],
        "keep": KEEP,
        "min_volume": between,
        "volumes": volumes,
        "far": 20.0,
    })
}

/// A ball of 12 of 40 voxels at its largest, off the middle.
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
    folder.run(&[&["compute", "ball_40x40x40_uint8.raw", "-o", "ball.isp"][..], &flags].concat());
    folder.run(&["html", "ball.isp", "-o", "ball.html"]);
}

/// Pictures as the program draws them.
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

/// A page that is coloured by a second field, x + y^2, and what the program draws in each colour.
fn write_colors(folder: &Folder, isovalue: f64) {
    let value = |i: usize| (i % 24) as f32 + (i / 24 % 24).pow(2) as f32;
    let samples: Vec<u8> = (0..24usize.pow(3)).flat_map(|i| value(i).to_le_bytes()).collect();
    folder.write("field_24x24x24_float32.raw", &samples);
    let by = ["--color-by", "field_24x24x24_float32.raw"];
    folder.run(&[&["html", "s.isp", "-o", "field.html"][..], &by].concat());
    let isovalue = isovalue.to_string();
    let size = format!("{}x{}", SIZE[0], SIZE[1]);
    for color in ["quality", "lifetime", "curvature", "field"] {
        let picture = format!("color-{color}.png");
        let base = ["render", "s.isp", "-c", &isovalue, "-o", &picture, "--size", &size];
        let look = ["--fit", "volume", "--no-legend"];
        let shown = if color == "field" { by } else { ["--color", color] };
        folder.run(&[&base[..], &look, &shown].concat());
    }
}

/// A page of which the author chose what points up, and the picture that the program draws so.
fn write_up(folder: &Folder, isovalue: f64) {
    let isovalue = isovalue.to_string();
    let size = format!("{}x{}", SIZE[0], SIZE[1]);
    let up = ["--up", "-x"];
    folder.run(&[&["html", "s.isp", "-o", "up.html"][..], &up].concat());
    let base = ["render", "s.isp", "-c", &isovalue, "-o", "up.png", "--fit", "volume"];
    folder.run(&[&base[..], &["--size", &size], &up].concat());
}

/// What the program draws in parallel projection, with dark hollows, both, and on nothing.
fn write_sights(folder: &Folder, isovalue: f64) {
    let isovalue = isovalue.to_string();
    let size = format!("{}x{}", SIZE[0], SIZE[1]);
    for (name, flags) in [
        ("parallel", &["--orthographic"][..]),
        ("hollows", &["--occlusion"]),
        ("both", &["--orthographic", "--occlusion", "--clip", "y:50%"]),
        ("nothing", &["--background", "transparent"]),
    ] {
        let picture = format!("sight-{name}.png");
        let base = ["render", "s.isp", "-c", &isovalue, "-o", &picture, "--size", &size];
        folder.run(&[&base[..], &["--fit", "volume"], flags].concat());
    }
    folder.run(&["html", "s.isp", "-o", "sight.html", "--orthographic", "--occlusion"]);
    let also = ["-c", "60%=red@0.9", "-c", "20%@0.3"];
    let look = ["--clip", "-y:25%", "--wireframe", "--background", "dark"];
    folder.run(&[&["html", "s.isp", "-o", "look.html"][..], &also, &look].concat());
    let line =
        folder.fails(&["html", "s.isp", "-o", "l.html", "--background", "transparent", "-q"], 2);
    assert!(line.contains("expected white, light or dark"), "{line}");
}

/// A page with files of isovalues beside it, and the same as one file.
fn write_split(folder: &Folder) {
    let compute = ["compute", "--phantom", "noise:33:5", "--backend", "cpu", "-q", "-o"];
    folder.run(&[&compute[..], &["n33.isp"]].concat());
    folder.run(&["html", "n33.isp", "--split", "split"]);
    folder.run(&["html", "n33.isp", "-o", "unsplit.html", "-q"]);
    // It takes the place of another one, but of nothing else.
    folder.run(&["html", "n33.isp", "--split", "split", "-q"]);
    std::fs::create_dir(folder.path().join("mine")).expect("made");
    folder.write("mine/index.html", b"mine");
    folder.write("mine/notes.txt", b"mine");
    let line = folder.fails(&["html", "n33.isp", "--split", "mine", "-q"], 3);
    assert!(line.contains("mine: already exists, expected a name that is free"), "{line}");
    let both = ["html", "n33.isp", "--split", "split", "-o", "x.html"];
    folder.fails(&both, 2);
}

/// Everything `tests/page/` compares the page with, in a folder.
fn folder_for_the_browser() -> Folder {
    let folder = folder_with_spectrum();
    let volume = phantom("torus:24").expect("a phantom");
    let Samples::F32(samples) = volume.samples() else { panic!("phantoms are of f32") };
    let bytes: Vec<u8> = samples.iter().flat_map(|x| x.to_le_bytes()).collect();
    folder.write("torus_24x24x24_float32.raw", &bytes);
    folder.run(&[
        "html",
        "s.isp",
        "-o",
        "page.html",
        "--title",
        "A torus & more",
        "--caption",
        "What is to be seen.",
        "--credit",
        "Nobody.",
        "--volume",
        "torus_24x24x24_float32.raw",
        "--mark",
        "top:10%=thin,50%",
    ]);
    folder.run(&["html", "s.isp", "-o", "fine.html", "--step", "0.0009765625"]);
    folder.run(&["convert", "s.isp", "s.thesis"]);
    write_split(&folder);
    write_ball(&folder);
    let spectrum = spectrum();
    let (low, high) = spectrum.range();
    let isovalues = SHARES.map(|share| low * (1.0 - share) + high * share);
    write_native_pictures(&folder, &spectrum, &isovalues);
    for (i, isovalue) in isovalues.iter().map(f64::to_string).enumerate() {
        let mesh = format!("extracted-{i}.ply");
        folder.run(&["extract", "s.isp", "--isovalue", &isovalue, "-o", &mesh]);
    }
    // The event that is furthest from all others can be pointed at.
    let alone = |&c: &f64| {
        let others = spectrum.events().iter().map(|e| (e.isovalue - c).abs()).filter(|&d| d > 0.0);
        others.fold(f64::INFINITY, f64::min)
    };
    let event =
        spectrum.events().iter().map(|e| e.isovalue).max_by(|a, b| alone(a).total_cmp(&alone(b)));
    let spacing = spectrum.volume().placement.spacing;
    let statistics = Statistics::of(&volume);
    let shaded = shaded_pages(&folder);
    write_colors(&folder, isovalues[1]);
    write_up(&folder, isovalues[1]);
    write_sights(&folder, isovalues[2]);
    let events: Vec<f64> = spectrum.events().iter().map(|e| e.isovalue).collect();
    let expected = serde_json::json!({
        "range": [low, high],
        "isovalues": isovalues,
        "width": SIZE[0],
        "height": SIZE[1],
        "view": CAMERA,
        "first": spectrum.shown_first(),
        "step": DEFAULT_STEP,
        "shaded": shaded,
        "components": components_of_noise(&folder),
        "colors": isovalues[1],
        "events": events,
        "unit": spacing.into_iter().fold(f64::INFINITY, f64::min),
        "p90": Histogram::of(&volume).percentile(90.0),
        "sigma": statistics.mean + statistics.deviation,
        "n_events": spectrum.events().len(),
        "event": event.expect("a torus has events"),
    });
    folder.write("expected.json", expected.to_string().as_bytes());
    folder
}

/// Runs the tests of `tests/page/` with node.
fn run_browser_tests(folder: &Folder) {
    let tests = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/page");
    assert!(
        tests.join("node_modules/playwright-core").is_dir(),
        "the page is tested with playwright-core: npm ci --prefix tests/page (scripts/setup does it)"
    );
    let mut files: Vec<_> = std::fs::read_dir(&tests)
        .expect("readable")
        .map(|entry| entry.expect("readable").path())
        .filter(|path| path.to_string_lossy().ends_with(".test.mjs"))
        .collect();
    files.sort();
    assert!(!files.is_empty());
    let output = Command::new("node")
        .arg("--test")
        // One browser at a time: they share the processor.
        .arg("--test-concurrency=1")
        .args(&files)
        .current_dir(&tests)
        .env("ISOSPECTRUM_PAGE", folder.path())
        .output()
        .unwrap_or_else(|error| {
            panic!(
                "node: {error}; the page is tested with node: apt-get install nodejs npm chromium"
            )
        });
    let said = String::from_utf8_lossy(&output.stdout);
    let complained = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}\n{complained}");
    println!("{said}");
}

#[test]
fn the_page_works_in_a_browser() {
    let folder = folder_for_the_browser();
    run_browser_tests(&folder);
    // The meshes it saved, with the checks that the program's own meshes pass.
    for i in 0..SHARES.len() {
        let read = |name: String| read_ply(folder.path().join(name)).expect("readable");
        let mesh = read(format!("downloaded-{i}.ply"));
        let wanted = read(format!("extracted-{i}.ply"));
        let found = mesh_topology(mesh.positions.len(), &mesh.triangles);
        assert!(found.is_closed_manifold(), "{found:?}");
        assert_eq!(found, mesh_topology(wanted.positions.len(), &wanted.triangles));
    }
}
