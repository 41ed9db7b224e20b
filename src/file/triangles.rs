//! Section `TRIA`: triangles and lifetimes.
//!
//! A triangle lives within the trajectories of its vertices, and most often exactly as long as the
//! youngest and the first to end of them. So birth and death are stored as the distance from
//! those: mostly zeros, and a lifetime that its vertices do not cover cannot be written down.

use super::column::{Columns, unzigzag, write_column, zigzag};
use super::trajectories::Ranks;
use crate::error::{Error, Result};
use crate::spectrum::Triangle;

/// Writes section `TRIA`. The triangles must lie within the trajectories.
pub(super) fn write_triangles(triangles: &[Triangle], ranks: &Ranks) -> Vec<u8> {
    let mut bytes = (triangles.len() as u64).to_le_bytes().to_vec();
    let mut columns: [Vec<u64>; 6] = Default::default();
    let mut previous = 0;
    for triangle in triangles {
        let [a, b, c] = triangle.vertices;
        let (first, last) = span(triangle.vertices, ranks).expect("checked vertices have knots");
        let row = [
            zigzag(i64::from(a) - i64::from(previous)),
            zigzag(i64::from(b) - i64::from(a)),
            zigzag(i64::from(c) - i64::from(a)),
            u64::from(triangle.birth - first),
            u64::from(last - triangle.death),
            u64::from(triangle.cap),
        ];
        columns.iter_mut().zip(row).for_each(|(column, value)| column.push(value));
        previous = a;
    }
    columns.iter().for_each(|column| write_column(&mut bytes, column));
    bytes
}

/// Reads section `TRIA`.
pub(super) fn read_triangles(bytes: &[u8], ranks: &Ranks) -> Result<Vec<Triangle>> {
    let mut columns = Columns::new(bytes);
    let n = columns.count()?;
    let vertices = [columns.column(n, 33)?, columns.column(n, 33)?, columns.column(n, 33)?];
    let births = columns.column(n, 32)?;
    let deaths = columns.column(n, 32)?;
    let caps = columns.column(n, 1)?;
    columns.end()?;
    let mut previous = 0;
    let mut triangles = Vec::with_capacity(n);
    for i in 0..n {
        let vertex = |base: u32, column: usize| {
            u32::try_from(i64::from(base) + unzigzag(vertices[column].get(i)?))
                .map_err(|_| Error::input(format!("triangle {i} has a vertex beyond 32 bits")))
        };
        let a = vertex(previous, 0)?;
        let abc = [a, vertex(a, 1)?, vertex(a, 2)?];
        let (first, last) = span(abc, ranks).ok_or_else(|| {
            Error::input(format!("triangle {i} has vertices {abc:?}, expected vertices with knots"))
        })?;
        let birth = u64::from(first) + births.get(i)?;
        let death = u64::from(last).checked_sub(deaths.get(i)?);
        let Some(death) = death.filter(|&death| birth < death) else {
            return Err(Error::input(format!("triangle {i} dies before it is born")));
        };
        // Both are below `last`, which is a rank.
        let (birth, death) = (birth as u32, death as u32);
        triangles.push(Triangle { vertices: abc, birth, death, cap: caps.get(i)? == 1 });
        previous = a;
    }
    Ok(triangles)
}

/// The first and last rank at which all three vertices have knots around them; none if one of
/// the vertices has no knots at all or does not exist.
fn span(vertices: [u32; 3], ranks: &Ranks) -> Option<(u32, u32)> {
    let mut span = (0, u32::MAX);
    for v in vertices {
        let trajectory = ranks.of(v)?;
        span = (span.0.max(*trajectory.first()?), span.1.min(*trajectory.last()?));
    }
    Some(span)
}
