//! GLB, binary glTF 2.0: one mesh with positions, normals and indices; several, visible together or as a flip-book; or one
//! that changes its shape (`morph`).
//!
//! Positions are relative to the origin of the volume, which is the translation of the nodes: 32-bit floats would lose the
//! shape of a mesh far from the world's origin.
//!
//! A flip-book is an animation with one node per mesh that scales all nodes but one to zero, in steps. Every program that
//! plays animations can play it. The same animation also sets `KHR_node_visibility` through `KHR_animation_pointer`, for
//! programs that skip invisible nodes; other programs ignore it.

use std::io::{self, Write};

use serde_json::{Value, json};

use super::color_data::ColorData;
use super::scene::{Arrangement, SurfaceStyle, WorldSceneMesh};
use super::world_mesh::WorldMesh;
use crate::volume::{Placement, Space, Unit};

/// glTF's component types: 8-bit, 16-bit and 32-bit unsigned integers, 32-bit floats.
const UNSIGNED_BYTE: u32 = 5121;
const UNSIGNED_SHORT: u32 = 5123;
const UNSIGNED_INT: u32 = 5125;
const FLOAT: u32 = 5126;

/// glTF's buffer view targets: vertex attributes, vertex indices.
const ARRAY_BUFFER: u32 = 34962;
const ELEMENT_ARRAY_BUFFER: u32 = 34963;

/// The names of the extensions of a flip-book.
const VISIBILITY: &str = "KHR_node_visibility";
const POINTER: &str = "KHR_animation_pointer";

/// Writes a mesh. An empty mesh becomes an empty scene, as glTF has no empty buffers.
///
/// By glTF +y is up and the unit is the metre. A molecule of 1e-9 m is invisible in most viewers, so coordinates are those of
/// the world, and `extras` holds unit and space.
pub(super) fn write(
    mesh: WorldMesh,
    colors: Option<&ColorData>,
    writer: &mut dyn Write,
) -> io::Result<()> {
    let mut file = File::default();
    if !mesh.mesh.triangles.is_empty() {
        let index = file.add_mesh(&mesh, colors, None);
        file.nodes.push(node(&mesh.placement, index));
    }
    file.write(json!({}), writer)
}

/// Writes several meshes, visible together or one after the other.
pub(super) fn write_scene(
    frames: &[WorldSceneMesh],
    arrangement: Arrangement,
    writer: &mut dyn Write,
) -> io::Result<()> {
    let mut file = File::default();
    let mut channels = Vec::new();
    for (i, WorldSceneMesh { mesh, colors, style }) in frames.iter().enumerate() {
        let material = match arrangement {
            Arrangement::Together => Some(material(style, colors.is_some())),
            Arrangement::Sweep { .. } => None,
        };
        // An empty mesh becomes a node without a mesh.
        let mut node = match mesh.mesh.triangles.is_empty() {
            false => node(&mesh.placement, file.add_mesh(mesh, colors.as_ref(), material)),
            true => json!({}),
        };
        node["name"] = json!(format!("isovalue {}", style.isovalue));
        node["extras"]["isovalue"] = json!(style.isovalue);
        if let Arrangement::Sweep { seconds } = arrangement {
            let duration = (seconds / frames.len() as f64) as f32;
            file.animate_page(
                &mut channels,
                &mut node,
                FlipBookPage { i, n: frames.len(), duration },
            );
        }
        file.nodes.push(node);
    }
    let properties = match arrangement {
        Arrangement::Together => json!({}),
        Arrangement::Sweep { .. } => json!({
            "animations": [{ "name": "sweep", "channels": channels, "samplers": file.samplers }],
            "extensionsUsed": [POINTER, VISIBILITY],
        }),
    };
    file.write(properties, writer)
}

