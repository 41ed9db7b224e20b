//! One isosurface of a picture: its active triangles in the shader's format.

use glam::DVec3;
use rayon::prelude::*;

use super::depth_order;
use super::pipeline::create_uniform_buffer;
use super::shader_types::{ActiveTriangle, Cut, SurfaceUniforms, encode_fractions, encode_normal};
use super::storage_buffer::StorageBuffer;
use super::view::View;
use crate::color::{Attribute, Color, ColorSources, Per, ScaleEnds, SpectrumMesh};
use crate::error::Result;
use crate::spectrum::active_set::ActiveSet;
use crate::spectrum::{Assembly, Keep, Mesh, Picked, Spectrum};

/// An isosurface and its buffers. The tables of trajectories are shared by all layers.
#[derive(Debug)]
pub(super) struct Layer {
    active_set: ActiveSet,
    assembly: Assembly,
    /// The mesh of the last isovalue, with caps.
    mesh: Mesh,
    /// Bits of the isovalue of `mesh`.
    mesh_isovalue: Option<u64>,
    pub(super) frame: wgpu::Buffer,
    pub(super) cut: wgpu::Buffer,
    pub(super) triangle_buffer: StorageBuffer,
    pub(super) list: TriangleList,
}

/// The active triangles of the last picture.
#[derive(Debug, Default)]
pub(super) struct TriangleList {
    key: Option<ListKey>,
    pub(super) triangles: Vec<ActiveTriangle>,
    /// Values of the whole mesh, for its colours.
    pub(super) attribute: Option<Attribute>,
    /// The isovalue's rank in the tables on the device, if all triangles are there in one batch.
    pub(super) uploaded_rank: Option<u32>,
    /// The index in the mesh of each triangle.
    mesh_indices: Vec<u32>,
    /// The triangles in the order of drawing, of a translucent surface.
    sorted: Option<Sorted>,
}

/// Triangles sorted by depth.
#[derive(Debug, PartialEq)]
struct Sorted {
    triangles: Vec<ActiveTriangle>,
    /// Where the slabs of [`depth_order`] begin, and the end.
    slabs: Vec<u32>,
}

impl TriangleList {
    /// The triangles in the order of drawing.
    pub(super) fn drawn(&self) -> &[ActiveTriangle] {
        self.sorted.as_ref().map_or(&self.triangles, |sorted| &sorted.triangles)
    }

    /// Where the slabs of a translucent surface begin, and the end.
    pub(super) fn slabs(&self) -> &[u32] {
        self.sorted.as_ref().map_or(&[], |sorted| &sorted.slabs)
    }
}

/// The inputs of a list: an equal key means an equal list.
#[derive(Clone, Debug, PartialEq)]
struct ListKey {
    isovalue_bits: u64,
    color: Color,
    ends: ScaleEnds,
    open: bool,
    keep: Keep,
    picked: Picked,
}

impl Layer {
    /// A layer without triangles.
    pub(super) fn new(device: &wgpu::Device, spectrum: &Spectrum) -> Self {
        Layer {
            active_set: ActiveSet::new(spectrum.triangles()),
            assembly: Assembly::new(spectrum),
            mesh: Mesh::default(),
            mesh_isovalue: None,
            frame: create_uniform_buffer(device, "surface.frame", size_of::<SurfaceUniforms>()),
            cut: create_uniform_buffer(device, "surface.cut", size_of::<Cut>()),
            triangle_buffer: StorageBuffer::new(device, "surface.triangles"),
            list: TriangleList::default(),
        }
    }

