//! Gaussian CUBE files (`.cube`, `.cub`): text, as programs of quantum chemistry write densities and orbitals.
//!
//! Source: gaussian.com/cubegen and h5cube-spec.readthedocs.io. Two comment lines are followed by the number of atoms and the
//! origin, three lines with the number of samples along an axis and the step between them, and the atoms. After a negative
//! number of atoms a line of orbital numbers follows: the channels of each sample. Otherwise a fifth number after the origin
//! is the number of channels. The axes may be sheared; the first is the slowest in the file and becomes x.
//! Lengths are in bohr, or in angstrom if the numbers of samples are negative; the world is in angstrom.

use std::fs::File;
use std::io::{self, BufRead, BufReader};

use super::data_error::invalid;
use super::layout::Channel;
use super::memory::try_filled_vec;
use super::placement::{Placement, Unit};
use super::read_options::ReadOptions;
use super::samples::{SampleGrid, Samples};
use super::select::one_of;
use super::text::{TextReader, check_text_length, finite, shortened};

/// A bohr in angstrom (CODATA 2018).
const ANGSTROM_PER_BOHR: f64 = 0.529_177_210_903;

/// The header of a CUBE file.
struct CubeHeader {
    dims: [usize; 3],
    placement: Placement,
    n_channels: usize,
}

/// Reads a CUBE file word by word, without keeping its text.
///
/// # Errors
///
/// `InvalidData` for damaged files, and if a channel must be chosen.
pub(super) fn read(file: File, length: u64, options: &ReadOptions) -> io::Result<SampleGrid> {
    let text = &mut TextReader::new(BufReader::with_capacity(1 << 16, file));
    let CubeHeader { dims, placement, n_channels } = header(text)?;
    let index = one_of("channel", options.channel, n_channels)?;
    let samples = samples(text, length, dims, Channel { index, of: n_channels })?;
    Ok(SampleGrid { dims, samples: Samples::F64(samples), placement })
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
    let (origin, n_values) = match finite::<4>(rest) {
        Some([x, y, z, n]) => ([x, y, z], n),
        None => (finite::<3>(rest).ok_or_else(wrong)?, 1.0),
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
        steps[a] = finite(step).ok_or_else(wrong)?;
    }
    for _ in 0..n_atoms.unsigned_abs() {
        text.line_bytes()?;
    }
    let n_channels = if n_atoms < 0 { read_orbitals(text)? } else { n_values as usize };
    let scale = if is_angstrom { 1.0 } else { ANGSTROM_PER_BOHR };
    let steps = steps.map(|step| step.map(|x| x * scale));
    let placed = Placement::from_steps(origin.map(|x| x * scale), steps);
    Ok(CubeHeader { dims, placement: Placement { unit: Unit::Angstrom, ..placed }, n_channels })
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

/// Reads the samples of a channel and reorders them: in the file z is fastest.
fn samples(
    text: &mut TextReader<impl BufRead>,
    length: u64,
    dims: [usize; 3],
    channel: Channel,
) -> io::Result<Vec<f64>> {
    let [nx, ny, nz] = dims;
    let what = format!("{nx}x{ny}x{nz} samples of {}", channel.of);
    let all = dims.iter().try_fold(channel.of, |n, &d| n.checked_mul(d));
    let all = all.ok_or_else(|| invalid(format!("{what}, more than memory can hold")))?;
    check_text_length(length, all, &what)?;
    let mut samples = try_filled_vec(all / channel.of, 0.0)?;
    for i in 0..all {
        let word = text.word()?;
        let word =
            word.ok_or_else(|| invalid(format!("{i} numbers, expected {all} for {what}")))?;
        let value: f64 = word.parse().map_err(|_| {
            let start = shortened(word);
            invalid(format!("'{start}' as number {i} of the text, expected one of {what}"))
        })?;
        if i % channel.of == channel.index {
            let at = i / channel.of;
            let [x, y, z] = [at / (ny * nz), at / nz % ny, at % nz];
            samples[x + nx * (y + ny * z)] = value;
        }
    }
    if text.word()?.is_some() {
        return Err(invalid(format!("more than the {all} numbers of {what}")));
    }
    Ok(samples)
}
