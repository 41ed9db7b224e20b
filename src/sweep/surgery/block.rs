//! The block of cells in which a surgery replaces the mesh.

use glam::{IVec3, Vec3};

use crate::mesh::bounds;
use crate::topology::exact::ExactField;

/// A set of cells of the padded grid.
pub(super) struct Block {
    cells: Vec<bool>,
    /// The lowest and the highest of them along each axis.
    bounds: (IVec3, IVec3),
    /// Cells along each axis.
    dims: IVec3,
    /// Vertices of the padded grid along x and y.
    rows: [i32; 2],
    inverse_voxel: Vec3,
}

impl Block {
    /// The empty set.
    pub(super) fn new(field: &ExactField) -> Block {
        let [nx, ny, nz] = field.dims().map(|d| d as i32);
        let voxel = field.volume().voxel_size().map(|x| (1.0 / x) as f32);
        Block {
            cells: vec![false; field.n_vertices()],
            bounds: (IVec3::MAX, IVec3::MIN),
            dims: IVec3::new(nx - 1, ny - 1, nz - 1),
            rows: [nx, ny],
            inverse_voxel: Vec3::from(voxel),
        }
    }

    /// The first and the last cell that a box (voxel frame) touches.
    fn cells_of(&self, low: Vec3, high: Vec3) -> (IVec3, IVec3) {
        let at = |p: Vec3| {
            ((p * self.inverse_voxel).floor().as_ivec3() + 1).clamp(IVec3::ZERO, self.dims - 1)
        };
        (at(low), at(high))
    }

    fn index(&self, c: IVec3) -> usize {
        (c.x + self.rows[0] * (c.y + self.rows[1] * c.z)) as usize
    }

    /// Adds the cells that a box touches. A cell at the border comes with the one beyond it in the
    /// layer: what crosses the border is replaced on both sides of it.
    pub(super) fn add_box(&mut self, low: Vec3, high: Vec3) {
        let (mut a, mut b) = self.cells_of(low, high);
        for axis in 0..3 {
            if a[axis] <= 1 {
                a[axis] = 0;
                b[axis] = b[axis].max(1.min(self.dims[axis] - 1));
            }
            if b[axis] >= self.dims[axis] - 2 {
                b[axis] = self.dims[axis] - 1;
                a[axis] = a[axis].min((self.dims[axis] - 2).max(0));
            }
        }
        self.bounds = (self.bounds.0.min(a), self.bounds.1.max(b));
        self.for_each(a, b, |cells, i| cells[i] = true);
    }

    /// Adds the cells around a point.
    pub(super) fn add_around(&mut self, p: Vec3, radius: f32) {
        self.add_box(p - radius, p + radius);
    }

    fn for_each(&mut self, a: IVec3, b: IVec3, mut visit: impl FnMut(&mut [bool], usize)) {
        for z in a.z..=b.z {
            for y in a.y..=b.y {
                for x in a.x..=b.x {
                    let i = self.index(IVec3::new(x, y, z));
                    visit(&mut self.cells, i);
                }
            }
        }
    }

    /// Whether a box touches one of the cells.
    fn touches(&self, low: Vec3, high: Vec3) -> bool {
        let (mut a, mut b) = self.cells_of(low, high);
        // Most of what is asked for lies far away.
        (a, b) = (a.max(self.bounds.0), b.min(self.bounds.1));
        (a.z..=b.z).any(|z| {
            (a.y..=b.y).any(|y| (a.x..=b.x).any(|x| self.cells[self.index(IVec3::new(x, y, z))]))
        })
    }

    /// Whether a triangle's bounding box, so much larger on every side, touches one of the cells.
    pub(super) fn touches_triangle(&self, t: [Vec3; 3], margin: f32) -> bool {
        let (low, high) = bounds(t);
        self.touches(low - margin, high + margin)
    }

    /// Whether the cell with this lowest corner belongs to it.
    pub(super) fn has(&self, corner: u32) -> bool {
        self.cells[corner as usize]
    }
}
