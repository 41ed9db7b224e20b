//! A mask: the samples of a volume that count.

pub(super) mod apply;
pub(super) mod record;

/// Which samples of a grid are inside.
#[derive(Clone, Debug, PartialEq)]
pub struct Mask {
    name: String,
    dims: [usize; 3],
    /// x fastest.
    inside: Vec<bool>,
}

impl Mask {
    /// The name of the mask's file.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Samples along x, y, z.
    pub fn dims(&self) -> [usize; 3] {
        self.dims
    }

    /// Number of samples inside.
    pub fn n_inside(&self) -> usize {
        self.inside.iter().filter(|&&inside| inside).count()
    }

    /// Whether a sample is inside, by its index, x fastest.
    #[inline]
    pub fn is_inside(&self, sample: usize) -> bool {
        self.inside[sample]
    }

    /// The part of the mask in a region: first index and end along x, y, z.
    pub(in crate::volume) fn cropped(&self, region: [[usize; 2]; 3]) -> Mask {
        let [nx, ny, _] = self.dims;
        let [x, y, z] = region;
        let rows = (z[0]..z[1]).flat_map(|k| (y[0]..y[1]).map(move |j| nx * (j + ny * k)));
        let inside = rows.flat_map(|row| &self.inside[row + x[0]..row + x[1]]).copied().collect();
        Mask { name: self.name.clone(), dims: region.map(|[first, end]| end - first), inside }
    }

    /// The mask of blocks of n^3 samples: a block is inside if at least half of its samples are.
    pub(in crate::volume) fn downsampled(&self, n: usize) -> Mask {
        let [nx, ny, _] = self.dims;
        let dims = self.dims.map(|d| d / n);
        let block = |i: usize| {
            let [x, y, z] = [i % dims[0], i / dims[0] % dims[1], i / (dims[0] * dims[1])];
            let rows = (0..n * n).map(|r| x * n + nx * (y * n + r % n + ny * (z * n + r / n)));
            let n_inside: usize =
                rows.map(|row| self.inside[row..row + n].iter().filter(|&&i| i).count()).sum();
            2 * n_inside >= n * n * n
        };
        let inside = (0..dims.iter().product()).map(block).collect();
        Mask { name: self.name.clone(), dims, inside }
    }
}
