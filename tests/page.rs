//! The page that `html` writes: its bytes here, its behaviour in a browser in `browser`.

#[path = "page/browser.rs"]
mod browser;
#[path = "common/mod.rs"]
mod common;

use std::process::Command;

use common::program::{self, Folder};
use isospectrum::Error;
use isospectrum::file;
use isospectrum::page::{Page, html, with_fewer_knots, with_range};
use isospectrum::spectrum::{Query, Spectrum};

/// The most bytes that the scripts of a page have.
const MAX_SCRIPT: usize = 150_000;

/// A folder with the spectrum of a torus, `s.isp`.
fn folder_with_spectrum() -> Folder {
    Folder::with_phantom("torus:24")
}

fn spectrum() -> Spectrum {
    file::from_bytes(&folder_with_spectrum().read("s.isp")).expect("just written")
}

fn page<'a>(spectrum: &Spectrum, title: &'a str) -> Page<'a> {
    Page::new(title, spectrum.range().0)
}

/// The text of a script element of a page.
fn element<'a>(text: &'a str, start: &str) -> &'a str {
    let (_, rest) = text.split_once(start).expect("the element");
    rest.split_once("</script>").expect("its end").0
}

#[test]
fn sizes_are_those_of_the_parts_and_equal_input_gives_equal_bytes() {
    let spectrum = spectrum();
    let (text, sizes) = html(&spectrum, &page(&spectrum, "torus")).expect("a page");
    assert_eq!(sizes.page, text.len());
    assert_eq!(sizes.script, element(&text, "<script>\n(").len() + 1);
    assert!(sizes.script <= MAX_SCRIPT, "{} bytes of scripts", sizes.script);
    // Base64 writes three bytes as four characters.
    assert_eq!(element(&text, "id=\"data\">").len(), 4 * sizes.data.div_ceil(3));
    assert_eq!(sizes.still, 0);
    let again = html(&spectrum, &page(&spectrum, "torus")).expect("a page").0;
    assert!(text == again);
    let coarse = page(&spectrum, "torus").with_step(0.25);
    assert!(html(&spectrum, &coarse).expect("a page").1.data < sizes.data);
}

#[test]
fn texts_are_escaped_and_scripts_send_no_request() {
    let spectrum = spectrum();
    let evil = "</title></script><img src=x onerror=alert(1)> & \"quotes\" {{data}}";
    let with_texts = page(&spectrum, evil).with_caption(evil).with_credit(evil);
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
    // The namespace of SVG is the only address.
    let addresses = text.matches("http:").count() + text.matches("https:").count();
    assert_eq!(addresses, text.matches("\"http://www.w3.org/2000/svg\"").count());
    for way in ["fetch(", "XMLHttpRequest", "WebSocket", "EventSource", "import(", "sendBeacon"] {
        assert!(!text.contains(way), "{way}");
    }
}

