//! Values and colours of a mesh as the formats store them.

use crate::color::{Attribute, Map, Per, to_srgb};
use crate::spectrum::Mesh;

/// Values of a mesh and the colour map.
#[derive(Clone, Copy, Debug)]
pub struct Colors<'a> {
    /// Values of the vertices or triangles of the mesh that is written.
    pub attribute: &'a Attribute,
    /// The map.
    pub map: Map,
}

/// Values and colours of a mesh as the formats store them.
pub(super) struct ColorData {
    /// The attribute's name as an identifier: letters, digits and `_`.
    pub(super) name: String,
    /// One value per vertex.
    pub(super) vertex_values: Vec<f32>,
    /// One value per triangle, for attributes of triangles.
    pub(super) triangle_values: Option<Vec<f32>>,
    /// Linear red, green and blue per vertex.
    pub(super) linear: Vec<[f32; 3]>,
}

impl ColorData {
    pub(super) fn new(Colors { attribute, map }: Colors<'_>, mesh: &Mesh) -> Self {
        let vertex_values = attribute.by_vertex(mesh);
        ColorData {
            name: attribute.identifier(),
            linear: vertex_values.iter().map(|&x| attribute.color_of(x, map)).collect(),
            triangle_values: (attribute.per == Per::Triangle).then(|| attribute.values.clone()),
            vertex_values,
        }
    }

    /// sRGB bytes per vertex.
    pub(super) fn srgb(&self) -> impl Iterator<Item = [u8; 3]> + '_ {
        self.linear.iter().map(|color| color.map(to_srgb))
    }
}
