//! The placement of the samples of a volume in the world.
//!
//! # Theory
//!
//! The position of sample (i, j, k) is origin + D * (spacing * (i, j, k)). The columns of D are linearly independent unit
//! vectors: a rotation, a reflection, or sheared, as for the cells of crystals and tilted gantries.
//!
//! The voxel frame has perpendicular axes and cells that are at most [`MAX_CELL_SIZE`] times as long along one axis as along
//! another, so the world is its affine image if it is sheared or a spacing is longer. Topology is the same in both. Tolerances
//! and radius ratios hold in the voxel frame, whose cells, and so the cost of a sweep, follow the samples and not the spacing;
//! a length there is [`Placement::stretch`] times as long in the world. Areas and volumes are measured in the world.

use std::fmt;

use serde::{Deserialize, Serialize};

/// Smallest and largest spacing, and largest coordinate of an origin: within these, positions and areas in the world are
/// normal numbers in the f32 of exported meshes.
const MIN_SPACING: f64 = 1e-15;
const MAX_SPACING: f64 = 1e15;

/// Length of a cell of the voxel frame along an axis, at most; the shortest is 1. A sweep costs up to 1.5 times as much with cells
/// of 1 x 1 x 1.5 as with cubes, and up to twice as much with 1 x 1 x 2 (`docs/decisions/0015-voxel-frame.md`).
const MAX_CELL_SIZE: f64 = 1.5;

/// Largest deviation of the squared length of a direction from 1, and largest cosine between perpendicular directions.
const DIRECTION_TOLERANCE: f64 = 1e-3;

/// Smallest volume that the three directions may span.
const MIN_SPAN: f64 = 1e-3;

/// The unit of lengths in the world.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
#[non_exhaustive]
pub enum Unit {
    /// Unknown.
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
    /// The unit of a name or symbol in a file.
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

    /// Its length in millimetres.
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

/// The meaning of the axes of the world.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "UPPERCASE")]
#[non_exhaustive]
pub enum Space {
    /// Unknown.
    #[default]
    Unknown,
    /// A patient's left, posterior, superior, in millimetres, as in DICOM and ITK.
    Lps,
    /// A patient's right, anterior, superior, in millimetres, as in NIfTI and 3D Slicer.
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

/// The placement of samples in the world.
///
/// ```
/// use isospectrum::Placement;
///
/// let placement = Placement { origin: [10.0, 0.0, 0.0], spacing: [0.5, 0.5, 2.0], ..Placement::default() };
/// // The voxel frame is that of meshes. Its unit is the smallest spacing; cells are at most 1.5 units long.
/// assert_eq!(placement.voxel_of_world([10.0, 1.0, 2.0]), [0.0, 2.0, 1.5]);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Placement {
    /// World position of sample (0, 0, 0).
    pub origin: [f64; 3],
    /// Distance between samples along x, y, z; positive.
    pub spacing: [f64; 3],
    /// Unit direction of each grid axis in the world; `direction[a]` is that of axis `a`. They need not be perpendicular.
    pub direction: [[f64; 3]; 3],
    /// Unit of origin and spacing; millimetres in the space of a patient.
    pub unit: Unit,
    /// The meaning of the axes of the world.
    pub space: Space,
}

impl Placement {
    /// The world equals the index frame; unit and space are unknown.
    pub const IDENTITY: Placement = Placement {
        origin: [0.0; 3],
        spacing: [1.0; 3],
        direction: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        unit: Unit::Unknown,
        space: Space::Unknown,
    };

    /// The placement with the given vectors from a sample to the next along each axis. [`Placement::check`] rejects vectors
    /// of length 0.
    pub fn from_steps(origin: [f64; 3], steps: [[f64; 3]; 3]) -> Self {
        let spacing = steps.map(|[x, y, z]| x.hypot(y).hypot(z));
        let direction = std::array::from_fn(|a| steps[a].map(|x| x / spacing[a]));
        Placement { origin, spacing, direction, ..Placement::IDENTITY }
    }

    /// The same placement with positive spacings: an axis of negative spacing has the opposite direction.
    pub(crate) fn with_positive_spacing(mut self) -> Self {
        for (spacing, direction) in self.spacing.iter_mut().zip(&mut self.direction) {
            if *spacing < 0.0 {
                *spacing = -*spacing;
                *direction = direction.map(|x| -x);
            }
        }
        self
    }

    /// The same placement in the space of a patient: in millimetres, converted if the unit is known.
    pub fn of_patient(mut self, space: Space) -> Self {
        let mm = self.unit.in_mm().unwrap_or(1.0);
        if mm != 1.0 {
            self.origin = self.origin.map(|x| x * mm);
            self.spacing = self.spacing.map(|s| s * mm);
        }
        Placement { unit: Unit::Mm, space, ..self }
    }

