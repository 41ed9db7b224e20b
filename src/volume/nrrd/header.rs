//! The text header of a NRRD file.
//!
//! Source: "Definition of NRRD File Format", teem.sourceforge.net/nrrd/format.html. A header is a
//! magic line, then one `field: value` per line in any order, and ends at a blank line (or, where
//! the samples are in another file, at the end of its own). Fields that change neither samples nor
//! placement (`content`, `labels`, ...) are ignored, as are
//! `key:=value` pairs and comments.

use std::io::BufRead;

use super::axes::{FourthAxis, axes};
use super::fields::NrrdFields;
use crate::volume::layout::SampleType;
use crate::volume::placement::{Placement, Space, Unit};
use crate::volume::text::{numbered, shortened};

/// How the samples are stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum NrrdEncoding {
    Raw,
    Text,
    Gzip,
}

/// The header of a NRRD file.
#[derive(Debug)]
pub(super) struct NrrdHeader {
    /// Along the axes of space.
    pub(super) dims: [usize; 3],
    pub(super) fourth: Option<FourthAxis>,
    pub(super) sample_type: SampleType,
    pub(super) big_endian: bool,
    pub(super) encoding: NrrdEncoding,
    /// Names of the files with the samples, as written, each with as many slices along z; empty if the samples follow the
    /// header.
    pub(super) data_files: Vec<String>,
    /// Lines to skip before the samples.
    pub(super) line_skip: u64,
    /// Bytes to skip after that; `None` for -1, "the samples are the end of the file".
    pub(super) byte_skip: Option<u64>,
    pub(super) placement: Placement,
}

/// Reads a header and leaves `reader` after the blank line.
///
/// # Errors
///
/// A description without the name of the file.
pub(super) fn parse(reader: &mut impl BufRead) -> Result<NrrdHeader, String> {
    let fields = NrrdFields::read(reader)?;
    let (fields, dims, fourth) = axes(fields)?;
    let type_name = fields.get("type").ok_or("no 'type' field")?;
    let sample_type = type_from_name(type_name)
        .ok_or_else(|| format!("type '{type_name}', expected a scalar number type"))?;
    let encoding = encoding(fields.get("encoding").ok_or("no 'encoding' field")?)?;
    let big_endian = match fields.get("endian").map(str::to_ascii_lowercase).as_deref() {
        Some("little") => false,
        Some("big") => true,
        Some(other) => return Err(format!("endian '{other}', expected little or big")),
        None if sample_type.n_bytes() == 1 || encoding == NrrdEncoding::Text => false,
        None => return Err(format!("no 'endian' field, which {sample_type} needs")),
    };
    Ok(NrrdHeader {
        dims,
        fourth,
        sample_type,
        big_endian,
        encoding,
        data_files: data_files(&fields, dims[2], fourth)?,
        line_skip: fields.number("line skip")?.unwrap_or(0),
        byte_skip: match fields.number::<i64>("byte skip")?.unwrap_or(0) {
            // By the definition for raw samples only; of compressed ones, the decompressed end is meant.
            -1 if encoding != NrrdEncoding::Text => None,
            n => Some(u64::try_from(n).map_err(|_| {
                format!("'byte skip' is {n}, expected 0 or more (or -1 with encoding raw or gzip)")
            })?),
        },
        placement: placement(&fields, dims)?,
    })
}

/// The type for every name of the definition; `block` is not a number.
fn type_from_name(name: &str) -> Option<SampleType> {
    let name = name.to_ascii_lowercase();
    Some(match name.split_whitespace().collect::<Vec<_>>().join(" ").as_str() {
        "signed char" | "int8" | "int8_t" => SampleType::I8,
        "uchar" | "unsigned char" | "uint8" | "uint8_t" => SampleType::U8,
        "short" | "short int" | "signed short" | "signed short int" | "int16" | "int16_t" => {
            SampleType::I16
        }
        "ushort" | "unsigned short" | "unsigned short int" | "uint16" | "uint16_t" => {
            SampleType::U16
        }
        "int" | "signed int" | "int32" | "int32_t" => SampleType::I32,
        "uint" | "unsigned int" | "uint32" | "uint32_t" => SampleType::U32,
        "longlong"
        | "long long"
        | "long long int"
        | "signed long long"
        | "signed long long int"
        | "int64"
        | "int64_t" => SampleType::I64,
        "ulonglong" | "unsigned long long" | "unsigned long long int" | "uint64" | "uint64_t" => {
            SampleType::U64
        }
        "float" => SampleType::F32,
        "double" => SampleType::F64,
        _ => return None,
    })
}

fn encoding(name: &str) -> Result<NrrdEncoding, String> {
    match name.to_ascii_lowercase().as_str() {
        "raw" => Ok(NrrdEncoding::Raw),
        "txt" | "text" | "ascii" => Ok(NrrdEncoding::Text),
        "gz" | "gzip" => Ok(NrrdEncoding::Gzip),
        _ => Err(format!("encoding '{}', expected raw, gzip or text", shortened(name))),
    }
}

