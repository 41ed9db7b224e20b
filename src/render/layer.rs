//! One isosurface of a picture: its active triangles, as the shader reads them.

use glam::{DMat4, Vec3};
use rayon::prelude::*;

use super::View;
use super::layout::{ActiveTriangle, Cut, Frame, normal_code, shares_code};
use super::table::Table;
use crate::color::{Attribute, Color, Ends, Parts, Per, Sources};
use crate::error::Result;
use crate::spectrum::active_set::ActiveSet;
use crate::spectrum::{Assembly, Keep, Picked, Spectrum, SurfaceMesh};

/// An isosurface and its buffers. The tables of trajectories are shared by all layers.
#[derive(Debug)]
pub(super) struct Layer {
    alive: ActiveSet,
    assembly: Assembly,
    /// The mesh of the last isovalue, caps and all.
    mesh: SurfaceMesh,
    meshed: Option<u64>,
    pub(super) frame: wgpu::Buffer,
    pub(super) cut: wgpu::Buffer,
    pub(super) table: Table,
    pub(super) listed: Listed,
}

/// The active triangles of the last picture, and what they depend on.
#[derive(Debug, Default)]
pub(super) struct Listed {
    key: Option<(u64, Color, Ends, bool, Keep, Picked)>,
    pub(super) triangles: Vec<ActiveTriangle>,
    /// What the colours show, of the whole mesh.
    pub(super) attribute: Option<Attribute>,
    /// Where the device has them, all in one piece: what its tables call the rank.
    pub(super) uploaded: Option<u32>,
    /// Of the triangles, which of the mesh's they are.
    numbers: Vec<u32>,
    /// Middles of the triangles, voxel frame; only where they are sorted by depth.
    middles: Vec<Vec3>,
}

impl Layer {
    /// A layer without triangles.
    pub(super) fn new(device: &wgpu::Device, spectrum: &Spectrum) -> Self {
        let uniform = |label, size| {
            device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(label),
                size,
                usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            })
        };
        Layer {
            alive: ActiveSet::new(spectrum.triangles()),
            assembly: Assembly::new(spectrum),
            mesh: SurfaceMesh::default(),
            meshed: None,
            frame: uniform("surface.frame", size_of::<Frame>() as u64),
            cut: uniform("surface.cut", size_of::<Cut>() as u64),
            table: Table::new(device, "surface.triangles"),
            listed: Listed::default(),
        }
    }

    /// Lists the active triangles with their attributes and normals, in the order of their indices, unless the last
    /// picture had the same.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`](crate::Error::Usage) where the colour needs a source that is not there.
    pub(super) fn list(
        &mut self,
        spectrum: &Spectrum,
        isovalue: f64,
        (view, picked): (&View, &Picked),
        sources: &Sources,
    ) -> Result<()> {
        let key = (isovalue.to_bits(), view.color, view.ends, view.open, view.keep, picked.clone());
        if self.listed.key.as_ref() == Some(&key) {
            return Ok(());
        }
        self.mesh_at(spectrum, isovalue);
        let Layer { alive, mesh, assembly, .. } = self;
        let active = spectrum.rank_at(isovalue).map_or(&[][..], |rank| alive.move_to(rank));
        // Caps are left out last, so that they do not change what the others show.
        let parts =
            Parts { spectrum, isovalue, mesh, vertices: assembly.vertices(), triangles: active };
        let attribute = parts.attribute(view.color, sources, view.ends)?;
        let measures = |t: usize| attribute.as_ref().map_or(0, |a| measures_of(a, mesh, t));
        let normals: Vec<u32> = mesh.normals.par_iter().map(|&n| normal_code(n)).collect();
        let is_kept = mesh.shown_triangles(&view.keep, picked);
        let Listed { mut triangles, mut numbers, .. } = std::mem::take(&mut self.listed);
        numbers.clear();
        numbers.extend((0..mesh.triangles.len() as u32).filter(|&i| {
            let i = i as usize;
            !(view.open && mesh.caps[i]) && is_kept.as_ref().is_none_or(|kept| kept[i])
        }));
        triangles.clear();
        triangles.extend(numbers.iter().map(|&i| {
            let i = i as usize;
            ActiveTriangle {
                vertices: spectrum.triangles()[active[i] as usize].vertices,
                measures: measures(i),
                normals: mesh.triangles[i].map(|v| normals[v as usize]),
            }
        }));
        self.listed = Listed {
            key: Some(key),
            triangles,
            attribute,
            uploaded: None,
            numbers,
            middles: Vec::new(),
        };
        Ok(())
    }

    /// The mesh of an isovalue, as meshes are saved.
    pub(super) fn mesh_at(&mut self, spectrum: &Spectrum, isovalue: f64) -> &SurfaceMesh {
        let Layer { alive, assembly, mesh, meshed, .. } = self;
        if meshed.replace(isovalue.to_bits()) != Some(isovalue.to_bits()) {
            let rank = spectrum.rank_at(isovalue);
            let active = rank.map_or(&[][..], |rank| alive.move_to(rank)).iter();
            let triangles = active.map(|&i| spectrum.triangles()[i as usize]);
            let place = |v| spectrum.vertex_at(v, rank.unwrap_or(0), isovalue);
            assembly.assemble(triangles.map(|t| (t.vertices, t.cap)), place, mesh);
        }
        mesh
    }

    /// The last mesh, and which of the spectrum's vertices its own are.
    #[cfg(feature = "viewer")]
    pub(super) fn meshed(&self) -> (&SurfaceMesh, &[u32]) {
        (&self.mesh, self.assembly.vertices())
    }

    /// Sorts the triangles from the farthest to the nearest, for surfaces that one looks through.
    /// Equally far ones keep their order.
    pub(super) fn sort_by_depth(&mut self, eye_from_voxel: DMat4) {
        let mesh = &self.mesh;
        let Listed { triangles, numbers, middles, uploaded, .. } = &mut self.listed;
        if middles.len() != triangles.len() {
            let middle = |&i: &u32| {
                let corners = mesh.triangles[i as usize];
                corners.iter().map(|&v| Vec3::from(mesh.positions[v as usize])).sum::<Vec3>() / 3.0
            };
            *middles = numbers.par_iter().map(middle).collect();
        }
        let towards_eye = eye_from_voxel.row(2).truncate().as_vec3();
        let depth = |i: usize| middles[i].dot(towards_eye);
        let mut order: Vec<(f32, u32)> =
            (0..triangles.len()).map(|i| (depth(i), i as u32)).collect();
        if order.is_sorted_by(|a, b| a.0 <= b.0) {
            return;
        }
        order.par_sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        *triangles = order.iter().map(|&(_, i)| triangles[i as usize]).collect();
        *middles = order.iter().map(|&(_, i)| middles[i as usize]).collect();
        *numbers = order.iter().map(|&(_, i)| numbers[i as usize]).collect();
        *uploaded = None;
    }
}

/// What the shader reads of an attribute of a triangle.
fn measures_of(attribute: &Attribute, mesh: &SurfaceMesh, t: usize) -> u32 {
    let Attribute { per, values, scale, .. } = attribute;
    match (scale, per) {
        (None, _) => values[t] as u32,
        (Some(scale), Per::Triangle) => shares_code([scale.share(f64::from(values[t])); 3]),
        (Some(scale), Per::Vertex) => {
            let share = |v: u32| scale.share(f64::from(values[v as usize]));
            shares_code(mesh.triangles[t].map(share))
        }
    }
}
