//! The commands of README and of the guide: on smaller volumes, and as they are written with the tests that take long.
//!
//! Every line of a block marked `sh` runs in a shell, page by page, in a folder with the files that the guide
//! names. Blocks marked `text` are for commands that install something or need more than the tests have.

use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

use flate2::Compression;
use flate2::write::GzEncoder;
use isospectrum::volume::Samples;
use isospectrum::volume::phantom::phantom;

use crate::common::program::{Folder, path, stderr};

/// Samples along an axis of the volumes whose names or commands say how many.
const SIDE: usize = 24;

/// Samples along an axis of all others.
const SMALL_SIDE: usize = 16;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).to_path_buf()
}

/// The lines of all blocks of a language in a Markdown text, block by block.
fn blocks(text: &str, language: &str) -> Vec<Vec<String>> {
    let mut found = Vec::new();
    let mut open: Option<Vec<String>> = None;
    for line in text.lines() {
        match (&mut open, line.strip_prefix("```")) {
            (None, Some(name)) if name == language => open = Some(Vec::new()),
            // A block of another language, up to its end.
            (None, Some(_)) => open = Some(vec!["\0".into()]),
            (Some(_), Some(_)) => {
                let block = open.take().expect("open");
                if block.first().is_none_or(|line| line != "\0") {
                    found.push(block);
                }
            }
            (Some(block), None) => block.push(line.to_owned()),
            (None, None) => {}
        }
    }
    found
}

/// The values of two blobs in a box of so many samples along each axis, x fastest, from 0 to about 1.
fn blobs(side: usize) -> Vec<f32> {
    let volume = phantom(&format!("blobs:{side}")).expect("a phantom");
    match volume.samples() {
        Samples::F32(samples) => samples.clone(),
        other => panic!("{} samples", other.type_name()),
    }
}

fn little_endian(values: impl IntoIterator<Item = i16>) -> Vec<u8> {
    values.into_iter().flat_map(i16::to_le_bytes).collect()
}

/// A NIfTI-1 file of `SMALL_SIDE`^3 samples of 16 bits, compressed by gzip.
fn nifti(values: &[i16]) -> Vec<u8> {
    let mut header = vec![0u8; 352];
    let mut put = |at: usize, bytes: &[u8]| header[at..at + bytes.len()].copy_from_slice(bytes);
    put(0, &348i32.to_le_bytes());
    for (i, n) in [3, SMALL_SIDE as i16, SMALL_SIDE as i16, SMALL_SIDE as i16, 1, 1, 1, 1]
        .into_iter()
        .enumerate()
    {
        put(40 + 2 * i, &n.to_le_bytes());
    }
    put(70, &4i16.to_le_bytes());
    put(72, &16i16.to_le_bytes());
    for i in 0..4 {
        put(76 + 4 * i, &1f32.to_le_bytes());
    }
    put(108, &352f32.to_le_bytes());
    // Millimetres.
    put(123, &[2]);
    put(344, b"n+1\0");
    let mut packed = GzEncoder::new(Vec::new(), Compression::fast());
    packed.write_all(&header).expect("in memory");
    packed.write_all(&little_endian(values.iter().copied())).expect("in memory");
    packed.finish().expect("in memory")
}

/// A MetaImage file of `SIDE`^3 samples of 16 bits, a millimetre apart.
fn metaimage(values: &[i16]) -> Vec<u8> {
    let header = format!(
        "ObjectType = Image\nNDims = 3\nDimSize = {SIDE} {SIDE} {SIDE}\nElementSpacing = 1 1 1\n\
         ElementType = MET_SHORT\nBinaryData = True\nBinaryDataByteOrderMSB = False\n\
         ElementDataFile = LOCAL\n"
    );
    [header.into_bytes(), little_endian(values.iter().copied())].concat()
}

/// A Gaussian CUBE file, in which z varies fastest.
fn cube(values: &[f32]) -> Vec<u8> {
    let mut text = String::from("a density\nfor the guide\n    0    0.0 0.0 0.0\n");
    for axis in ["0.5 0.0 0.0", "0.0 0.5 0.0", "0.0 0.0 0.5"] {
        text += &format!("{SMALL_SIDE:5}    {axis}\n");
    }
    for x in 0..SMALL_SIDE {
        for y in 0..SMALL_SIDE {
            for z in 0..SMALL_SIDE {
                text += &format!(" {:.5e}", values[x + SMALL_SIDE * (y + SMALL_SIDE * z)]);
            }
            text += "\n";
        }
    }
    text.into_bytes()
}

