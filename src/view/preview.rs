//! The isosurface that is shown until the spectrum of a volume is there: the exact one of one isovalue.

use crate::error::Result;
use crate::extract::extract;
use crate::forecast::crossings;
use crate::spectrum::{About, Knot, Patch, Spectrum, Triangle};
use crate::topology::exact::ExactField;
use crate::volume::{Outside, Volume};

/// Most lattice edges that the isosurface of a preview crosses: about half of its triangles.
const MAX_CROSSINGS: u64 = 1_000_000;

/// A spectrum of the isovalue in the middle of the range; `None` if its surface would be too large.
pub(super) fn preview(volume: &Volume) -> Result<Option<Spectrum>> {
    let (low, high) = volume.range();
    let isovalue = 0.5 * low + 0.5 * high;
    let field = ExactField::new(volume)?;
    if crossings(&field, &[isovalue], true)[0] > MAX_CROSSINGS {
        return Ok(None);
    }
    let surface = extract(&field, isovalue);
    let triangles = surface.faces.iter().zip(&surface.caps).map(|(&[a, b, c], &cap)| {
        // Counter-clockwise seen from the outer side.
        let vertices = match volume.outside() {
            Outside::Low => [a, b, c],
            Outside::High => [a, c, b],
        };
        Triangle { vertices, birth: 0, death: 1, cap }
    });
    // The second isovalue only ends the lifetimes.
    let patch = Patch {
        isovalues: vec![isovalue, isovalue.next_up()],
        first_knot: (0..=surface.positions.len() as u32).map(|v| 2 * v).collect(),
        knots: surface
            .positions
            .iter()
            .flat_map(|&position| [0, 1].map(|rank| Knot { rank, position }))
            .collect(),
        triangles: triangles.collect(),
        collapses: Vec::new(),
    };
    let about = About::new(volume.info(), (isovalue, isovalue), 0.0);
    Spectrum::new(about, patch).map(Some)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spectrum::Measures;
    use crate::volume::phantom;

    #[test]
    fn a_preview_is_the_closed_isosurface_in_the_middle_of_the_range() {
        let volume = phantom("sphere:16").expect("a phantom");
        let (low, high) = volume.range();
        for outside in [Outside::Low, Outside::High] {
            let volume = volume.clone().with_outside(outside);
            let spectrum = preview(&volume).expect("valid").expect("small");
            let middle = 0.5 * low + 0.5 * high;
            assert_eq!(spectrum.range(), (middle, middle));
            let measures = Measures::of(&spectrum.mesh_at(middle).expect("in the range"));
            assert!(measures.volume > 10.0, "{outside:?}: the outer side is outside: {measures:?}");
        }
    }
}
