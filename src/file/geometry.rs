//! Section `POSN`: where the vertices are.
//!
//! The columns hold what predictions miss ([`super::predict`]). They lie apart by what is told, because
//! each kind has its own statistics: lattice vertices ([`super::samples`]), first knots of other vertices, and
//! their further knots.

use std::borrow::Cow;

use rayon::prelude::*;

use super::column::{CodedColumns, Column, Columns, Content, zigzag};
use super::facing::Units;
use super::predict::Predictor;
use super::samples::Samples;
use super::trajectories::{Ranks, read_flags};
use crate::error::{Error, Result};
use crate::spectrum::{Knot, Spectrum, Triangle, VolumeInfo};

/// Kinds of knots, those of lattice vertices aside: each with columns of its own.
const FIRST: usize = 0;
const FURTHER: usize = 1;

/// So many vertices are told by one task.
const VERTICES_AT_ONCE: usize = 1 << 14;

/// How many columns there are, and which of them are the axes.
const COLUMNS: usize = 11;
const FACING: usize = 4;

/// All columns.
#[derive(Debug, Default)]
struct Told {
    /// The samples at which lattice vertices start, less the predicted ones.
    samples: [Vec<u64>; 3],
    /// Their ways.
    ways: Vec<u64>,
    /// The axes that the others face.
    facing: Vec<u64>,
    /// By kind; none of lattice vertices.
    positions: [[Vec<u64>; 3]; 2],
}

/// Writes section `POSN`. Positions are as [`Units::rounded`] leaves them.
///
/// # Errors
///
/// As [`Predictor::new`].
pub(super) fn write_geometry(
    spectrum: &Spectrum,
    ranks: &Ranks,
    units: Units,
) -> Result<Content<'static>> {
    let told = tell(spectrum, ranks, units)?;
    let mut positions = CodedColumns::new();
    for k in (0..COLUMNS).filter(|&k| k != FACING || units.has_facing()) {
        positions.column(told.iter().flat_map(|told| told.columns()[k].iter().copied()));
    }
    Ok(positions.end())
}

/// What the predictions miss, knot by knot, of some vertices after the other.
fn tell(spectrum: &Spectrum, ranks: &Ranks, units: Units) -> Result<Vec<Told>> {
    let samples = Samples::new(spectrum.volume(), units);
    let mut predictor = Predictor::new(ranks, spectrum.isovalues(), spectrum.triangles())?;
    spectrum.knots().iter().for_each(|knot| predictor.push(units.of(knot)));
    let all: Vec<u32> = (0..ranks.n_vertices()).collect();
    let told = all.par_chunks(VERTICES_AT_ONCE);
    let told = told.map(|vertices| tell_some(spectrum, &predictor, &samples, units, vertices));
    Ok(told.collect())
}

/// The same for vertices in a row, of a predictor that knows all knots.
fn tell_some(
    spectrum: &Spectrum,
    predictor: &Predictor,
    samples: &Samples,
    units: Units,
    vertices: &[u32],
) -> Told {
    let mut told = Told::default();
    let has_knots = |v: &u32| !spectrum.trajectory(*v).is_empty();
    let mut last = (0..vertices[0]).rev().find(has_knots);
    for &v in vertices {
        let knots = spectrum.trajectory(v);
        let first = spectrum.first_knot()[v as usize] as usize;
        let lattice = samples.way_along(knots);
        let axis = units.facing(knots);
        if lattice.is_none() && !knots.is_empty() {
            told.facing.push(axis as u64);
        }
        for (i, knot) in knots.iter().enumerate() {
            let expected = predictor.expected(v, first + i, last);
            let stored = units.of(knot);
            match lattice {
                Some((start, way)) if i == 0 => {
                    let near = samples.nearest(expected);
                    for a in 0..3 {
                        told.samples[a].push(zigzag(start[a] - near[a]));
                    }
                    told.ways.push(way);
                }
                Some(_) => {}
                None => {
                    for (k, column) in told.positions[kind(i)].iter_mut().enumerate() {
                        let a = (axis + k) % 3;
                        let unit = if k == 0 { 1 } else { units.along };
                        let miss = i64::from(stored[a]) / unit - nearest(expected[a].into(), unit);
                        column.push(zigzag(miss));
                    }
                }
            }
        }
        if has_knots(&v) {
            last = Some(v);
        }
    }
    told
}

impl Told {
    /// In the order of the file.
    fn columns(&self) -> [&[u64]; COLUMNS] {
        let Told { samples: [x, y, z], ways, facing, positions: [[a, b, c], [d, e, f]] } = self;
        [x, y, z, ways, facing, a, b, c, d, e, f].map(Vec::as_slice)
    }
}

