//! One component of the isosurface, followed from an edge that it crosses: what it takes depends on the
//! component alone, not on the volume or on the rest of the isosurface.

use std::collections::{HashMap, HashSet};

use super::cell::{CellSurface, EDGES};
use super::lattice::Cell;
use super::{Extraction, Numbering, Polygoniser};
use crate::topology::exact::ExactField;

/// The component of the isosurface that crosses a lattice edge, given as (sample not above the isovalue,
/// sample above it), both of the padded grid. As that component in [`super::extract`], with the same
/// order of faces. `None` if it passes more than `most_cells`; hardly more than those are looked at then.
pub fn extract_component(
    field: &ExactField,
    isovalue: f64,
    crossing: (u32, u32),
    most_cells: usize,
) -> Option<Extraction> {
    let isovalue_key = field.isovalue_key(isovalue);
    let edges = edges_of_component(field, isovalue, crossing, most_cells)?;
    let mut cells: Vec<(u32, u16)> = edges.into_iter().collect();
    cells.sort_unstable();
    let crossings = Numbering::Found(HashMap::with_capacity(cells.len()));
    let mut polygoniser = Polygoniser::new(field, isovalue, crossings);
    for (corner, edges) in cells {
        let cell = Cell::at(field, corner, isovalue);
        let surface = CellSurface::of(field, &cell, isovalue_key);
        polygoniser.add_loops(&cell, &surface, |l| edges >> surface.loop_edges(l)[0] & 1 == 1);
    }
    Some(polygoniser.finish())
}

/// The lattice edges that a component crosses: by cell (its lowest corner), bit `e` is set iff a loop of the component
/// passes its edge `e`. `None` if there are more cells.
fn edges_of_component(
    field: &ExactField,
    isovalue: f64,
    (low, high): (u32, u32),
    most_cells: usize,
) -> Option<HashMap<u32, u16>> {
    let isovalue_key = field.isovalue_key(isovalue);
    let (strides, offsets) = (field.strides(), field.cell_offsets());
    let axis_of =
        |a: u32, b: u32| strides.iter().position(|&s| s == a.abs_diff(b)).expect("a lattice edge");
    let first = (low.min(high), axis_of(low, high));
    let mut cells: HashMap<u32, u16> = HashMap::new();
    let mut seen = HashSet::from([first]);
    let mut stack = vec![first];
    while let Some((from, axis)) = stack.pop() {
        let [u, v] = [strides[(axis + 1) % 3], strides[(axis + 2) % 3]];
        for corner in [from, from - u, from - v, from - u - v] {
            let edge = EDGES.iter().position(|&(a, b)| {
                let [a, b] = [a, b].map(|c| corner + offsets[c as usize]);
                (a, b) == (from, from + strides[axis])
            });
            let edge = edge.expect("the edge belongs to the four cells around it") as u8;
            let edges = cells.entry(corner).or_default();
            if *edges >> edge & 1 == 1 {
                continue;
            }
            let cell = Cell::at(field, corner, isovalue);
            let surface = CellSurface::of(field, &cell, isovalue_key);
            let with_edge = (0..surface.n_loops()).find(|&l| surface.loop_edges(l).contains(&edge));
            let with_edge = with_edge.expect("a crossed edge belongs to a loop");
            let joined = surface.tunnel.and_then(|(a, b)| match with_edge {
                l if l == a => Some(b),
                l if l == b => Some(a),
                _ => None,
            });
            for l in std::iter::once(with_edge).chain(joined) {
                for &edge in surface.loop_edges(l) {
                    *edges |= 1 << edge;
                    let from = corner + offsets[EDGES[edge as usize].0 as usize];
                    let beside = (from, edge as usize / 4);
                    if seen.insert(beside) {
                        stack.push(beside);
                    }
                }
            }
        }
        if cells.len() > most_cells {
            return None;
        }
    }
    Some(cells)
}