/// The input files that pages name.
fn inputs() -> &'static Vec<(&'static str, Vec<u8>)> {
    static INPUTS: OnceLock<Vec<(&str, Vec<u8>)>> = OnceLock::new();
    INPUTS.get_or_init(|| {
        let [small, large] = [SMALL_SIDE, SIDE].map(blobs);
        let scaled = |blobs: &[f32]| -> Vec<i16> {
            blobs.iter().map(|v| (v * 800.0 - 400.0) as i16).collect()
        };
        let column = |i: usize| i % SMALL_SIDE;
        let potential: Vec<f32> = (0..small.len()).map(|i| column(i) as f32 - 8.0).collect();
        let mask: Vec<i16> =
            (0..small.len()).map(|i| i16::from(column(i) > SMALL_SIDE / 2)).collect();
        let raw = (0..32 * 32 * 16).map(|i: i32| {
            let squares =
                (i % 32 - 16).pow(2) + (i / 32 % 32 - 16).pow(2) + 4 * (i / 1024 - 8).pow(2);
            (1600 - 4 * squares) as i16
        });
        let floats = |v: &[f32]| v.iter().flat_map(|v| v.to_le_bytes()).collect();
        let mut files = vec![
            ("blobs_16x16x16_float32.raw", floats(&small)),
            ("blobs_24x24x24_float32.raw", floats(&large)),
            ("scan.raw", little_endian(raw)),
            ("scan.nii.gz", nifti(&scaled(&small))),
            ("head.nii.gz", nifti(&scaled(&small))),
            ("brain_mask.nii.gz", nifti(&mask)),
            ("ct.mha", metaimage(&scaled(&large))),
            ("density.cube", cube(&small)),
            ("potential.cube", cube(&potential)),
        ];
        let folder = Folder::new();
        for (name, bytes) in &files {
            folder.write(name, bytes);
        }
        folder.run(&["compute", "-q", "blobs_16x16x16_float32.raw", "-o", "blobs.isp"]);
        folder.run(&["compute", "-q", "density.cube", "-o", "density.isp"]);
        files.push(("blobs.isp", folder.read("blobs.isp")));
        files.push(("density.isp", folder.read("density.isp")));
        files
    })
}

/// Texts of the pages, and what takes less time in their place: smaller volumes, no GPU in software, no check of results.
const SMALLER: [(&str, &str); 6] = [
    ("isospectrum compute ", "isospectrum compute -q --backend cpu "),
    ("blobs_24x24x24_float32", "blobs_16x16x16_float32"),
    ("simplified_24x24x24", "simplified_16x16x16"),
    ("--brick 12", "--brick 8"),
    ("--phantom blobs:24", "--phantom blobs:16"),
    ("--phantom hydrogen:48", "--phantom hydrogen:20"),
];

fn text(page: &str) -> String {
    std::fs::read_to_string(root().join(page)).expect("a page")
}

/// Runs all commands of a page as [`SMALLER`] says.
fn run_smaller(page: &str) {
    let replaced = |text: String, (large, small): &(&str, &str)| text.replace(large, small);
    run(page, &SMALLER.iter().fold(text(page), replaced), &[]);
}

/// Runs all commands of a page as they are written.
fn run_as_written(page: &str) {
    static SPECTRUM: OnceLock<Vec<u8>> = OnceLock::new();
    let spectrum = SPECTRUM.get_or_init(|| {
        let folder = Folder::new();
        folder.run(&["compute", "-q", "--phantom", "blobs:24", "-o", "blobs.isp"]);
        folder.read("blobs.isp")
    });
    run(page, &text(page), &[("blobs.isp", spectrum)]);
}