/// The kind of knot `i` of a vertex that is no lattice vertex.
fn kind(i: usize) -> usize {
    if i == 0 { FIRST } else { FURTHER }
}

/// How many `unit`s are nearest to a coordinate.
fn nearest(x: i64, unit: i64) -> i64 {
    (x + unit / 2).div_euclid(unit)
}

/// Columns of one length, read from the front.
#[derive(Debug)]
struct Queue<'a> {
    columns: [Column<'a>; 3],
    next: usize,
}

impl<'a> Queue<'a> {
    fn new(from: &mut Columns<'a>, n: usize) -> Result<Self> {
        let mut column = || from.column(n, 34);
        Ok(Queue { columns: [column()?, column()?, column()?], next: 0 })
    }

    /// The next number of each column.
    fn take(&mut self) -> Result<[i64; 3]> {
        let mut numbers = [0; 3];
        for (number, column) in numbers.iter_mut().zip(&self.columns) {
            *number = column.get_signed(self.next)?;
        }
        self.next += 1;
        Ok(numbers)
    }
}

/// Reads section `POSN` of a file.
pub(super) fn read_geometry(
    content: &Content,
    volume: &VolumeInfo,
    ranks: &Ranks,
    (isovalues, triangles): (&[f64], &[Triangle]),
    units: Units,
) -> Result<Vec<Knot>> {
    let mut columns = content.columns();
    let is_lattice = match &ranks.is_lattice {
        Some(is_lattice) => Cow::Borrowed(is_lattice),
        None => Cow::Owned(read_flags(&mut columns, &ranks.first_knot)?),
    };
    let (n_lattice, n) = counts(ranks, &is_lattice);
    let mut starts = Queue::new(&mut columns, n_lattice)?;
    let ways = columns.column(n_lattice, 3)?;
    let mut positions =
        [Queue::new(&mut columns, n[FIRST])?, Queue::new(&mut columns, n[FURTHER])?];
    columns.end()?;

    let samples = Samples::new(volume, units);
    let mut predictor = Predictor::new(ranks, isovalues, triangles)?;
    let mut knots = Vec::with_capacity(ranks.ranks.len());
    for v in 0..ranks.n_vertices() {
        let (mut sample, mut way) = ([0; 3], 0);
        for (i, &rank) in ranks.of(v).expect("the vertex exists").iter().enumerate() {
            let expected = predictor.predict(v);
            let position = if is_lattice[v as usize] {
                if i == 0 {
                    way = read_way(&ways, starts.next)?;
                    sample = added(samples.nearest(expected), starts.take()?);
                } else {
                    sample = Samples::neighbour(sample, way);
                }
                samples.place(sample).ok_or_else(|| {
                    Error::input(format!(
                        "vertex {v} starts or ends at {sample:?}, expected a sample"
                    ))
                })?
            } else {
                let x = added(expected.map(i64::from), positions[kind(i)].take()?);
                in_file(x, units).ok_or_else(|| {
                    Error::input(format!(
                        "knot {i} of vertex {v} lies at {x:?} quanta, expected less"
                    ))
                })?
            };
            predictor.push(position);
            knots.push(Knot { rank, position: position.map(|x| units.coordinate(x)) });
        }
    }
    Ok(knots)
}

/// How many lattice vertices there are, and how many knots of others of each kind.
fn counts(ranks: &Ranks, is_lattice: &[bool]) -> (usize, [usize; 2]) {
    let (mut n_lattice, mut n) = (0, [0; 2]);
    for v in 0..ranks.n_vertices() {
        let knots = ranks.of(v).map_or(0, <[u32]>::len);
        if is_lattice[v as usize] {
            n_lattice += 1;
        } else {
            (0..knots).for_each(|i| n[kind(i)] += 1);
        }
    }
    (n_lattice, n)
}

/// Way number `i` of a column.
fn read_way(ways: &Column, i: usize) -> Result<u64> {
    let way = ways.get(i)?;
    (way < 6).then_some(way).ok_or_else(|| Error::input(format!("way {way}, expected 0 to 5")))
}

fn added(a: [i64; 3], b: [i64; 3]) -> [i64; 3] {
    std::array::from_fn(|i| a[i].saturating_add(b[i]))
}

/// A position that a file may hold.
pub(super) fn in_file(x: [i64; 3], units: Units) -> Option<[i32; 3]> {
    let mut position = [0; 3];
    for (whole, x) in position.iter_mut().zip(x) {
        let comes_back = |&x: &i32| units.of_coordinate(units.coordinate(x)) == x;
        *whole = i32::try_from(x).ok().filter(comes_back)?;
    }
    Some(position)
}
