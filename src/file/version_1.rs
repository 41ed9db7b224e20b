//! Sections `POSN` and `NRML` of version 1: all knots in one order, none of them told by its sample.

use super::column::Columns;
use super::geometry::{FILE, around, in_file, knot};
use super::predict::Predictor;
use super::trajectories::Ranks;
use crate::error::{Error, Result};
use crate::spectrum::{Knot, Triangle};

/// Reads both sections.
pub(super) fn read_geometry(
    position_bytes: &[u8],
    normal_bytes: &[u8],
    ranks: &Ranks,
    isovalues: &[f64],
    triangles: &[Triangle],
) -> Result<Vec<Knot>> {
    let n = ranks.ranks.len();
    let mut columns = Columns::new(position_bytes);
    let positions = [columns.column(n, 34)?, columns.column(n, 34)?, columns.column(n, 34)?];
    columns.end()?;
    let mut columns = Columns::new(normal_bytes);
    let normals = [columns.column(n, 8)?, columns.column(n, 8)?];
    columns.end()?;
    let mut predictor = Predictor::new(ranks, isovalues, triangles, FILE.radius);
    let mut knots = Vec::with_capacity(n);
    for v in 0..ranks.n_vertices() {
        for &rank in ranks.of(v).expect("the vertex exists") {
            let (position, normal) = predictor.predict(v);
            let i = knots.len();
            let mut x = position.map(i64::from);
            for a in 0..3 {
                x[a] += positions[a].get_signed(i)?;
            }
            let position = in_file(x).ok_or_else(|| {
                Error::input(format!("knot {i} of vertex {v} lies at {x:?} quanta, expected less"))
            })?;
            let mut code = normal;
            for a in 0..2 {
                let sum = i64::from(normal[a]) + normals[a].get_signed(i)?;
                code[a] = around(sum, FILE.radius) as i8;
            }
            predictor.push(position, code);
            knots.push(knot(rank, position, code));
        }
    }
    Ok(knots)
}
