//! The values that a surface is coloured by.
//!
//! # Theory
//!
//! The *radius ratio* is 2r/R, inradius over circumradius ([`radius_ratio`]).
//!
//! The *mean curvature* is half the divergence of the unit normal field. Over a triangle the normals are interpolated
//! linearly, so it is half the sum over the corners of the gradient of the corner's barycentric coordinate times the corner's
//! normal. Normals point to the outer side: a ball with radius r has mean curvature 1/r, a saddle about 0.

use std::fmt;
use std::sync::Arc;

use glam::DVec3;
use rayon::prelude::*;

use super::knot_values::KnotValues;
use super::map::Map;
use super::scale::{Scale, ScaleEnd, ScaleEnds};
use super::srgb::{NO_VALUE, component_color};
use crate::error::{Error, Result};
use crate::mesh::radius_ratio;
use crate::parse_name::named_values;
use crate::spectrum::{Components, Mesh, Spectrum, Triangle};

/// What the colour of a surface shows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Color {
    /// Nothing: one colour per side.
    #[default]
    None,
    /// Radius ratio 2r/R, 0 to 1.
    Quality,
    /// Length of the triangle's lifetime as a fraction of the spectrum's range, 0 to 1.
    Lifetime,
    /// Mean curvature, 1/voxel, positive where the surface is convex towards the outer side. Computed from the mesh's normals,
    /// which are weighted by area (an error of a sixth on a sphere of triangles of different sizes).
    Curvature,
    /// Distance from each vertex to the isosurface, voxels; needs the volume ([`ColorSources::distance`]).
    Distance,
    /// A second field ([`ColorSources::field`]).
    Field,
    /// Connected component of the closed mesh, in the order of [`Components`]: the largest first.
    Component,
    /// Direction of the normal along the volume's axes: x red, y green, z blue, lighter towards larger coordinates.
    Normal,
}

impl Color {
    /// The default map: a diverging one for values with a center.
    pub fn default_map(self, sources: &ColorSources) -> Map {
        match self {
            Color::Curvature => Map::Vik,
            Color::Field if sources.field_ends().center.is_some() => Map::Vik,
            _ => Map::Viridis,
        }
    }
}

named_values! {
    Color, "color":
    None = "none",
    Quality = "quality",
    Lifetime = "lifetime",
    Curvature = "curvature",
    Distance = "distance",
    Field = "field",
    Component = "component",
    Normal = "normal",
}

/// Of an isovalue, a point (voxel frame) and the unit normal there; voxels, NaN where unknown.
type Distance = dyn Fn(f64, [f32; 3], [f32; 3]) -> f64 + Send + Sync;

/// A function that computes the distance to the isosurface.
#[derive(Clone)]
pub struct DistanceTo(Arc<Distance>);

impl DistanceTo {
    /// A function of the isovalue, a point of the voxel frame and the unit normal there; it returns voxels, or NaN where the
    /// distance is unknown.
    pub fn new(distance: impl Fn(f64, [f32; 3], [f32; 3]) -> f64 + Send + Sync + 'static) -> Self {
        DistanceTo(Arc::new(distance))
    }
}

impl fmt::Debug for DistanceTo {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("DistanceTo")
    }
}

/// The data that some colours need in addition to the spectrum.
#[derive(Clone, Debug, Default)]
pub struct ColorSources {
    /// For [`Color::Field`].
    pub field: Option<Arc<KnotValues>>,
    /// The default ends of the field's scale, the same at all isovalues.
    field_ends: ScaleEnds,
    /// For [`Color::Distance`].
    pub distance: Option<DistanceTo>,
}

impl ColorSources {
    /// Adds a second field.
    pub fn with_field(mut self, field: KnotValues) -> Self {
        let values = field.values.iter().map(|&x| f64::from(x));
        let percentiles = ScaleEnds {
            low: Some(ScaleEnd::Percentile(FIELD_PERCENTILES[0])),
            high: Some(ScaleEnd::Percentile(FIELD_PERCENTILES[1])),
            center: None,
        };
        let Scale { low, high } = Scale::of_checked(values, percentiles, ScaleEnds::default());
        let center = (low < 0.0 && high > 0.0).then_some(0.0);
        self.field_ends = ScaleEnds { center, ..ScaleEnds::between(low, high) };
        self.field = Some(Arc::new(field));
        self
    }

    /// Whether the data that a colour needs is available.
    pub fn support(&self, color: Color) -> bool {
        match color {
            Color::Field => self.field.is_some(),
            Color::Distance => self.distance.is_some(),
            _ => true,
        }
    }

