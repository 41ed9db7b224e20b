//! GLB: binary glTF 2.0: one mesh with its positions, normals and indices; or several, beside each other or as a flip-book; or
//! one that changes its shape (`morph`).
//!
//! Positions are around the origin of the volume, which is the translation of the nodes: far away, 32-bit floats would
//! lose the shape.
//!
//! A flip-book is an animation in which each mesh has its node, and all but one of them are scaled to nothing, in steps: every
//! program that plays animations plays it, whatever the meshes have in common. `KHR_node_visibility` stands beside, by
//! `KHR_animation_pointer`, for those that would rather not draw than draw nothing; who knows it not passes it over.

use std::io::{self, Write};

use serde_json::{Value, json};

use super::{Arrangement, Look, Painted, Placed};
use crate::volume::{Placement, Space, Unit};

/// glTF's numbers for components: 8-bit, 16-bit and 32-bit unsigned whole numbers, 32-bit floats.
const UNSIGNED_BYTE: u32 = 5121;
const UNSIGNED_SHORT: u32 = 5123;
const UNSIGNED_INT: u32 = 5125;
const FLOAT: u32 = 5126;

/// glTF's numbers for what a buffer view is read as: attributes, and corners of triangles.
const ATTRIBUTES: u32 = 34962;
const CORNERS: u32 = 34963;

/// The names of the extensions of a flip-book.
const VISIBILITY: &str = "KHR_node_visibility";
const POINTER: &str = "KHR_animation_pointer";

/// Writes a mesh. An empty mesh becomes an empty scene, as glTF has no empty buffers.
///
/// glTF calls +y up and metres the unit; a molecule of 1e-9 is nothing to most viewers, so coordinates are those of the
/// world, and unit and space stand beside them.
pub(super) fn write(
    placed: Placed,
    painted: Option<&Painted>,
    writer: &mut dyn Write,
) -> io::Result<()> {
    let mut file = File::default();
    if !placed.mesh.triangles.is_empty() {
        let mesh = file.mesh(&placed, painted, None);
        file.nodes.push(node(&placed.placement, mesh));
    }
    file.write(json!({}), writer)
}

/// Writes several meshes, beside each other or one after the other.
pub(super) fn write_all(
    frames: &[(Placed, Option<Painted>, Look)],
    arrangement: Arrangement,
    writer: &mut dyn Write,
) -> io::Result<()> {
    let mut file = File::default();
    let mut channels = Vec::new();
    for (i, (placed, painted, look)) in frames.iter().enumerate() {
        // A node without a mesh is what is seen of an empty one.
        let has_mesh = !placed.mesh.triangles.is_empty();
        let material = match arrangement {
            Arrangement::Together => Some(material(look, painted.is_some())),
            Arrangement::Sweep { .. } => None,
        };
        let mut node = match has_mesh {
            true => node(&placed.placement, file.mesh(placed, painted.as_ref(), material)),
            false => json!({}),
        };
        node["name"] = json!(format!("isovalue {}", look.isovalue));
        node["extras"]["isovalue"] = json!(look.isovalue);
        if let Arrangement::Sweep { seconds } = arrangement {
            let page = seconds / frames.len() as f64;
            file.turn(&mut channels, &mut node, (i, frames.len()), page as f32);
        }
        file.nodes.push(node);
    }
    let more = match arrangement {
        Arrangement::Together => json!({}),
        Arrangement::Sweep { .. } => json!({
            "animations": [{ "name": "sweep", "channels": channels, "samplers": file.samplers }],
            "extensionsUsed": [POINTER, VISIBILITY],
        }),
    };
    file.write(more, writer)
}

