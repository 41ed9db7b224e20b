//! Section `TRIA`: triangles and lifetimes.
//!
//! A triangle lives within the trajectories of its vertices, and often as long as the first of them
//! to end, or as long as the triangle before it: those of one cell of the exact extraction die together.
//! So its death is told as one of the two, or by the way from its birth ([`super::stations`]); a lifetime
//! that its vertices do not cover is refused. What it joins and when it is born is
//! [`super::connectivity`]'s.

use super::column::{Column, Columns, collected, write_column};
use super::connectivity::{Walk, WalkReader, arrange};
use super::stations::{Ways, write_ways};
use super::trajectories::Ranks;
use super::{LAST_WITHOUT_STATIONS, too_many_unused};
use crate::error::{Error, Result};
use crate::spectrum::{Collapse, Patch, Spectrum, Triangle};

/// Codes of deaths: with the first of the triangle's vertices to end; with the triangle before; by a way from its birth. Before
/// version 5, larger codes were so many ranks before the first of its vertices.
const WITH_A_VERTEX: u64 = 0;
const AS_BEFORE: u64 = 1;
const BY_A_WAY: u64 = 2;

/// The spectrum in the order of the file, the walk that tells its triangles, and of each vertex which it was. Columns of the
/// spectrum as it was go as soon as those in their place are there.
pub(super) fn arranged(spectrum: Spectrum) -> (Spectrum, Walk, Vec<u32>) {
    let n_vertices = spectrum.n_vertices();
    let (order, walk) = arrange(spectrum.triangles(), n_vertices, spectrum.isovalues().len());
    let (about, patch) = spectrum.into_parts();
    let Patch { isovalues, first_knot, knots, triangles, collapses } = patch;
    let old = triangles;
    let triangles = order.triangles.into_iter();
    let triangles = triangles.map(|(i, vertices)| Triangle { vertices, ..old[i as usize] });
    let triangles = triangles.collect();
    drop(old);
    let mut number = vec![0; n_vertices];
    let mut new_first = Vec::with_capacity(n_vertices + 1);
    new_first.push(0);
    let mut new_knots = Vec::with_capacity(knots.len());
    for (&v, new) in order.vertices.iter().zip(0..) {
        number[v as usize] = new;
        let [from, to] = [v as usize, v as usize + 1].map(|v| first_knot[v] as usize);
        new_knots.extend_from_slice(&knots[from..to]);
        new_first.push(new_knots.len() as u32);
    }
    drop((knots, first_knot));
    let collapses = collapses.iter().map(|c| Collapse {
        vertex: number[c.vertex as usize],
        target: number[c.target as usize],
        ..*c
    });
    let collapses = collapses.collect();
    let (first_knot, knots) = (new_first, new_knots);
    let patch = Patch { isovalues, first_knot, knots, triangles, collapses };
    (Spectrum::unchecked(about, patch), walk, order.vertices)
}

/// Writes section `TRIA`: a walk, and the deaths and caps of the triangles it tells, in its order.
pub(super) fn write_triangles(walk: &Walk, triangles: &[Triangle], ranks: &Ranks) -> Vec<u8> {
    let mut bytes = Vec::new();
    walk.write(&mut bytes);
    let end = |t: &Triangle| span(t.vertices, ranks).expect("checked vertices have knots").1;
    let mut before = 0;
    let mut ways = Vec::new();
    let mut code = |t: &Triangle| {
        let is_as_before = t.death == std::mem::replace(&mut before, t.death);
        if end(t) == t.death {
            return WITH_A_VERTEX;
        }
        if is_as_before {
            return AS_BEFORE;
        }
        ways.push((t.birth, t.death));
        BY_A_WAY
    };
    write_column(&mut bytes, &triangles.iter().map(&mut code).collect::<Vec<_>>());
    write_ways(&mut bytes, &ways);
    write_column(&mut bytes, &triangles.iter().map(|t| t.cap.into()).collect::<Vec<_>>());
    bytes
}

/// Reads section `TRIA` of a version. At most `most_unused` vertices are in none of its triangles.
pub(super) fn read_triangles(
    bytes: &[u8],
    ranks: &Ranks,
    n_isovalues: usize,
    version: u32,
    most_unused: usize,
) -> Result<Vec<Triangle>> {
    let mut columns = Columns::new(bytes);
    let walk = WalkReader::new(&mut columns)?;
    let n = walk.n_triangles()?;
    let deaths = columns.column(n, 33)?;
    let mut ways = ways(&mut columns, (n, &deaths), n_isovalues, version)?;
    let caps = columns.column(n, 1)?;
    columns.end()?;
    let mut before = 0;
    let death = |i: usize, vertices: [u32; 3], birth: u32| {
        let code = deaths.get(i)?;
        let way = match &mut ways {
            Some(ways) if code == BY_A_WAY => u32::try_from(ways.next(birth)?).ok(),
            _ => None,
        };
        let death = span(vertices, ranks).and_then(|(first, last)| {
            let death = match code {
                // In version 1 the distance itself.
                _ if version == 1 => u64::from(last).checked_sub(code)? as u32,
                WITH_A_VERTEX => last,
                AS_BEFORE => before,
                _ if version <= LAST_WITHOUT_STATIONS => {
                    u64::from(last).checked_sub(code - AS_BEFORE)? as u32
                }
                _ => way?,
            };
            (first <= birth && birth < death && death <= last).then_some(death)
        });
        before = death.unwrap_or(0);
        death.ok_or_else(|| Error::input(format!("triangle {i} outlives its vertices")))
    };
    let n_vertices = ranks.n_vertices() as usize;
    let (triangles, n_used) = walk.triangles(n_vertices, n_isovalues, death)?;
    ways.map_or(Ok(()), Ways::end)?;
    if n_vertices - n_used > most_unused {
        return Err(too_many_unused(n_vertices - n_used, most_unused));
    }
    collected(triangles.len(), |i| {
        let (vertices, birth, death) = triangles[i];
        Ok(Triangle { vertices, birth, death, cap: caps.get(i)? == 1 })
    })
}

/// The ways from birth to death, of the triangles that are told by one; before version 5 there are none.
fn ways<'a>(
    columns: &mut Columns<'a>,
    (n, deaths): (usize, &Column),
    n_isovalues: usize,
    version: u32,
) -> Result<Option<Ways<'a>>> {
    if version <= LAST_WITHOUT_STATIONS {
        return Ok(None);
    }
    let mut n_ways = 0;
    for i in 0..n {
        n_ways += usize::from(deaths.get(i)? == BY_A_WAY);
    }
    Ways::new(columns, n_ways, n_isovalues).map(Some)
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
