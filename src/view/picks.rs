//! Components that the hand picked: kept alone, or hidden, and followed through the isovalue by the vertices that they keep. The twin
//! of `Selection` in `page/components.js`.

use std::collections::BTreeMap;

use crate::error::Result;
use crate::render::Painter;
use crate::spectrum::{Components, Picked, Spectrum, SurfaceMesh};

/// Into so many steps the way to another isovalue is divided where a picked component is not found again at once.
const STEPS: u32 = 16;

/// Most components that are hidden at once.
const MOST: usize = 100;

/// What is picked.
#[derive(Clone, Debug, Default)]
pub(super) struct Picks {
    list: Vec<Pick>,
    is_hiding: bool,
    /// The isovalue at which they were last seen.
    isovalue: f64,
}

#[derive(Clone, Debug)]
struct Pick {
    /// On its surface, voxel frame; none while it is gone.
    point: Option<[f64; 3]>,
    /// The spectrum's vertices that it had when it was last there, in order.
    vertices: Vec<u32>,
}

/// The components of a mesh, with what its vertices are.
struct Found<'a> {
    mesh: &'a SurfaceMesh,
    /// Of each vertex, which of the spectrum's it is.
    vertices: &'a [u32],
    components: Components,
    /// Of each vertex, the number of its component.
    of_vertex: Vec<u32>,
}

impl<'a> Found<'a> {
    fn at(painter: &'a mut Painter, spectrum: &Spectrum, isovalue: f64) -> Result<Self> {
        let (mesh, vertices) = painter.mesh_and_vertices(spectrum, isovalue)?;
        let components = Components::of(mesh);
        let mut of_vertex = vec![0; mesh.positions.len()];
        for (corners, &number) in mesh.triangles.iter().zip(&components.of_triangle) {
            corners.iter().for_each(|&v| of_vertex[v as usize] = number);
        }
        Ok(Found { mesh, vertices, components, of_vertex })
    }

    /// The component that has most of some vertices; of those with as many the larger one.
    fn with_most_of(&self, vertices: &[u32]) -> Option<u32> {
        let mut votes: BTreeMap<u32, usize> = BTreeMap::new();
        for (v, &number) in self.vertices.iter().zip(&self.of_vertex) {
            if vertices.binary_search(v).is_ok() {
                *votes.entry(number).or_default() += 1;
            }
        }
        votes
            .into_iter()
            .max_by_key(|&(number, n)| (n, std::cmp::Reverse(number)))
            .map(|best| best.0)
    }

    fn pick(&self, number: u32) -> Pick {
        let its: Vec<usize> =
            (0..self.of_vertex.len()).filter(|&v| self.of_vertex[v] == number).collect();
        let point = its.first().map(|&v| self.mesh.positions[v].map(f64::from));
        let mut vertices: Vec<u32> = its.into_iter().map(|v| self.vertices[v]).collect();
        vertices.sort_unstable();
        Pick { point, vertices }
    }
}

impl Picks {
    /// Keeps the component nearest to a point (voxel frame) alone, or hides it.
    pub(super) fn pick(
        &mut self,
        painter: &mut Painter,
        spectrum: &Spectrum,
        (isovalue, point): (f64, [f64; 3]),
        is_hiding: bool,
    ) -> Result<()> {
        if !is_hiding || !self.is_hiding {
            self.list.clear();
        }
        if self.list.len() == MOST {
            return Ok(());
        }
        let found = Found::at(painter, spectrum, isovalue)?;
        if let Some(number) = found.components.nearest_to(found.mesh, point) {
            self.list.push(found.pick(number));
        }
        (self.is_hiding, self.isovalue) = (is_hiding, isovalue);
        Ok(())
    }

    /// The isovalue at which they were last seen.
    pub(super) fn isovalue(&self) -> f64 {
        self.isovalue
    }

    /// Finds them again by where they were, in another part of a folder, whose vertices have other numbers.
    pub(super) fn find_again(
        &mut self,
        painter: &mut Painter,
        spectrum: &Spectrum,
        isovalue: f64,
    ) -> Result<()> {
        if self.list.is_empty() {
            return Ok(());
        }
        self.isovalue = isovalue;
        let found = Found::at(painter, spectrum, isovalue)?;
        for pick in &mut self.list {
            let nearest = pick.point.and_then(|p| found.components.nearest_to(found.mesh, p));
            let none = || Pick { point: None, vertices: Vec::new() };
            *pick = nearest.map_or_else(none, |number| found.pick(number));
        }
        Ok(())
    }

    /// Whether all components are shown.
    pub(super) fn is_empty(&self) -> bool {
        self.list.is_empty()
    }

    /// Finds them again at another isovalue.
    pub(super) fn follow(
        &mut self,
        painter: &mut Painter,
        spectrum: &Spectrum,
        isovalue: f64,
    ) -> Result<()> {
        if self.list.is_empty() || isovalue == self.isovalue {
            return Ok(());
        }
        let from = std::mem::replace(&mut self.isovalue, isovalue);
        let before = self.list.clone();
        if !self.step(&Found::at(painter, spectrum, isovalue)?) {
            // What was lost may have gone further than its vertices live.
            self.list = before;
            for i in 1..=STEPS {
                let share = f64::from(i) / f64::from(STEPS);
                let between =
                    if i == STEPS { isovalue } else { from * (1.0 - share) + isovalue * share };
                self.step(&Found::at(painter, spectrum, between)?);
            }
        }
        Ok(())
    }

    /// Finds them among components; whether none that was there is lost.
    fn step(&mut self, found: &Found) -> bool {
        let mut is_lost = false;
        for pick in &mut self.list {
            match found.with_most_of(&pick.vertices) {
                Some(number) => *pick = found.pick(number),
                // What is gone may come back.
                None => is_lost |= pick.point.take().is_some(),
            }
        }
        !is_lost
    }

    /// What is shown by that.
    pub(super) fn picked(&self) -> Picked {
        let points = self.list.iter().filter_map(|pick| pick.point).collect();
        match self.list.is_empty() || self.is_hiding {
            true => Picked::Without(points),
            false => Picked::Only(points),
        }
    }
}
