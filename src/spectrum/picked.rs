//! Components that are chosen one by one, as a hand picks them.

/// Components that are chosen one by one, each by a point to which it is the nearest of all (voxel frame).
#[derive(Clone, Debug, PartialEq)]
pub enum Picked {
    /// These alone; without a point none.
    Only(Vec<[f64; 3]>),
    /// All but these.
    Without(Vec<[f64; 3]>),
}

impl Picked {
    /// Whether nothing is left out.
    pub fn is_all(&self) -> bool {
        matches!(self, Picked::Without(points) if points.is_empty())
    }
}

impl Default for Picked {
    fn default() -> Self {
        Picked::Without(Vec::new())
    }
}