/// Writes a mesh with morph targets and an animation that goes through them linearly in `seconds`; the mesh's own shape comes
/// at position `base` among them.
pub(super) fn write_morph(
    mesh: &WorldMesh,
    targets: &[WorldMesh],
    base: usize,
    seconds: f64,
    writer: &mut dyn Write,
) -> io::Result<()> {
    let mut file = File::default();
    let index = file.add_mesh(mesh, None, None);
    let n = targets.len();
    let targets: Vec<Value> =
        targets.iter().map(|target| file.add_morph_target(mesh, target)).collect();
    file.meshes[index]["primitives"][0]["targets"] = json!(targets);
    // One weight per target and time, all of them 0 at the time of the mesh's own shape.
    let weights = |time: usize| {
        (0..=n).filter(move |&shape| shape != base).map(move |s| f32::from(u8::from(s == time)))
    };
    file.meshes[index]["weights"] = json!(weights(0).collect::<Vec<_>>());
    let times: Vec<f32> = (0..=n).map(|i| (seconds * i as f64 / n as f64) as f32).collect();
    let input = file.add_times(&times);
    let all = (0..=n).flat_map(weights).flat_map(f32::to_le_bytes);
    let view = file.add_view(all, None, None);
    let output = file.add_accessor(json!({
        "bufferView": view, "componentType": FLOAT, "count": n * (n + 1), "type": "SCALAR",
    }));
    file.nodes.push(node(&mesh.placement, index));
    let animation = json!({
        "name": "sweep",
        "channels": [{ "sampler": 0, "target": { "node": 0, "path": "weights" } }],
        "samplers": [{ "input": input, "output": output, "interpolation": "LINEAR" }],
    });
    file.write(json!({ "animations": [animation] }), writer)
}

/// Frame `i` of the `n` of a flip-book, visible for `duration` seconds.
#[derive(Clone, Copy)]
struct FlipBookPage {
    i: usize,
    n: usize,
    duration: f32,
}

/// A file under construction.
#[derive(Default)]
struct File {
    nodes: Vec<Value>,
    meshes: Vec<Value>,
    materials: Vec<Value>,
    samplers: Vec<Value>,
    accessors: Vec<Value>,
    views: Vec<Value>,
    bytes: Vec<u8>,
}

impl File {
    /// Adds bytes as a buffer view and returns its index.
    fn add_view(
        &mut self,
        bytes: impl Iterator<Item = u8>,
        stride: Option<usize>,
        target: Option<u32>,
    ) -> usize {
        let start = self.bytes.len();
        self.bytes.extend(bytes);
        let mut view =
            json!({ "buffer": 0, "byteOffset": start, "byteLength": self.bytes.len() - start });
        if let Some(stride) = stride {
            view["byteStride"] = json!(stride);
        }
        if let Some(target) = target {
            view["target"] = json!(target);
        }
        // Every view starts at a multiple of four bytes.
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        self.views.push(view);
        self.views.len() - 1
    }

    fn add_accessor(&mut self, accessor: Value) -> usize {
        self.accessors.push(accessor);
        self.accessors.len() - 1
    }

    /// Adds the increasing times of an animation, seconds, and returns the index of the accessor.
    fn add_times(&mut self, times: &[f32]) -> usize {
        let view = self.add_view(times.iter().flat_map(|t| t.to_le_bytes()), None, None);
        self.add_accessor(json!({
            "bufferView": view, "componentType": FLOAT, "count": times.len(), "type": "SCALAR",
            "min": [times[0]], "max": [times[times.len() - 1]],
        }))
    }

