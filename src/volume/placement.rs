//! Where the samples of a volume lie in the world.
//!
//! # Theory
//!
//! Sample (i, j, k) lies at origin + D * (spacing * (i, j, k)). The columns of D are unit vectors and any three that
//! span space: a right-handed rotation, a mirror image, or sheared, as the cells of crystals and tilted gantries are.
//!
//! The voxel frame takes the axes as perpendicular, so a sheared world is its affine image. Topology is the same in both.
//! Tolerances and radius ratios hold in the voxel frame; a length there is [`Placement::stretch`] times as long in
//! the world, where the spacing is one and the same, and areas and volumes are measured in the world.

use std::fmt;

use serde::{Deserialize, Serialize};

/// Spacings from the first to the second, and origins up to the second: with them all positions of the world frame,
/// and areas there, are normal numbers in the f32 of exported meshes.
const SPACINGS: (f64, f64) = (1e-15, 1e15);

/// How far the lengths of directions may be from 1, and the cosines between those that count as perpendicular.
const OFF: f64 = 1e-3;

/// Least volume that three directions may span.
const LEAST_SPAN: f64 = 1e-3;

/// What lengths of the world are measured in.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
#[non_exhaustive]
pub enum Unit {
    /// Not told.
    #[default]
    Unknown,
    /// Metres.
    M,
    /// Centimetres.
    Cm,
    /// Millimetres.
    Mm,
    /// Micrometres.
    Um,
    /// Nanometres.
    Nm,
    /// 0.1 nanometres.
    Angstrom,
}

impl Unit {
    /// The unit behind a name or a sign, as files spell it.
    pub fn from_name(name: &str) -> Option<Unit> {
        Some(match name.trim().to_lowercase().as_str() {
            "m" | "metre" | "meter" | "metres" | "meters" => Unit::M,
            "cm" | "centimetre" | "centimeter" => Unit::Cm,
            "mm" | "millimetre" | "millimeter" | "millimetres" | "millimeters" => Unit::Mm,
            "um" | "µm" | "μm" | "\\u00b5m" | "micron" | "microns" | "micrometre"
            | "micrometer" => Unit::Um,
            "nm" | "nanometre" | "nanometer" => Unit::Nm,
            "å" | "angstrom" | "angstroms" | "ångström" => Unit::Angstrom,
            _ => return None,
        })
    }

    /// How many millimetres it is long.
    pub fn in_mm(self) -> Option<f64> {
        Some(match self {
            Unit::Unknown => return None,
            Unit::M => 1e3,
            Unit::Cm => 1e1,
            Unit::Mm => 1.0,
            Unit::Um => 1e-3,
            Unit::Nm => 1e-6,
            Unit::Angstrom => 1e-7,
        })
    }
}

impl fmt::Display for Unit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Unit::Unknown => "world unit",
            Unit::M => "m",
            Unit::Cm => "cm",
            Unit::Mm => "mm",
            Unit::Um => "um",
            Unit::Nm => "nm",
            Unit::Angstrom => "angstrom",
        })
    }
}

/// What the axes of the world mean.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "UPPERCASE")]
#[non_exhaustive]
pub enum Space {
    /// Nothing that is known.
    #[default]
    Unknown,
    /// A patient's left, posterior, superior; in millimetres. So DICOM and ITK.
    Lps,
    /// A patient's right, anterior, superior; in millimetres. So NIfTI and 3D Slicer.
    Ras,
}

impl fmt::Display for Space {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Space::Unknown => "unknown",
            Space::Lps => "LPS",
            Space::Ras => "RAS",
        })
    }
}

