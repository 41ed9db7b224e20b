//! Section `TRIA`: triangles and lifetimes.
//!
//! A triangle lives within the trajectories of its vertices, and often as long as the first of them
//! to end. So its death is stored as the distance from that: small, and a lifetime that its
//! vertices do not cover cannot be written down. What it joins and when it is born is
//! [`super::connectivity`]'s.

use super::column::{Columns, write_column};
use super::connectivity::{Walk, WalkReader, arrange};
use super::trajectories::Ranks;
use crate::error::{Error, Result};
use crate::spectrum::{Collapse, Spectrum, Triangle};

/// The spectrum in the order of the file, and the walk that tells its triangles.
pub(super) fn arranged(spectrum: &Spectrum) -> (Spectrum, Walk) {
    let (order, walk) =
        arrange(&spectrum.triangles, spectrum.n_vertices(), spectrum.isovalues.len());
    let mut number = vec![0; spectrum.n_vertices()];
    let mut first_knot = vec![0];
    let mut knots = Vec::with_capacity(spectrum.knots.len());
    for (&v, new) in order.vertices.iter().zip(0..) {
        number[v as usize] = new;
        knots.extend_from_slice(spectrum.trajectory(v));
        first_knot.push(knots.len() as u32);
    }
    let triangles = order.triangles.iter();
    let triangles =
        triangles.map(|&(i, vertices)| Triangle { vertices, ..spectrum.triangles[i as usize] });
    let collapses = spectrum.collapses.iter().map(|c| Collapse {
        vertex: number[c.vertex as usize],
        target: number[c.target as usize],
        ..*c
    });
    let arranged = Spectrum {
        volume: spectrum.volume.clone(),
        range: spectrum.range,
        tolerance: spectrum.tolerance,
        parameters: spectrum.parameters.clone(),
        events: spectrum.events.clone(),
        isovalues: spectrum.isovalues.clone(),
        first_knot,
        knots,
        triangles: triangles.collect(),
        collapses: collapses.collect(),
    };
    (arranged, walk)
}

/// Writes section `TRIA`: a walk, and the deaths and caps of the triangles it tells, in its order.
pub(super) fn write_triangles(walk: &Walk, triangles: &[Triangle], ranks: &Ranks) -> Vec<u8> {
    let mut bytes = Vec::new();
    walk.write(&mut bytes);
    let end = |t: &Triangle| span(t.vertices, ranks).expect("checked vertices have knots").1;
    write_column(
        &mut bytes,
        &triangles.iter().map(|t| (end(t) - t.death).into()).collect::<Vec<_>>(),
    );
    write_column(&mut bytes, &triangles.iter().map(|t| t.cap.into()).collect::<Vec<_>>());
    bytes
}

/// Reads section `TRIA`.
pub(super) fn read_triangles(
    bytes: &[u8],
    ranks: &Ranks,
    n_isovalues: usize,
) -> Result<Vec<Triangle>> {
    let mut columns = Columns::new(bytes);
    let walk = WalkReader::new(&mut columns)?;
    let n = walk.n_triangles()?;
    let deaths = columns.column(n, 32)?;
    let caps = columns.column(n, 1)?;
    columns.end()?;
    let death = |i: usize, vertices: [u32; 3], birth: u32| {
        let early = deaths.get(i)?;
        let death = span(vertices, ranks).and_then(|(first, last)| {
            let death = u64::from(last).checked_sub(early)? as u32;
            (first <= birth && birth < death).then_some(death)
        });
        death.ok_or_else(|| Error::input(format!("triangle {i} outlives its vertices")))
    };
    let triangles = walk.triangles(ranks.n_vertices() as usize, n_isovalues, death)?;
    let triangles = triangles.into_iter().enumerate();
    triangles
        .map(|(i, (vertices, birth, death))| {
            Ok(Triangle { vertices, birth, death, cap: caps.get(i)? == 1 })
        })
        .collect()
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
