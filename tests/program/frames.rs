//! `render --sweep`: one picture per isovalue, each the same as that picture alone.

use crate::common::program::{Folder, stderr};

#[test]
fn a_sweep_writes_the_pictures_of_its_isovalues() {
    let folder = Folder::with_spectrum();
    // The camera of a sweep fits all of its surfaces, that of a single picture one surface.
    let size = ["--size", "96x64", "--fit", "volume"];
    let sweep = ["render", "s.isp", "--sweep", "80%:20%:3", "-o", "f%03d.png"];
    folder.run(&[&sweep[..], &size[..]].concat());
    assert_eq!(folder.names(), ["f000.png", "f001.png", "f002.png", "s.isp"]);
    for (frame, isovalue) in [("f000.png", "80%"), ("f001.png", "50%"), ("f002.png", "20%")] {
        folder
            .run(&[&["render", "s.isp", "-c", isovalue, "-o", "one.png"][..], &size[..]].concat());
        assert!(folder.read(frame) == folder.read("one.png"), "{frame} is not that at {isovalue}");
    }
    assert!(folder.read("f000.png") != folder.read("f002.png"));
}

#[test]
fn errors_of_a_sweep_come_before_any_output() {
    let folder = Folder::with_spectrum();
    for (sweep, output, code, message) in [
        ("0%:100%:3", "f.png", 2, "%04d"),
        ("0%:100%:3", "f%d.jpg", 2, ".png"),
        ("0%:100%:3", "%d%d.png", 2, "%04d"),
        ("0%:100%:1", "f%d.png", 2, "2 to 100000 frames"),
        ("0%:100%", "f%d.png", 2, "FROM:TO:N"),
        ("0%:101%:3", "f%d.png", 4, "outside the range"),
        ("0%:100%:3", "s.isp/f%d.png", 3, "s.isp"),
    ] {
        let line = folder.fails(&["render", "s.isp", "--sweep", sweep, "-o", output], code);
        assert!(line.contains(message), "{line}");
    }
    folder.fails(&["render", "s.isp", "-o", "f.png"], 2);
    folder.fails(&["render", "s.isp", "-c", "1", "--sweep", "0%:100%:3", "-o", "f%d.png"], 2);
}

#[test]
fn the_folder_of_a_sweep_is_made() {
    let folder = Folder::with_spectrum();
    let sweep = ["render", "s.isp", "--sweep", "20%:80%:2", "-o", "a/b/%04d.png", "--size", "8x8"];
    folder.run(&sweep);
    assert!(folder.read("a/b/0001.png").starts_with(b"\x89PNG"));
    let other = ["render", "no.isp", "--sweep", "20%:80%:2", "-o", "c/%04d.png"];
    folder.fails(&other, 3);
}

#[test]
fn empty_pictures_are_reported() {
    let folder = Folder::with_spectrum();
    let size = ["--size", "8x8"];
    let one = ["render", "s.isp", "-c", "100%", "-o", "a.png"];
    let printed = stderr(&folder.run(&[&one[..], &size].concat()));
    assert!(printed.contains("is empty") && printed.contains("try 50%"), "{printed}");
    let quiet = folder.run(&[&one[..], &size, &["-q"]].concat());
    assert_eq!(stderr(&quiet), "");
    let sweep = ["render", "s.isp", "--sweep", "50%:100%:2", "-o", "%d.png"];
    let printed = stderr(&folder.run(&[&sweep[..], &size].concat()));
    assert!(printed.contains("1 of 2 pictures"), "{printed}");
}

#[test]
fn a_style_is_the_flags_that_it_stands_for_and_single_flags_win() {
    let folder = Folder::with_spectrum();
    let picture = |c: &str, flags: &[&str]| {
        let base =
            ["render", "s.isp", "-c", c, "--clip", "x:50%", "--size", "96x64", "-o", "p.png"];
        folder.run(&[&base[..], flags].concat());
        folder.read("p.png")
    };
    let styled = ["default", "paper", "studio", "flat"]
        .map(|style| (style, picture("50%", &["--style", style])));
    assert!(styled[0].1 == picture("50%", &[]), "the default style is no style");
    for (i, (style, own)) in styled.iter().enumerate() {
        for (other, picture) in &styled[..i] {
            assert!(own != picture, "{style} and {other} give the same picture");
        }
    }
    let [_, _, (_, studio), (_, flat)] = &styled;
    assert!(*flat == picture("50%", &["--light", "eye"]), "flat is light from the eye");
    let dark = ["--background", "dark", "--occlusion"];
    assert!(*studio == picture("50%=#e3b27c", &dark), "studio is dark, amber and occluded");
    let overridden = ["--light", "left", "--background", "white", "--occlusion=false"];
    let with_style = [&overridden[..], &["--style", "studio"]].concat();
    assert!(
        picture("50%=red", &with_style) == picture("50%=red", &overridden),
        "single flags win over the style"
    );
    // Films and turntables have the colour, too.
    let sweep = ["render", "s.isp", "--sweep", "50%:60%:2", "--clip", "x:50%", "-o", "f%d.png"];
    let sweep = [&sweep[..], &["--size", "96x64", "--fit", "volume", "--style", "studio"]].concat();
    folder.run(&sweep);
    let single = picture("50%", &["--fit", "volume", "--style", "studio"]);
    assert!(folder.read("f0.png") == single, "a frame of a sweep has the style");
    let wrong = ["render", "s.isp", "-c", "50%", "-o", "w.png", "--style", "gallery"];
    let line = folder.fails(&wrong, 2);
    assert!(line.contains("default, paper, studio, flat"), "{line}");
}

#[test]
fn each_flag_of_appearance_changes_the_picture() {
    let folder = Folder::with_spectrum();
    // A hollow half of a ball: its pictures from different sides differ, and occlusion darkens its inside.
    let base = ["render", "s.isp", "-c", "50%", "--clip", "x:50%", "--open", "--camera", "20,10"];
    let picture = |flags: &[&str]| {
        folder.run(&[&base[..], &["--size", "96x64", "-o", "p.png"], flags].concat());
        folder.read("p.png")
    };
    let appearances: [&[&str]; 7] = [
        &[],
        &["--orthographic"],
        &["--up", "-y"],
        &["--occlusion"],
        &["--silhouette"],
        &["--axes"],
        &["--axes", "--occlusion", "--orthographic", "--up", "x"],
    ];
    let pictures = appearances.map(picture);
    for i in 0..appearances.len() {
        for j in 0..i {
            assert!(
                pictures[i] != pictures[j],
                "{:?} gives the same picture as {:?}",
                appearances[i],
                appearances[j]
            );
        }
    }
    // The phantom's axes are those of the world.
    assert!(picture(&["--up", "z"]) == pictures[0], "z is up by itself");
    let line = folder.fails(&[&base[..], &["--up", "w", "-o", "w.png"]].concat(), 2);
    assert!(line.contains("x, y, z, -x, -y, -z"), "{line}");
}