/// Where the samples lie in the world.
///
/// ```
/// use isospectrum::Placement;
///
/// let placement = Placement { origin: [10.0, 0.0, 0.0], spacing: [0.5, 0.5, 2.0], ..Placement::default() };
/// // The voxel frame is that of meshes; its unit is the smallest spacing.
/// assert_eq!(placement.voxel_of_world([10.0, 1.0, 2.0]), [0.0, 2.0, 4.0]);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Placement {
    /// World position of sample (0, 0, 0).
    pub origin: [f64; 3],
    /// Distance between samples along x, y, z; positive.
    pub spacing: [f64; 3],
    /// Unit direction of each grid axis in the world; `direction[a]` is that of axis `a`. They need not be perpendicular.
    pub direction: [[f64; 3]; 3],
    /// What origin and spacing are measured in; millimetres wherever the space is that of a patient.
    #[serde(default)]
    pub unit: Unit,
    /// What the axes of the world mean.
    #[serde(default)]
    pub space: Space,
}

impl Placement {
    /// A world that is the index frame, of no unit and no space.
    pub const IDENTITY: Placement = Placement {
        origin: [0.0; 3],
        spacing: [1.0; 3],
        direction: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        unit: Unit::Unknown,
        space: Space::Unknown,
    };

    /// The placement with the vectors from a sample to the next along each axis. One of no length is left to
    /// [`Placement::check`].
    pub fn from_steps(origin: [f64; 3], steps: [[f64; 3]; 3]) -> Self {
        let spacing = steps.map(|[x, y, z]| x.hypot(y).hypot(z));
        let direction = std::array::from_fn(|a| steps[a].map(|x| x / spacing[a]));
        Placement { origin, spacing, direction, ..Placement::IDENTITY }
    }

    /// The same place, told in millimetres where the unit is known: what the spaces of patients are in.
    pub fn of_patient(mut self, space: Space) -> Self {
        let mm = self.unit.in_mm().unwrap_or(1.0);
        if mm != 1.0 {
            self.origin = self.origin.map(|x| x * mm);
            self.spacing = self.spacing.map(|s| s * mm);
        }
        Placement { unit: Unit::Mm, space, ..self }
    }

    /// Whether this is a frame that a grid may have.
    ///
    /// # Errors
    ///
    /// What is wrong: a number that is not finite or too large, a spacing that is not positive or extreme, directions
    /// that are not of unit length to within 1e-3 or lie (nearly) in a plane. Left-handed and sheared frames are fine.
    pub fn check(&self) -> Result<(), String> {
        if self.spacing.iter().any(|s| !(SPACINGS.0..=SPACINGS.1).contains(s)) {
            return Err(format!(
                "spacing {:?}, expected positive numbers from {:e} to {:e}",
                self.spacing, SPACINGS.0, SPACINGS.1
            ));
        }
        if self.origin.iter().any(|x| !(-SPACINGS.1..=SPACINGS.1).contains(x)) {
            return Err(format!(
                "origin {:?}, expected finite numbers up to {:e}",
                self.origin, SPACINGS.1
            ));
        }
        let is_unit = |u: &[f64; 3]| (dot(*u, *u) - 1.0).abs() <= OFF;
        if !self.direction.iter().all(is_unit) || self.span().abs() < LEAST_SPAN {
            return Err(format!(
                "axis directions {:?}, expected unit vectors that do not lie in a plane",
                self.direction
            ));
        }
        Ok(())
    }

    /// The smallest spacing: the length of a voxel.
    pub fn voxel(&self) -> f64 {
        let [x, y, z] = self.spacing;
        x.min(y).min(z)
    }

    /// The volume of a voxel in the world: what volumes of the voxel frame are counted in.
    pub fn voxel_volume(&self) -> f64 {
        self.voxel().powi(3) * self.span().abs()
    }

    /// World position of a point of the index frame.
    pub fn world(&self, index: [f64; 3]) -> [f64; 3] {
        let along = |a: usize| self.spacing[a] * index[a];
        self.plus_origin(self.turned([along(0), along(1), along(2)]))
    }

    /// World position of a point of the voxel frame.
    pub fn world_of_voxel(&self, p: [f32; 3]) -> [f64; 3] {
        self.plus_origin(self.around_origin(p))
    }

