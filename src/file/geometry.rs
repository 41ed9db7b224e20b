//! Section `POSN`: positions.
//!
//! The columns hold the differences from predicted positions ([`super::predict`]). Three kinds of knots have columns of their own, because
//! their statistics differ: those of lattice vertices ([`super::samples`]), first knots of other vertices, and
//! further knots of these.

use rayon::prelude::*;

use super::column::{CodedColumns, Column, Columns, Content, zigzag};
use super::predict::{Predictor, Surroundings};
use super::samples::Samples;
use super::trajectories::Ranks;
use super::units::{Facing, Units};
use crate::error::{Error, Result};

/// Kinds of knots of vertices that are not lattice vertices.
const FIRST: usize = 0;
const FURTHER: usize = 1;

/// Vertices that are encoded by one task.
const VERTICES_PER_TASK: usize = 1 << 14;

/// The number of columns.
const N_COLUMNS: usize = 11;

/// The columns, of some vertices.
#[derive(Debug, Default)]
struct PositionColumns {
    /// The first samples of lattice vertices, minus the predicted ones.
    samples: [Vec<u64>; 3],
    /// The directions of lattice vertices.
    directions: Vec<u64>,
    /// The axes that other vertices face ([`Facing`]).
    axes: Vec<u64>,
    /// The positions of other vertices minus the predicted ones, by kind.
    positions: [[Vec<u64>; 3]; 2],
}

/// Writes section `POSN` of a chunk, whose knots are the last ones of `positions`.
///
/// # Errors
///
/// As [`Predictor::new`].
pub(super) fn write_geometry(
    of: Surroundings,
    positions: &mut Vec<[i32; 3]>,
    samples: &Samples,
) -> Result<Content<'static>> {
    let predictor = Predictor::new(of, std::mem::take(positions))?;
    let vertices: Vec<u32> = (of.n_above..of.ranks.n_vertices()).collect();
    let parts = vertices.par_chunks(VERTICES_PER_TASK);
    let parts: Vec<PositionColumns> =
        parts.map(|part| encode_part(&predictor, samples, part)).collect();
    let mut content = CodedColumns::new();
    for k in 0..N_COLUMNS {
        content.column(parts.iter().flat_map(|part| part.columns()[k].iter().copied()));
    }
    *positions = predictor.into_positions();
    Ok(content.end())
}

/// The columns of consecutive vertices, given a predictor that knows all knots.
fn encode_part(predictor: &Predictor, samples: &Samples, vertices: &[u32]) -> PositionColumns {
    let mut part = PositionColumns::default();
    let has_knots = |v: &u32| !predictor.trajectory(*v).is_empty();
    let mut last = (0..vertices[0]).rev().find(has_knots);
    for &v in vertices {
        let (first, positions) = (predictor.first_knot(v), predictor.trajectory(v));
        let lattice_edge = match positions {
            &[start, end] => samples.edge_between([start, end]),
            _ => None,
        };
        let facing = Facing::of(positions);
        if lattice_edge.is_none() && !positions.is_empty() {
            part.axes.push(facing.code());
        }
        for (i, (knot, before)) in predictor.knots(v).enumerate() {
            let stored = positions[knot - first];
            let predicted = predictor.expected(v, (knot, before), last);
            match lattice_edge {
                Some((start, direction)) if i == 0 => {
                    let nearest = samples.nearest(predicted);
                    for a in 0..3 {
                        part.samples[a].push(zigzag(start[a] - nearest[a]));
                    }
                    part.directions.push(direction);
                }
                Some(_) => {}
                None => {
                    for (column, (a, unit)) in
                        part.positions[kind(i)].iter_mut().zip(facing.units())
                    {
                        let difference =
                            i64::from(stored[a]) / unit - rounded(predicted[a].into(), unit);
                        column.push(zigzag(difference));
                    }
                }
            }
        }
        if has_knots(&v) {
            last = Some(v);
        }
    }
    part
}

impl PositionColumns {
    /// In the order of the file.
    fn columns(&self) -> [&[u64]; N_COLUMNS] {
        let PositionColumns { samples: [x, y, z], directions, axes, positions } = self;
        let [[a, b, c], [d, e, f]] = positions;
        [x, y, z, directions, axes, a, b, c, d, e, f].map(Vec::as_slice)
    }
}

/// The kind of knot `i` of a vertex that is not a lattice vertex.
fn kind(i: usize) -> usize {
    if i == 0 { FIRST } else { FURTHER }
}

/// A coordinate in multiples of `unit`, rounded to the nearest.
fn rounded(x: i64, unit: i64) -> i64 {
    (x + unit / 2).div_euclid(unit)
}

/// Reads three columns of one length from the front.
#[derive(Debug)]
struct VectorReader {
    columns: [Column<'static>; 3],
    next: usize,
}

impl VectorReader {
    fn new(from: &mut Columns, n: usize) -> Result<Self> {
        let mut column = || from.column(n, 34).map(Column::into_owned);
        Ok(VectorReader { columns: [column()?, column()?, column()?], next: 0 })
    }

