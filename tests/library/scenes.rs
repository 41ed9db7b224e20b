//! Several meshes in one GLB or USDA file, next to each other and as a sweep.

use std::collections::BTreeSet;

use crate::common::program::Folder;
use isospectrum::Error;
use isospectrum::export::{Arrangement, Format, SceneMesh, SurfaceStyle, write_scene_to};
use isospectrum::spectrum::Mesh;
use isospectrum::volume::{Placement, Space, Unit};

/// A fan of triangles around the first corner.
fn fan(n: u32) -> Mesh {
    let corner = |i: u32| [f32::from(i as u8), f32::from((i * i) as u8), 0.5];
    Mesh {
        positions: (0..n + 2).map(corner).collect(),
        normals: vec![[0.0, 0.0, 1.0]; n as usize + 2],
        triangles: (1..=n).map(|i| [0, i, i + 1]).collect(),
        caps: vec![false; n as usize],
    }
}

fn frames() -> Vec<SceneMesh> {
    let style = |isovalue: f64| SurfaceStyle { isovalue, color: [0.5, 0.25, 0.125], opacity: 0.75 };
    let frame =
        |(i, n)| SceneMesh { mesh: fan(n), style: style(10.0 * f64::from(i)), colors: None };
    [(1, 3), (2, 0), (3, 2)].map(frame).to_vec()
}

fn bytes(arrangement: Arrangement, format: Format) -> Vec<u8> {
    let placement = Placement {
        origin: [1e6, 2.0, 3.0],
        unit: Unit::Mm,
        space: Space::Lps,
        ..Placement::default()
    };
    let mut bytes = Vec::new();
    write_scene_to(frames(), arrangement, &placement, format, &mut bytes)
        .expect("memory takes all");
    bytes
}

fn glb(file: &[u8]) -> (serde_json::Value, Vec<u8>) {
    let u32_at = |at: usize| u32::from_le_bytes(file[at..at + 4].try_into().expect("four"));
    assert_eq!(u32_at(8) as usize, file.len());
    let length = u32_at(12) as usize;
    let json = serde_json::from_slice(&file[20..20 + length]).expect("JSON");
    assert_eq!(u32_at(20 + length) as usize, file.len() - 28 - length);
    (json, file[28 + length..].to_vec())
}

/// The numbers of an accessor of 32-bit floats.
fn floats(json: &serde_json::Value, binary: &[u8], accessor: u64, width: usize) -> Vec<f32> {
    let accessor = &json["accessors"][accessor as usize];
    let view = &json["bufferViews"][accessor["bufferView"].as_u64().expect("a view") as usize];
    let start = view["byteOffset"].as_u64().expect("an offset") as usize;
    let n = accessor["count"].as_u64().expect("a count") as usize * width;
    let row = |i: usize| binary[start + 4 * i..][..4].try_into().expect("four bytes");
    (0..n).map(|i| f32::from_le_bytes(row(i))).collect()
}

#[test]
fn a_flip_book_shows_one_mesh_at_a_time() {
    let (json, binary) = glb(&bytes(Arrangement::Sweep { seconds: 6.0 }, Format::Glb));
    let nodes = json["nodes"].as_array().expect("nodes");
    assert_eq!(nodes.len(), 3);
    assert_eq!(json["scenes"][0]["nodes"], serde_json::json!([0, 1, 2]));
    // The second isosurface is empty: a page without a mesh.
    let has_mesh: Vec<bool> = nodes.iter().map(|node| node.get("mesh").is_some()).collect();
    assert_eq!(has_mesh, [true, false, true]);
    assert_eq!(nodes[2]["translation"], serde_json::json!([1e6, 2.0, 3.0]));
    assert_eq!(
        nodes[2]["extras"],
        serde_json::json!({ "isovalue": 30.0, "unit": "mm", "space": "LPS" })
    );
    let animation = &json["animations"][0];
    let mut shown = Vec::new();
    for channel in animation["channels"].as_array().expect("channels") {
        let sampler = &animation["samplers"][channel["sampler"].as_u64().expect("one") as usize];
        assert_eq!(sampler["interpolation"], "STEP");
        if channel["target"]["path"] == "pointer" {
            continue;
        }
        assert_eq!(channel["target"]["path"], "scale");
        let times = floats(&json, &binary, sampler["input"].as_u64().expect("one"), 1);
        let scales = floats(&json, &binary, sampler["output"].as_u64().expect("one"), 3);
        assert_eq!(times.last().map(|t| *t <= 6.0), Some(true));
        assert!(times.windows(2).all(|w| w[0] < w[1]), "{times:?}");
        // The scale at half a second, 2.5 and 4.5.
        let at = |time: f32| scales[3 * (times.partition_point(|&t| t <= time) - 1)];
        shown.push([0.5, 2.5, 4.5, 6.0].map(at));
    }
    assert_eq!(shown, [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 1.0]]);
    // A viewer that plays no animation shows the first mesh alone.
    let scales: Vec<_> = nodes.iter().map(|node| node.get("scale").cloned()).collect();
    let nothing = Some(serde_json::json!([0.0, 0.0, 0.0]));
    assert_eq!(scales, [None, nothing.clone(), nothing]);
    let pointers = animation["channels"].as_array().expect("channels").iter().filter_map(|c| {
        c["target"]["extensions"]["KHR_animation_pointer"]["pointer"].as_str().map(str::to_owned)
    });
    let wanted = (0..3).map(|i| format!("/nodes/{i}/extensions/KHR_node_visibility/visible"));
    assert_eq!(pointers.collect::<BTreeSet<_>>(), wanted.collect::<BTreeSet<_>>());
}

