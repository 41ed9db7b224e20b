//! GLB: binary glTF 2.0 with one mesh, its positions, normals and indices.
//!
//! Positions are around the origin of the volume, which is the translation of the node: far away, 32-bit floats would
//! lose the shape.

use std::io::{self, Write};

use serde_json::{Value, json};

use super::{Painted, Placed};
use crate::spectrum::SurfaceMesh;
use crate::volume::{Placement, Space, Unit};

/// glTF's number for 32-bit floating point components.
const FLOAT: u32 = 5126;

/// glTF's number for 16-bit unsigned components.
const UNSIGNED_SHORT: u32 = 5123;

/// glTF's number for 32-bit unsigned components.
const UNSIGNED_INT: u32 = 5125;

/// Writes a mesh. An empty mesh becomes an empty scene, as glTF has no empty buffers.
///
/// glTF calls +y up and metres the unit; a molecule of 1e-9 is nothing to most viewers, so coordinates are those of the
/// world, and unit and space stand beside them.
pub(super) fn write(
    placed: Placed,
    painted: Option<&Painted>,
    writer: &mut dyn Write,
) -> io::Result<()> {
    let around = |&p: &[f32; 3]| placed.placement.around_origin(p).map(|x| x as f32);
    let positions = placed.mesh.positions.iter().map(around).collect();
    let mesh = &SurfaceMesh { positions, ..placed.mesh };
    let painted = painted.filter(|_| !mesh.triangles.is_empty());
    let mut json = description(mesh, &placed.placement);
    if let Some(painted) = painted {
        describe_colors(&mut json, mesh, painted);
    }
    let mut json = json.to_string().into_bytes();
    json.resize(json.len().next_multiple_of(4), b' ');
    let per_vertex = if painted.is_some() { 24 + COLOR_BYTES } else { 24 };
    let binary_length = per_vertex * mesh.positions.len() + 12 * mesh.triangles.len();
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
        if let Some(painted) = painted {
            for [r, g, b] in &painted.linear {
                for share in [*r, *g, *b, 1.0] {
                    writer.write_all(&((share * 65535.0).round() as u16).to_le_bytes())?;
                }
            }
            for x in &painted.numbers {
                // A number that is none is no JSON and no glTF either.
                writer.write_all(&(if x.is_finite() { *x } else { 0.0 }).to_le_bytes())?;
            }
        }
    }
    Ok(())
}

/// Bytes of the colour of a vertex and of the number that it shows.
const COLOR_BYTES: usize = 12;

/// Adds colours (linear, as glTF has them) and the numbers that they show, in an attribute of the application's own,
/// behind what there is.
fn describe_colors(json: &mut Value, mesh: &SurfaceMesh, painted: &Painted) {
    let (n, m) = (mesh.positions.len(), mesh.triangles.len());
    let start = 24 * n + 12 * m;
    let name = format!("_{}", painted.name.to_ascii_uppercase());
    let add = |list: &mut Value, more: Value| list.as_array_mut().map(|list| list.push(more));
    for (offset, length, stride) in [(start, 8 * n, 8), (start + 8 * n, 4 * n, 4)] {
        add(
            &mut json["bufferViews"],
            json!({ "buffer": 0, "byteOffset": offset, "byteLength": length, "byteStride": stride, "target": 34962 }),
        );
    }
    add(
        &mut json["accessors"],
        json!({ "bufferView": 3, "componentType": UNSIGNED_SHORT, "normalized": true, "count": n, "type": "VEC4" }),
    );
    add(
        &mut json["accessors"],
        json!({ "bufferView": 4, "componentType": FLOAT, "count": n, "type": "SCALAR" }),
    );
    let attributes = &mut json["meshes"][0]["primitives"][0]["attributes"];
    attributes["COLOR_0"] = json!(3);
    attributes[name] = json!(4);
    json["buffers"][0]["byteLength"] = json!(start + COLOR_BYTES * n);
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
