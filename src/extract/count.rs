//! The topology of an isosurface counted on the grid, without a mesh.
//!
//! The isosurface is cut by the grid into points on lattice edges, open arcs on cell faces and
//! open patches in cells. The Euler characteristic (with compact support) is additive, a patch
//! with one loop contributes 1, a tunnel takes away 2, so per component
//!
//! chi = n_loops - 2 n_tunnels - n_arcs + n_crossings,
//!
//! where each arc belongs to the loops of two cells. Components follow by joining the crossings
//! of each loop and of both loops of a tunnel.

use super::cell::CellSurface;
use super::lattice::{Crossing, Crossings, for_each_crossed_cell};
use crate::disjoint_sets::DisjointSets;
use crate::topology::exact::ExactField;

/// One component of an isosurface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ComponentCount {
    /// Of the first lattice edge it crosses (in the order of [`super::extract`]), the end that is
    /// not above the isovalue.
    pub low: u32,
    /// The end above the isovalue.
    pub high: u32,
    /// Its Euler characteristic: 2 - 2 * genus.
    pub euler: i64,
    /// How many lattice edges it crosses.
    pub n_crossings: usize,
}

/// Counts the isosurface at an isovalue, component by component in the order of their first
/// crossings. All of them are closed: the layer around the volume closes them.
pub fn count(field: &ExactField, isovalue: f64) -> Vec<ComponentCount> {
    let isovalue_key = field.isovalue_key(isovalue);
    let mut numbers = Crossings::new(field);
    let mut crossings: Vec<Crossing> = Vec::new();
    let mut sets = DisjointSets::new(0);
    // Twice the Euler characteristic that loops and tunnels contribute, at their first crossing.
    let mut doubled: Vec<i64> = Vec::new();
    for_each_crossed_cell(field, isovalue, |cell| {
        let surface = CellSurface::of(field, &cell, isovalue_key);
        let mut firsts = [0; 4];
        for (l, first) in firsts.iter_mut().enumerate().take(surface.n_loops()) {
            let edges = surface.loop_edges(l);
            for (place, &edge) in edges.iter().enumerate() {
                let (crossing, is_new) = numbers.vertex(&cell, edge as usize, crossings.len());
                if is_new {
                    crossings.push(crossing);
                    sets.push();
                    doubled.push(2);
                }
                if place == 0 {
                    *first = crossing.vertex;
                }
                sets.join(*first, crossing.vertex);
            }
            doubled[*first as usize] += 2 - edges.len() as i64;
        }
        if let Some((first, second)) = surface.tunnel {
            sets.join(firsts[first], firsts[second]);
            doubled[firsts[first] as usize] -= 4;
        }
    });
    let mut places = vec![usize::MAX; crossings.len()];
    let mut components: Vec<ComponentCount> = Vec::new();
    for crossing in crossings {
        let root = sets.find(crossing.vertex) as usize;
        if places[root] == usize::MAX {
            places[root] = components.len();
            let Crossing { low, high, .. } = crossing;
            components.push(ComponentCount { low, high, euler: 0, n_crossings: 0 });
        }
        let component = &mut components[places[root]];
        component.n_crossings += 1;
        component.euler += doubled[crossing.vertex as usize];
    }
    for component in &mut components {
        component.euler /= 2;
    }
    components
}
