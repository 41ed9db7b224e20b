//! Bricks as users compute them: plans, parts, merges, and `compute` within limits.

use std::sync::OnceLock;

use crate::common::program::{Folder, json, one_line, stderr};

const PLAN: [&str; 7] = ["plan", "--phantom", "noise:9:4", "--brick", "4", "-o", "p.json"];
const PARTS: [&str; 7] = ["compute", "--backend", "cpu", "-q", "--plan", "p.json", "--parts"];

/// The plan, all of its parts and the spectrum that they make, `m.isp`; computed once for all tests.
fn merged() -> Folder {
    static MERGED: OnceLock<Folder> = OnceLock::new();
    let merged = MERGED.get_or_init(|| {
        let folder = Folder::new();
        folder.run(&PLAN);
        folder.run(&[&PARTS[..], &["0:7"]].concat());
        folder.run(&["merge", "p.json", "-o", "m.isp", "-q"]);
        folder
    });
    merged.copy()
}

#[test]
fn the_bytes_do_not_depend_on_which_process_computes_which_part() {
    let folder = merged();
    // Two processes at once, the later half first, some parts by both.
    let script = r#""$0" compute --backend cpu -q --plan p.json --parts 3:7 -o two & "$0" compute --backend cpu --threads 1 -q --plan p.json --parts 0:4 -o two; wait"#;
    assert!(folder.shell(script).status.success());
    folder.run(&["merge", "p.json", "--parts", "two", "-o", "two.isp", "-q"]);
    assert_eq!(folder.read("m.isp"), folder.read("two.isp"));
    // Existing parts are not computed again.
    let printed = stderr(&folder.run(&["compute", "--backend", "cpu", "--plan", "p.json"]));
    assert_eq!(printed.matches("exists already").count(), 8, "{printed}");
    let verify = ["verify", "m.isp", "--phantom", "noise:9:4", "--n", "8"];
    folder.run(&verify);
}

#[test]
fn a_killed_worker_and_a_damaged_part_are_recomputed() {
    let folder = merged();
    // Killed once the first part exists.
    let script = r#""$0" compute --backend cpu --threads 1 -q --plan p.json -o parts & worker=$!
        while [ ! -e parts/000000.part ]; do :; done; kill -9 $worker; wait $worker; true"#;
    assert!(folder.shell(script).status.success());
    let merge = ["merge", "p.json", "--parts", "parts", "-o", "again.isp"];
    let line = folder.fails(&merge, 3);
    assert!(line.contains("of 8 parts") && line.contains("expected them in"), "{line}");
    folder.run(&[&PARTS[..], &["0:7", "-o", "parts"]].concat());
    let part = folder.path().join("parts/000005.part");
    let mut bytes = std::fs::read(&part).expect("a part");
    let middle = bytes.len() / 2;
    bytes[middle] ^= 16;
    std::fs::write(&part, bytes).expect("damaged");
    let line = folder.fails(&merge, 3);
    assert!(line.contains("000005.part") && line.contains("damaged"), "{line}");
    let anew = ["compute", "--backend", "cpu", "--plan", "p.json", "--parts", "5", "-o", "parts"];
    let printed = stderr(&folder.run(&anew));
    assert!(printed.contains("computed again"), "{printed}");
    folder.run(&merge);
    assert_eq!(folder.read("again.isp"), folder.read("m.isp"));
}

#[test]
fn errors_of_a_plan_are_one_line() {
    let folder = Folder::new();
    folder.run(&PLAN);
    let line = folder.fails(&[&PARTS[..], &["3:8"]].concat(), 2);
    assert!(line.contains("expected 0 to 7"), "{line}");
    let line = folder.fails(&["plan", "--phantom", "blobs:9", "--brick", "3", "-o", "q.json"], 2);
    assert!(line.contains("3 cells, expected 4"), "{line}");
    let start = ["--start", "0.4", "--initial-mesh", "m.ply", "-o", "q.json"];
    let initial = [&["plan", "--phantom", "blobs:9"][..], &start].concat();
    assert!(folder.fails(&initial, 2).contains("initial mesh"));
    let changed = String::from_utf8(folder.read("p.json")).expect("text");
    folder.write("p.json", changed.replace("\"error\": 0.1", "\"error\": 0.2").as_bytes());
    assert!(folder.fails(&[&PARTS[..], &["0"]].concat(), 3).contains("changed"));
    folder.write("p.json", b"{}");
    let line = folder.fails(&["merge", "p.json", "-o", "m.isp"], 3);
    assert!(line.contains("p.json: unsupported"), "{line}");
}

const BRICKS: [&str; 8] =
    ["compute", "--phantom", "noise:9:4", "--backend", "cpu", "--brick", "4", "-q"];