/// Writes a mesh with the shapes that it takes, which it goes through in so many seconds, straight from one to the next; its own
/// shape comes at place `base` among them.
pub(super) fn write_morph(
    placed: &Placed,
    shapes: &[Placed],
    base: usize,
    seconds: f64,
    writer: &mut dyn Write,
) -> io::Result<()> {
    let mut file = File::default();
    let mesh = file.mesh(placed, None, None);
    let targets: Vec<Value> = shapes.iter().map(|shape| file.target(placed, shape)).collect();
    file.meshes[mesh]["primitives"][0]["targets"] = json!(targets);
    let n = shapes.len();
    // One weight for each shape at each time, all of them 0 where it is the mesh's own.
    let weights = |time: usize| {
        (0..=n).filter(move |&place| place != base).map(move |p| f32::from(u8::from(p == time)))
    };
    file.meshes[mesh]["weights"] = json!(weights(0).collect::<Vec<_>>());
    let times: Vec<f32> = (0..=n).map(|i| (seconds * i as f64 / n as f64) as f32).collect();
    let view = file.view(times.iter().flat_map(|t| t.to_le_bytes()), None, None);
    let input = file.accessor(json!({
        "bufferView": view, "componentType": FLOAT, "count": n + 1, "type": "SCALAR",
        "min": [times[0]], "max": [times[n]],
    }));
    let all = (0..=n).flat_map(weights).flat_map(f32::to_le_bytes);
    let view = file.view(all, None, None);
    let output = file.accessor(json!({
        "bufferView": view, "componentType": FLOAT, "count": n * (n + 1), "type": "SCALAR",
    }));
    file.nodes.push(node(&placed.placement, mesh));
    let animation = json!({
        "name": "sweep",
        "channels": [{ "sampler": 0, "target": { "node": 0, "path": "weights" } }],
        "samplers": [{ "input": input, "output": output, "interpolation": "LINEAR" }],
    });
    file.write(json!({ "animations": [animation] }), writer)
}

