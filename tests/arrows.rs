//! No import circles: rooms (`x.rs` with its folder `x/`) use each other in one direction only, and so do the files inside
//! each room. Read from the text of the sources.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// A room may use the rooms listed before it. `main` and `cli` are the program, which may use all of them.
const ORDER: &[&str] = &[
    "numbers",
    "caught_panic",
    "error",
    "setters",
    "parse_name",
    "progress",
    "random",
    "disjoint_sets",
    "grouped",
    "keys",
    "input",
    "ply_reader",
    "abandoned",
    "atomic_file",
    "atomic_folder",
    "output",
    "volume",
    "topology",
    "field",
    "mesh",
    "extract",
    "forecast",
    "suggestions",
    "gpu",
    "kernels",
    "spectrum",
    "sweep",
    "file",
    "color",
    "export",
    "render",
    "series",
    "page",
    "verify",
    "prepared",
    "settings",
    "color_sources",
    "extraction",
    "bricks",
    "view",
    "lib",
];

/// Rooms whose files still use each other in circles. None may be added.
const ROOMS_WITH_CIRCLES: &[&str] = &[];

/// The path of a module in the crate: `["volume", "nrrd"]`; the root is empty.
type Name = Vec<String>;

/// Which modules each module uses.
type Graph = BTreeMap<Name, BTreeSet<Name>>;

fn root(folder: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(folder)
}

/// All files below `folder` with this extension.
fn files(folder: &Path, extension: &str) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            found.extend(files(&path, extension));
        } else if path.extension().is_some_and(|e| e == extension) {
            found.push(path);
        }
    }
    found
}

/// The modules of a crate and their text. Files of unit tests are left out.
fn sources(folder: &str) -> BTreeMap<Name, String> {
    let folder = root(folder);
    let name = |path: &Path| -> Name {
        let inside = path.strip_prefix(&folder).expect("below").with_extension("");
        let parts: Name =
            inside.iter().map(|part| part.to_str().expect("UTF-8").to_owned()).collect();
        if parts == ["lib"] { vec![] } else { parts }
    };
    let files = files(&folder, "rs").into_iter();
    let files = files.filter(|path| !path.ends_with("tests.rs"));
    files.map(|path| (name(&path), fs::read_to_string(&path).expect("text"))).collect()
}

/// The code of a file without its unit tests, comments and string literals.
fn code(text: &str) -> String {
    let end = text.find("#[cfg(test)]\nmod tests").unwrap_or(text.len());
    let mut code = String::new();
    let mut rest = text[..end].chars().peekable();
    while let Some(c) = rest.next() {
        match c {
            '/' if rest.peek() == Some(&'/') => {
                rest.by_ref().find(|&c| c == '\n');
                code.push('\n');
            }
            '"' => {
                while let Some(c) = rest.next() {
                    match c {
                        '\\' => drop(rest.next()),
                        '"' => break,
                        _ => {}
                    }
                }
            }
            // A quote or an escape as a character.
            '\'' if rest.peek() == Some(&'"') => drop(rest.next()),
            '\'' if rest.peek() == Some(&'\\') => drop(rest.nth(1)),
            _ => code.push(c),
        }
    }
    code
}

/// The paths of a `use` declaration: `a::{b, c::d}` has `a::b` and `a::c::d`.
fn paths(tree: &str) -> Vec<Name> {
    let Some((prefix, list)) = tree.split_once('{') else {
        let path = tree.split(" as ").next().expect("a path");
        return vec![path.split("::").map(|part| part.trim().to_owned()).collect()];
    };
    let list = list.trim_end().strip_suffix('}').expect("the end of the list");
    let prefix: Name = prefix
        .split("::")
        .map(|part| part.trim().to_owned())
        .filter(|part| !part.is_empty())
        .collect();
    let (mut depth, mut start, mut found) = (0, 0, Vec::new());
    for (i, c) in list.char_indices().chain([(list.len(), ',')]) {
        match c {
            '{' => depth += 1,
            '}' => depth -= 1,
            ',' if depth == 0 => {
                if !list[start..i].trim().is_empty() {
                    let inner = paths(&list[start..i]).into_iter();
                    found.extend(inner.map(|path| [&prefix[..], &path].concat()));
                }
                start = i + 1;
            }
            _ => {}
        }
    }
    found
}