#[test]
fn compute_in_bricks_equals_plan_parts_and_merge() {
    let folder = merged();
    folder.run(&[&BRICKS[..], &["-o", "a.isp"]].concat());
    folder.run(&[&BRICKS[..], &["-o", "b.isp", "--threads", "1"]].concat());
    let piped = folder.run(&[&BRICKS[..], &["-o", "-", "--threads", "3"]].concat());
    let expected = folder.read("m.isp");
    assert!(folder.read("a.isp") == expected && folder.read("b.isp") == expected);
    assert!(piped.stdout == expected);
    assert_eq!(folder.names(), ["a.isp", "b.isp", "m.isp", "p.json", "p.parts"]);
    let more = [&BRICKS[..7], &["-o", "c.isp", "--max-triangles", "100"]].concat();
    let output = folder.run_for(&more, 2);
    assert!(stderr(&output).contains("1 of 8 bricks, expected 100"));
    assert!(!folder.path().join("c.isp").exists());
}

/// A long volume with small balls in a row, which needs at least 77 MB as a whole.
fn row_of_balls(folder: &Folder) {
    let [x, y, z] = [1200usize, 40, 40];
    let off = |i: usize, middle: f64| (i as f64 - middle).powi(2);
    let ball =
        |i: usize, j: usize, k: usize| (off(i % 100, 47.3) + off(j, 19.4) + off(k, 20.2)).sqrt();
    let sample = |i, j, k| (200.0 - 12.0 * ball(i, j, k)).max(0.0) as u8;
    let all = (0..z).flat_map(|k| (0..y).flat_map(move |j| (0..x).map(move |i| (i, j, k))));
    let bytes: Vec<u8> = all.map(|(i, j, k)| sample(i, j, k)).collect();
    folder.write("balls_1200x40x40_uint8.raw", &bytes);
}

#[test]
fn bricks_keep_a_limit_of_memory() {
    let folder = Folder::new();
    row_of_balls(&folder);
    let compute =
        ["compute", "balls_1200x40x40_uint8.raw", "--backend", "cpu", "--range", "168:176"];
    let within = [&compute[..], &["--max-memory", "70MB"]].concat();
    let printed = stderr(&folder.run(&[&within[..], &["-o", "a.isp"]].concat()));
    assert!(printed.contains("in 9 bricks of about 128^3"), "{printed}");
    // The same bytes as with `--brick`.
    folder.run(&[&compute[..], &["-q", "--brick", "128", "-o", "b.isp"]].concat());
    assert!(folder.read("a.isp") == folder.read("b.isp"));
    // A file that can only be read as a whole is reported.
    let prepared = [&within[..], &["--median", "1", "-o", "c.isp"]].concat();
    let printed = stderr(&folder.run(&prepared));
    assert!(printed.contains("1.83 MiB of samples"), "{printed}");
    // Some limits are too small even for bricks.
    let tight = [&compute[..], &["--max-memory", "50MB", "--brick", "128", "-o", "d.isp"]].concat();
    let output = folder.run_for(&tight, 2);
    let line = stderr(&output);
    let line = line.lines().last().expect("a line");
    assert!(line.contains(" MB ") && line.contains("--brick"), "{line}");
    let names = folder.names();
    assert_eq!(names, ["a.isp", "b.isp", "balls_1200x40x40_uint8.raw", "c.isp"]);
    let info = json(&folder.run(&["info", "a.isp", "--json"]));
    assert_eq!(info["parameters"]["bricks"]["n"], 9);
}

#[cfg(unix)]
#[test]
fn a_full_disk_is_an_error_of_one_line_and_leaves_no_partial_files() {
    let folder = merged();
    let before = folder.names();
    // Files end at 512 bytes: a signal unless it is ignored, then an error as of a full disk.
    let full = |arguments: &str| {
        let script = format!("trap '' XFSZ; ulimit -f 1; \"$0\" {arguments}");
        let output = folder.shell(&script);
        let printed = stderr(&output);
        assert_eq!(output.status.code(), Some(3), "{arguments}: {printed}");
        assert_eq!(folder.names(), before, "{arguments}");
        one_line(&printed)
    };
    let phantom = "compute --phantom noise:9:4 --backend cpu --brick 4 -q";
    assert!(full(&format!("{phantom} -o s.isp")).contains("s.isp"));
    assert!(full("merge p.json -q -o s.isp").contains("s.isp"));
    assert!(full("merge p.json -q -o /dev/full").contains("/dev/full"));
    let output = folder
        .shell("trap '' XFSZ; ulimit -f 1; \"$0\" compute --plan p.json --backend cpu -q -o new");
    assert_eq!(output.status.code(), Some(3));
    assert!(one_line(&stderr(&output)).contains("new/000000.part"));
    let left = std::fs::read_dir(folder.path().join("new")).expect("made").count();
    assert_eq!(left, 0);
}

#[cfg(unix)]
#[test]
fn a_stopped_computation_in_bricks_leaves_nothing() {
    let folder = Folder::new();
    // Once a part exists.
    let script = r#""$0" compute --phantom noise:17:4 --backend cpu --brick 4 -q -o s.isp & worker=$!
        while ! ls -A | grep -q part || ! ls .isospectrum-*.part | grep -q part; do sleep 0.01; done
        kill -TERM $worker; wait $worker"#;
    let output = folder.shell(script);
    assert_eq!(output.status.code(), Some(143), "{}", stderr(&output));
    assert_eq!(folder.names(), [] as [&str; 0]);
}
