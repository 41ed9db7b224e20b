//! GLB: binary glTF 2.0 with one mesh, its positions, normals and indices.
//!
//! Positions are around the origin of the volume, which is the translation of the node: far away, 32-bit floats would
//! lose the shape.

use std::io::{self, Write};

use serde_json::{Value, json};

use super::Placed;
use crate::spectrum::SurfaceMesh;
use crate::volume::{Placement, Space, Unit};

/// glTF's number for 32-bit floating point components.
const FLOAT: u32 = 5126;

/// glTF's number for 32-bit unsigned components.
const UNSIGNED_INT: u32 = 5125;

/// Writes a mesh. An empty mesh becomes an empty scene, as glTF has no empty buffers.
///
/// glTF calls +y up and metres the unit; a molecule of 1e-9 is nothing to most viewers, so coordinates are those of the
/// world, and unit and space stand beside them.
pub(super) fn write(placed: Placed, writer: &mut dyn Write) -> io::Result<()> {
    let around = |&p: &[f32; 3]| placed.placement.around_origin(p).map(|x| x as f32);
    let positions = placed.mesh.positions.iter().map(around).collect();
    let mesh = &SurfaceMesh { positions, ..placed.mesh };
    let mut json = description(mesh, &placed.placement).to_string().into_bytes();
    json.resize(json.len().next_multiple_of(4), b' ');
    let binary_length = 24 * mesh.positions.len() + 12 * mesh.triangles.len();
    let has_binary = binary_length > 0;
    let total = 12 + 8 + json.len() + if has_binary { 8 + binary_length } else { 0 };

    writer.write_all(b"glTF")?;
    for number in [2, total as u32, json.len() as u32] {
        writer.write_all(&number.to_le_bytes())?;
    }
    writer.write_all(b"JSON")?;
    writer.write_all(&json)?;
    if has_binary {
        writer.write_all(&(binary_length as u32).to_le_bytes())?;
        writer.write_all(b"BIN\0")?;
        for x in mesh.positions.iter().chain(&mesh.normals).flatten() {
            writer.write_all(&x.to_le_bytes())?;
        }
        for v in mesh.triangles.iter().flatten() {
            writer.write_all(&v.to_le_bytes())?;
        }
    }
    Ok(())
}

fn description(mesh: &SurfaceMesh, placement: &Placement) -> Value {
    let asset = json!({
        "version": "2.0",
        "generator": concat!("isospectrum ", env!("CARGO_PKG_VERSION")),
    });
    if mesh.triangles.is_empty() {
        return json!({ "asset": asset, "scene": 0, "scenes": [{}] });
    }
    let (n, m) = (mesh.positions.len(), mesh.triangles.len());
    let bound = |pick: fn(f32, f32) -> f32| -> [f32; 3] {
        let points = mesh.positions.iter().copied();
        points.reduce(|a, b| std::array::from_fn(|i| pick(a[i], b[i]))).unwrap_or_default()
    };
    let attribute = json!({ "bufferView": 0, "componentType": FLOAT, "count": n, "type": "VEC3" });
    let (mut position, mut normal) = (attribute.clone(), attribute);
    position["min"] = json!(bound(f32::min));
    position["max"] = json!(bound(f32::max));
    normal["bufferView"] = json!(1);
    json!({
        "asset": asset,
        "scene": 0,
        "scenes": [{ "nodes": [0] }],
        "nodes": [node(placement)],
        "meshes": [{ "primitives": [{
            "attributes": { "POSITION": 0, "NORMAL": 1 },
            "indices": 2,
        }] }],
        "accessors": [
            position,
            normal,
            { "bufferView": 2, "componentType": UNSIGNED_INT, "count": 3 * m, "type": "SCALAR" },
        ],
        "bufferViews": [
            { "buffer": 0, "byteOffset": 0, "byteLength": 12 * n, "byteStride": 12, "target": 34962 },
            { "buffer": 0, "byteOffset": 12 * n, "byteLength": 12 * n, "byteStride": 12, "target": 34962 },
            { "buffer": 0, "byteOffset": 24 * n, "byteLength": 12 * m, "target": 34963 },
        ],
        "buffers": [{ "byteLength": 24 * n + 12 * m }],
    })
}

/// The node of the mesh, where it lies and in what.
fn node(placement: &Placement) -> Value {
    let mut node = json!({ "mesh": 0 });
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
