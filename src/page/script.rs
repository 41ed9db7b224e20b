//! Joins the scripts of `page/*.js` into the one script of a page.
//!
//! Comments and white space are left out ([`compact`]), and names are shortened ([`names`]); they are two thirds of the bytes
//! (`docs/decisions/0013-plain-scripts-and-base64.md`).

use super::compact::compact;
use super::{names, tokens};

/// The scripts in the order in which the page has them, without the one that starts it.
const SCRIPTS: [&str; 45] = [
    include_str!("../../page/unpack.js"),
    include_str!("../../page/coder.js"),
    include_str!("../../page/file.js"),
    include_str!("../../page/connectivity.js"),
    include_str!("../../page/samples.js"),
    include_str!("../../page/trajectories.js"),
    include_str!("../../page/active.js"),
    include_str!("../../page/normals.js"),
    include_str!("../../page/surface.js"),
    include_str!("../../page/mesh.js"),
    include_str!("../../page/components.js"),
    include_str!("../../page/camera.js"),
    include_str!("../../page/colors.js"),
    include_str!("../../page/occlusion.js"),
    include_str!("../../page/depth_order.js"),
    include_str!("../../page/webgpu.js"),
    include_str!("../../page/webgl2.js"),
    include_str!("../../page/elements.js"),
    include_str!("../../page/plot.js"),
    include_str!("../../page/overlay.js"),
    include_str!("../../page/cube.js"),
    include_str!("../../page/picture.js"),
    include_str!("../../page/webm.js"),
    include_str!("../../page/film.js"),
    include_str!("../../page/weld.js"),
    include_str!("../../page/download.js"),
    include_str!("../../page/saves.js"),
    include_str!("../../page/isovalue.js"),
    include_str!("../../page/input.js"),
    include_str!("../../page/look_panel.js"),
    include_str!("../../page/slice.js"),
    include_str!("../../page/panel.js"),
    include_str!("../../page/embed.js"),
    include_str!("../../page/scene.js"),
    include_str!("../../page/viewer.js"),
    include_str!("../../page/address.js"),
    include_str!("../../page/container.js"),
    include_str!("../../page/chunk.js"),
    include_str!("../../page/chunked_file.js"),
    include_str!("../../page/local_file.js"),
    include_str!("../../page/worker.js"),
    include_str!("../../page/decode.js"),
    include_str!("../../page/loading.js"),
    include_str!("../../page/local.js"),
    include_str!("../../page/main.js"),
];

/// Starts a page that contains its isovalues.
const START: &str = include_str!("../../page/start.js");

/// Reads the isovalues of a page from a spectrum file on a server, and starts the page.
const LINKED: [&str; 2] =
    [include_str!("../../page/ranges.js"), include_str!("../../page/linked.js")];

/// The script of a page, a function without global names; `is_linked` if the isovalues are in a file on a server.
pub(super) fn script(is_linked: bool) -> String {
    let last = if is_linked { &LINKED[..] } else { &[START] };
    let scripts: Vec<&str> = SCRIPTS.iter().chain(last).copied().collect();
    let text = format!("(() => {{\n\"use strict\";\n{}}})();\n", scripts.join("\n"));
    let mut tokens = tokens::tokens(&text);
    names::shorten(&mut tokens);
    compact(&tokens)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_script_of_the_folder_is_in_the_page() {
        let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/page");
        let mut n = 0;
        for entry in std::fs::read_dir(folder).expect("readable") {
            let path = entry.expect("readable").path();
            if path.extension().is_some_and(|extension| extension == "js") {
                let text = std::fs::read_to_string(&path).expect("text");
                let mut all = SCRIPTS.iter().chain(&LINKED).chain([&START]);
                assert!(all.any(|known| **known == *text), "{path:?}");
                n += 1;
            }
        }
        assert_eq!(n, SCRIPTS.len() + LINKED.len() + 1);
    }
}