    /// Adds a non-empty mesh and returns its index. Colours are linear, as glTF defines them; the values they show go into an
    /// application-specific attribute.
    fn add_mesh(
        &mut self,
        world_mesh: &WorldMesh,
        colors: Option<&ColorData>,
        material: Option<Value>,
    ) -> usize {
        let mesh = &world_mesh.mesh;
        let (n, m) = (mesh.positions.len(), mesh.triangles.len());
        let position = self.add_vectors(&world_mesh.positions_around_origin(), true);
        let normal = self.add_vectors(&mesh.normals, false);
        let corners = mesh.triangles.iter().flatten().flat_map(|v| v.to_le_bytes());
        let view = self.add_view(corners, None, Some(ELEMENT_ARRAY_BUFFER));
        let indices = self.add_accessor(json!({
            "bufferView": view, "componentType": UNSIGNED_INT, "count": 3 * m, "type": "SCALAR",
        }));
        let mut primitive =
            json!({ "attributes": { "POSITION": position, "NORMAL": normal }, "indices": indices });
        if let Some(colors) = colors {
            let channels = colors.linear.iter().flat_map(|&[r, g, b]| [r, g, b, 1.0]);
            let rgba = channels.flat_map(|c| ((c * 65535.0).round() as u16).to_le_bytes());
            let view = self.add_view(rgba, Some(8), Some(ARRAY_BUFFER));
            primitive["attributes"]["COLOR_0"] = json!(self.add_accessor(json!({
                "bufferView": view, "componentType": UNSIGNED_SHORT, "normalized": true, "count": n, "type": "VEC4",
            })));
            // glTF forbids NaN and infinity.
            let values = colors.vertex_values.iter().map(|&x| if x.is_finite() { x } else { 0.0 });
            let values = values.flat_map(f32::to_le_bytes);
            let view = self.add_view(values, Some(4), Some(ARRAY_BUFFER));
            let name = format!("_{}", colors.name.to_ascii_uppercase());
            primitive["attributes"][name] = json!(self.add_accessor(json!({
                "bufferView": view, "componentType": FLOAT, "count": n, "type": "SCALAR",
            })));
        }
        if let Some(material) = material {
            primitive["material"] = json!(self.materials.len());
            self.materials.push(material);
        }
        self.meshes.push(json!({ "primitives": [primitive] }));
        self.meshes.len() - 1
    }

    /// Adds a vector per vertex, with its bounds if `bounded`, and returns the index of the accessor.
    fn add_vectors(&mut self, rows: &[[f32; 3]], bounded: bool) -> usize {
        let bytes = rows.iter().flatten().flat_map(|x| x.to_le_bytes());
        let view = self.add_view(bytes, Some(12), Some(ARRAY_BUFFER));
        let mut accessor = json!({
            "bufferView": view, "componentType": FLOAT, "count": rows.len(), "type": "VEC3",
        });
        if bounded {
            for (name, pick) in [("min", f32::min as fn(f32, f32) -> f32), ("max", f32::max)] {
                let rows = rows.iter().copied();
                let bound = rows.reduce(|a, b| std::array::from_fn(|i| pick(a[i], b[i])));
                accessor[name] = json!(bound.unwrap_or_default());
            }
        }
        self.add_accessor(accessor)
    }

    /// Adds a morph target: the differences of its positions and normals to those of the mesh.
    fn add_morph_target(&mut self, mesh: &WorldMesh, target: &WorldMesh) -> Value {
        let differences = |to: &[[f32; 3]], from: &[[f32; 3]]| -> Vec<[f32; 3]> {
            let pairs = to.iter().zip(from);
            pairs.map(|(a, b)| std::array::from_fn(|i| a[i] - b[i])).collect()
        };
        let positions =
            differences(&target.positions_around_origin(), &mesh.positions_around_origin());
        let normals = differences(&target.mesh.normals, &mesh.mesh.normals);
        let position = self.add_vectors(&positions, true);
        json!({ "POSITION": position, "NORMAL": self.add_vectors(&normals, false) })
    }

    /// Adds the animation channels that show the next node during one page of a flip-book.
    fn animate_page(&mut self, channels: &mut Vec<Value>, node: &mut Value, page: FlipBookPage) {
        let FlipBookPage { i, n, duration } = page;
        let index = self.nodes.len();
        let mut keys = vec![(0.0, i == 0)];
        if i > 0 {
            keys.push((duration * i as f32, true));
        }
        // The last page stays visible; its last key only marks the end of the animation.
        keys.push((duration * (i + 1) as f32, i + 1 == n));
        let times: Vec<f32> = keys.iter().map(|key| key.0).collect();
        let input = self.add_times(&times);
        let scales = keys.iter().flat_map(|key| [f32::from(u8::from(key.1)); 3]);
        let view = self.add_view(scales.flat_map(f32::to_le_bytes), None, None);
        let scale = self.add_accessor(json!({
            "bufferView": view, "componentType": FLOAT, "count": keys.len(), "type": "VEC3",
        }));
        let view = self.add_view(keys.iter().map(|key| u8::from(key.1)), None, None);
        let visible = self.add_accessor(json!({
            "bufferView": view, "componentType": UNSIGNED_BYTE, "count": keys.len(), "type": "SCALAR",
        }));
        for (output, target) in [
            (scale, json!({ "node": index, "path": "scale" })),
            (
                visible,
                json!({
                    "path": "pointer",
                    "extensions": { POINTER: { "pointer": format!("/nodes/{index}/extensions/{VISIBILITY}/visible") } },
                }),
            ),
        ] {
            channels.push(json!({ "sampler": self.samplers.len(), "target": target }));
            self.samplers
                .push(json!({ "input": input, "output": output, "interpolation": "STEP" }));
        }
        // Without the animation only the first page is visible, because the others have a scale of zero. The visibility must
        // be true for programs that know the extension but not its animation.
        node["extensions"][VISIBILITY] = json!({ "visible": true });
        if i > 0 {
            node["scale"] = json!([0.0, 0.0, 0.0]);
        }
    }

