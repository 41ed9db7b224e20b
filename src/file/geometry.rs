//! Sections `POSN` and `NRML`: where and which way the vertices are.
//!
//! The columns hold what predictions miss ([`super::predict`]). They lie apart by what is told, because
//! each kind has its own statistics: lattice vertices ([`super::samples`]), first knots of other vertices, and
//! their further knots.

use super::column::{Column, Columns, write_column, zigzag};
use super::predict::Predictor;
use super::samples::{Samples, candidates};
use super::trajectories::Ranks;
use crate::error::{Error, Result};
use crate::spectrum::{
    Knot, QUANTUM, Spectrum, Triangle, VolumeInfo, from_fixed, narrow_normal, to_fixed,
    widen_normal,
};

/// What positions and normals are counted in.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Units {
    /// Units of a position per voxel.
    pub(crate) per_voxel: f64,
    /// Largest component of a code of a normal, at most 127.
    pub(crate) radius: i8,
}

/// The units of a file.
pub(super) const FILE: Units = Units { per_voxel: 1.0 / QUANTUM, radius: 127 };

/// Kinds of knots, each with columns of its own.
const LATTICE: usize = 0;
const FIRST: usize = 1;
const FURTHER: usize = 2;

/// All columns.
#[derive(Debug, Default)]
struct Told {
    /// For each vertex with two knots, whether it is a lattice vertex.
    is_lattice: Vec<u64>,
    /// The samples at which lattice vertices start, less the predicted ones.
    samples: [Vec<u64>; 3],
    /// Their ways.
    ways: Vec<u64>,
    /// By kind; none of lattice vertices.
    positions: [[Vec<u64>; 3]; 3],
    /// By kind.
    normals: [[Vec<u64>; 2]; 3],
}

/// Writes sections `POSN` and `NRML`. Positions are multiples of [`QUANTUM`], whatever the units are.
pub(super) fn write_geometry(
    spectrum: &Spectrum,
    ranks: &Ranks,
    units: Units,
) -> (Vec<u8>, Vec<u8>) {
    let told = tell(spectrum, ranks, units);
    let mut positions = Vec::new();
    write_column(&mut positions, &told.is_lattice);
    told.samples.iter().for_each(|column| write_column(&mut positions, column));
    write_column(&mut positions, &told.ways);
    for column in told.positions[FIRST..].as_flattened() {
        write_column(&mut positions, column);
    }
    let mut normals = Vec::new();
    told.normals.as_flattened().iter().for_each(|column| write_column(&mut normals, column));
    (positions, normals)
}

/// What the predictions miss, knot by knot.
fn tell(spectrum: &Spectrum, ranks: &Ranks, units: Units) -> Told {
    let mut told = Told::default();
    let mut samples = Samples::new(&spectrum.volume, units.per_voxel);
    let (isovalues, triangles) = (&spectrum.isovalues, &spectrum.triangles);
    let mut predictor = Predictor::new(ranks, isovalues, triangles, units.radius);
    for v in 0..ranks.n_vertices() {
        let knots = spectrum.trajectory(v);
        let mut lattice = None;
        if let [start, end] = knots {
            lattice = samples.way_of([start, end].map(|knot| knot.position.map(to_fixed)));
            told.is_lattice.push(lattice.is_some().into());
        }
        for (i, knot) in knots.iter().enumerate() {
            let (position, mut normal) = predictor.predict(v);
            let stored = knot.position.map(to_fixed);
            let code = knot.normal.map(|s| narrow_normal(s, units.radius));
            let kind = kind(lattice.is_some(), i);
            if let Some((start, way)) = lattice {
                if i == 0 {
                    let near = samples.nearest(position);
                    for a in 0..3 {
                        told.samples[a].push(zigzag(start[a] - near[a]));
                    }
                    told.ways.push(way);
                }
                let sample = if i == 0 { start } else { Samples::neighbour(start, way) };
                normal = samples.normal(sample).unwrap_or(normal);
                samples.set_normal(sample, code);
            } else {
                for a in 0..3 {
                    let miss = i64::from(stored[a]) - i64::from(position[a]);
                    told.positions[kind][a].push(zigzag(miss));
                }
            }
            for a in 0..2 {
                let miss = i64::from(code[a]) - i64::from(normal[a]);
                told.normals[kind][a].push(zigzag(around(miss, units.radius)));
            }
            predictor.push(stored, code);
        }
    }
    told
}

/// The kind of knot `i` of a vertex.
fn kind(is_lattice: bool, i: usize) -> usize {
    match (is_lattice, i) {
        (true, _) => LATTICE,
        (false, 0) => FIRST,
        (false, _) => FURTHER,
    }
}

/// Columns of one length, read from the front.
#[derive(Debug)]
struct Queue<'a, const N: usize> {
    columns: [Column<'a>; N],
    next: usize,
}

impl<'a, const N: usize> Queue<'a, N> {
    fn new(from: &mut Columns<'a>, n: usize, bits: u32) -> Result<Self> {
        let mut columns = Vec::with_capacity(N);
        for _ in 0..N {
            columns.push(from.column(n, bits)?);
        }
        Ok(Queue { columns: columns.try_into().expect("so many were read"), next: 0 })
    }

