//! A selection of single components.

/// A selection of components. Each is given by a point (voxel frame) and is the component nearest to it.
#[derive(Clone, Debug, PartialEq)]
pub enum Picked {
    /// Only these.
    Only(Vec<[f64; 3]>),
    /// All but these.
    Without(Vec<[f64; 3]>),
}

impl Picked {
    /// Whether all components are selected.
    pub fn is_all(&self) -> bool {
        matches!(self, Picked::Without(points) if points.is_empty())
    }
}

impl Default for Picked {
    fn default() -> Self {
        Picked::Without(Vec::new())
    }
}
