//! The field of one volume at points in the frame of another.

use super::grid::Volume;
use super::placement::{Placement, Space, Unit};

/// Distance in cells beyond the outermost samples up to which a volume has the values of its border: caps of surfaces are
/// within it.
const MARGIN: f64 = 0.5;

impl Volume {
    /// The trilinear field at points of the voxel frame of another volume of `dims` samples at `placement`; NaN outside
    /// this volume.
    ///
    /// Points are mapped through the world; units are converted, and LPS and RAS. A volume of the same dimensions without a
    /// placement is assumed to have that of the other.
    pub fn field_in(
        &self,
        dims: [usize; 3],
        placement: &Placement,
    ) -> impl Fn([f32; 3]) -> f64 + Sync + '_ {
        let own = *self.placement();
        let is_same = own == *placement || own == Placement::IDENTITY && dims == self.dims();
        let (from, to) = (*placement, own);
        let scale = match (from.unit.in_mm(), to.unit.in_mm()) {
            (Some(a), Some(b)) if from.unit != Unit::Unknown => a / b,
            _ => 1.0,
        };
        let is_turned =
            matches!((from.space, to.space), (Space::Lps, Space::Ras) | (Space::Ras, Space::Lps));
        let side = if is_turned { -1.0 } else { 1.0 };
        // The points are in the voxel frame of the other volume, whose spacing may differ.
        let size = if is_same { from.cell_size() } else { self.voxel_size() };
        let own_size = self.voxel_size();
        move |p| {
            let p = match is_same {
                true => p.map(f64::from),
                false => {
                    let [x, y, z] = from.world_of_voxel(p);
                    to.voxel_of_world([side * scale * x, side * scale * y, scale * z])
                }
            };
            let mut inside = [0.0; 3];
            for a in 0..3 {
                let x = p[a] / size[a];
                let last = self.dims()[a] as f64 - 1.0;
                if !(-MARGIN..=last + MARGIN).contains(&x) {
                    return f64::NAN;
                }
                inside[a] = own_size[a] * x.clamp(0.0, last);
            }
            self.value_at(inside)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::volume::Samples;

    /// The field x + 10 y + 100 z of the index frame, at a placement.
    fn ramp(dims: [usize; 3], placement: Placement) -> Volume {
        let samples: Vec<f32> = (0..dims[0] * dims[1] * dims[2])
            .map(|i| {
                let (x, y, z) = (i % dims[0], i / dims[0] % dims[1], i / dims[0] / dims[1]);
                (x + 10 * y + 100 * z) as f32
            })
            .collect();
        Volume::new("ramp", dims, Samples::F32(samples), placement).expect("a volume")
    }

    #[test]
    fn the_same_point_of_the_world_has_the_same_value() {
        let mm = |unit, space, origin, spacing| Placement {
            unit,
            space,
            origin,
            spacing,
            ..Placement::IDENTITY
        };
        // Voxels of 2 mm around (0, 0, 0), sampled by a volume with voxels of 0.5 cm in the other space.
        let volume = ramp([9, 9, 9], mm(Unit::Mm, Space::Lps, [-8.0; 3], [2.0; 3]));
        let frame = mm(Unit::Cm, Space::Ras, [0.0; 3], [0.5, 1.0, 0.5]);
        let field = volume.field_in([3, 3, 3], &frame);
        // At (5, 2.5, 5) mm in RAS: (-5, -2.5, 5) in LPS, sample (1.5, 2.75, 6.5). A cell of 1 cm is 1.5 voxels long.
        assert!((field([1.0, 0.375, 1.0]) - (1.5 + 27.5 + 650.0)).abs() < 1e-9);
        assert!(field([3.0, 0.0, 0.0]).is_nan(), "(-15, 0, 0) mm is outside");
    }

    #[test]
    fn a_volume_of_the_same_dimensions_without_a_placement_has_that_of_the_other() {
        let volume = ramp([4, 4, 4], Placement::IDENTITY);
        let frame = Placement { spacing: [1.0, 1.0, 3.0], origin: [7.0; 3], ..Placement::IDENTITY };
        let field = volume.field_in([4, 4, 4], &frame);
        assert!((field([1.0, 2.0, 2.25]) - (1.0 + 20.0 + 150.0)).abs() < 1e-9);
        // The field ends half a cell beyond the border.
        assert!((field([-0.25, 0.0, 0.0])).abs() < 1e-9 && field([-0.6, 0.0, 0.0]).is_nan());
        // A volume of other dimensions keeps its placement.
        let field = volume.field_in([5, 5, 5], &frame);
        assert!(field([0.0; 3]).is_nan(), "(7, 7, 7) is outside");
    }
}