    /// Writes the file, with further top-level properties.
    fn write(self, properties: Value, writer: &mut dyn Write) -> io::Result<()> {
        let generator = concat!("isospectrum ", env!("CARGO_PKG_VERSION"));
        let mut json = json!({ "asset": { "version": "2.0", "generator": generator }, "scene": 0, "scenes": [{}] });
        let lists = [
            ("nodes", self.nodes),
            ("meshes", self.meshes),
            ("materials", self.materials),
            ("accessors", self.accessors),
            ("bufferViews", self.views),
        ];
        if !lists[0].1.is_empty() {
            json["scenes"][0]["nodes"] = json!((0..lists[0].1.len()).collect::<Vec<_>>());
        }
        // glTF has no empty lists.
        for (name, list) in lists {
            if !list.is_empty() {
                json[name] = Value::Array(list);
            }
        }
        if !self.bytes.is_empty() {
            json["buffers"] = json!([{ "byteLength": self.bytes.len() }]);
        }
        if let Value::Object(properties) = properties {
            properties.into_iter().for_each(|(name, value)| json[name] = value);
        }
        let mut json = json.to_string().into_bytes();
        json.resize(json.len().next_multiple_of(4), b' ');
        let has_binary = !self.bytes.is_empty();
        let total = 12 + 8 + json.len() + if has_binary { 8 + self.bytes.len() } else { 0 };
        let total = u32::try_from(total).map_err(|_| {
            io::Error::other(format!("{total} bytes, expected less than 4 GiB in GLB"))
        })?;

        writer.write_all(b"glTF")?;
        for number in [2, total, json.len() as u32] {
            writer.write_all(&number.to_le_bytes())?;
        }
        writer.write_all(b"JSON")?;
        writer.write_all(&json)?;
        if has_binary {
            writer.write_all(&(self.bytes.len() as u32).to_le_bytes())?;
            writer.write_all(b"BIN\0")?;
            writer.write_all(&self.bytes)?;
        }
        Ok(())
    }
}

/// The material of one of several surfaces: white where vertex colours multiply it.
fn material(style: &SurfaceStyle, has_vertex_colors: bool) -> Value {
    let [r, g, b] = if has_vertex_colors { [1.0; 3] } else { style.color };
    let mut material = json!({
        "name": format!("isovalue {}", style.isovalue),
        "pbrMetallicRoughness": {
            "baseColorFactor": [r, g, b, style.opacity], "metallicFactor": 0.0, "roughnessFactor": 0.6,
        },
        "doubleSided": true,
    });
    if style.opacity < 1.0 {
        material["alphaMode"] = json!("BLEND");
    }
    material
}

/// The node of a mesh, with its translation, unit and space.
fn node(placement: &Placement, mesh: usize) -> Value {
    let mut node = json!({ "mesh": mesh });
    if placement.origin != [0.0; 3] {
        node["translation"] = json!(placement.origin);
    }
    if placement.unit != Unit::Unknown {
        node["extras"]["unit"] = json!(placement.unit);
    }
    if placement.space != Space::Unknown {
        node["extras"]["space"] = json!(placement.space);
    }
    node
}