/// The data files: one, a list, or a pattern with first number, last number and step. Each has one slice, or the same
/// number of slices if the field gives them 3 axes.
fn data_files(
    fields: &NrrdFields,
    n_slices: usize,
    fourth: Option<FourthAxis>,
) -> Result<Vec<String>, String> {
    let Some(value) = fields.get("data file") else { return Ok(Vec::new()) };
    // Files follow each other along the slowest axis.
    if let Some(FourthAxis { n, is_fastest: false }) = fourth {
        let files = data_files(fields, n, None)?;
        return match files.len() {
            1 => Ok(files),
            n_files if n_files == n => Ok(files),
            n_files => Err(format!("{n_files} data files, expected one, or {n} of a volume each")),
        };
    }
    let words: Vec<&str> = value.split_whitespace().collect();
    let (n_axes, n_files, files) = match &words[..] {
        ["LIST"] => ("2", fields.files.len(), fields.files.clone()),
        ["LIST", n_axes] => (*n_axes, fields.files.len(), fields.files.clone()),
        [pattern, first, last, step, rest @ ..] if pattern.contains('%') && rest.len() < 2 => {
            let files = numbered(pattern, [first, last, step], n_slices).ok_or_else(|| {
                format!(
                    "'data file' is '{}', expected e.g. slice%03d.raw 1 {n_slices} 1",
                    shortened(value)
                )
            })?;
            (rest.first().copied().unwrap_or("2"), files.len(), files)
        }
        _ => return Ok(vec![value.to_owned()]),
    };
    // A sample of several numbers adds an axis to each file.
    let n_axes = match (fourth, n_axes) {
        (Some(_), "3") => "2",
        (Some(_), "4") => "3",
        (_, n_axes) => n_axes,
    };
    let fits = match n_axes {
        "2" => n_files == n_slices,
        "3" => n_files > 0 && n_slices.is_multiple_of(n_files),
        _ => return Err(format!("files of {} axes each, expected 2 or 3", shortened(n_axes))),
    };
    if !fits {
        return Err(format!(
            "{n_files} data files of {n_axes} axes, expected files for {n_slices} slices"
        ));
    }
    Ok(files)
}

/// The placement from space directions and origin, or spacings, or axis minima and maxima.
fn placement(fields: &NrrdFields, dims: [usize; 3]) -> Result<Placement, String> {
    let space = space(fields)?;
    let mut placement = Placement::default();
    if let Some(text) = fields.get("space directions") {
        let vectors = vectors(text).filter(|v| v.len() == 3).ok_or_else(|| {
            format!("'space directions' is '{}', expected 3 vectors of 3 numbers", shortened(text))
        })?;
        placement = Placement::from_steps(placement.origin, [vectors[0], vectors[1], vectors[2]]);
    } else {
        axis_aligned(fields, dims, &mut placement)?;
    }
    if let Some(text) = fields.get("space origin") {
        placement.origin = match vectors(text).as_deref() {
            Some(&[origin]) => origin,
            _ => {
                return Err(format!(
                    "'space origin' is '{}', expected a vector of 3 numbers",
                    shortened(text)
                ));
            }
        };
    }
    placement.unit = unit(fields);
    let placement = placement.with_positive_spacing();
    Ok(match space {
        NrrdSpace::Patient(space) => placement.of_patient(space),
        NrrdSpace::LeftAnterior => {
            let mut placement = placement;
            placement.origin[0] *= -1.0;
            placement.direction.iter_mut().for_each(|axis| axis[0] *= -1.0);
            placement.of_patient(Space::Ras)
        }
        NrrdSpace::Other => placement,
    })
}

/// The space of a header.
enum NrrdSpace {
    Patient(Space),
    /// As RAS with right and left exchanged.
    LeftAnterior,
    Other,
}

/// The unit of the space or of the axes, if all are the same.
fn unit(fields: &NrrdFields) -> Unit {
    let text = fields.get("space units").or_else(|| fields.get("units")).unwrap_or_default();
    let units: Option<Vec<Unit>> =
        text.split_whitespace().map(|u| Unit::from_name(u.trim_matches('"'))).collect();
    match units.as_deref() {
        Some([first, rest @ ..]) if rest.iter().all(|u| u == first) => *first,
        _ => Unit::Unknown,
    }
}

