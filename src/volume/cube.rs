//! Gaussian CUBE files (`.cube`, `.cub`), plain or gzip: text, as programs of quantum chemistry write densities and orbitals.
//!
//! Source: gaussian.com/cubegen and h5cube-spec.readthedocs.io. Two comment lines are followed by the number of atoms and the
//! origin, three lines with the number of samples along an axis and the step between them, and the atoms. After a negative
//! number of atoms a line of orbital numbers follows: the channels of each sample. Otherwise a fifth number after the origin
//! is the number of channels. Molden writes the line of orbitals after a positive number of atoms. The axes may be sheared; the first is the slowest in the file and becomes x.
//! Lengths are in bohr, or in angstrom if the numbers of samples are negative; the world is in angstrom.

use std::collections::VecDeque;
use std::fs::File;
use std::io::{self, BufRead};

use super::data_error::invalid;
use super::layout::{Channel, Compression};
use super::placement::{Placement, Unit};
use super::read_options::ReadOptions;
use super::samples::{SampleGrid, Samples};
use super::select::one_of;
use super::stream;
use super::text::{TextReader, columns, shortened};
use super::text_grid::TextGrid;

/// A bohr in angstrom (CODATA 2018).
const ANGSTROM_PER_BOHR: f64 = 0.529_177_210_903;

/// Most orbitals of a line that the number of atoms does not announce.
const MAX_UNANNOUNCED: usize = 16;

/// The header of a CUBE file.
struct CubeHeader {
    dims: [usize; 3],
    placement: Placement,
    n_channels: usize,
    /// Whether a line of orbitals was read.
    has_orbitals: bool,
}

/// Reads a CUBE file word by word, without keeping its text.
///
/// # Errors
///
/// `InvalidData` for damaged files, and if a channel must be chosen.
pub(super) fn read(
    file: File,
    length: u64,
    compression: Compression,
    options: &ReadOptions,
) -> io::Result<SampleGrid> {
    let text = &mut TextReader::new(stream::text(file, compression));
    let read = |text: &mut TextReader<_>| {
        let CubeHeader { dims, placement, n_channels, has_orbitals } = header(text)?;
        let (first, n_channels) = match has_orbitals {
            true => (VecDeque::new(), n_channels),
            false => unannounced_orbitals(text, n_channels)?,
        };
        let index = one_of("channel", options.channel, n_channels)?;
        let channel = Channel { index, of: n_channels };
        let grid = TextGrid { dims, channel, length, compression };
        let samples = grid.read(text, first)?;
        grid.check_end(text)?;
        Ok(SampleGrid { dims, samples: Samples::F64(samples), placement })
    };
    read(text).map_err(stream::describe_text_damage)
}

/// The first words of the samples, and the number of channels; after a line of orbitals that the number of atoms does not
/// announce, that of the line. Such a line has integers, their number first, and the samples have decimal points.
fn unannounced_orbitals(
    text: &mut TextReader<impl BufRead>,
    n_channels: usize,
) -> io::Result<(VecDeque<String>, usize)> {
    let mut words = VecDeque::new();
    let mut n_orbitals = None;
    while let Some(word) = text.word()? {
        words.push_back(word.to_owned());
        let is_integer = word.parse::<u64>().is_ok();
        if words.len() == 1 {
            n_orbitals = word.parse().ok().filter(|n| (1..=MAX_UNANNOUNCED).contains(n));
        }
        let Some(n) = n_orbitals.filter(|_| n_channels == 1) else { break };
        if words.len() == n + 2 {
            if !is_integer && word.contains('.') {
                let samples = words.split_off(n + 1);
                return Ok((samples, n));
            }
            break;
        }
        if !is_integer {
            break;
        }
    }
    Ok((words, n_channels))
}

fn header(text: &mut TextReader<impl BufRead>) -> io::Result<CubeHeader> {
    // Comments may be in any encoding.
    for _ in 0..2 {
        text.line_bytes()?;
    }
    let first = text.line()?;
    let wrong = || invalid(format!("line '{}', expected atoms and origin", shortened(first)));
    let (n_atoms, rest) = first.split_once(char::is_whitespace).ok_or_else(wrong)?;
    let n_atoms: i64 = n_atoms.parse().map_err(|_| wrong())?;
    let (origin, n_values) = match columns::<4>(rest) {
        Some([x, y, z, n]) => ([x, y, z], n),
        None => (columns::<3>(rest).ok_or_else(wrong)?, 1.0),
    };
    if !(1.0..=65536.0).contains(&n_values) || n_values.fract() != 0.0 {
        return Err(wrong());
    }
    let (mut dims, mut steps, mut is_angstrom) = ([0; 3], [[0.0; 3]; 3], false);
    for a in 0..3 {
        let line = text.line()?;
        let wrong = || invalid(format!("line '{}', expected samples and a step", shortened(line)));
        let (n, step) = line.split_once(char::is_whitespace).ok_or_else(wrong)?;
        let n: i64 = n.parse().map_err(|_| wrong())?;
        is_angstrom |= n < 0;
        dims[a] = usize::try_from(n.unsigned_abs()).map_err(|_| wrong())?;
        steps[a] = columns(step).ok_or_else(wrong)?;
    }
    for _ in 0..n_atoms.unsigned_abs() {
        text.line_bytes()?;
    }
    let has_orbitals = n_atoms < 0;
    let n_channels = if has_orbitals { read_orbitals(text)? } else { n_values as usize };
    let scale = if is_angstrom { 1.0 } else { ANGSTROM_PER_BOHR };
    let steps = steps.map(|step| step.map(|x| x * scale));
    let placed = Placement::from_steps(origin.map(|x| x * scale), steps);
    let placement = Placement { unit: Unit::Angstrom, ..placed };
    Ok(CubeHeader { dims, placement, n_channels, has_orbitals })
}

/// Reads the number of orbitals and skips their numbers.
fn read_orbitals(text: &mut TextReader<impl BufRead>) -> io::Result<usize> {
    let ends = || invalid("the file ends before its samples");
    let word = text.word()?.ok_or_else(ends)?;
    let n = word.parse().ok().filter(|n| (1..=1 << 16).contains(n));
    let n = n.ok_or_else(|| {
        invalid(format!("'{}', expected the number of orbitals", shortened(word)))
    })?;
    for _ in 0..n {
        let word = text.word()?.ok_or_else(ends)?;
        if word.parse::<i64>().is_err() {
            return Err(invalid(format!(
                "'{}', expected the number of an orbital",
                shortened(word)
            )));
        }
    }
    Ok(n)
}