/// Runs all commands of a page in one folder, one block after the other. `others` replace files of the same name.
fn run(page: &str, text: &str, others: &[(&str, &[u8])]) {
    let blocks = blocks(text, "sh");
    assert!(!blocks.is_empty(), "{page}: no commands");
    let folder = Folder::new();
    let inputs = inputs().iter().map(|(name, bytes)| (*name, &bytes[..]));
    for (name, bytes) in inputs.chain(others.iter().copied()) {
        folder.write(name, bytes);
    }
    let search = std::env::join_paths(
        [path().parent().expect("a folder").to_path_buf()]
            .into_iter()
            .chain(std::env::split_paths(&std::env::var_os("PATH").unwrap_or_default())),
    )
    .expect("paths");
    for line in blocks.iter().flatten().filter(|line| !line.trim().is_empty()) {
        let output = Command::new("sh")
            .args(["-ec", line])
            .env("PATH", &search)
            .current_dir(folder.path())
            .output()
            .expect("sh runs");
        assert!(output.status.success(), "{page}: {line}\n{}", stderr(&output));
    }
}

macro_rules! pages {
    ($($name:ident $page:literal)*) => {
        $(
            #[test]
            fn $name() {
                run_smaller($page);
            }
        )*

        mod long {
            use super::*;
            $(
                #[test]
                #[ignore = "long: run by scripts/test --long"]
                fn $name() {
                    run_as_written($page);
                }
            )*
        }

        const PAGES: &[&str] = &[$($page),*];
    };
}

pages! {
    the_commands_of_the_readme_run "README.md"
    the_commands_for_volumes_run "docs/guide/volumes.md"
    the_commands_for_noise_and_masks_run "docs/guide/noise-and-masks.md"
    the_commands_for_computing_run "docs/guide/compute.md"
    the_commands_for_isovalues_run "docs/guide/isovalues.md"
    the_commands_for_meshes_run "docs/guide/meshes.md"
    the_commands_for_components_run "docs/guide/components.md"
    the_commands_for_pictures_run "docs/guide/pictures.md"
    the_commands_for_pages_run "docs/guide/pages.md"
    the_commands_for_accuracy_run "docs/guide/accuracy.md"
    the_commands_for_bricks_run "docs/guide/bricks.md"
    the_commands_for_scripts_run "docs/guide/scripts.md"
}

/// Pages whose commands need a window or a real scan, which `scripts/test-viewer`, `scripts/tour` and `scripts/gallery` run, and the page for
/// Python, whose lines pytest runs.
const ELSEWHERE: [&str; 5] = [
    "docs/guide/SUMMARY.md",
    "docs/guide/window.md",
    "docs/guide/tour.md",
    "docs/guide/gallery.md",
    "docs/guide/python.md",
];

#[test]
fn every_page_of_the_guide_is_in_its_summary_and_tested() {
    let summary = std::fs::read_to_string(root().join("docs/guide/SUMMARY.md")).expect("a summary");
    for entry in std::fs::read_dir(root().join("docs/guide")).expect("a folder") {
        let name = entry.expect("an entry").file_name().into_string().expect("plain text");
        if let Some(name) = name.strip_suffix(".md") {
            let page = format!("docs/guide/{name}.md");
            assert!(PAGES.contains(&&*page) || ELSEWHERE.contains(&&*page), "{page}");
            assert!(name == "SUMMARY" || summary.contains(&format!("({name}.md)")), "{name}");
        }
    }
}

#[test]
fn every_link_between_documents_leads_to_a_file() {
    let mut pages = vec![root().join("README.md"), root().join("ARCHITECTURE.md")];
    pages.extend([root().join("CONTRIBUTING.md"), root().join("python/README.md")]);
    for folder in ["docs/guide", "docs/decisions"] {
        for entry in std::fs::read_dir(root().join(folder)).expect("a folder") {
            pages.push(entry.expect("an entry").path());
        }
    }
    let mut n = 0;
    for page in pages.iter().filter(|page| page.extension().is_some_and(|e| e == "md")) {
        let text = std::fs::read_to_string(page).expect("a page");
        for rest in text.split("](").skip(1) {
            let target = rest.split([')', '#']).next().expect("one part at least");
            if target.is_empty() || target.contains("://") {
                continue;
            }
            n += 1;
            let file = page.parent().expect("a folder").join(target);
            assert!(file.exists(), "{}: {target}", page.display());
        }
    }
    assert!(n > 50, "{n} links were looked at");
}