/// Spacing and origin from the per-axis fields; `nan` in them means "unknown".
fn axis_aligned(
    fields: &NrrdFields,
    dims: [usize; 3],
    placement: &mut Placement,
) -> Result<(), String> {
    let unknown = [f64::NAN; 3];
    let spacings = fields.three::<f64>("spacings")?.unwrap_or(unknown);
    let minima = fields.three::<f64>("axis mins")?.unwrap_or(unknown);
    let maxima = fields.three::<f64>("axis maxs")?.unwrap_or(unknown);
    let centers: Vec<&str> = fields.get("centers").unwrap_or_default().split_whitespace().collect();
    for a in 0..3 {
        // Cell-centred samples are half a spacing inside the extent of the axis.
        let cell = centers.get(a).is_some_and(|c| c.eq_ignore_ascii_case("cell"));
        let n_steps = if cell { dims[a] as f64 } else { dims[a] as f64 - 1.0 };
        if !spacings[a].is_nan() {
            placement.spacing[a] = spacings[a];
        } else if !(minima[a].is_nan() || maxima[a].is_nan()) {
            placement.spacing[a] = (maxima[a] - minima[a]) / n_steps;
        }
        if !minima[a].is_nan() {
            placement.origin[a] = minima[a] + if cell { 0.5 * placement.spacing[a] } else { 0.0 };
        }
    }
    Ok(())
}

/// The space, which must have three dimensions.
fn space(fields: &NrrdFields) -> Result<NrrdSpace, String> {
    if let Some(n) = fields.number::<usize>("space dimension")?.filter(|&n| n != 3) {
        return Err(format!("'space dimension' is {n}, expected 3"));
    }
    let named = fields.get("space").unwrap_or_default();
    match named.to_ascii_lowercase().as_str() {
        time if time.contains("time") => {
            Err(format!("space '{}', expected one of 3 dimensions", shortened(named)))
        }
        "left-posterior-superior" | "lps" => Ok(NrrdSpace::Patient(Space::Lps)),
        "right-anterior-superior" | "ras" => Ok(NrrdSpace::Patient(Space::Ras)),
        "left-anterior-superior" | "las" => Ok(NrrdSpace::LeftAnterior),
        _ => Ok(NrrdSpace::Other),
    }
}

/// Vectors written `(x,y,z) (x,y,z)`, with spaces anywhere; `None` for anything else.
fn vectors(text: &str) -> Option<Vec<[f64; 3]>> {
    let mut rest = text.trim();
    let mut vectors = Vec::new();
    while !rest.is_empty() {
        let (inside, after) = rest.strip_prefix('(')?.split_once(')')?;
        let numbers: Option<Vec<f64>> = inside
            .split(',')
            .map(|v| v.trim().parse().ok().filter(|v: &f64| v.is_finite()))
            .collect();
        vectors.push(numbers?.try_into().ok()?);
        rest = after.trim_start();
    }
    Some(vectors)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn header(lines: &str) -> Result<NrrdHeader, String> {
        let base = "NRRD0004\ntype: uchar\ndimension: 3\nsizes: 4 5 6\nencoding: raw\n";
        parse(&mut format!("{base}{lines}\n").as_bytes())
    }

    #[test]
    fn space_directions_become_spacing_and_unit_directions() {
        let h = header(
            "space: left-posterior-superior\nspace directions: (0, 2,0) (-3,0,0) ( 0,0,0.5)\nspace origin: (1,-2,3.5)\n",
        )
        .expect("a valid header");
        assert_eq!(h.placement.spacing, [2.0, 3.0, 0.5]);
        assert_eq!(h.placement.direction, [[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]);
        assert_eq!(h.placement.origin, [1.0, -2.0, 3.5]);
    }

    #[test]
    fn axis_minima_and_maxima_place_node_and_cell_centred_samples() {
        let h = header("axis mins: 0 0 nan\naxis maxs: 3 10 nan\ncenters: node cell node\n")
            .expect("a valid header");
        assert_eq!(h.placement.spacing, [1.0, 2.0, 1.0]);
        assert_eq!(h.placement.origin, [0.0, 1.0, 0.0]);
    }

    #[test]
    fn fields_of_other_volumes_are_named_in_the_error() {
        let known = [
            ("kinds: RGB-color domain domain\n", "RGB-color"),
            ("space: left-posterior-superior-time\n", "time"),
            ("space dimension: 2\n", "'space dimension' is 2"),
            ("space directions: none (1,0,0) (0,1,0)\n", "'space directions'"),
            ("space origin: (1,2)\n", "'space origin'"),
            ("data file: LIST\n", "0 data files"),
            ("data file: a%03d.raw 1 5 1\n", "5 data files"),
            ("byte skip: -2\n", "'byte skip' is -2"),
            ("endian: middle\n", "endian 'middle'"),
            ("sizes: 1 2 3\n", "appears twice"),
            ("spacings: 1 1\n", "'spacings'"),
            ("no colon\n", "'no colon'"),
        ];
        for (lines, part) in known {
            let error = header(lines).expect_err(lines);
            assert!(error.contains(part), "{lines:?}: {error}");
        }
    }
}
