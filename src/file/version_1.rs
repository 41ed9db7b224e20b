//! Section `POSN` of version 1: all knots in one order, none of them told by its sample.

use super::column::Content;
use super::facing::Units;
use super::geometry::in_file;
use super::predict::Predictor;
use super::trajectories::Ranks;
use crate::error::{Error, Result};
use crate::spectrum::{Knot, Triangle};

/// Reads it.
pub(super) fn read_geometry(
    content: &Content,
    ranks: &Ranks,
    isovalues: &[f64],
    triangles: &[Triangle],
) -> Result<Vec<Knot>> {
    let (n, units) = (ranks.ranks.len(), Units::of_file(1, 0.0));
    let mut columns = content.columns();
    let positions = [columns.column(n, 34)?, columns.column(n, 34)?, columns.column(n, 34)?];
    columns.end()?;
    let mut predictor = Predictor::new(ranks, isovalues, triangles)?;
    let mut knots = Vec::with_capacity(n);
    for v in 0..ranks.n_vertices() {
        for &rank in ranks.of(v).expect("the vertex exists") {
            let i = knots.len();
            let mut x = predictor.predict(v).map(i64::from);
            for a in 0..3 {
                x[a] += positions[a].get_signed(i)?;
            }
            let position = in_file(x, units).ok_or_else(|| {
                Error::input(format!("knot {i} of vertex {v} lies at {x:?} quanta, expected less"))
            })?;
            predictor.push(position);
            knots.push(Knot { rank, position: position.map(|x| units.coordinate(x)) });
        }
    }
    Ok(knots)
}