    /// The default ends of the field's scale: percentiles of its knots, symmetric around zero if it has both signs.
    pub fn field_ends(&self) -> ScaleEnds {
        self.field_ends
    }
}

/// Percentiles of a field that its scale covers: outliers do not compress the rest.
const FIELD_PERCENTILES: [f64; 2] = [1.0, 99.0];

/// Percentile of curvatures and distances at the upper end of their scale, for the same reason.
const UPPER_PERCENTILE: f64 = 95.0;

/// The elements of a mesh that have values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Per {
    /// One value per vertex, interpolated over the triangles.
    Vertex,
    /// One value per triangle.
    Triangle,
}

/// Values of the vertices or triangles of a mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct Attribute {
    /// Name and unit of the values.
    pub name: String,
    /// Whether vertices or triangles have values.
    pub per: Per,
    /// The values; NaN where they are missing.
    pub values: Vec<f32>,
    /// The scale of the values; `None` for indices of components.
    pub scale: Option<Scale>,
}

/// A mesh of a spectrum, with its caps, and the spectrum's indices of its vertices and triangles.
#[derive(Clone, Copy, Debug)]
pub struct SpectrumMesh<'a> {
    /// The spectrum.
    pub spectrum: &'a Spectrum,
    /// The isovalue of the mesh.
    pub isovalue: f64,
    /// The mesh.
    pub mesh: &'a Mesh,
    /// The index in the spectrum of each vertex of the mesh.
    pub vertices: &'a [u32],
    /// The index in the spectrum of each triangle of the mesh.
    pub triangles: &'a [u32],
}

impl SpectrumMesh<'_> {
    /// The values that a colour shows, with their scale by the requested ends; `None` for colours without values.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`] if the colour needs data that `sources` does not have.
    pub fn attribute(
        &self,
        color: Color,
        sources: &ColorSources,
        requested: ScaleEnds,
    ) -> Result<Option<Attribute>> {
        let SpectrumMesh { spectrum, mesh, .. } = *self;
        let corners = |corners: &[u32; 3]| corners.map(|v| vector(mesh.positions[v as usize]));
        let unit_range = ScaleEnds::between(0.0, 1.0);
        let from_zero = ScaleEnds {
            low: Some(ScaleEnd::At(0.0)),
            high: Some(ScaleEnd::Percentile(UPPER_PERCENTILE)),
            center: None,
        };
        let (name, per, values, default) = match color {
            Color::None | Color::Normal => return Ok(None),
            Color::Quality => {
                let ratio = |t: &[u32; 3]| radius_ratio(corners(t)) as f32;
                let values = mesh.triangles.par_iter().map(ratio).collect();
                ("radius ratio", Per::Triangle, values, unit_range)
            }
            Color::Lifetime => {
                let lifetime = |&i: &u32| {
                    relative_lifetime(spectrum, &spectrum.triangles()[i as usize]) as f32
                };
                let values = self.triangles.iter().map(lifetime).collect();
                ("lifetime, share of the range", Per::Triangle, values, unit_range)
            }
            Color::Curvature => {
                let curvature = |t: &[u32; 3]| {
                    let n = t.map(|v| vector(mesh.normals[v as usize]));
                    mean_curvature(corners(t), n) as f32
                };
                let values: Vec<f32> = mesh.triangles.par_iter().map(curvature).collect();
                let inner = values.iter().zip(&mesh.caps).filter(|(_, cap)| !**cap);
                let sizes = inner.map(|(h, _)| f64::from(h.abs()));
                let Scale { high, .. } = Scale::of_checked(sizes, from_zero, ScaleEnds::default());
                let ends = ScaleEnds { center: Some(0.0), ..ScaleEnds::between(-high, high) };
                ("mean curvature, 1/voxel", Per::Triangle, values, ends)
            }
            Color::Distance => {
                let needed =
                    || Error::Usage("the distance to the isosurface needs the volume".into());
                let DistanceTo(distance) = sources.distance.as_ref().ok_or_else(needed)?;
                let vertices = mesh.positions.par_iter().zip(&mesh.normals);
                let values =
                    vertices.map(|(&p, &n)| distance(self.isovalue, p, n) as f32).collect();
                ("distance to the isosurface, voxel", Per::Vertex, values, from_zero)
            }
            Color::Field => {
                let needed = || Error::Usage("there is no second field to colour by".into());
                let field = sources.field.as_ref().ok_or_else(needed)?;
                let rank = spectrum.rank_at(self.isovalue).unwrap_or(0);
                let at = |&v: &u32| field.at(spectrum, v, rank, self.isovalue);
                let values = self.vertices.par_iter().map(at).collect();
                (field.name.as_str(), Per::Vertex, values, sources.field_ends)
            }
            Color::Component => {
                let numbers = Components::of(mesh).of_triangle.into_iter();
                let values = numbers.map(|c| c as f32).collect();
                let name = "component, the largest first".to_owned();
                return Ok(Some(Attribute { name, per: Per::Triangle, values, scale: None }));
            }
        };
        let scale = Scale::of(values.iter().map(|&x| f64::from(x)), requested, default)?;
        Ok(Some(Attribute { name: name.to_owned(), per, values, scale: Some(scale) }))
    }
}