/// Every path that some code names: those of `use`, and those of two parts or more anywhere else.
fn named_paths(code: &str) -> Vec<Name> {
    let mut found = Vec::new();
    let mut word = |word: &str| {
        if word.contains("::") {
            found.push(word.split("::").map(str::to_owned).collect());
        }
    };
    let mut imported = Vec::new();
    let is_part = |c: char| c == '_' || c.is_alphanumeric();
    let mut rest = code;
    let mut before = ["", ""];
    while let Some(start) = rest.find(is_part) {
        rest = &rest[start..];
        let mut end = 0;
        loop {
            end += rest[end..].find(|c| !is_part(c)).unwrap_or(rest.len() - end);
            match rest[end..].strip_prefix("::") {
                Some(next) if next.starts_with(is_part) => end += 2,
                _ => break,
            }
        }
        let (text, behind) = rest.split_at(end);
        rest = behind;
        // Not the captures `use<'a>`.
        if text == "use" && behind.starts_with(char::is_whitespace) {
            let (tree, behind) = rest.split_once(';').expect("the end of a use");
            imported.extend(paths(tree));
            rest = behind;
        } else if before != ["pub", "in"] {
            word(text);
        }
        before = [before[1], text];
    }
    found.extend(imported);
    found
}

/// The deepest module of the crate in a path that `user` names, if any.
fn module_of(modules: &BTreeSet<Name>, user: &Name, path: &Name) -> Option<Name> {
    let parent = |name: &Name| name[..name.len().saturating_sub(1)].to_vec();
    let mut rest = &path[1..];
    let mut at = match path[0].as_str() {
        "crate" => vec![],
        "self" => user.clone(),
        "super" => parent(user),
        _ => {
            rest = path;
            user.clone()
        }
    };
    let start = at.clone();
    while rest.first().is_some_and(|part| part == "super") {
        (at, rest) = (parent(&at), &rest[1..]);
    }
    while let Some((part, behind)) = rest.split_first() {
        let next = [&at[..], std::slice::from_ref(part)].concat();
        if !modules.contains(&next) {
            break;
        }
        (at, rest) = (next, behind);
    }
    let is_relative = std::ptr::eq(path.as_slice(), rest) && at == start;
    (!is_relative).then_some(at)
}

fn graph(sources: &BTreeMap<Name, String>) -> Graph {
    let modules: BTreeSet<Name> = sources.keys().cloned().collect();
    let uses = |(name, text): (&Name, &String)| {
        let paths = named_paths(&code(text)).into_iter();
        let used = paths.filter_map(|path| module_of(&modules, name, &path));
        (name.clone(), used.filter(|used| used != name).collect())
    };
    sources.iter().map(uses).collect()
}

/// The modules reachable from one.
fn reachable(graph: &Graph, from: &Name) -> BTreeSet<Name> {
    let (mut found, mut open) = (BTreeSet::new(), vec![from]);
    while let Some(name) = open.pop() {
        // The root uses every room, and rooms use its re-exports.
        for used in graph.get(name).into_iter().flatten().filter(|used| !used.is_empty()) {
            if found.insert(used.clone()) {
                open.push(used);
            }
        }
    }
    found
}

/// Each set of modules that use each other in a circle.
fn circles(graph: &Graph) -> Vec<BTreeSet<Name>> {
    let reach: BTreeMap<&Name, BTreeSet<Name>> =
        graph.keys().map(|name| (name, reachable(graph, name))).collect();
    let mut found: Vec<BTreeSet<Name>> = Vec::new();
    for name in graph.keys().filter(|name| reach[name].contains(*name)) {
        if found.iter().any(|circle| circle.contains(name)) {
            continue;
        }
        found.push(
            reach[name]
                .iter()
                .filter(|other| reach.get(other).is_some_and(|of| of.contains(name)))
                .cloned()
                .collect(),
        );
    }
    found
}

/// Each circle in a room that is not excused, and each unnecessary excuse.
fn complaints(graph: &Graph, excused: &[&str]) -> Vec<String> {
    let mut found = Vec::new();
    let mut rooms = BTreeSet::new();
    for circle in circles(graph) {
        for name in circle.iter().filter(|name| !excused.contains(&name[0].as_str())) {
            let used: Vec<String> =
                graph[name].intersection(&circle).map(|used| used.join("/")).collect();
            found.push(format!("{} uses {}", name.join("/"), used.join(", ")));
        }
        rooms.extend(circle.into_iter().map(|name| name[0].clone()));
    }
    let unneeded = excused.iter().filter(|room| !rooms.contains(**room));
    found.extend(
        unneeded.map(|room| format!("{room} has no circle any more: take it off the list")),
    );
    found
}

/// Each use of a room that is not listed before its user, or not listed at all.
fn against(order: &[&str], graph: &Graph) -> Vec<String> {
    let room = |name: &Name| name.first().map_or("lib", String::as_str).to_owned();
    let place = |room: &str| order.iter().position(|&name| name == room);
    let mut found = Vec::new();
    for (user, used) in
        graph.iter().filter(|(user, _)| !["main", "cli"].contains(&room(user).as_str()))
    {
        let Some(own) = place(&room(user)) else {
            found.push(format!("{} has no place", user.join("/")));
            continue;
        };
        for used in used.iter().filter(|used| !used.is_empty()) {
            match place(&room(used)) {
                Some(other) if other <= own => {}
                Some(_) => found.push(format!("{} uses {}", user.join("/"), used.join("/"))),
                None => found.push(format!("{} has no place", used.join("/"))),
            }
        }
    }
    found
}

