//! Modules use each other one way: what `use crate::` and `crate::` say in `src`, read from the text.

use std::fs;
use std::path::Path;

/// Each module may use those that stand before it. The program (`main`, `cli`) is a crate of its own.
const FLOW: [&str; 29] = [
    "error",
    "named",
    "progress",
    "random",
    "disjoint_sets",
    "input",
    "ply_reader",
    "beside",
    "volume",
    "topology",
    "field",
    "mesh",
    "extract",
    "gpu",
    "kernels",
    "spectrum",
    "sweep",
    "file",
    "color",
    "export",
    "render",
    "page",
    "verify",
    "prepared",
    "sources",
    "forecast",
    "bricks",
    "view",
    "lib",
];

/// Names of `error` that the root of the crate hands on.
const OF_THE_ROOT: [&str; 2] = ["Error", "Result"];

fn place_of(module: &str) -> Option<usize> {
    FLOW.iter().position(|&name| name == module)
}

/// The code of a file without its tests and comments.
fn code(text: &str) -> String {
    let tests = text.find("#[cfg(test)]\nmod tests {").unwrap_or(text.len());
    text[..tests].lines().filter_map(|line| line.split("//").next()).collect::<Vec<_>>().join("\n")
}

/// Names that stand directly behind `crate::`.
fn used(code: &str) -> Vec<String> {
    let name = |text: &str| text.chars().take_while(|&c| c == '_' || c.is_alphanumeric()).collect();
    let mut names = Vec::new();
    for behind in code.split("crate::").skip(1) {
        match behind.strip_prefix('{') {
            None => names.push(name(behind)),
            Some(list) => {
                let mut depth = 0;
                let mut is_start = true;
                for (i, c) in list.char_indices() {
                    if is_start && depth == 0 && c.is_alphabetic() {
                        names.push(name(&list[i..]));
                        is_start = false;
                    }
                    match c {
                        '{' => depth += 1,
                        '}' if depth == 0 => break,
                        '}' => depth -= 1,
                        ',' => is_start = true,
                        _ => {}
                    }
                }
            }
        }
    }
    names
}

/// Each use of a file that goes against the flow, or of a module that has no place in it.
fn against(module: &str, text: &str) -> Vec<String> {
    let Some(own) = place_of(module) else { return vec![format!("{module} has no place")] };
    let mut found = Vec::new();
    for name in used(&code(text)) {
        match place_of(&name) {
            _ if OF_THE_ROOT.contains(&name.as_str()) => {}
            Some(other) if other <= own => {}
            Some(_) => found.push(format!("{module} uses {name}")),
            None => found.push(format!("{module} uses {name}, which has no place")),
        }
    }
    found
}

fn look(folder: &Path, module: Option<&str>, found: &mut Vec<String>, n: &mut usize) {
    for entry in fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        let stem = path.file_stem().expect("a name").to_str().expect("plain text").to_owned();
        let of = module.unwrap_or(&stem);
        if ["main", "cli"].contains(&of) {
            continue;
        }
        if path.is_dir() {
            look(&path, Some(of), found, n);
        } else if path.extension().is_some_and(|e| e == "rs") && stem != "tests" {
            *n += 1;
            let text = fs::read_to_string(&path).expect("text");
            let here = against(of, &text);
            found.extend(here.into_iter().map(|what| format!("{}: {what}", path.display())));
        }
    }
}

#[test]
fn modules_use_each_other_one_way() {
    let (mut found, mut n) = (Vec::new(), 0);
    look(&Path::new(env!("CARGO_MANIFEST_DIR")).join("src"), None, &mut found, &mut n);
    assert!(n > 100, "{n} files of the library were read");
    assert!(found.is_empty(), "against the flow:\n{}", found.join("\n"));
}

#[test]
fn an_arrow_against_the_flow_is_seen() {
    for text in [
        "use crate::spectrum::Event;",
        "use crate::{error::{Error, Result}, spectrum::Event};",
        "fn f() { crate::spectrum::g() }",
    ] {
        assert_eq!(against("topology", text), ["topology uses spectrum"], "{text}");
    }
    assert!(against("topology", "use crate::volume::Volume; // as crate::spectrum").is_empty());
    assert!(against("topology", "use crate::{volume, error::Error};").is_empty());
    assert_eq!(
        against("topology", "use crate::new::X;"),
        ["topology uses new, which has no place"]
    );
    assert_eq!(against("new", ""), ["new has no place"]);
}
