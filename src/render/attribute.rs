//! The number each active triangle is coloured by.
//!
//! # Theory
//!
//! The *radius ratio* is 2r/R, inradius over circumradius ([`radius_ratio`]).
//!
//! The *mean curvature* is half the divergence of the unit normal field. Over a triangle the
//! normals are interpolated linearly, so it is half the sum over the corners of the gradient of
//! the corner's barycentric coordinate times the corner's normal. Normals point to lower values:
//! a ball of high values with radius r has mean curvature 1/r, a saddle about 0.

use glam::DVec3;
use rayon::prelude::*;

use super::layout::Palette;
use crate::error::{Error, Result};
use crate::mesh::radius_ratio;
use crate::spectrum::{Components, Spectrum, SurfaceMesh, Triangle};

/// What the colour of a triangle shows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Color {
    /// Nothing: one colour for each side.
    #[default]
    None,
    /// Radius ratio 2r/R, 0 to 1.
    Quality,
    /// Length of the triangle's lifetime as a share of the spectrum's range, 0 to 1.
    Lifetime,
    /// Mean curvature, 1/voxel, positive where the surface bulges towards lower values; by the mesh's normals,
    /// which lean towards larger triangles (by a sixth of it on a sphere of triangles that differ in size).
    Curvature,
    /// Connected component of the closed mesh, in the order of [`Components`]: the largest first.
    Component,
    /// Direction of the normal along the volume's axes: x red, y green, z blue, lighter towards
    /// larger coordinates.
    Normal,
}

impl Color {
    /// Every colour, in the order of the documentation.
    pub const ALL: [Color; 6] = [
        Color::None,
        Color::Quality,
        Color::Lifetime,
        Color::Curvature,
        Color::Component,
        Color::Normal,
    ];

    /// The name as flags spell it.
    pub fn name(self) -> &'static str {
        match self {
            Color::None => "none",
            Color::Quality => "quality",
            Color::Lifetime => "lifetime",
            Color::Curvature => "curvature",
            Color::Component => "component",
            Color::Normal => "normal",
        }
    }

    /// How the shader shows it.
    pub(super) fn palette(self) -> Palette {
        match self {
            Color::None => Palette::Plain,
            Color::Quality | Color::Lifetime => Palette::Ramp,
            Color::Curvature => Palette::Balance,
            Color::Component => Palette::Names,
            Color::Normal => Palette::Normals,
        }
    }
}

impl std::str::FromStr for Color {
    type Err = Error;

    /// Reads the name as flags spell it.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`] for any other text.
    fn from_str(text: &str) -> Result<Self> {
        Color::ALL.into_iter().find(|color| color.name() == text).ok_or_else(|| {
            let names = Color::ALL.map(Color::name).join(", ");
            Error::Usage(format!("color '{text}', expected one of {names}"))
        })
    }
}

/// The attributes of the active triangles, on the scale of the palette.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Attributes {
    /// One number per active triangle.
    pub(super) values: Vec<f32>,
    /// What the two ends of the palette stand for; none where there is no scale.
    pub(super) ends: Option<(f64, f64)>,
}

/// The attributes of the triangles `active` (indices into the spectrum's), which are those of `mesh` in turn. The
/// largest curvature the palette shows is `largest_curvature`, or is found from the mesh.
pub(super) fn attributes(
    spectrum: &Spectrum,
    (active, mesh): (&[u32], &SurfaceMesh),
    color: Color,
    largest_curvature: Option<f64>,
) -> Attributes {
    let of_corners = |corners: &[u32; 3], of: &[[f32; 3]]| corners.map(|v| vector(of[v as usize]));
    match color {
        Color::None | Color::Normal => Attributes { values: vec![0.0; active.len()], ends: None },
        Color::Quality => {
            let ratio = |corners| radius_ratio(of_corners(corners, &mesh.positions)) as f32;
            Attributes {
                values: mesh.triangles.par_iter().map(ratio).collect(),
                ends: Some((0.0, 1.0)),
            }
        }
        Color::Lifetime => {
            let share = |&i: &u32| lifetime_share(spectrum, &spectrum.triangles[i as usize]) as f32;
            Attributes { values: active.iter().map(share).collect(), ends: Some((0.0, 1.0)) }
        }
        Color::Curvature => {
            let curvature = |corners| {
                let [p, n] = [&mesh.positions, &mesh.normals].map(|of| of_corners(corners, of));
                mean_curvature(p, n)
            };
            let curvatures: Vec<f64> = mesh.triangles.par_iter().map(curvature).collect();
            let inner = mesh.caps.iter().zip(&curvatures).filter(|(is_cap, _)| !**is_cap);
            let largest =
                largest_curvature.unwrap_or_else(|| typical_largest(inner.map(|(_, &h)| h)));
            Attributes {
                values: curvatures.iter().map(|h| (h / largest) as f32).collect(),
                ends: Some((-largest, largest)),
            }
        }
        Color::Component => Attributes {
            values: Components::of(mesh).of_triangle.into_iter().map(|c| c as f32).collect(),
            ends: None,
        },
    }
}