impl Attribute {
    /// The values of a part of the mesh, given the indices of its vertices and triangles.
    pub fn of_part(&self, [vertices, triangles]: &[Vec<u32>; 2]) -> Attribute {
        let kept = if self.per == Per::Vertex { vertices } else { triangles };
        let values = kept.iter().map(|&i| self.values[i as usize]).collect();
        Attribute { values, ..self.clone() }
    }

    /// One value per vertex: values of triangles are averaged by area over the triangles around the vertex.
    pub(crate) fn by_vertex(&self, mesh: &Mesh) -> Vec<f32> {
        if self.per == Per::Vertex {
            return self.values.clone();
        }
        let mut sums = vec![(0.0f64, 0.0f64); mesh.positions.len()];
        for (corners, &value) in mesh.triangles.iter().zip(&self.values) {
            let [a, b, c] = corners.map(|v| vector(mesh.positions[v as usize]));
            // Not zero, so that a vertex whose triangles have no area gets their mean.
            let area = (b - a).cross(c - a).length().max(f64::from(f32::MIN_POSITIVE));
            for &v in corners {
                let (sum, areas) = &mut sums[v as usize];
                *sum += area * f64::from(value);
                *areas += area;
            }
        }
        let mean = |(sum, areas): (f64, f64)| (sum / areas) as f32;
        match self.scale {
            Some(_) => sums.into_iter().map(mean).collect(),
            None => sums.into_iter().map(|sum| mean(sum).round()).collect(),
        }
    }

    /// The name as an identifier: letters, digits and `_`.
    pub(crate) fn identifier(&self) -> String {
        let name = self.name.split(',').next().unwrap_or_default();
        let plain = |c: char| if c.is_ascii_alphanumeric() { c } else { '_' };
        name.trim().chars().map(plain).collect()
    }

    /// Linear red, green and blue of a value.
    pub fn color_of(&self, value: f32, map: Map) -> [f32; 3] {
        match self.scale {
            Some(scale) => scale.fraction(f64::from(value)).map_or(NO_VALUE, |t| map.at(t)),
            None => component_color(value as u32),
        }
    }
}

fn vector(p: [f32; 3]) -> DVec3 {
    DVec3::from_array(p.map(f64::from))
}

/// Length of a triangle's lifetime as a fraction of the spectrum's range.
fn relative_lifetime(spectrum: &Spectrum, triangle: &Triangle) -> f64 {
    let (low, high) = spectrum.range();
    let at = |rank: u32| spectrum.isovalues()[rank as usize].clamp(low, high);
    let length = (0.5 * at(triangle.death) - 0.5 * at(triangle.birth)) / (0.5 * high - 0.5 * low);
    // In a range of one isovalue every triangle lives through all of it.
    if length.is_finite() { length } else { 1.0 }
}

/// Mean curvature of a triangle with corners `p` and unit normals `n`; 0 if it has no area.
fn mean_curvature(p: [DVec3; 3], n: [DVec3; 3]) -> f64 {
    let doubled_area = (p[1] - p[0]).cross(p[2] - p[0]);
    let squared = doubled_area.length_squared();
    if squared <= 0.0 {
        return 0.0;
    }
    // The gradient of corner i's coordinate is in the plane of the triangle, perpendicular to the opposite edge, with length
    // 1 / altitude.
    let divergence: f64 = (0..3)
        .map(|i| doubled_area.cross(p[(i + 2) % 3] - p[(i + 1) % 3]).dot(n[i]) / squared)
        .sum();
    0.5 * divergence
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mean_curvature_of_a_sphere_a_cylinder_and_a_saddle() {
        // Right triangle with legs h in the tangent plane, normals exact at its corners: the normal's slope is exact up to O(h).
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
    fn colors_are_parsed_by_name() {
        for color in Color::ALL {
            assert_eq!(color.name().parse::<Color>().expect("a color"), color);
        }
        let error = "colour".parse::<Color>().expect_err("no such color");
        assert!(matches!(error, Error::Usage(_)), "{error}");
    }
}
