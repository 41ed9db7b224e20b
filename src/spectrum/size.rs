//! The size of a spectrum.

use serde::{Deserialize, Serialize};

use super::data::Spectrum;

/// The size of a spectrum: the lengths of its tables.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct Size {
    /// Isovalues of the table.
    pub isovalues: u64,
    /// Trajectories, one for each vertex.
    pub trajectories: u64,
    /// Knots of all trajectories.
    pub knots: u64,
    /// All triangles.
    pub triangles: u64,
    /// The most triangles that are alive at one isovalue.
    pub most_triangles: u64,
    /// Collapses of edges.
    pub collapses: u64,
}

impl Size {
    /// The size of a spectrum, in O(n) of its triangles and isovalues.
    pub fn of(spectrum: &Spectrum) -> Self {
        let mut changes = vec![0i64; spectrum.isovalues().len() + 1];
        for triangle in spectrum.triangles() {
            changes[triangle.birth as usize] += 1;
            changes[triangle.death as usize] -= 1;
        }
        let mut alive = 0;
        let most = changes.iter().fold(0, |most: i64, change| {
            alive += change;
            most.max(alive)
        });
        Size {
            isovalues: spectrum.isovalues().len() as u64,
            trajectories: spectrum.n_vertices() as u64,
            knots: spectrum.knots().len() as u64,
            triangles: spectrum.triangles().len() as u64,
            most_triangles: most as u64,
            collapses: spectrum.collapses().len() as u64,
        }
    }

    /// Each number with its name.
    pub(crate) fn named(&self) -> [(&'static str, u64); 6] {
        [
            ("isovalues", self.isovalues),
            ("trajectories", self.trajectories),
            ("knots", self.knots),
            ("triangles", self.triangles),
            ("triangles at an isovalue", self.most_triangles),
            ("collapses", self.collapses),
        ]
    }
}
