//! Reads triangle meshes from PLY files: text and binary, either byte order, any numeric types.
//!
//! Files are not trusted: no memory is reserved for the counts in the header, and every element takes bytes of the file.

use std::path::Path;

use crate::error::{Error, Result};
use crate::input;

/// The triangle mesh in a PLY file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PlyMesh {
    /// Positions, in the frame of the file.
    pub positions: Vec<[f64; 3]>,
    /// Vertex indices, all below the number of positions.
    pub triangles: Vec<[u32; 3]>,
}

/// Longest header accepted, bytes.
const MAX_HEADER: usize = 1 << 16;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Encoding {
    Text,
    LittleEndian,
    BigEndian,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Number {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

#[derive(Debug)]
struct Property {
    name: String,
    /// The type of the length, for a list.
    length: Option<Number>,
    number: Number,
}

#[derive(Debug)]
struct Element {
    name: String,
    count: u64,
    properties: Vec<Property>,
}

/// Reads a PLY file.
///
/// # Errors
///
/// [`Error::Io`]; [`Error::Input`] as [`parse_ply`], with the path.
pub fn read_ply(path: impl AsRef<Path>) -> Result<PlyMesh> {
    let path = path.as_ref();
    let bytes = input::read(path)?;
    parse_ply(&bytes).map_err(|e| e.of_file(path))
}

/// The triangle mesh in the bytes of a PLY file. Properties other than `x`, `y`, `z` and
/// `vertex_indices` (or `vertex_index`), and elements other than `vertex` and `face`, are skipped.
///
/// # Errors
///
/// [`Error::Input`] if they are not a PLY file, end early, or have faces that are not triangles or positions that are not
/// finite.
pub fn parse_ply(bytes: &[u8]) -> Result<PlyMesh> {
    let (encoding, elements, body) = parse_header(bytes)?;
    let mut body = Body { encoding, rest: body };
    let mut mesh = PlyMesh::default();
    for element in &elements {
        // An element without properties takes no bytes of the file, so its count must not cost time.
        if element.properties.is_empty() {
            continue;
        }
        for i in 0..element.count {
            read_element(&mut body, element, &mut mesh)
                .map_err(|what| Error::input(format!("{} {i}: {what}", element.name)))?;
        }
    }
    let n = mesh.positions.len();
    match mesh.triangles.iter().position(|t| t.iter().any(|&v| v as usize >= n)) {
        Some(i) => Err(Error::input(format!(
            "face {i}: vertices {:?}, expected numbers below {n}",
            mesh.triangles[i]
        ))),
        None => Ok(mesh),
    }
}

fn parse_header(bytes: &[u8]) -> Result<(Encoding, Vec<Element>, &[u8])> {
    let mut rest = bytes;
    let mut encoding = None;
    let mut elements: Vec<Element> = Vec::new();
    let mut first = true;
    loop {
        let searched = &rest[..rest.len().min(MAX_HEADER)];
        let end = searched.iter().position(|&b| b == b'\n');
        let read = bytes.len() - rest.len();
        let (Some(end), true) = (end, read < MAX_HEADER) else {
            return Err(Error::input(if first { "no PLY file" } else { "the header has no end" }));
        };
        let line = String::from_utf8_lossy(&rest[..end]);
        rest = &rest[end + 1..];
        let words: Vec<&str> = line.split_ascii_whitespace().collect();
        if std::mem::take(&mut first) {
            if words != ["ply"] {
                return Err(Error::input("no PLY file: it does not start with 'ply'"));
            }
            continue;
        }
        let wrong = || Error::input(format!("header line '{}' is not PLY", line.trim()));
        match words[..] {
            [] | ["comment" | "obj_info", ..] => {}
            ["format", "ascii", _] => encoding = Some(Encoding::Text),
            ["format", "binary_little_endian", _] => encoding = Some(Encoding::LittleEndian),
            ["format", "binary_big_endian", _] => encoding = Some(Encoding::BigEndian),
            ["element", name, count] => elements.push(Element {
                name: name.to_string(),
                count: count.parse().map_err(|_| wrong())?,
                properties: Vec::new(),
            }),
            ["property", "list", length, number, name] => {
                elements.last_mut().ok_or_else(wrong)?.properties.push(Property {
                    name: name.to_string(),
                    length: Some(Number::parse(length).ok_or_else(wrong)?),
                    number: Number::parse(number).ok_or_else(wrong)?,
                });
            }
            ["property", number, name] => {
                elements.last_mut().ok_or_else(wrong)?.properties.push(Property {
                    name: name.to_string(),
                    length: None,
                    number: Number::parse(number).ok_or_else(wrong)?,
                });
            }
            ["end_header"] => break,
            _ => return Err(wrong()),
        }
    }
    let encoding = encoding.ok_or_else(|| Error::input("the header has no format line"))?;
    Ok((encoding, elements, rest))
}

fn read_element(
    body: &mut Body<'_>,
    element: &Element,
    mesh: &mut PlyMesh,
) -> std::result::Result<(), String> {
    let mut position = [None; 3];
    let mut triangle = None;
    for property in &element.properties {
        let Some(length) = property.length else {
            let value = body.number(property.number)?;
            let axis = ["x", "y", "z"].iter().position(|&axis| axis == property.name);
            if let Some(axis) = axis {
                position[axis] = Some(value);
            }
            continue;
        };
        let n = body.number(length)?;
        if !(n >= 0.0 && n.fract() == 0.0) {
            return Err(format!("a list has {n} entries, expected a count"));
        }
        if element.name == "face" && matches!(&*property.name, "vertex_indices" | "vertex_index") {
            if n != 3.0 {
                return Err(format!("{n} corners, expected triangles"));
            }
            let mut corners = [0; 3];
            for corner in &mut corners {
                let v = body.number(property.number)?;
                if !(v >= 0.0 && v <= f64::from(u32::MAX) && v.fract() == 0.0) {
                    return Err(format!("vertex {v}, expected the number of one"));
                }
                *corner = v as u32;
            }
            triangle = Some(corners);
        } else {
            // Each round takes bytes or fails, so the file's length bounds the loop.
            for _ in 0..n as u64 {
                body.number(property.number)?;
            }
        }
    }
    match element.name.as_str() {
        "vertex" => match position {
            [Some(x), Some(y), Some(z)] if x.is_finite() && y.is_finite() && z.is_finite() => {
                mesh.positions.push([x, y, z]);
            }
            _ => return Err("expected finite x, y and z".into()),
        },
        "face" => mesh.triangles.push(triangle.ok_or("expected a list vertex_indices")?),
        _ => {}
    }
    Ok(())
}

/// The unread rest of the file after the header.
struct Body<'a> {
    encoding: Encoding,
    rest: &'a [u8],
}

impl Body<'_> {
    fn number(&mut self, number: Number) -> std::result::Result<f64, String> {
        match self.encoding {
            Encoding::Text => self.word(),
            Encoding::LittleEndian => self.binary(number, false),
            Encoding::BigEndian => self.binary(number, true),
        }
    }

    fn word(&mut self) -> std::result::Result<f64, String> {
        let start = self.rest.trim_ascii_start();
        let end = start.iter().position(u8::is_ascii_whitespace).unwrap_or(start.len());
        let (word, rest) = start.split_at(end);
        if word.is_empty() {
            return Err("the file ends here".into());
        }
        self.rest = rest;
        let word = String::from_utf8_lossy(word);
        word.parse().map_err(|_| {
            format!(
                "'{}' is not a number",
                word.chars().take(40).collect::<String>().escape_debug()
            )
        })
    }

    fn binary(&mut self, number: Number, big_endian: bool) -> std::result::Result<f64, String> {
        let size = number.size();
        let (taken, rest) = self.rest.split_at_checked(size).ok_or("the file ends here")?;
        self.rest = rest;
        let mut bytes = [0; 8];
        bytes[..size].copy_from_slice(taken);
        if big_endian {
            bytes[..size].reverse();
        }
        let bits = u64::from_le_bytes(bytes);
        Ok(match number {
            Number::I8 => f64::from(bits as i8),
            Number::U8 => f64::from(bits as u8),
            Number::I16 => f64::from(bits as i16),
            Number::U16 => f64::from(bits as u16),
            Number::I32 => f64::from(bits as i32),
            Number::U32 => f64::from(bits as u32),
            Number::F32 => f64::from(f32::from_bits(bits as u32)),
            Number::F64 => f64::from_bits(bits),
        })
    }
}

impl Number {
    fn parse(name: &str) -> Option<Number> {
        Some(match name {
            "char" | "int8" => Number::I8,
            "uchar" | "uint8" => Number::U8,
            "short" | "int16" => Number::I16,
            "ushort" | "uint16" => Number::U16,
            "int" | "int32" => Number::I32,
            "uint" | "uint32" => Number::U32,
            "float" | "float32" => Number::F32,
            "double" | "float64" => Number::F64,
            _ => return None,
        })
    }

    fn size(self) -> usize {
        match self {
            Number::I8 | Number::U8 => 1,
            Number::I16 | Number::U16 => 2,
            Number::I32 | Number::U32 | Number::F32 => 4,
            Number::F64 => 8,
        }
    }
}