#[test]
fn several_surfaces_keep_their_colors() {
    let (json, _) = glb(&bytes(Arrangement::Together, Format::Glb));
    assert_eq!(json["meshes"].as_array().map(Vec::len), Some(2));
    let material = &json["materials"][1];
    assert_eq!(
        material["pbrMetallicRoughness"]["baseColorFactor"],
        serde_json::json!([0.5, 0.25, 0.125, 0.75])
    );
    assert_eq!(material["alphaMode"], "BLEND");
    assert!(json.get("animations").is_none() && json.get("extensionsUsed").is_none());
    let text = String::from_utf8(bytes(Arrangement::Together, Format::Usda)).expect("text");
    assert_eq!(text.matches("def Mesh ").count(), 3);
    assert!(text.contains("primvars:displayColor = [(0.5, 0.25, 0.125)]"), "{text}");
    assert!(text.contains("double3 xformOp:translate = (1000000, 2, 3)"));
    assert!(text.contains("metersPerUnit = 1e-3\n"));
}

#[test]
fn usda_has_a_mesh_for_every_time() {
    let text =
        String::from_utf8(bytes(Arrangement::Sweep { seconds: 6.0 }, Format::Usda)).expect("text");
    for line in [
        "    endTimeCode = 2\n",
        "    timeCodesPerSecond = 0.5\n",
        "            0: [0, 1, 2, 0, 2, 3, 0, 3, 4],\n            1: [],\n            2: [0, 1, 2, 0, 2, 3],\n",
        "        custom double isovalue.timeSamples = {\n            0: 10,\n            1: 20,\n            2: 30,\n        }\n",
    ] {
        assert!(text.contains(line), "{line} in {text}");
    }
    assert_eq!(text.matches('{').count(), text.matches('}').count());
}

#[test]
fn other_formats_hold_one_mesh() {
    for format in [Format::Ply, Format::ThreeMf] {
        let written = write_scene_to(
            frames(),
            Arrangement::Together,
            &Placement::default(),
            format,
            &mut Vec::new(),
        );
        assert!(matches!(written, Err(Error::Usage(_))));
    }
}

#[test]
fn the_program_writes_scenes_by_the_extension() {
    let folder = Folder::with_spectrum();
    let output =
        folder.run(&["extract", "s.isp", "--sweep", "20%:80%:4", "-o", "sweep.glb", "--json"]);
    let report: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert_eq!(report["meshes"].as_array().map(Vec::len), Some(4));
    assert_eq!(report["bytes"].as_u64(), Some(folder.read("sweep.glb").len() as u64));
    let (json, _) = glb(&folder.read("sweep.glb"));
    assert_eq!(json["nodes"].as_array().map(Vec::len), Some(4));
    // Pages of a flip-book are the meshes that are written by themselves.
    folder.run(&["extract", "s.isp", "--sweep", "20%:80%:4", "-o", "page-%d.glb"]);
    let (page, _) = glb(&folder.read("page-2.glb"));
    assert_eq!(
        page["accessors"][0]["count"],
        json["accessors"][json["meshes"][2]["primitives"][0]["attributes"]["POSITION"]
            .as_u64()
            .expect("one") as usize]["count"]
    );

    folder.run(&["extract", "s.isp", "-c", "30%=bone", "-c", "60%@0.5", "-o", "both.usda"]);
    let text = String::from_utf8(folder.read("both.usda")).expect("text");
    assert!(text.contains("displayOpacity = [0.5]") && text.contains("def Mesh \"mesh_2\""));
    folder.run(&["extract", "s.isp", "--sweep", "20%:80%:3", "-o", "s.usda", "--color", "quality"]);
    let text = String::from_utf8(folder.read("s.usda")).expect("text");
    assert!(
        text.contains("color3f[] primvars:displayColor.timeSamples"),
        "colours change with time"
    );
    let line = folder.fails(&["extract", "s.isp", "--sweep", "20%:80%:3", "-o", "m.ply"], 2);
    assert!(line.contains("number"), "{line}");
}