    /// The next number of each column.
    fn take(&mut self) -> Result<[i64; N]> {
        let mut numbers = [0; N];
        for (number, column) in numbers.iter_mut().zip(&self.columns) {
            *number = column.get_signed(self.next)?;
        }
        self.next += 1;
        Ok(numbers)
    }
}

/// Reads sections `POSN` and `NRML`.
pub(super) fn read_geometry(
    position_bytes: &[u8],
    normal_bytes: &[u8],
    volume: &VolumeInfo,
    ranks: &Ranks,
    isovalues: &[f64],
    triangles: &[Triangle],
) -> Result<Vec<Knot>> {
    let mut columns = Columns::new(position_bytes);
    let is_lattice = read_flags(&mut columns, ranks)?;
    let n = counts(ranks, &is_lattice);
    let mut starts: Queue<3> = Queue::new(&mut columns, n[LATTICE] / 2, 34)?;
    let ways = columns.column(n[LATTICE] / 2, 3)?;
    let none = Queue::new(&mut Columns::new(&[1; 3]), 0, 34)?;
    let [first, further] = [FIRST, FURTHER].map(|kind| Queue::new(&mut columns, n[kind], 34));
    let mut positions = [none, first?, further?];
    columns.end()?;
    let mut columns = Columns::new(normal_bytes);
    let normals = n.map(|n| Queue::<2>::new(&mut columns, n, 8));
    columns.end()?;
    let [a, b, c] = normals;
    let mut normals = [a?, b?, c?];

    let mut samples = Samples::new(volume, FILE.per_voxel);
    let mut predictor = Predictor::new(ranks, isovalues, triangles, FILE.radius);
    let mut knots = Vec::with_capacity(ranks.ranks.len());
    for v in 0..ranks.n_vertices() {
        let (mut sample, mut way) = ([0; 3], 0);
        for (i, &rank) in ranks.of(v).expect("the vertex exists").iter().enumerate() {
            let (mut position, mut normal) = predictor.predict(v);
            let kind = kind(is_lattice[v as usize], i);
            if kind == LATTICE {
                if i == 0 {
                    way = read_way(&ways, starts.next)?;
                    sample = added(samples.nearest(position), starts.take()?);
                } else {
                    sample = Samples::neighbour(sample, way);
                }
                position = samples.place(sample).ok_or_else(|| {
                    Error::input(format!(
                        "vertex {v} starts or ends at {sample:?}, expected a sample"
                    ))
                })?;
                normal = samples.normal(sample).unwrap_or(normal);
            } else {
                let x = added(position.map(i64::from), positions[kind].take()?);
                position = in_file(x).ok_or_else(|| {
                    Error::input(format!(
                        "knot {i} of vertex {v} lies at {x:?} quanta, expected less"
                    ))
                })?;
            }
            let miss = normals[kind].take()?;
            let code = [0, 1].map(|a| around(i64::from(normal[a]) + miss[a], FILE.radius) as i8);
            if kind == LATTICE {
                samples.set_normal(sample, code);
            }
            predictor.push(position, code);
            knots.push(knot(rank, position, code));
        }
    }
    Ok(knots)
}

/// For each vertex, whether it is a lattice vertex.
fn read_flags(columns: &mut Columns, ranks: &Ranks) -> Result<Vec<bool>> {
    let chosen: Vec<u32> = candidates(ranks).collect();
    let flags = columns.column(chosen.len(), 1)?;
    let mut is_lattice = vec![false; ranks.n_vertices() as usize];
    for (i, &v) in chosen.iter().enumerate() {
        is_lattice[v as usize] = flags.get(i)? == 1;
    }
    Ok(is_lattice)
}

/// How many knots there are of each kind.
fn counts(ranks: &Ranks, is_lattice: &[bool]) -> [usize; 3] {
    let mut n = [0; 3];
    for v in 0..ranks.n_vertices() {
        let knots = ranks.of(v).map_or(0, <[u32]>::len);
        (0..knots).for_each(|i| n[kind(is_lattice[v as usize], i)] += 1);
    }
    n
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
pub(super) fn in_file(x: [i64; 3]) -> Option<[i32; 3]> {
    let mut position = [0; 3];
    for (whole, x) in position.iter_mut().zip(x) {
        *whole = i32::try_from(x).ok().filter(|&x| to_fixed(from_fixed(x)) == x)?;
    }
    Some(position)
}

/// The knot at a position and a code that a file holds.
pub(super) fn knot(rank: u32, position: [i32; 3], code: [i8; 2]) -> Knot {
    Knot { rank, position: position.map(from_fixed), normal: code.map(widen_normal) }
}

/// A difference of two components of a normal modulo 2 `radius` + 1, in -`radius` to `radius`.
pub(super) fn around(difference: i64, radius: i8) -> i64 {
    let radius = i64::from(radius);
    (difference + radius).rem_euclid(2 * radius + 1) - radius
}
