//! A folder of parts in the window, which reads only the parts that it shows.

use isospectrum::file::SpectrumFolder;

use super::server::{Server, wait_for};
use super::window::{Picture, TIES, Window};
use crate::common::program::{Folder, json};

/// The window reads this much of the range ahead, up and down.
const AHEAD: f64 = 1.0 / 16.0;

/// Position of the button that computes the curves, from the top left of the window.
const CURVES: (i32, i32) = (820, 589);

/// The colour of the curve of components.
const COMPONENTS: [u8; 3] = [0xE6, 0x9F, 0x00];

/// Types an isovalue that may begin with a minus.
fn type_isovalue(window: &Window<'_>, isovalue: f64) {
    window.type_isovalue(&format!("-- {isovalue}"));
}

/// Triangles of a mesh of the folder.
fn n_triangles(folder: &Folder, isovalue: f64) -> usize {
    let isovalue = isovalue.to_string();
    let mesh = ["extract", "s.ispt", "-c", &isovalue, "-o", "m.ply", "--json"];
    let report = json(&folder.run(&mesh));
    report["n_triangles"].as_u64().expect("a number") as usize
}

/// Waits until the window shows an isovalue with so many triangles.
fn wait_for_mesh(window: &Window<'_>, isovalue: f64, n: usize) {
    let title = format!("s.ispt - isovalue {isovalue} - {n} triangles");
    wait_for(&title, || (window.title() == title).then_some(()));
}

/// Checks that the window shows the picture that `render` draws of the folder.
fn assert_rendered(window: &Window<'_>, folder: &Folder, isovalue: f64) {
    window.point(400, 250);
    window.input("key r");
    let seen = window.picture();
    assert!(seen.covered() > 0.1, "the surface fills the picture at {isovalue}");
    let (size, isovalue) = (format!("{}x{}", seen.width, seen.height()), isovalue.to_string());
    folder.run(&["render", "s.ispt", "-c", &isovalue, "--size", &size, "-o", "r.png"]);
    let rendered = Picture::read(&folder.path().join("r.png"));
    std::fs::remove_file(folder.path().join("r.png")).expect("removed");
    let difference = seen.difference(&rendered);
    assert!(difference < TIES, "{difference} of the pixels differ at {isovalue}");
}

#[test]
fn the_window_reads_only_the_parts_that_it_shows() {
    let server = Server::start();
    let folder = Folder::new();
    let compute = ["compute", "-q", "--phantom", "noise:41:6", "--brick", "20", "--backend", "cpu"];
    folder.run(&[&compute[..], &["-q", "-o", "s.ispt"]].concat());
    let path = folder.path().join("s.ispt");
    let split = SpectrumFolder::open(&path).expect("just written");
    let (low, high) = split.whole().range();
    let at = |share: f64| ((low + share * (high - low)) * 100.0).round() / 100.0;

    // Only the parts that the first isovalue needs exist.
    let first = at(0.12);
    let far = AHEAD * (high - low);
    let (mut needed, mut n_bytes) = (Vec::new(), 0);
    for (place, chunk) in split.chunks_between((first - far, first + far)) {
        needed.push(place);
        n_bytes += chunk.bytes;
    }
    assert!(2 * n_bytes < split.n_bytes(), "{n_bytes} of {} bytes", split.n_bytes());
    let away = folder.path().join("away");
    std::fs::create_dir(&away).expect("a folder");
    let parts = split.index().parts.iter().enumerate();
    let all = parts.flat_map(|(i, part)| (0..part.chunks.len()).map(move |k| (i, k)));
    let moved: Vec<String> = all
        .filter(|place| !needed.contains(place))
        .flat_map(|(i, k)| ["isp", "seam"].map(|kind| format!("{i:06}-{k:03}.{kind}")))
        .collect();
    for name in &moved {
        std::fs::rename(path.join(name), away.join(name)).expect("there");
    }
    let text = first.to_string();
    let window = Window::open(&server, &folder, &["s.ispt", "-c", &text]);
    wait_for_mesh(&window, first, n_triangles(&folder, first));
    assert_rendered(&window, &folder, first);

    // A missing file is an error of one line, and the window stays open.
    type_isovalue(&window, at(0.8));
    window.wait_for_isovalue(|c| c == at(0.8));
    for name in &moved {
        std::fs::rename(away.join(name), path.join(name)).expect("there");
    }
    // At other isovalues the required parts are read, also for two isosurfaces.
    for share in [0.7, 0.12, 0.45] {
        type_isovalue(&window, at(share));
        wait_for_mesh(&window, at(share), n_triangles(&folder, at(share)));
        assert_rendered(&window, &folder, at(share));
    }
    drop(window);
    let two = [at(0.45), at(0.12)].map(|c| c.to_string());
    let window = Window::open(&server, &folder, &["s.ispt", "-c", &two[0], "-c", &two[1]]);
    let n = n_triangles(&folder, at(0.45)) + n_triangles(&folder, at(0.12));
    wait_for_mesh(&window, at(0.45), n);

    // The curves are computed on request.
    let components = || server.screen().1.iter().filter(|&&p| p == COMPONENTS).count();
    let before = components();
    window.click(CURVES.0, CURVES.1);
    wait_for("curves", || (components() > before + 50).then_some(()));
    folder.run(&["extract", "s.ispt", "-c", &at(0.7).to_string(), "-o", "m.ply"]);
    drop(window);
    let window = Window::open(&server, &folder, &["s.ispt", "-c", "0.1"]);
    type_isovalue(&window, at(0.7));
    wait_for_mesh(&window, at(0.7), n_triangles(&folder, at(0.7)));
    window.point(400, 250);
    window.save_mesh("mine.ply");
    assert!(folder.read("mine.ply") == folder.read("m.ply"), "the mesh is that of extract");
}