    /// Checks that a grid may have this placement.
    ///
    /// # Errors
    ///
    /// A description: a number that is not finite or too large, a spacing that is not positive or extreme, directions
    /// that are not of unit length to within 1e-3 or (nearly) in a plane. Left-handed and sheared frames are valid.
    pub fn check(&self) -> Result<(), String> {
        if self.spacing.iter().any(|s| !(MIN_SPACING..=MAX_SPACING).contains(s)) {
            return Err(format!(
                "spacing {:?}, expected positive numbers from {:e} to {:e}",
                self.spacing, MIN_SPACING, MAX_SPACING
            ));
        }
        if self.origin.iter().any(|x| !(-MAX_SPACING..=MAX_SPACING).contains(x)) {
            return Err(format!(
                "origin {:?}, expected finite numbers up to {:e}",
                self.origin, MAX_SPACING
            ));
        }
        let is_unit = |u: &[f64; 3]| (dot(*u, *u) - 1.0).abs() <= DIRECTION_TOLERANCE;
        if !self.direction.iter().all(is_unit) || self.span().abs() < MIN_SPAN {
            return Err(format!(
                "axis directions {:?}, expected linearly independent unit vectors",
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

    /// Size of a cell in the voxel frame: spacing over the smallest spacing, at most 1.5.
    pub fn cell_size(&self) -> [f64; 3] {
        let voxel = self.voxel();
        self.spacing.map(|s| (s / voxel).min(MAX_CELL_SIZE))
    }

    /// World lengths of the unit vectors of the voxel frame: the smallest spacing, more along axes whose cells would be longer
    /// than [`MAX_CELL_SIZE`].
    fn units(&self) -> [f64; 3] {
        let voxel = self.voxel();
        self.spacing.map(|s| if s / voxel > MAX_CELL_SIZE { s / MAX_CELL_SIZE } else { voxel })
    }

    /// The unit vectors of the voxel frame in the axes of the world, in smallest spacings: [`Placement::direction`], longer along
    /// axes whose spacing is more than 1.5 times the smallest.
    pub fn axes(&self) -> [[f64; 3]; 3] {
        let (units, voxel) = (self.units(), self.voxel());
        std::array::from_fn(|a| self.direction[a].map(|x| x * (units[a] / voxel)))
    }

    /// The volume of a cube of the voxel frame in the world: the unit of volumes in the voxel frame.
    pub fn voxel_volume(&self) -> f64 {
        let [x, y, z] = self.axes();
        self.voxel().powi(3) * dot(x, cross(y, z)).abs()
    }

    /// World position of a point of the index frame.
    pub fn world(&self, index: [f64; 3]) -> [f64; 3] {
        let along = |a: usize| self.spacing[a] * index[a];
        self.plus_origin(self.rotate([along(0), along(1), along(2)]))
    }

    /// World position of a point of the voxel frame.
    pub fn world_of_voxel(&self, p: [f32; 3]) -> [f64; 3] {
        self.plus_origin(self.around_origin(p))
    }

    /// As [`Placement::world_of_voxel`], relative to the origin.
    pub fn around_origin(&self, p: [f32; 3]) -> [f64; 3] {
        let units = self.units();
        self.rotate(std::array::from_fn(|a| units[a] * f64::from(p[a])))
    }

    /// Point of the voxel frame at a world position, the inverse of [`Placement::world_of_voxel`].
    pub fn voxel_of_world(&self, p: [f64; 3]) -> [f64; 3] {
        let [a, b, c] = self.direction;
        let from_origin: [f64; 3] = std::array::from_fn(|i| p[i] - self.origin[i]);
        let (span, units) = (self.span(), self.units());
        let normals = [cross(b, c), cross(c, a), cross(a, b)];
        std::array::from_fn(|a| dot(normals[a], from_origin) / (span * units[a]))
    }

    /// Unit normal in the world of a surface with normal `n` in the voxel frame, by the inverse transpose of the axes.
    /// A zero vector stays.
    pub fn normal(&self, n: [f32; 3]) -> [f32; 3] {
        self.normals()(n)
    }

    /// [`Placement::normal`] as a function, for many normals.
    pub fn normals(&self) -> impl Fn([f32; 3]) -> [f32; 3] {
        let [a, b, c] = self.direction;
        let side = self.span().signum();
        let (units, voxel) = (self.units(), self.voxel());
        let normals = [cross(b, c), cross(c, a), cross(a, b)];
        let inverse: [[f64; 3]; 3] =
            std::array::from_fn(|a| normals[a].map(|x| x * (voxel / units[a])));
        move |n| {
            let along = |i: usize, a: usize| side * inverse[a][i] * f64::from(n[a]);
            let turned: [f64; 3] = std::array::from_fn(|i| (0..3).map(|a| along(i, a)).sum());
            let length = dot(turned, turned).sqrt();
            if length > 0.0 { turned.map(|x| (x / length) as f32) } else { n }
        }
    }

    /// Volume that the directions span (their determinant): 1 or -1 if they are perpendicular, negative if left-handed.
    pub fn span(&self) -> f64 {
        let [a, b, c] = self.direction;
        dot(a, cross(b, c))
    }

    /// Whether a spacing is so long that cells of the voxel frame are shortened along it.
    pub fn is_stretched(&self) -> bool {
        self.spacing.iter().any(|s| s / self.voxel() > MAX_CELL_SIZE)
    }

    /// Whether the axes are not perpendicular, to within 1e-3.
    pub fn is_sheared(&self) -> bool {
        let [a, b, c] = self.direction;
        [dot(a, b), dot(b, c), dot(c, a)].iter().any(|cosine| cosine.abs() > DIRECTION_TOLERANCE)
    }

    /// Smallest and largest factor by which lengths grow from the voxel frame to the world, where they are counted in smallest
    /// spacings: the singular values of [`Placement::axes`]. Both are 1 unless the axes are sheared or a spacing is more than
    /// 1.5 times the smallest.
    pub fn stretch(&self) -> (f64, f64) {
        let axes = glam::DMat3::from_cols_array_2d(&self.axes());
        let (low, high) = symmetric_eigenvalues(axes.transpose() * axes);
        (low.max(0.0).sqrt(), high.sqrt())
    }

    fn rotate(&self, p: [f64; 3]) -> [f64; 3] {
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

/// Smallest and largest eigenvalue of a symmetric matrix (Smith 1961, trigonometric solution).
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
    fn a_point_of_the_voxel_frame_survives_the_round_trip_through_the_world() {
        for mirrored in [1.0, -1.0] {
            let mut p = hexagonal();
            p.direction[2][2] *= mirrored;
            let again = p.voxel_of_world(p.world_of_voxel([3.0, -4.5, 5.25]));
            assert!((0..3).all(|a| (again[a] - [3.0, -4.5, 5.25][a]).abs() < 1e-12), "{again:?}");
        }
    }

    #[test]
    fn normals_stay_perpendicular_to_their_plane() {
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
        let (low, high) = Placement { spacing: [2.0; 3], ..hexagonal() }.stretch();
        // The matrix of scalar products has the eigenvalues 1 - 1/2, 1 and 1 + 1/2.
        assert!((low - 0.5f64.sqrt()).abs() < 1e-12 && (high - 1.5f64.sqrt()).abs() < 1e-12);
        assert!((hexagonal().span() - 0.75f64.sqrt()).abs() < 1e-12);
        assert_eq!(Placement::default().stretch(), (1.0, 1.0));
    }

    #[test]
    fn a_long_spacing_stretches_the_world_and_not_the_voxel_frame() {
        let p = Placement { spacing: [0.5, 0.5, 15.0], ..Placement::default() };
        assert!(p.is_stretched());
        assert_eq!(p.cell_size(), [1.0, 1.0, 1.5]);
        assert_eq!(p.world_of_voxel([3.0, 2.0, 3.0]), p.world([3.0, 2.0, 2.0]));
        assert_eq!(p.voxel_of_world(p.world([3.0, 2.0, 2.0])), [3.0, 2.0, 3.0]);
        let (low, high) = p.stretch();
        assert!((low - 1.0).abs() < 1e-12 && (high - 20.0).abs() < 1e-12, "{low} {high}");
        // A unit along z is 10 in the world.
        assert!((p.voxel_volume() - 0.5 * 0.5 * 10.0).abs() < 1e-12);
        // The plane x + z = 0 of the voxel frame is 2 x + z / 10 = 0 in the world.
        let [x, y, z] = p.normal([1.0, 0.0, 1.0]).map(f64::from);
        assert!(y == 0.0 && (x / z - 20.0).abs() < 1e-5, "{x} {z}");
        // None is more than 1.5 times the smallest.
        let p = Placement { spacing: [0.7, 1.0, 0.9], ..Placement::default() };
        assert!(!p.is_stretched() && p.axes() == Placement::IDENTITY.direction);
    }

    #[test]
    fn invalid_frames_are_rejected() {
        let with = |direction| Placement { direction, ..Placement::default() };
        let x = [1.0, 0.0, 0.0];
        for direction in [
            [x, x, [0.0, 0.0, 1.0]],
            [x, [0.0, 1.0, 0.0], [0.6, 0.8, 0.0]],
            [x, [0.0, 1.0, 0.0], [0.0, 0.0, 2.0]],
            [x, [0.0, 1.0, 0.0], [0.0, 0.0, f64::NAN]],
        ] {
            let message = with(direction).check().expect_err("no frame");
            assert!(message.contains("axis directions"), "{message}");
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