#[test]
fn a_part_has_the_isosurfaces_of_the_whole_in_its_range_and_no_others() {
    let whole = spectrum();
    let (low, high) = whole.range();
    let at = |share: f64| low * (1.0 - share) + high * share;
    let some = with_range(&whole, (at(0.3), at(0.7))).expect("a part");
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
    assert!(matches!(with_range(&whole, (low - 1.0, high)), Err(Error::Range { .. })));
    assert!(matches!(with_range(&whole, (high, low)), Err(Error::Usage(_))));
    let all = with_range(&whole, whole.range()).expect("the whole");
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
    folder.run(&["convert", "s.isp", "s.thesis", "-q"]);
    for (arguments, code, fact) in [
        (&["html", "s.isp", "-o", "page.txt"][..], 2, ".html"),
        (&["html", "s.isp", "-o", "p.html", "--range", "-5:9000"], 4, "outside the range"),
        (&["html", "s.isp", "-o", "p.html", "--range", "60%:40%"], 2, "lower isovalue first"),
        (&["html", "s.isp", "-o", "p.html", "--isovalue", "9000"], 4, "outside the range"),
        (&["html", "s.isp", "-o", "p.html", "--step", "1e-9"], 2, "step of"),
        (&["html", "s.isp", "-o", "p.html", "--background", "transparent"], 2, "transparent"),
        (&["html", "s.isp", "-o", "p.html", "--link", "ftp://a/s.isp"], 2, "ftp://a/s.isp"),
        (&["html", "s.isp", "-o", "p.html", "--link", "s.isp", "--range", "40%:60%"], 2, "--range"),
        (
            &["html", "s.isp", "-o", "p.html", "--link", "s.isp", "--tolerance", "0.1"],
            2,
            "--tolerance",
        ),
        (&["html", "s.isp", "-o", "p.html", "--link", "s.isp", "--step", "0.1"], 2, "--step"),
        (
            &["html", "s.isp", "-o", "p.html", "--link", "s.isp", "--color-by", "s.isp"],
            2,
            "--color-by",
        ),
        (&["html", "s.thesis", "-o", "p.html", "--link", "s.thesis"], 2, "s.thesis: --link needs"),
        (
            &["html", "s.isp", "-o", "p.html", "--color", "distance"],
            2,
            "cannot show the color distance",
        ),
        (
            &["html", "s.isp", "-o", "p.html", "--volume", "v_2x2x2_uint8.raw"],
            3,
            "expected [24, 24, 24]",
        ),
        (&["html", "s.isp", "-o", "p.html", "--slice"], 2, "--volume"),
        (&["html", "none.isp", "-o", "p.html"], 3, "none.isp"),
        (&["html", "s.isp", "-o", "none/p.html"], 3, "none/p.html"),
    ] {
        // Without -q the program reports what it packs before it finds the error.
        let line = folder.fails(&[arguments, &["-q"]].concat(), code);
        assert!(line.contains(fact), "{line}");
    }
}

#[test]
fn a_linked_page_has_the_places_of_the_tables_and_the_origin_of_the_link() {
    let folder = folder_with_spectrum();
    let linked = |url: &str| {
        folder.run(&["html", "s.isp", "--link", url, "-q", "-o", "linked.html"]);
        String::from_utf8(folder.read("linked.html")).expect("text")
    };
    let text = linked("s.isp");
    assert!(text.contains("worker-src blob:; connect-src 'self'; style-src"));
    assert!(element(&text, "<script type=\"text/plain\" id=\"data\">").is_empty());
    assert!(element(&text, "<script>\n(").len() < MAX_SCRIPT);
    let about = element(&text, "<script type=\"application/json\" id=\"about\">");
    let about: serde_json::Value = serde_json::from_str(about).expect("JSON");
    let link = &about["link"];
    let file = folder.read("s.isp");
    let number = |value: &serde_json::Value| value.as_u64().expect("a number") as usize;
    assert_eq!((&link["url"], number(&link["end"])), (&"s.isp".into(), file.len()));
    let [start, end] = [0, 1].map(|i| number(&link["info"][i]));
    assert!(file[start..].starts_with(b"INFO") && file[end..].starts_with(b"EVNT"));
    assert!(file[number(&link["isovalues"])..].starts_with(b"ISOV"));
    let index = file.windows(4).rposition(|tag| tag == b"INDX").expect("an index");
    let crc = u32::from_le_bytes(file[index + 24..index + 28].try_into().expect("four bytes"));
    assert_eq!(link["crc32"], crc);
    // A self-contained page has none of the scripts that read a file, and may not connect.
    let text = linked("https://data.example.org:8000/a/s.isp?b=<c>");
    assert!(
        text.contains("worker-src blob:; connect-src https://data.example.org:8000; style-src")
    );
    let alone = html(&spectrum(), &page(&spectrum(), "alone")).expect("a page").0;
    assert!(text.contains("fetch(") && !alone.contains("fetch("));
    assert!(!alone.contains("connect-src"));
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
    let stderr = program::stderr(&output);
    assert!(output.status.success(), "{stderr}");
    assert!(stderr.contains("no still picture"), "{stderr}");
    let page = String::from_utf8(folder.read("page.html")).expect("text");
    assert!(page.contains("<title>") && !page.contains("<img"));
}
