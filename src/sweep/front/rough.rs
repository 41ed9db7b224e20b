//! Cells in which the field's direction turns too much for a mesh to be moved through them.
//!
//! # Theory
//!
//! A tracked triangle is as long as a cell or longer. Where the gradient turns by more than `WIDEST` inside one cell, as it
//! does around every critical point and everywhere in noise, the isosurface bends within less than a triangle: a mesh
//! of free vertices folds there, and separates other samples than the isosurface does. Such cells are exact
//! while the isosurface passes through them.

use std::collections::BTreeSet;

use glam::Vec3;
use rayon::prelude::*;

use super::calendar::Passage;
use super::region::Grid;
use crate::topology::exact::ExactField;

/// Largest angle, as its cosine, between the gradient at a corner of a cell and their mean. Of bonsai's crossings between
/// 92 and 112 half are tracked with .7, .63 with .3, .65 with -.5; that took 48, 69 and 119 s.
const WIDEST: f32 = 0.7;

/// The rough cells: their block, and the keys of their lowest and highest corners.
pub(super) struct Rough {
    cells: Vec<(u32, i128, i128)>,
}

impl Rough {
    /// The rough cells that meet isosurfaces of a range.
    pub(super) fn new(field: &ExactField, grid: Grid, range: (f64, f64)) -> Rough {
        let [first, last] = [range.0, range.1].map(|c| field.isovalue_key(c));
        let gradients = Gradients::new(field);
        let cells = (0..field.n_vertices() as u32)
            .into_par_iter()
            .with_min_len(4096)
            .filter_map(|cell| {
                let block = grid.block_of_cell(cell)?;
                let corners = field.cell_offsets().map(|o| cell + o);
                let keys = corners.map(|v| field.key(v));
                let (low, high) = (*keys.iter().min()?, *keys.iter().max()?);
                let meets = low <= last && high > first && low < high;
                (meets && gradients.turn(corners) < WIDEST).then_some((block, low, high))
            })
            .collect();
        Rough { cells }
    }

    /// The blocks of those that isosurfaces of a passage meet.
    pub(super) fn blocks(&self, passage: Passage) -> BTreeSet<u32> {
        let met = self.cells.par_iter().filter(|c| passage.meets(c.1, c.2)).map(|c| c.0);
        met.collect::<Vec<u32>>().into_iter().collect()
    }
}

/// Central differences at samples.
struct Gradients<'a> {
    field: &'a ExactField<'a>,
    inverse_size: [f32; 3],
}

impl<'a> Gradients<'a> {
    fn new(field: &'a ExactField<'a>) -> Self {
        let inverse_size = field.volume().voxel_size().map(|x| 1.0 / x as f32);
        Gradients { field, inverse_size }
    }

    /// At a sample; one-sided at the volume's border.
    fn at(&self, v: u32) -> Vec3 {
        let (dims, strides) = (self.field.dims(), self.field.strides());
        let p = self.field.position(v);
        Vec3::from(std::array::from_fn(|a| {
            let low = if p[a] >= 1 { v - strides[a] } else { v };
            let high = if p[a] + 2 < dims[a] as i64 - 1 { v + strides[a] } else { v };
            let n = (high - low) / strides[a];
            let rise = (self.field.sample(high) - self.field.sample(low)) as f32;
            rise * self.inverse_size[a] / n.max(1) as f32
        }))
    }

    /// The smallest cosine of the angle between the gradient at a corner and the mean.
    fn turn(&self, corners: [u32; 8]) -> f32 {
        let all = corners.map(|v| self.at(v));
        let mean = all.iter().sum::<Vec3>();
        let cosine = |g: &Vec3| g.dot(mean) / (g.length() * mean.length()).max(1e-30);
        all.iter().map(cosine).fold(1.0, f32::min)
    }
}