    /// The next number of each column.
    fn next(&mut self) -> Result<[i64; 3]> {
        let mut numbers = [0; 3];
        for (number, column) in numbers.iter_mut().zip(&self.columns) {
            *number = column.get_signed(self.next)?;
        }
        self.next += 1;
        Ok(numbers)
    }
}

/// The columns of section `POSN` of a chunk in a file.
#[derive(Debug)]
pub(super) struct PositionReader {
    /// The first samples of lattice vertices, minus the predicted ones, and the directions.
    starts: VectorReader,
    directions: Column<'static>,
    /// The axes that other vertices face.
    axes: Column<'static>,
    /// The positions of other vertices minus the predicted ones, by kind of knot.
    differences: [VectorReader; 2],
}

impl PositionReader {
    /// Unpacks the section of a chunk whose vertices have these ranks.
    pub(super) fn unpack(content: &Content, ranks: &Ranks) -> Result<Self> {
        let mut columns = content.columns();
        let (n_lattice, n) = counts(ranks);
        let starts = VectorReader::new(&mut columns, n_lattice)?;
        let directions = columns.column(n_lattice, 3)?.into_owned();
        let axes = columns.column(n[FIRST], 3)?.into_owned();
        let mut reader = |kind| VectorReader::new(&mut columns, n[kind]);
        let differences = [reader(FIRST)?, reader(FURTHER)?];
        columns.end()?;
        Ok(PositionReader { starts, directions, axes, differences })
    }
}

/// Appends the positions of a chunk in a file to those of the chunks above.
///
/// # Errors
///
/// [`Error::Input`]; then `positions` is empty.
pub(super) fn read_geometry(
    columns: PositionReader,
    of: Surroundings,
    positions: &mut Vec<[i32; 3]>,
    samples: &Samples,
    units: Units,
) -> Result<()> {
    let PositionReader { mut starts, directions, axes, mut differences } = columns;
    let ranks = of.ranks;
    let mut predictor = Predictor::new(of, std::mem::take(positions))?;
    let has_knots = |&v: &u32| ranks.life(v).is_some();
    let mut last = (0..of.n_above).rev().find(has_knots);
    for v in of.n_above..ranks.n_vertices() {
        let (mut sample, mut direction, mut facing) = ([0; 3], 0, Facing::default());
        for (i, (knot, before)) in predictor.knots(v).enumerate() {
            let predicted = predictor.expected(v, (knot, before), last);
            let position = if ranks.is_lattice(v) {
                if i == 0 {
                    direction = read_direction(&directions, starts.next)?;
                    sample = sum(samples.nearest(predicted), starts.next()?);
                } else {
                    sample = Samples::neighbour(sample, direction);
                }
                samples.position(sample).ok_or_else(|| {
                    Error::input(format!(
                        "vertex {v} starts or ends at {sample:?}, expected a sample"
                    ))
                })?
            } else {
                if i == 0 {
                    facing = read_facing(&axes, differences[FIRST].next)?;
                }
                let x = moved(predicted, differences[kind(i)].next()?, facing);
                storable(x, units).ok_or_else(|| {
                    Error::input(format!(
                        "knot {i} of vertex {v} is at {x:?} quanta, which is too far"
                    ))
                })?
            };
            predictor.set(knot, position);
        }
        last = Some(v).filter(has_knots).or(last);
    }
    *positions = predictor.into_positions();
    Ok(())
}

/// The number of lattice vertices, and of knots of other vertices by kind.
fn counts(ranks: &Ranks) -> (usize, [usize; 2]) {
    let (mut n_lattice, mut n) = (0, [0; 2]);
    for v in 0..ranks.n_vertices() {
        let knots = ranks.of(v).map_or(0, <[u32]>::len);
        if ranks.is_lattice(v) {
            n_lattice += 1;
        } else {
            (0..knots).for_each(|i| n[kind(i)] += 1);
        }
    }
    (n_lattice, n)
}

/// Axis number `i` of a column.
fn read_facing(axes: &Column, i: usize) -> Result<Facing> {
    let code = axes.get(i)?;
    Facing::from_code(code)
        .ok_or_else(|| Error::input(format!("axis {code}, expected 0 to {}", Facing::MAX_CODE)))
}

/// The position at a difference from a predicted one.
fn moved(predicted: [i32; 3], difference: [i64; 3], facing: Facing) -> [i64; 3] {
    let mut position = [0; 3];
    for (difference, (a, unit)) in difference.into_iter().zip(facing.units()) {
        let multiple = rounded(predicted[a].into(), unit).saturating_add(difference);
        position[a] = multiple.saturating_mul(unit);
    }
    position
}

/// Direction number `i` of a column.
fn read_direction(directions: &Column, i: usize) -> Result<u64> {
    let direction = directions.get(i)?;
    let is_valid = direction < 6;
    is_valid
        .then_some(direction)
        .ok_or_else(|| Error::input(format!("direction {direction}, expected 0 to 5")))
}

fn sum(a: [i64; 3], b: [i64; 3]) -> [i64; 3] {
    std::array::from_fn(|i| a[i].saturating_add(b[i]))
}

/// The position, if a coordinate can hold it exactly.
fn storable(x: [i64; 3], units: Units) -> Option<[i32; 3]> {
    let mut position = [0; 3];
    for (integer, x) in position.iter_mut().zip(x) {
        let is_exact = |&x: &i32| units.of_coordinate(units.coordinate(x)) == x;
        *integer = i32::try_from(x).ok().filter(is_exact)?;
    }
    Some(position)
}
