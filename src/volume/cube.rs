//! Gaussian CUBE files (`.cube`, `.cub`): text, as programs of quantum chemistry write densities and orbitals.
//!
//! Source: gaussian.com/cubegen and h5cube-spec.readthedocs.io. After two lines of comment come the number of atoms and the
//! origin, three lines with the samples along an axis and the step between them, and the atoms. A negative number of atoms
//! tells that a line of orbital numbers follows: channels, beside each other for each sample, as are the values where a
//! fifth number tells how many there are. The axes may be sheared; the first is the slowest in the file, and is x here.
//! Lengths are bohr, or angstrom where the numbers of samples are negative; the world is in angstrom.

use std::fs::File;
use std::io;
use std::path::Path;

use super::decode::SampleType;
use super::decode::{invalid, permuted, picked, read_error};
use super::select::one_of;
use super::stream::Channel;
use super::text::{finite, shortened};
use super::{Grid, Placement, ReadOptions, Unit, text};
use crate::error::Result;
use crate::input;

/// A bohr in angstrom (CODATA 2018).
const BOHR: f64 = 0.529_177_210_903;

/// Reads a CUBE file.
///
/// # Errors
///
/// [`crate::Error::Io`] if it cannot be read; [`crate::Error::Input`] for damaged files, and where a channel must be chosen.
pub(crate) fn read(path: &Path, _: (File, u64), options: &ReadOptions) -> Result<Grid> {
    let bytes = input::read(path)?;
    parse(&bytes, options).map_err(|e| read_error(path, e))
}

/// The lines of a file, and what follows those that were taken.
struct Lines<'a>(&'a [u8]);

impl<'a> Lines<'a> {
    fn next(&mut self) -> io::Result<&'a str> {
        if self.0.is_empty() {
            return Err(invalid("the file ends before its samples"));
        }
        let end = self.0.iter().position(|&b| b == b'\n');
        let (line, rest) = self.0.split_at(end.map_or(self.0.len(), |end| end + 1));
        self.0 = rest;
        std::str::from_utf8(line).map(str::trim).map_err(|_| invalid("a line that is not text"))
    }

    /// The next word, on whatever line.
    fn word(&mut self) -> io::Result<&'a str> {
        let start = self.0.trim_ascii_start();
        let end = start.iter().position(u8::is_ascii_whitespace).unwrap_or(start.len());
        let (word, rest) = start.split_at(end);
        self.0 = rest;
        std::str::from_utf8(word).map_err(|_| invalid("a word that is not text"))
    }
}

fn parse(bytes: &[u8], options: &ReadOptions) -> io::Result<Grid> {
    let mut lines = Lines(bytes);
    // Comments may be in any encoding.
    for _ in 0..2 {
        let end = lines.0.iter().position(|&b| b == b'\n');
        lines.0 = end.map_or(&[], |end| &lines.0[end + 1..]);
    }
    let first = lines.next()?;
    let wrong = || invalid(format!("line '{}', expected atoms and origin", shortened(first)));
    let (n_atoms, rest) = first.split_once(char::is_whitespace).ok_or_else(wrong)?;
    let n_atoms: i64 = n_atoms.parse().map_err(|_| wrong())?;
    let ([x, y, z], n_values) = match finite::<4>(rest) {
        Some([x, y, z, n]) => ([x, y, z], n),
        None => (finite::<3>(rest).ok_or_else(wrong)?, 1.0),
    };
    if !(1.0..=65536.0).contains(&n_values) || n_values.fract() != 0.0 {
        return Err(wrong());
    }
    let (mut dims, mut steps, mut is_angstrom) = ([0; 3], [[0.0; 3]; 3], false);
    for a in 0..3 {
        let line = lines.next()?;
        let wrong = || invalid(format!("line '{}', expected samples and a step", shortened(line)));
        let (n, step) = line.split_once(char::is_whitespace).ok_or_else(wrong)?;
        let n: i64 = n.parse().map_err(|_| wrong())?;
        is_angstrom |= n < 0;
        dims[a] = usize::try_from(n.unsigned_abs()).map_err(|_| wrong())?;
        steps[a] = finite(step).ok_or_else(wrong)?;
    }
    for _ in 0..n_atoms.unsigned_abs() {
        lines.next()?;
    }
    let n_channels = if n_atoms < 0 { orbitals(&mut lines)? } else { n_values as usize };
    let index = one_of("channel", options.channel, n_channels)?;
    let n = dims.iter().try_fold(n_channels, |n, &d| n.checked_mul(d));
    let [nx, ny, nz] = dims;
    let what = format!("{nx}x{ny}x{nz} samples of {n_channels}");
    let n = n.ok_or_else(|| invalid(format!("{what}, more than memory can hold")))?;
    let samples = text::samples(lines.0, SampleType::F64, n, &what)?;
    let samples = picked(samples, Channel { index, of: n_channels });
    // The file's fastest axis is z.
    let (samples, dims) = permuted(samples, [nz, ny, nx], [2, 1, 0])?;
    let scale = if is_angstrom { 1.0 } else { BOHR };
    let steps = steps.map(|step| step.map(|x| x * scale));
    let placed = Placement::from_steps([x, y, z].map(|x| x * scale), steps);
    Ok((dims, samples, Placement { unit: Unit::Angstrom, ..placed }))
}

/// How many orbitals there are; their numbers are passed over.
fn orbitals(lines: &mut Lines<'_>) -> io::Result<usize> {
    let word = lines.word()?;
    let n = word.parse().ok().filter(|n| (1..=1 << 16).contains(n));
    let n =
        n.ok_or_else(|| invalid(format!("'{}', expected how many orbitals", shortened(word))))?;
    for _ in 0..n {
        let word = lines.word()?;
        if word.parse::<i64>().is_err() {
            return Err(invalid(format!(
                "'{}', expected the number of an orbital",
                shortened(word)
            )));
        }
    }
    Ok(n)
}