    /// As [`Placement::world_of_voxel`], less the origin.
    pub fn around_origin(&self, p: [f32; 3]) -> [f64; 3] {
        let voxel = self.voxel();
        self.turned(p.map(|x| voxel * f64::from(x)))
    }

    /// Point of the voxel frame at a world position, the inverse of [`Placement::world_of_voxel`].
    pub fn voxel_of_world(&self, p: [f64; 3]) -> [f64; 3] {
        let [a, b, c] = self.direction;
        let from_origin: [f64; 3] = std::array::from_fn(|i| p[i] - self.origin[i]);
        let scale = self.span() * self.voxel();
        [cross(b, c), cross(c, a), cross(a, b)].map(|normal| dot(normal, from_origin) / scale)
    }

    /// Unit normal, in the world, of a surface with a normal of the voxel frame. It turns as what is perpendicular to it
    /// requires, which is the inverse transpose of the directions. A normal of no length stays.
    pub fn normal(&self, n: [f32; 3]) -> [f32; 3] {
        self.normals()(n)
    }

    /// As [`Placement::normal`], for many: what does not depend on the normal is found once.
    pub fn normals(&self) -> impl Fn([f32; 3]) -> [f32; 3] {
        let [a, b, c] = self.direction;
        let side = self.span().signum();
        let inverse = [cross(b, c), cross(c, a), cross(a, b)];
        move |n| {
            let along = |i: usize, a: usize| side * inverse[a][i] * f64::from(n[a]);
            let turned: [f64; 3] = std::array::from_fn(|i| (0..3).map(|a| along(i, a)).sum());
            let length = dot(turned, turned).sqrt();
            if length > 0.0 { turned.map(|x| (x / length) as f32) } else { n }
        }
    }

    /// Volume that the directions span: 1 where they are perpendicular, below 0 where they are left-handed.
    pub fn span(&self) -> f64 {
        let [a, b, c] = self.direction;
        dot(a, cross(b, c))
    }

    /// Whether the axes are not perpendicular, to within 1e-3.
    pub fn is_sheared(&self) -> bool {
        let [a, b, c] = self.direction;
        [dot(a, b), dot(b, c), dot(c, a)].iter().any(|cosine| cosine.abs() > OFF)
    }

    /// The least and the largest length in the world of what is a spacing long in the voxel frame, in spacings. Both are 1
    /// unless the axes are sheared: they are the singular values of the directions.
    pub fn stretch(&self) -> (f64, f64) {
        let directions = glam::DMat3::from_cols_array_2d(&self.direction);
        let (low, high) = symmetric_eigenvalues(directions.transpose() * directions);
        (low.max(0.0).sqrt(), high.sqrt())
    }

    fn turned(&self, p: [f64; 3]) -> [f64; 3] {
        std::array::from_fn(|i| {
            let along = |a: usize| self.direction[a][i] * p[a];
            along(0) + along(1) + along(2)
        })
    }

    fn plus_origin(&self, p: [f64; 3]) -> [f64; 3] {
        std::array::from_fn(|i| self.origin[i] + p[i])
    }
}

impl Default for Placement {
    fn default() -> Self {
        Placement::IDENTITY
    }
}

