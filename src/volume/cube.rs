//! Gaussian CUBE files (`.cube`, `.cub`): text, as programs of quantum chemistry write densities and orbitals.
//!
//! Source: gaussian.com/cubegen and h5cube-spec.readthedocs.io. After two lines of comment come the number of atoms and the
//! origin, three lines with the samples along an axis and the step between them, and the atoms. A negative number of atoms
//! tells that a line of orbital numbers follows: channels, beside each other for each sample, as are the values where a
//! fifth number tells how many there are. The axes may be sheared; the first is the slowest in the file, and is x here.
//! Lengths are bohr, or angstrom where the numbers of samples are negative; the world is in angstrom.

use std::fs::File;
use std::io::{self, BufRead, BufReader};
use std::path::Path;

use super::decode::{invalid, read_error, reserve};
use super::select::one_of;
use super::stream::Channel;
use super::text::{Stream, finite, shortened};
use super::{Grid, Placement, ReadOptions, Samples, Unit};
use crate::error::Result;

/// A bohr in angstrom (CODATA 2018).
const BOHR: f64 = 0.529_177_210_903;

/// Reads a CUBE file, as the text comes: no more of it is kept than a word.
///
/// # Errors
///
/// [`crate::Error::Io`] if it cannot be read; [`crate::Error::Input`] for damaged files, and where a channel must be chosen.
pub(crate) fn read(
    path: &Path,
    (file, length): (File, u64),
    options: &ReadOptions,
) -> Result<Grid> {
    let mut text = Stream::new(BufReader::with_capacity(1 << 16, file));
    parse(&mut text, length, options).map_err(|e| read_error(path, e))
}

/// What stands before the samples.
struct Header {
    dims: [usize; 3],
    placement: Placement,
    n_channels: usize,
}

fn parse(text: &mut Stream<impl BufRead>, length: u64, options: &ReadOptions) -> io::Result<Grid> {
    let Header { dims, placement, n_channels } = header(text)?;
    let index = one_of("channel", options.channel, n_channels)?;
    let samples = samples(text, length, dims, Channel { index, of: n_channels })?;
    Ok((dims, Samples::F64(samples), placement))
}

fn header(text: &mut Stream<impl BufRead>) -> io::Result<Header> {
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
    let n_channels = if n_atoms < 0 { orbitals(text)? } else { n_values as usize };
    let scale = if is_angstrom { 1.0 } else { BOHR };
    let steps = steps.map(|step| step.map(|x| x * scale));
    let placed = Placement::from_steps(origin.map(|x| x * scale), steps);
    Ok(Header { dims, placement: Placement { unit: Unit::Angstrom, ..placed }, n_channels })
}

/// How many orbitals there are; their numbers are passed over.
fn orbitals(text: &mut Stream<impl BufRead>) -> io::Result<usize> {
    let ends = || invalid("the file ends before its samples");
    let word = text.word()?.ok_or_else(ends)?;
    let n = word.parse().ok().filter(|n| (1..=1 << 16).contains(n));
    let n =
        n.ok_or_else(|| invalid(format!("'{}', expected how many orbitals", shortened(word))))?;
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

/// The samples of a channel, each put where it belongs: in the file z is fastest.
fn samples(
    text: &mut Stream<impl BufRead>,
    length: u64,
    dims: [usize; 3],
    channel: Channel,
) -> io::Result<Vec<f64>> {
    let [nx, ny, nz] = dims;
    let what = format!("{nx}x{ny}x{nz} samples of {}", channel.of);
    let all = dims.iter().try_fold(channel.of, |n, &d| n.checked_mul(d));
    let all = all.ok_or_else(|| invalid(format!("{what}, more than memory can hold")))?;
    // A number and the space behind it take two bytes.
    if all as u64 > length / 2 + 1 {
        return Err(invalid(format!("{length} bytes of text, too few for {what}")));
    }
    let mut samples = reserve(all / channel.of, 0.0)?;
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