fn vector(p: [f32; 3]) -> DVec3 {
    DVec3::from_array(p.map(f64::from))
}

/// How much of the spectrum's range a triangle lives through.
fn lifetime_share(spectrum: &Spectrum, triangle: &Triangle) -> f64 {
    let (low, high) = spectrum.range;
    let at = |rank: u32| spectrum.isovalues[rank as usize].clamp(low, high);
    let share = (0.5 * at(triangle.death) - 0.5 * at(triangle.birth)) / (0.5 * high - 0.5 * low);
    // A range of one isovalue has no length: every triangle lives through all of it.
    if share.is_finite() { share } else { 1.0 }
}

/// Mean curvature of the triangle with corners `p` and unit normals `n`; 0 if it has no area.
fn mean_curvature(p: [DVec3; 3], n: [DVec3; 3]) -> f64 {
    let doubled_area = (p[1] - p[0]).cross(p[2] - p[0]);
    let squared = doubled_area.length_squared();
    if squared <= 0.0 {
        return 0.0;
    }
    // The gradient of corner i's coordinate lies in the triangle, at right angles to the opposite
    // edge, with length 1 / altitude.
    let divergence: f64 = (0..3)
        .map(|i| doubled_area.cross(p[(i + 2) % 3] - p[(i + 1) % 3]).dot(n[i]) / squared)
        .sum();
    0.5 * divergence
}

/// The curvature that 95 % of the triangles stay below: a few sharp places do not wash out the rest.
fn typical_largest(curvatures: impl Iterator<Item = f64>) -> f64 {
    let mut sizes: Vec<f64> = curvatures.map(f64::abs).filter(|h| h.is_finite()).collect();
    if sizes.is_empty() {
        return 1.0;
    }
    let at = (sizes.len() - 1) * 95 / 100;
    let (_, &mut found, _) = sizes.select_nth_unstable_by(at, f64::total_cmp);
    if found > 0.0 { found } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mean_curvature_of_a_sphere_a_cylinder_and_a_saddle() {
        // Right-angled triangle with legs h in the tangent plane, normals exact at its corners: the
        // normal's slope is exact up to O(h).
        let h = 1e-4;
        let tangent = [DVec3::ZERO, h * DVec3::X, h * DVec3::Y];
        let bend =
            |kx: f64, ky: f64| tangent.map(|p| DVec3::new(kx * p.x, ky * p.y, 1.0).normalize());
        for (kx, ky) in [(0.25, 0.25), (0.5, 0.0), (0.3, -0.3), (-1.0, -0.5)] {
            let found = mean_curvature(tangent, bend(kx, ky));
            assert!((found - 0.5 * (kx + ky)).abs() < 1e-4, "{kx} {ky}: {found}");
        }
        // On a sphere of radius r, n = p / r, exactly 1/r whatever the triangle.
        let p = [DVec3::new(3.0, 0.0, 0.0), DVec3::new(0.0, 3.0, 0.0), DVec3::new(0.0, 0.0, 3.0)];
        assert!((mean_curvature(p, p.map(|p| p / 3.0)) - 1.0 / 3.0).abs() < 1e-14);
        assert_eq!(mean_curvature([DVec3::X; 3], [DVec3::Z; 3]), 0.0);
    }

    #[test]
    fn the_largest_curvature_shown_ignores_the_last_twentieth() {
        let sizes = (0..100).map(|i| if i < 5 { 1e9 } else { -f64::from(i) });
        assert_eq!(typical_largest(sizes), 99.0);
        assert_eq!(typical_largest([0.0, 0.0].into_iter()), 1.0);
        assert_eq!(typical_largest(std::iter::empty()), 1.0);
    }

    #[test]
    fn colors_are_read_by_name() {
        for color in Color::ALL {
            assert_eq!(color.name().parse::<Color>().expect("a color"), color);
        }
        let error = "colour".parse::<Color>().expect_err("no such color");
        assert_eq!(error.exit_code(), 2);
    }
}
