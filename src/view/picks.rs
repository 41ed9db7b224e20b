//! Picked components: shown exclusively, or hidden, and tracked over the isovalue by the vertices that they keep. Twin:
//! `Selection` in `page/components.js`.

use std::collections::BTreeMap;

use crate::error::Result;
use crate::render::Painter;
use crate::spectrum::{Components, Mesh, Picked, Spectrum};

/// Number of intermediate isovalues at which a component is tracked that is not found in one step.
const TRACKING_STEPS: u32 = 16;

/// Maximum number of hidden components.
const MAX_HIDDEN: usize = 100;

/// The picked components.
#[derive(Clone, Debug, Default)]
pub(super) struct PickedComponents {
    list: Vec<Pick>,
    is_hiding: bool,
    /// The isovalue of the last update.
    isovalue: f64,
}

#[derive(Clone, Debug)]
struct Pick {
    /// A point of the component, voxel frame; `None` while it does not exist.
    point: Option<[f64; 3]>,
    /// The spectrum's indices of the vertices that it had last, increasing.
    vertices: Vec<u32>,
}

/// The components of a mesh.
struct MeshComponents<'a> {
    mesh: &'a Mesh,
    /// The spectrum's index of each vertex.
    vertices: &'a [u32],
    components: Components,
    /// The index of each vertex's component.
    of_vertex: Vec<u32>,
}

impl<'a> MeshComponents<'a> {
    fn at(painter: &'a mut Painter, spectrum: &Spectrum, isovalue: f64) -> Result<Self> {
        let (mesh, vertices) = painter.mesh_and_vertices(spectrum, isovalue)?;
        let components = Components::of(mesh);
        let mut of_vertex = vec![0; mesh.positions.len()];
        for (corners, &component) in mesh.triangles.iter().zip(&components.of_triangle) {
            corners.iter().for_each(|&v| of_vertex[v as usize] = component);
        }
        Ok(MeshComponents { mesh, vertices, components, of_vertex })
    }

    /// The component that has most of some vertices; the larger one of those with equally many.
    fn with_most_of(&self, vertices: &[u32]) -> Option<u32> {
        let mut counts: BTreeMap<u32, usize> = BTreeMap::new();
        for (v, &component) in self.vertices.iter().zip(&self.of_vertex) {
            if vertices.binary_search(v).is_ok() {
                *counts.entry(component).or_default() += 1;
            }
        }
        counts
            .into_iter()
            .max_by_key(|&(component, n)| (n, std::cmp::Reverse(component)))
            .map(|best| best.0)
    }

    fn pick(&self, component: u32) -> Pick {
        let own: Vec<usize> =
            (0..self.of_vertex.len()).filter(|&v| self.of_vertex[v] == component).collect();
        let point = own.first().map(|&v| self.mesh.positions[v].map(f64::from));
        let mut vertices: Vec<u32> = own.into_iter().map(|v| self.vertices[v]).collect();
        vertices.sort_unstable();
        Pick { point, vertices }
    }
}

impl PickedComponents {
    /// Keeps only the component nearest to a point (voxel frame), or hides it.
    pub(super) fn pick(
        &mut self,
        painter: &mut Painter,
        spectrum: &Spectrum,
        isovalue: f64,
        point: [f64; 3],
        is_hiding: bool,
    ) -> Result<()> {
        if !is_hiding || !self.is_hiding {
            self.list.clear();
        }
        if self.list.len() == MAX_HIDDEN {
            return Ok(());
        }
        let mesh = MeshComponents::at(painter, spectrum, isovalue)?;
        if let Some(component) = mesh.components.nearest_to(mesh.mesh, point) {
            self.list.push(mesh.pick(component));
        }
        (self.is_hiding, self.isovalue) = (is_hiding, isovalue);
        Ok(())
    }

    /// The isovalue of the last update.
    pub(super) fn isovalue(&self) -> f64 {
        self.isovalue
    }

    /// Finds the components again by their points, after the chunks of a folder, and so the indices of vertices, have changed.
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
        let mesh = MeshComponents::at(painter, spectrum, isovalue)?;
        for pick in &mut self.list {
            let nearest = pick.point.and_then(|p| mesh.components.nearest_to(mesh.mesh, p));
            let none = || Pick { point: None, vertices: Vec::new() };
            *pick = nearest.map_or_else(none, |component| mesh.pick(component));
        }
        Ok(())
    }

    /// Whether all components are shown.
    pub(super) fn is_empty(&self) -> bool {
        self.list.is_empty()
    }

    /// Tracks the components to another isovalue.
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
        if !self.step(&MeshComponents::at(painter, spectrum, isovalue)?) {
            // A lost component may have no vertex that lives over the whole interval.
            self.list = before;
            for i in 1..=TRACKING_STEPS {
                let t = f64::from(i) / f64::from(TRACKING_STEPS);
                let between =
                    if i == TRACKING_STEPS { isovalue } else { from * (1.0 - t) + isovalue * t };
                self.step(&MeshComponents::at(painter, spectrum, between)?);
            }
        }
        Ok(())
    }

    /// Finds the components in a mesh; returns `false` if an existing one is lost.
    fn step(&mut self, mesh: &MeshComponents) -> bool {
        let mut is_lost = false;
        for pick in &mut self.list {
            match mesh.with_most_of(&pick.vertices) {
                Some(component) => *pick = mesh.pick(component),
                // It may appear again.
                None => is_lost |= pick.point.take().is_some(),
            }
        }
        !is_lost
    }

    /// The choice of components for the view.
    pub(super) fn picked(&self) -> Picked {
        let points = self.list.iter().filter_map(|pick| pick.point).collect();
        match self.list.is_empty() || self.is_hiding {
            true => Picked::Without(points),
            false => Picked::Only(points),
        }
    }
}
