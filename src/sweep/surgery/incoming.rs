//! Which part of an extraction comes in.

use glam::Vec3;

use super::block::Block;
use super::near::Near;
use super::rim::{Side, is_one_sided};
use crate::extract::Extraction;
use crate::mesh::normal;

/// What lies beside what in an extraction.
pub(super) struct Adjacency {
    /// Unit, by vertex.
    pub(super) normals: Vec<Vec3>,
    /// The three faces beside each face, across its sides.
    beside: Vec<[u32; 3]>,
    /// The faces around each vertex: those from one entry of `first` to the next.
    around: Vec<u32>,
    first: Vec<u32>,
}

impl Adjacency {
    pub(super) fn new(extraction: &Extraction) -> Adjacency {
        let n_vertices = extraction.positions.len();
        let at = |v: u32| Vec3::from(extraction.positions[v as usize]);
        let mut normals = vec![Vec3::ZERO; n_vertices];
        let mut first = vec![0u32; n_vertices + 1];
        for face in &extraction.faces {
            let n = normal(face.map(at));
            for &v in face {
                normals[v as usize] += n;
                first[v as usize + 1] += 1;
            }
        }
        normals.iter_mut().for_each(|n| *n = n.normalize_or_zero());
        for v in 0..n_vertices {
            first[v + 1] += first[v];
        }
        let mut next = first.clone();
        let mut around = vec![0; 3 * extraction.faces.len()];
        for (f, face) in extraction.faces.iter().enumerate() {
            for &v in face {
                around[next[v as usize] as usize] = f as u32;
                next[v as usize] += 1;
            }
        }
        let mut adjacency = Adjacency { normals, beside: Vec::new(), around, first };
        let across = |f: usize, a: u32, b: u32| {
            let is_other = |&g: &u32| g as usize != f && extraction.faces[g as usize].contains(&b);
            let found = adjacency.around(a).iter().copied().find(is_other);
            found.expect("an extraction is closed")
        };
        let faces = extraction.faces.iter().enumerate();
        let beside: Vec<[u32; 3]> =
            faces.map(|(f, t)| [0, 1, 2].map(|i| across(f, t[i], t[(i + 1) % 3]))).collect();
        adjacency.beside = beside;
        adjacency
    }

    /// The faces around a vertex.
    fn around(&self, v: u32) -> &[u32] {
        &self.around[self.first[v as usize] as usize..self.first[v as usize + 1] as usize]
    }
}

/// The part of an extraction that comes in.
pub(super) struct Incoming<'a> {
    extraction: &'a Extraction,
    adjacency: &'a Adjacency,
    /// By face.
    pub(super) comes_in: Vec<bool>,
}

impl<'a> Incoming<'a> {
    /// The faces in the block, and those around them that do not lie near what stays.
    pub(super) fn new(
        extraction: &'a Extraction,
        adjacency: &'a Adjacency,
        block: &Block,
        near: &Near,
    ) -> Incoming<'a> {
        let comes_in = vec![false; extraction.faces.len()];
        let mut incoming = Incoming { extraction, adjacency, comes_in };
        incoming.spread(block, near);
        incoming.unpinch();
        incoming
    }

    /// Spreads from the block until near what stays.
    fn spread(&mut self, block: &Block, near: &Near) {
        let mut is_near: Vec<Option<bool>> = vec![None; self.adjacency.normals.len()];
        let mut stack: Vec<u32> = (0..self.comes_in.len() as u32)
            .filter(|&f| block.has(self.extraction.cells[f as usize]))
            .collect();
        while let Some(f) = stack.pop() {
            if self.comes_in[f as usize] {
                continue;
            }
            let apart = self.extraction.faces[f as usize].iter().all(|&v| {
                let known = &mut is_near[v as usize];
                let p = Vec3::from(self.extraction.positions[v as usize]);
                !*known.get_or_insert_with(|| near.is_near(p, self.adjacency.normals[v as usize]))
            });
            if apart {
                self.comes_in[f as usize] = true;
                stack.extend(self.adjacency.beside[f as usize]);
            }
        }
    }

    /// Takes away what meets the rest at single vertices only, or at the border of the volume along
    /// an edge or on one side.
    fn unpinch(&mut self) {
        loop {
            let mut changed = false;
            for v in 0..self.adjacency.normals.len() {
                let around = self.adjacency.around(v as u32);
                let open = around.iter().filter(|&&f| {
                    self.comes_in[f as usize] && self.starts_rim_at(f as usize, v as u32)
                });
                if open.count() > 1 || self.is_beside_curve(v, around) {
                    for &f in around {
                        changed |= std::mem::replace(&mut self.comes_in[f as usize], false);
                    }
                }
            }
            for f in 0..self.comes_in.len() {
                let meets_cap = self.adjacency.beside[f].iter().any(|&g| {
                    !self.comes_in[g as usize]
                        && self.extraction.caps[g as usize] != self.extraction.caps[f]
                });
                if self.comes_in[f] && meets_cap {
                    self.comes_in[f] = false;
                    changed = true;
                }
            }
            if !changed {
                return;
            }
        }
    }

    /// Whether a vertex in the border of the volume would not lie on the curve in which what comes in meets the
    /// border.
    fn is_beside_curve(&self, v: usize, around: &[u32]) -> bool {
        let faces = around.iter().map(|&f| f as usize).filter(|&f| self.comes_in[f]);
        self.extraction.borders[v] != 0 && is_one_sided(faces.map(|f| self.extraction.caps[f]))
    }

    /// Whether the side of a face that starts at a vertex belongs to a rim.
    fn starts_rim_at(&self, f: usize, v: u32) -> bool {
        let i = self.extraction.faces[f].iter().position(|&w| w == v).expect("a corner");
        !self.comes_in[self.adjacency.beside[f][i] as usize]
    }

    /// The sides of the rims.
    pub(super) fn sides(&self) -> Vec<Side> {
        let mut sides = Vec::new();
        for f in (0..self.comes_in.len()).filter(|&f| self.comes_in[f]) {
            let t = self.extraction.faces[f];
            for i in 0..3 {
                if !self.comes_in[self.adjacency.beside[f][i] as usize] {
                    sides.push((t[i], t[(i + 1) % 3], self.extraction.caps[f]));
                }
            }
        }
        sides
    }
}
