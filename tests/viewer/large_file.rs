//! A large file in the window, which reads only the chunks that it shows.

use isospectrum::file::SpectrumFile;

use super::server::{Server, wait_for};
use super::window::{Picture, TIES, Window};
use crate::common::program::{Folder, json};

/// Triangles that the window keeps: fewer than the file has, more than two isosurfaces need.
const MAX_TRIANGLES: u64 = 150_000;

/// The colour of the curve of components.
const COMPONENTS: [u8; 3] = [0xd9, 0x7d, 0x2e];

/// Types an isovalue that may begin with a minus.
fn type_isovalue(window: &Window<'_>, isovalue: f64) {
    window.type_isovalue(&format!("-- {isovalue}"));
}

/// Triangles of a mesh of the file.
fn n_triangles(folder: &Folder, isovalue: f64) -> usize {
    let isovalue = isovalue.to_string();
    let mesh = ["extract", "s.isp", "-c", &isovalue, "-o", "m.ply", "--json"];
    let report = json(&folder.run(&mesh));
    report["n_triangles"].as_u64().expect("a number") as usize
}

/// Waits until the window shows an isovalue with so many triangles.
fn wait_for_mesh(window: &Window<'_>, isovalue: f64, n: usize) {
    let title = format!("s.isp - isovalue {isovalue} - {n} triangles");
    wait_for(&title, || (window.title() == title).then_some(()));
}

/// Checks that the window shows the picture that `render` draws.
fn assert_rendered(window: &Window<'_>, folder: &Folder, isovalue: f64) {
    window.point(400, 250);
    window.input("key r");
    let seen = window.picture();
    assert!(seen.covered() > 0.1, "the surface fills the picture at {isovalue}");
    let (size, isovalue) = (format!("{}x{}", seen.width, seen.height()), isovalue.to_string());
    folder.run(&["render", "s.isp", "-c", &isovalue, "--size", &size, "-o", "r.png"]);
    let rendered = Picture::read(&folder.path().join("r.png"));
    std::fs::remove_file(folder.path().join("r.png")).expect("removed");
    let difference = seen.difference(&rendered);
    assert!(difference < TIES, "{difference} of the pixels differ at {isovalue}");
}

#[test]
fn the_window_reads_only_the_chunks_that_it_shows() {
    let server = Server::start();
    let folder = Folder::new();
    let compute = ["compute", "-q", "--phantom", "noise:33:6", "--brick", "16", "--backend", "cpu"];
    folder.run(&[&compute[..], &["-o", "s.isp"]].concat());
    let file = SpectrumFile::open(folder.path().join("s.isp")).expect("just written");
    let n = file.size().triangles;
    assert!(n > MAX_TRIANGLES, "{n} triangles");
    let limit = MAX_TRIANGLES.to_string();
    let open = |arguments: &[&str]| {
        let file = ["s.isp", "--max-triangles", &limit];
        Window::open(&server, &folder, &[&file[..], arguments].concat())
    };
    let (low, high) = file.description().range();
    let at = |share: f64| ((low + share * (high - low)) * 100.0).round() / 100.0;

    // All chunks are damaged that the first isovalue does not need.
    let first = at(0.12);
    let whole = folder.read("s.isp");
    let mut bytes = whole.clone();
    let (mut n_damaged, mut start) = (0, 16);
    while &bytes[start..start + 4] == b"VERT" {
        let mut end = start;
        for _ in 0..4 {
            let n = u64::from_le_bytes(bytes[end + 8..end + 16].try_into().expect("eight bytes"));
            end += 28 + n as usize;
        }
        bytes[start + 40] ^= 4;
        folder.write("s.isp", &bytes);
        let damaged = SpectrumFile::open(folder.path().join("s.isp")).expect("undamaged tables");
        if damaged.read_around(&[first]).is_err() {
            bytes[start + 40] ^= 4;
        } else {
            n_damaged += 1;
        }
        start = end;
    }
    assert!(n_damaged > 5, "{n_damaged} chunks are not needed");
    folder.write("s.isp", &bytes);
    let text = first.to_string();
    let window = open(&["-c", &text]);
    wait_for_mesh(&window, first, n_triangles(&folder, first));
    assert_rendered(&window, &folder, first);

    // A damaged chunk is an error of one line, and the window stays open.
    type_isovalue(&window, at(0.8));
    window.wait_for_isovalue(|c| c == at(0.8));
    drop(window);
    folder.write("s.isp", &whole);
    let window = open(&["-c", &text]);
    // At other isovalues the required chunks are read, also for two isosurfaces.
    for share in [0.45, 0.12] {
        type_isovalue(&window, at(share));
        wait_for_mesh(&window, at(share), n_triangles(&folder, at(share)));
        assert_rendered(&window, &folder, at(share));
    }
    drop(window);
    let two = [at(0.45), at(0.12)].map(|c| c.to_string());
    let window = open(&["-c", &two[0], "-c", &two[1]]);
    let n = n_triangles(&folder, at(0.45)) + n_triangles(&folder, at(0.12));
    wait_for_mesh(&window, at(0.45), n);

    // The curves are computed on request.
    let components = || server.screen().1.iter().filter(|&&p| p == COMPONENTS).count();
    let before = components();
    window.click_on("Button", "compute curves");
    wait_for("curves", || (components() > before + 50).then_some(()));
    folder.run(&["extract", "s.isp", "-c", &at(0.7).to_string(), "-o", "m.ply"]);
    drop(window);
    let window = open(&["-c", "0.1"]);
    type_isovalue(&window, at(0.7));
    wait_for_mesh(&window, at(0.7), n_triangles(&folder, at(0.7)));
    window.point(400, 250);
    window.save_mesh("mine.ply");
    assert!(folder.read("mine.ply") == folder.read("m.ply"), "the mesh is that of extract");
}