#[test]
fn rooms_use_each_other_in_one_direction() {
    let graph = graph(&sources("src"));
    assert!(graph.len() > 100, "{} files were read", graph.len());
    let found = against(ORDER, &graph);
    assert!(found.is_empty(), "against the order:\n{}", found.join("\n"));
}

#[test]
fn files_of_a_room_use_each_other_in_one_direction() {
    let found = complaints(&graph(&sources("src")), ROOMS_WITH_CIRCLES);
    assert!(found.is_empty(), "in a circle:\n{}", found.join("\n"));
}

#[test]
fn files_of_the_python_package_use_each_other_in_one_direction() {
    let graph = graph(&sources("python/src"));
    assert!(graph.len() > 5, "{} files were read", graph.len());
    let found = complaints(&graph, &[]);
    assert!(found.is_empty(), "in a circle:\n{}", found.join("\n"));
}

/// The modules of the Python package that each of them imports, anywhere in its file.
fn python_graph() -> Graph {
    let files = files(&root("python/package/isospectrum"), "py").into_iter();
    let stem = |path: &Path| path.file_stem().expect("a name").to_str().expect("UTF-8").to_owned();
    let modules: BTreeSet<String> = files.clone().map(|path| stem(&path)).collect();
    let uses = |path: PathBuf| {
        let text = fs::read_to_string(&path).expect("text");
        let imports = text.lines().filter_map(|line| line.trim_start().strip_prefix("from ."));
        let names = imports.flat_map(|import| {
            // Either `_module import Name` or ` import _module, _other`.
            let (module, names) = import.split_once(" import ").unwrap_or((import, ""));
            let names = if module.is_empty() { names } else { module };
            names.split(',').map(|name| name.trim().to_owned()).collect::<Vec<_>>()
        });
        (
            vec![stem(&path)],
            names.filter(|name| modules.contains(name)).map(|name| vec![name]).collect(),
        )
    };
    files.map(uses).collect()
}

#[test]
fn modules_of_the_python_package_import_each_other_in_one_direction() {
    let graph = python_graph();
    assert!(graph.values().map(BTreeSet::len).sum::<usize>() > 10, "{graph:?}");
    let found = complaints(&graph, &[]);
    assert!(found.is_empty(), "in a circle:\n{}", found.join("\n"));
}

fn example(files: &[(&str, &str)]) -> Graph {
    let name = |path: &str| path.split('/').map(str::to_owned).collect();
    graph(&files.iter().map(|&(path, text)| (name(path), text.to_owned())).collect())
}

#[test]
fn a_use_that_violates_the_order_of_rooms_is_found() {
    for text in [
        "use crate::b::Item;",
        "use crate::{c::{Item, Other}, b::Item};",
        "fn f() { crate::b::g() }",
        "fn f(x: super::b::X) {}",
    ] {
        let graph = example(&[("a", text), ("b", ""), ("c", "")]);
        assert_eq!(against(&["c", "a", "b"], &graph), ["a uses b"], "{text}");
    }
    let graph = example(&[
        ("a", "use crate::c::X; // crate::b::X\nconst X: &str = \"crate::b::X\";"),
        ("b", ""),
        ("c", ""),
    ]);
    assert!(against(&["c", "a", "b"], &graph).is_empty());
    assert_eq!(against(&["a"], &example(&[("a", "use crate::new::X;"), ("new", "")])).len(), 2);
}

#[test]
fn a_circle_inside_a_room_is_found() {
    let circle = |x: &str, y: &str| {
        complaints(&example(&[("r", "mod x; mod y;"), ("r/x", x), ("r/y", y)]), &[])
    };
    for (x, y) in [
        ("use super::y::Y;", "use super::x::{X, Other};"),
        ("use crate::r::y;", "fn f() { super::x::f() }"),
        ("use super::{Z, y::{self}};", "pub(super) use crate::r::x::X as Y;"),
    ] {
        assert_eq!(circle(x, y), ["r/x uses r/y", "r/y uses r/x"], "{x} {y}");
    }
    assert!(circle("use super::y::Y;", "").is_empty());
    assert!(
        circle("use super::y::Y;", "#[cfg(test)]\nmod tests { use super::super::x::X; }")
            .is_empty()
    );
    // An item of the parent that a child uses makes a circle if the parent uses the child.
    let parent = |text| complaints(&example(&[("r", text), ("r/x", "use super::Item;")]), &[]);
    assert_eq!(parent("mod x; pub use x::X;"), ["r uses r/x", "r/x uses r"]);
    assert!(parent("mod x;").is_empty());
    // Circles of an excused room are allowed, and the excuse must be needed.
    let files = [("r", "mod x; use x::X;"), ("r/x", "use super::Item;")];
    assert!(complaints(&example(&files), &["r"]).is_empty());
    assert_eq!(complaints(&example(&files[1..]), &["r"]).len(), 1);
}