    /// Lists the active triangles with their values and normals, in the order of their indices; keeps the list of the last
    /// picture if it has the same inputs.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`](crate::Error::Usage) if the colour needs data that `sources` does not have.
    pub(super) fn update(
        &mut self,
        spectrum: &Spectrum,
        isovalue: f64,
        view: &View,
        picked: Picked,
        sources: &ColorSources,
    ) -> Result<()> {
        let &View { color, ends, open, keep, .. } = view;
        let key = ListKey { isovalue_bits: isovalue.to_bits(), color, ends, open, keep, picked };
        if self.list.key.as_ref() == Some(&key) {
            return Ok(());
        }
        self.mesh_at(spectrum, isovalue);
        let Layer { active_set, mesh, assembly, .. } = self;
        let active = spectrum.rank_at(isovalue).map_or(&[][..], |rank| active_set.move_to(rank));
        // Caps are removed after the attribute is computed, so that the colours do not depend on `open`.
        let vertices = assembly.vertices();
        let attribute = SpectrumMesh { spectrum, isovalue, mesh, vertices, triangles: active }
            .attribute(color, sources, ends)?;
        let values = |t: usize| attribute.as_ref().map_or(0, |a| encode_values(a, mesh, t));
        let normals: Vec<u32> = mesh.normals.par_iter().map(|&n| encode_normal(n)).collect();
        let is_kept = mesh.shown_triangles(&keep, &key.picked);
        let TriangleList { mut triangles, mut mesh_indices, .. } = std::mem::take(&mut self.list);
        mesh_indices.clear();
        mesh_indices.extend((0..mesh.triangles.len() as u32).filter(|&i| {
            let i = i as usize;
            !(open && mesh.caps[i]) && is_kept.as_ref().is_none_or(|kept| kept[i])
        }));
        triangles.clear();
        triangles.extend(mesh_indices.iter().map(|&i| {
            let i = i as usize;
            ActiveTriangle {
                vertices: spectrum.triangles()[active[i] as usize].vertices,
                values: values(i),
                normals: mesh.triangles[i].map(|v| normals[v as usize]),
            }
        }));
        self.list = TriangleList {
            key: Some(key),
            triangles,
            attribute,
            uploaded_rank: None,
            mesh_indices,
            sorted: None,
        };
        Ok(())
    }

    /// The mesh of an isovalue, the same as [`Spectrum::mesh_at`].
    pub(super) fn mesh_at(&mut self, spectrum: &Spectrum, isovalue: f64) -> &Mesh {
        let Layer { active_set, assembly, mesh, mesh_isovalue, .. } = self;
        if mesh_isovalue.replace(isovalue.to_bits()) != Some(isovalue.to_bits()) {
            let rank = spectrum.rank_at(isovalue);
            let active = rank.map_or(&[][..], |rank| active_set.move_to(rank)).iter();
            let triangles = active.map(|&i| spectrum.triangles()[i as usize]);
            let position = |v| spectrum.vertex_at(v, rank.unwrap_or(0), isovalue);
            assembly.assemble(triangles.map(|t| (t.vertices, t.cap)), position, mesh);
        }
        mesh
    }

    /// The last mesh, and the spectrum's indices of its vertices.
    #[cfg(feature = "viewer")]
    pub(super) fn mesh_and_vertices(&self) -> (&Mesh, &[u32]) {
        (&self.mesh, self.assembly.vertices())
    }

    /// The depths of the triangles of the list, which is that of an isovalue.
    pub(super) fn depths(
        &mut self,
        spectrum: &Spectrum,
        isovalue: f64,
        towards_eye: DVec3,
    ) -> Vec<f32> {
        self.mesh_at(spectrum, isovalue);
        depth_order::depths(&self.mesh, &self.list.mesh_indices, towards_eye)
    }

    /// Sorts the triangles for drawing by the slabs of [`depth_order`], within a range of depths; or undoes that.
    pub(super) fn sort(&mut self, depths: Option<(&[f32], (f32, f32))>) {
        let list = &mut self.list;
        let sorted = depths.map(|(depths, range)| {
            let (slabs, places) = depth_order::slabs(depths, range);
            let triangles = places.iter().map(|&i| list.triangles[i as usize]).collect();
            Sorted { triangles, slabs }
        });
        if list.sorted != sorted {
            (list.sorted, list.uploaded_rank) = (sorted, None);
        }
    }
}

/// [`ActiveTriangle::values`] of triangle `t`.
fn encode_values(attribute: &Attribute, mesh: &Mesh, t: usize) -> u32 {
    let Attribute { per, values, scale, .. } = attribute;
    let Some(scale) = scale else { return values[t] as u32 };
    let fraction = |i: usize| scale.fraction(f64::from(values[i]));
    encode_fractions(match per {
        Per::Triangle => [fraction(t); 3],
        Per::Vertex => mesh.triangles[t].map(|v| fraction(v as usize)),
    })
}
