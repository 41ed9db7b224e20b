//! The contour spectrum: properties of the isosurface as functions of the isovalue.

use isospectrum::Progress;
use isospectrum::unstable::extract::extract;
use isospectrum::unstable::topology::Topology;
use isospectrum::unstable::topology::exact::ExactField;
use isospectrum::{Error, Result};
use serde::Serialize;

/// One point of the curves.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub(super) struct Curve {
    /// The isovalue.
    pub(super) isovalue: f64,
    /// Components of the closed isosurface: Betti number 0, and 2.
    pub(super) components: usize,
    /// Handles, over all components: half of Betti number 1.
    pub(super) handles: i64,
    /// Euler characteristic.
    pub(super) euler: i64,
    /// Area without the caps at the border and beyond a mask, squares of the unit of the report.
    pub(super) area: f64,
    /// Volume enclosed by the isosurface and its caps, cubes of the unit of the report.
    pub(super) enclosed_volume: f64,
}

/// Samples the curves at `n` isovalues, at least two, evenly from one end of the range to the other.
///
/// Components and Euler characteristic are exact; area and volume are those of the mesh that is
/// extracted from the volume at the isovalue.
pub(super) fn sample(
    field: &ExactField<'_>,
    topology: &Topology,
    (low, high): (f64, f64),
    n: usize,
    progress: &dyn Progress,
) -> Result<Vec<Curve>> {
    let placement = field.volume().placement();
    let mut curves = Vec::with_capacity(n);
    for i in 0..n {
        if progress.cancelled() {
            return Err(Error::Interrupted);
        }
        progress.report(i as f64 / n as f64, "curves");
        let share = i as f64 / (n - 1) as f64;
        let isovalue = (low * (1.0 - share) + high * share).clamp(low, high);
        let mesh = extract(field, isovalue);
        let place = |v: u32| placement.around_origin(mesh.positions[v as usize]);
        let corners = |t: &[u32; 3]| t.map(place);
        let is_masked_out = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|v| mesh.positions[v as usize].map(f64::from));
            field.volume().is_masked_out([0, 1, 2].map(|i| (a[i] + b[i] + c[i]) / 3.0))
        };
        let uncapped = mesh.faces.iter().zip(&mesh.caps);
        let uncapped = uncapped.filter(|&(t, &cap)| !(cap || is_masked_out(t)));
        let area: f64 = uncapped.map(|(t, _)| area(corners(t))).sum();
        let enclosed: f64 = mesh.faces.iter().map(|t| signed_volume(corners(t))).sum();
        let components = topology.n_components_at(isovalue) as usize;
        let euler = topology.euler_at(isovalue);
        curves.push(Curve {
            isovalue,
            components,
            handles: components as i64 - euler / 2,
            euler,
            area,
            enclosed_volume: enclosed * placement.span().signum(),
        });
    }
    Ok(curves)
}

type Point = [f64; 3];

fn cross(a: Point, b: Point) -> Point {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn dot(a: Point, b: Point) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn area([a, b, c]: [Point; 3]) -> f64 {
    let minus = |p: Point| std::array::from_fn(|i| p[i] - a[i]);
    let n = cross(minus(b), minus(c));
    0.5 * dot(n, n).sqrt()
}

/// Returns the volume of the tetrahedron between a triangle and the origin; the sum over a closed mesh is the enclosed volume.
fn signed_volume([a, b, c]: [Point; 3]) -> f64 {
    dot(a, cross(b, c)) / 6.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn area_and_volume_of_a_tetrahedron_do_not_depend_on_its_position() {
        let at = |x: f64, y: f64, z: f64| [x + 5.0, y - 3.0, z + 2.0];
        let p = [at(0.0, 0.0, 0.0), at(1.0, 0.0, 0.0), at(0.0, 1.0, 0.0), at(0.0, 0.0, 1.0)];
        let faces = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]].map(|f| f.map(|v: usize| p[v]));
        let total: f64 = faces.iter().map(|&f| signed_volume(f)).sum();
        let areas: f64 = faces.iter().map(|&f| area(f)).sum();
        assert!((total - 1.0 / 6.0).abs() < 1e-12);
        assert!((areas - (1.5 + 0.75f64.sqrt())).abs() < 1e-12);
    }
}
