//! The topology of an isosurface counted on the grid, without a mesh.
//!
//! The grid divides the isosurface into points on lattice edges, open arcs on cell faces and
//! open patches in cells. The Euler characteristic (with compact support) is additive, a patch
//! with one loop contributes 1, a tunnel subtracts 2, so per component
//!
//! chi = n_loops - 2 n_tunnels - n_arcs + n_crossings,
//!
//! where each arc belongs to the loops of two cells. Joining the crossings
//! of each loop and of both loops of a tunnel gives the components.

use super::cell::CellSurface;
use super::lattice::{Crossing, Crossings, for_each_crossed_cell};
use crate::disjoint_sets::DisjointSets;
use crate::topology::exact::ExactField;

/// One component of an isosurface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ComponentCount {
    /// The first lattice edge it crosses (in the order of [`super::extract`]): the end that is
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
/// crossings. All components are closed by the layer around the volume.
pub fn count(field: &ExactField, isovalue: f64) -> Vec<ComponentCount> {
    let parts = count_parts(field, isovalue, |_| true);
    let mut components: Vec<ComponentCount> = Vec::new();
    for (crossing, part) in parts.crossings.into_iter().zip(parts.part_of) {
        if part as usize == components.len() {
            let Crossing { low, high, .. } = crossing;
            let euler = parts.doubled[part as usize] / 2;
            components.push(ComponentCount { low, high, euler, n_crossings: 0 });
        }
        components[part as usize].n_crossings += 1;
    }
    components
}

/// The parts of the isosurface in some of the cells.
#[derive(Debug)]
pub(crate) struct Parts {
    /// Crossed lattice edges, in the order of the walk.
    pub(crate) crossings: Vec<Crossing>,
    /// Part of each crossing; parts are numbered by their first crossings.
    pub(crate) part_of: Vec<u32>,
    /// By part: twice its Euler characteristic plus the number of arcs on its boundary. For a triangulation of it whose
    /// boundary has as many edges, this is twice the number of vertices minus the number of faces.
    pub(crate) doubled: Vec<i64>,
}

/// Counts the parts of the isosurface in the cells (given by their lowest corners) for which `is_in` holds.
pub(crate) fn count_parts(field: &ExactField, isovalue: f64, is_in: impl Fn(u32) -> bool) -> Parts {
    let isovalue_key = field.isovalue_key(isovalue);
    let mut numbers = Crossings::new(field);
    let mut crossings: Vec<Crossing> = Vec::new();
    let mut sets = DisjointSets::new(0);
    // The contributions of loops and tunnels, at their first crossing.
    let mut own: Vec<i64> = Vec::new();
    for_each_crossed_cell(field, isovalue, |cell| {
        if !is_in(cell.corner) {
            return;
        }
        let surface = CellSurface::of(field, &cell, isovalue_key);
        let mut firsts = [0; 4];
        for (l, first) in firsts.iter_mut().enumerate().take(surface.n_loops()) {
            let edges = surface.loop_edges(l);
            for (place, &edge) in edges.iter().enumerate() {
                let (crossing, is_new) = numbers.vertex(&cell, edge as usize, crossings.len());
                if is_new {
                    crossings.push(crossing);
                    sets.push();
                    own.push(2);
                }
                if place == 0 {
                    *first = crossing.vertex;
                }
                sets.join(*first, crossing.vertex);
            }
            own[*first as usize] += 2 - edges.len() as i64;
        }
        if let Some((first, second)) = surface.tunnel {
            sets.join(firsts[first], firsts[second]);
            own[firsts[first] as usize] -= 4;
        }
    });
    let mut places = vec![u32::MAX; crossings.len()];
    let (mut part_of, mut doubled) = (Vec::with_capacity(crossings.len()), Vec::new());
    for (crossing, own) in crossings.iter().zip(own) {
        let place = &mut places[sets.find(crossing.vertex) as usize];
        if *place == u32::MAX {
            *place = doubled.len() as u32;
            doubled.push(0);
        }
        part_of.push(*place);
        doubled[*place as usize] += own;
    }
    Parts { crossings, part_of, doubled }
}