/// A file on its way.
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
    /// Adds bytes as a view, each element so many bytes, to be read as what is told; its number.
    fn view(
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
        // What comes behind begins where four bytes do.
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        self.views.push(view);
        self.views.len() - 1
    }

    fn accessor(&mut self, accessor: Value) -> usize {
        self.accessors.push(accessor);
        self.accessors.len() - 1
    }

    /// Adds a mesh that is not empty, its colours (linear, as glTF has them) and the numbers that they show, in an attribute of
    /// the application's own; its number.
    fn mesh(
        &mut self,
        placed: &Placed,
        painted: Option<&Painted>,
        material: Option<Value>,
    ) -> usize {
        let mesh = &placed.mesh;
        let (n, m) = (mesh.positions.len(), mesh.triangles.len());
        let position = self.vectors(&around_origin(placed), true);
        let normal = self.vectors(&mesh.normals, false);
        let corners = mesh.triangles.iter().flatten().flat_map(|v| v.to_le_bytes());
        let view = self.view(corners, None, Some(CORNERS));
        let indices = self.accessor(json!({
            "bufferView": view, "componentType": UNSIGNED_INT, "count": 3 * m, "type": "SCALAR",
        }));
        let mut primitive =
            json!({ "attributes": { "POSITION": position, "NORMAL": normal }, "indices": indices });
        if let Some(painted) = painted {
            let shares = painted.linear.iter().flat_map(|&[r, g, b]| [r, g, b, 1.0]);
            let colors = shares.flat_map(|share| ((share * 65535.0).round() as u16).to_le_bytes());
            let view = self.view(colors, Some(8), Some(ATTRIBUTES));
            primitive["attributes"]["COLOR_0"] = json!(self.accessor(json!({
                "bufferView": view, "componentType": UNSIGNED_SHORT, "normalized": true, "count": n, "type": "VEC4",
            })));
            // A number that is none is no JSON and no glTF either.
            let numbers = painted.numbers.iter().map(|&x| if x.is_finite() { x } else { 0.0 });
            let view = self.view(numbers.flat_map(f32::to_le_bytes), Some(4), Some(ATTRIBUTES));
            let name = format!("_{}", painted.name.to_ascii_uppercase());
            primitive["attributes"][name] = json!(self.accessor(json!({
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

    /// Adds three numbers for each vertex, with their bounds where they are `bounded`; the number of the accessor.
    fn vectors(&mut self, rows: &[[f32; 3]], bounded: bool) -> usize {
        let bytes = rows.iter().flatten().flat_map(|x| x.to_le_bytes());
        let view = self.view(bytes, Some(12), Some(ATTRIBUTES));
        let mut accessor = json!({
            "bufferView": view, "componentType": FLOAT, "count": rows.len(), "type": "VEC3",
        });
        if bounded {
            for (name, pick) in [("min", f32::min as fn(f32, f32) -> f32), ("max", f32::max)] {
                let least = rows.iter().copied();
                let bound = least.reduce(|a, b| std::array::from_fn(|i| pick(a[i], b[i])));
                accessor[name] = json!(bound.unwrap_or_default());
            }
        }
        self.accessor(accessor)
    }

    /// Adds a shape of a mesh: what is added to its positions and normals.
    fn target(&mut self, placed: &Placed, shape: &Placed) -> Value {
        let differences = |to: &[[f32; 3]], from: &[[f32; 3]]| -> Vec<[f32; 3]> {
            let pairs = to.iter().zip(from);
            pairs.map(|(a, b)| std::array::from_fn(|i| a[i] - b[i])).collect()
        };
        let positions = differences(&around_origin(shape), &around_origin(placed));
        let normals = differences(&shape.mesh.normals, &placed.mesh.normals);
        json!({ "POSITION": self.vectors(&positions, true), "NORMAL": self.vectors(&normals, false) })
    }

    /// Shows a node as page `i` of `n` of a flip-book, each so many seconds.
    fn turn(
        &mut self,
        channels: &mut Vec<Value>,
        node: &mut Value,
        (i, n): (usize, usize),
        page: f32,
    ) {
        let number = self.nodes.len();
        let mut keys = vec![(0.0, i == 0)];
        if i > 0 {
            keys.push((page * i as f32, true));
        }
        // The last one stays until the end, which this tells.
        keys.push((page * (i + 1) as f32, i + 1 == n));
        let times: Vec<f32> = keys.iter().map(|key| key.0).collect();
        let view = self.view(times.iter().flat_map(|t| t.to_le_bytes()), None, None);
        let input = self.accessor(json!({
            "bufferView": view, "componentType": FLOAT, "count": keys.len(), "type": "SCALAR",
            "min": [times[0]], "max": [times[times.len() - 1]],
        }));
        let scales = keys.iter().flat_map(|key| [f32::from(u8::from(key.1)); 3]);
        let view = self.view(scales.flat_map(f32::to_le_bytes), None, None);
        let scale = self.accessor(json!({ "bufferView": view, "componentType": FLOAT, "count": keys.len(), "type": "VEC3" }));
        let view = self.view(keys.iter().map(|key| u8::from(key.1)), None, None);
        let visible = self.accessor(json!({
            "bufferView": view, "componentType": UNSIGNED_BYTE, "count": keys.len(), "type": "SCALAR",
        }));
        for (output, target) in [
            (scale, json!({ "node": number, "path": "scale" })),
            (
                visible,
                json!({
                    "path": "pointer",
                    "extensions": { POINTER: { "pointer": format!("/nodes/{number}/extensions/{VISIBILITY}/visible") } },
                }),
            ),
        ] {
            channels.push(json!({ "sampler": self.samplers.len(), "target": target }));
            self.samplers
                .push(json!({ "input": input, "output": output, "interpolation": "STEP" }));
        }
        // Before it is played, and where it is not, the first one is seen. One that knows the visibility alone shows nothing
        // of the others, as their scale is nothing.
        node["extensions"][VISIBILITY] = json!({ "visible": true });
        if i > 0 {
            node["scale"] = json!([0.0, 0.0, 0.0]);
        }
    }

    /// Writes the file; `more` is what else its description has.
    fn write(self, more: Value, writer: &mut dyn Write) -> io::Result<()> {
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
        if let Value::Object(more) = more {
            more.into_iter().for_each(|(name, value)| json[name] = value);
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

/// Positions in the axes and the unit of the world.
fn around_origin(placed: &Placed) -> Vec<[f32; 3]> {
    let around = |&p: &[f32; 3]| placed.placement.around_origin(p).map(|x| x as f32);
    placed.mesh.positions.iter().map(around).collect()
}

/// How one of several surfaces looks; where colours show something they are seen as they are.
fn material(look: &Look, is_painted: bool) -> Value {
    let [r, g, b] = if is_painted { [1.0; 3] } else { look.color };
    let mut material = json!({
        "name": format!("isovalue {}", look.isovalue),
        "pbrMetallicRoughness": {
            "baseColorFactor": [r, g, b, look.opacity], "metallicFactor": 0.0, "roughnessFactor": 0.6,
        },
        "doubleSided": true,
    });
    if look.opacity < 1.0 {
        material["alphaMode"] = json!("BLEND");
    }
    material
}

/// The node of a mesh, where it lies and in what.
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