pub(super) fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub(super) fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// Least and largest eigenvalue of a symmetric matrix, by the cosines of a third of an angle (Smith 1961).
fn symmetric_eigenvalues(m: glam::DMat3) -> (f64, f64) {
    let mean = (m.x_axis.x + m.y_axis.y + m.z_axis.z) / 3.0;
    let off = m - glam::DMat3::from_diagonal(glam::DVec3::splat(mean));
    let square: f64 = off.to_cols_array().iter().map(|x| x * x).sum();
    let p = (square / 6.0).sqrt();
    if p < f64::MIN_POSITIVE {
        return (mean, mean);
    }
    let angle = ((off * (1.0 / p)).determinant() / 2.0).clamp(-1.0, 1.0).acos() / 3.0;
    let third = 2.0 * std::f64::consts::FRAC_PI_3;
    (mean + 2.0 * p * (angle + third).cos(), mean + 2.0 * p * angle.cos())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Axes at 60 degrees in a plane, the third upright.
    fn hexagonal() -> Placement {
        let s = 0.75f64.sqrt();
        Placement::from_steps(
            [1.0, 2.0, 3.0],
            [[2.0, 0.0, 0.0], [1.0, 2.0 * s, 0.0], [0.0, 0.0, 5.0]],
        )
    }

    #[test]
    fn steps_become_spacing_and_directions_and_lead_to_the_samples() {
        let p = hexagonal();
        assert!(p.check().is_ok() && p.is_sheared());
        assert_eq!(p.spacing.map(|s| (s * 1e12).round() / 1e12), [2.0, 2.0, 5.0]);
        let corner = p.world([1.0, 2.0, 3.0]);
        let expected = [1.0 + 2.0 + 2.0, 2.0 + 4.0 * 0.75f64.sqrt(), 18.0];
        assert!((0..3).all(|i| (corner[i] - expected[i]).abs() < 1e-12), "{corner:?}");
        assert!(!Placement::default().is_sheared());
    }

    #[test]
    fn a_point_of_the_voxel_frame_is_found_again() {
        for mirrored in [1.0, -1.0] {
            let mut p = hexagonal();
            p.direction[2][2] *= mirrored;
            let again = p.voxel_of_world(p.world_of_voxel([3.0, -4.5, 5.25]));
            assert!((0..3).all(|a| (again[a] - [3.0, -4.5, 5.25][a]).abs() < 1e-12), "{again:?}");
        }
    }

    #[test]
    fn normals_stay_perpendicular_to_what_they_were_perpendicular_to() {
        for mirrored in [1.0, -1.0] {
            let mut p = hexagonal();
            p.direction[2][2] *= mirrored;
            // The plane of the voxel frame through its second and third axis.
            let n = p.normal([1.0, 0.0, 0.0]).map(f64::from);
            assert!(dot(n, p.direction[1]).abs() < 1e-7 && dot(n, p.direction[2]).abs() < 1e-7);
            assert!(dot(n, p.direction[0]) > 0.8, "{n:?}");
        }
    }

    #[test]
    fn stretch_and_span_are_those_of_axes_at_60_degrees() {
        let (low, high) = hexagonal().stretch();
        // The matrix of scalar products has the eigenvalues 1 - 1/2, 1 and 1 + 1/2.
        assert!((low - 0.5f64.sqrt()).abs() < 1e-12 && (high - 1.5f64.sqrt()).abs() < 1e-12);
        assert!((hexagonal().span() - 0.75f64.sqrt()).abs() < 1e-12);
        assert_eq!(Placement::default().stretch(), (1.0, 1.0));
    }

    #[test]
    fn frames_that_no_grid_has_are_refused() {
        let with = |direction| Placement { direction, ..Placement::default() };
        let x = [1.0, 0.0, 0.0];
        for direction in [
            [x, x, [0.0, 0.0, 1.0]],
            [x, [0.0, 1.0, 0.0], [0.6, 0.8, 0.0]],
            [x, [0.0, 1.0, 0.0], [0.0, 0.0, 2.0]],
            [x, [0.0, 1.0, 0.0], [0.0, 0.0, f64::NAN]],
        ] {
            let said = with(direction).check().expect_err("no frame");
            assert!(said.contains("axis directions"), "{said}");
        }
        let flat = Placement::from_steps([0.0; 3], [x, [0.0; 3], [0.0, 0.0, 1.0]]);
        assert!(flat.check().expect_err("no step").contains("spacing"));
    }

    #[test]
    fn the_space_of_a_patient_is_in_millimetres() {
        let micro = Placement { unit: Unit::Um, origin: [5.0; 3], ..Placement::default() };
        let placed = micro.of_patient(Space::Ras);
        assert_eq!((placed.unit, placed.space), (Unit::Mm, Space::Ras));
        assert_eq!((placed.origin, placed.spacing), ([0.005; 3], [0.001; 3]));
    }
}
