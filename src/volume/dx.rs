//! OpenDX files (`.dx`) of a regular grid, plain or gzip: text, as APBS writes electrostatic potentials.
//!
//! Source: the user's guide of OpenDX, appendix B.2, and "OpenDX scalar data" of APBS (apbs.readthedocs.io). Objects of class
//! `gridpositions` (numbers of samples, origin, steps) and `array` (the samples) are read; the first axis is the slowest in the
//! file and becomes x. The unit of lengths is not known.

use std::collections::VecDeque;
use std::fs::File;
use std::io::{self, BufRead};

use super::data_error::invalid;
use super::layout::{Channel, Compression};
use super::placement::Placement;
use super::samples::{SampleGrid, Samples};
use super::stream;
use super::text::{TextReader, exactly, finite, shortened};
use super::text_grid::TextGrid;

/// Most lines before the samples: comments and three objects have some tens.
const MAX_LINES: usize = 10_000;

/// Reads an OpenDX file.
///
/// # Errors
///
/// `InvalidData` for damaged files, other grids, samples of several numbers, binary ones, and ones in another file.
pub(super) fn read(file: File, length: u64, compression: Compression) -> io::Result<SampleGrid> {
    let text = &mut TextReader::new(stream::text(file, compression));
    let read = |text: &mut TextReader<_>| {
        let DxHeader { dims, placement, is_float } = header(text)?;
        let grid = TextGrid { dims, channel: Channel::ONLY, length, compression };
        let samples = grid.read(text, VecDeque::new())?;
        let samples = match is_float {
            true => Samples::F32(samples.into_iter().map(|v| v as f32).collect()),
            false => Samples::F64(samples),
        };
        Ok(SampleGrid { dims, samples, placement })
    };
    read(text).map_err(stream::describe_text_damage)
}

/// The objects before the samples.
struct DxHeader {
    dims: [usize; 3],
    placement: Placement,
    /// Whether samples have 32 bits.
    is_float: bool,
}

fn header(text: &mut TextReader<impl BufRead>) -> io::Result<DxHeader> {
    let (mut dims, mut origin, mut steps) = (None, [0.0; 3], Vec::new());
    for _ in 0..MAX_LINES {
        let line = text.line()?;
        let wrong = || invalid(format!("line '{}', expected one of OpenDX", shortened(line)));
        let words: Vec<&str> = line.split_whitespace().collect();
        match words[..] {
            ["origin", x, y, z] => {
                origin = finite(&[x, y, z].join(" ")).ok_or_else(wrong)?;
            }
            ["delta", x, y, z] if steps.len() < 3 => {
                steps.push(finite::<3>(&[x, y, z].join(" ")).ok_or_else(wrong)?);
            }
            ["object", _, "class", "gridpositions", "counts", ref counts @ ..] => {
                dims = Some(exactly::<usize, 3>(&counts.join(" ")).ok_or_else(|| {
                    invalid(format!("'{}', expected a grid of 3 axes", shortened(line)))
                })?);
            }
            ["object", _, "class", "array", ref properties @ ..] => {
                let dims = dims.ok_or_else(|| invalid("samples before the grid"))?;
                let is_float = check_array(properties, dims, line)?;
                let steps = <[[f64; 3]; 3]>::try_from(steps)
                    .map_err(|all| invalid(format!("{} lines of delta, expected 3", all.len())))?;
                let placement = Placement::from_steps(origin, steps);
                return Ok(DxHeader { dims, placement, is_float });
            }
            _ => {}
        }
    }
    Err(invalid(format!("no array in the first {MAX_LINES} lines, expected an OpenDX file")))
}

/// Checks an array of samples. Returns whether they have 32 bits.
fn check_array(properties: &[&str], dims: [usize; 3], line: &str) -> io::Result<bool> {
    let find = |name: &str| {
        let at = properties.iter().position(|&word| word == name)?;
        properties.get(at + 1).copied()
    };
    let shown = || shortened(line);
    let is_scalar = find("rank").is_none_or(|rank| rank == "0");
    // Text is the default; any other encoding is named before the samples.
    let is_text = properties.ends_with(&["data", "follows"])
        && !properties
            .iter()
            .any(|&word| matches!(word, "binary" | "ieee" | "msb" | "lsb" | "xdr"));
    if !is_scalar || !is_text {
        return Err(invalid(format!("'{}', expected scalars of rank 0 as text", shown())));
    }
    let expected = dims.iter().try_fold(1usize, |n, &d| n.checked_mul(d));
    let found = find("items").and_then(|n| n.parse().ok());
    if found.is_none() || found != expected {
        let [x, y, z] = dims;
        return Err(invalid(format!("'{}', expected the items of {x}x{y}x{z}", shown())));
    }
    match find("type").unwrap_or("float") {
        "float" => Ok(true),
        "double" | "int" | "short" | "byte" | "ubyte" | "ushort" | "uint" => Ok(false),
        other => Err(invalid(format!("type '{}', expected float or double", shortened(other)))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn other_arrays_than_scalars_as_text_are_named() {
        let check = |line: &str| {
            let words: Vec<&str> = line.split_whitespace().collect();
            check_array(&words, [2, 3, 4], line).map_err(|e| e.to_string())
        };
        assert_eq!(check("type double rank 0 items 24 data follows"), Ok(false));
        assert_eq!(check("type float rank 0 items 24 data follows"), Ok(true));
        for (line, part) in [
            ("type double rank 1 shape 3 items 24 data follows", "rank 0"),
            ("type double rank 0 items 23 data follows", "items of 2x3x4"),
            ("type double rank 0 items 24 lsb ieee data follows", "as text"),
            ("type double rank 0 items 24 data file x.bin,0", "as text"),
            ("type string rank 0 items 24 data follows", "type 'string'"),
        ] {
            let message = check(line).expect_err(line);
            assert!(message.contains(part), "{message}");
        }
    }
}
