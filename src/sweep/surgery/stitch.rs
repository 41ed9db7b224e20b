//! Stitching: the faces that stay, the extraction inside the block, and the strips between them.

use glam::Vec3;

use super::block::Block;
use super::cut::{Moved, sides};
use super::rim::{RimVertex, Side, pair, rims};
use super::zip::zip;
use super::{Front, Sweep};
use crate::extract::{DisjointSets, Extraction};
use crate::mesh::{Face, Mesh, Vertex};

/// One component after a surgery: vertices and faces that stay come first.
pub(super) struct Stitched {
    /// The arc whose component it is.
    pub(super) arc: usize,
    /// The mesh.
    pub(super) mesh: Mesh,
    /// Where its first vertices come from: number of the front, and slot.
    pub(super) kept_vertices: Vec<(usize, Vertex)>,
    /// Where its first faces come from.
    pub(super) kept_faces: Vec<(usize, Face)>,
    /// Per vertex: whether it lies on a rim.
    pub(super) on_rim: Vec<bool>,
}

/// All vertices and faces of a surgery: those that stay, then those of the extraction.
struct Parts {
    positions: Vec<[f32; 3]>,
    borders: Vec<u8>,
    faces: Vec<[u32; 3]>,
    caps: Vec<bool>,
    kept_vertices: Vec<(usize, Vertex)>,
    kept_faces: Vec<(usize, Face)>,
    on_rim: Vec<bool>,
    /// Per vertex: the arc, for those of the extraction.
    arcs: Vec<Option<usize>>,
}

/// Stitches the meshes of the arcs. Says why if that is not possible with this block.
pub(super) fn stitch(
    sweep: &Sweep,
    fronts: &[Front],
    moved: &[Moved],
    (extraction, arcs): &(Extraction, Vec<usize>),
    block: &Block,
) -> Result<Vec<Stitched>, String> {
    let mut parts = Parts {
        positions: Vec::new(),
        borders: Vec::new(),
        faces: Vec::new(),
        caps: Vec::new(),
        kept_vertices: Vec::new(),
        kept_faces: Vec::new(),
        on_rim: Vec::new(),
        arcs: Vec::new(),
    };
    let staying = parts.add_staying(fronts, moved, block)?;
    let incoming = parts.add_extraction(sweep, extraction, arcs, block)?;
    let partners = pair(&staying, &incoming).ok_or_else(|| {
        format!("{} rims stay, {} come in, not in pairs", staying.len(), incoming.len())
    })?;
    for (rim, &partner) in incoming.iter().zip(&partners) {
        let strip = zip(&staying[partner], rim).ok_or("no strip joins two rims")?;
        for (t, cap) in strip {
            parts.faces.push(t);
            parts.caps.push(cap);
        }
    }
    for v in staying.iter().chain(&incoming).flatten() {
        parts.on_rim[v.vertex as usize] = true;
    }
    parts.components(sweep, arcs)
}

impl Parts {
    /// Adds what stays of the meshes. Returns its rims.
    fn add_staying(
        &mut self,
        fronts: &[Front],
        moved: &[Moved],
        block: &Block,
    ) -> Result<Vec<Vec<RimVertex>>, String> {
        let mut all = Vec::new();
        for (r, (Front { mesh, .. }, moved)) in fronts.iter().zip(moved).enumerate() {
            let stays = moved.staying(mesh, block);
            let mut number = vec![u32::MAX; mesh.vertex_slots()];
            for f in mesh.faces().filter(|f| stays[f.0 as usize]) {
                let face = mesh.face_vertices(f).map(|v| {
                    let n = &mut number[v.0 as usize];
                    if *n == u32::MAX {
                        *n = self.positions.len() as u32;
                        self.positions.push(moved.positions[v.0 as usize].to_array());
                        self.borders.push(mesh.border(v));
                        self.kept_vertices.push((r, v));
                    }
                    *n
                });
                self.faces.push(face);
                self.caps.push(mesh.is_cap(f));
                self.kept_faces.push((r, f));
            }
            let rims = rims(&sides(mesh, &stays)).map_err(|_| "a rim that stays meets another")?;
            let vertex = |&(v, _, cap): &Side| {
                moved.rim_vertex(mesh, Vertex(v), number[v as usize], cap)
            };
            all.extend(rims.iter().map(|rim| rim.iter().map(vertex).collect::<Vec<_>>()));
        }
        self.on_rim = vec![false; self.positions.len()];
        self.arcs = vec![None; self.positions.len()];
        Ok(all)
    }

    /// Adds the extraction inside the block. Returns its rims.
    fn add_extraction(
        &mut self,
        sweep: &Sweep,
        extraction: &Extraction,
        arcs: &[usize],
        block: &Block,
    ) -> Result<Vec<Vec<RimVertex>>, String> {
        let mut number = vec![u32::MAX; extraction.positions.len()];
        let mut sides: Vec<Side> = Vec::new();
        for (f, face) in extraction.faces.iter().enumerate() {
            if !block.has(extraction.cells[f]) {
                continue;
            }
            let face = face.map(|v| {
                let n = &mut number[v as usize];
                if *n == u32::MAX {
                    *n = self.positions.len() as u32;
                    self.positions.push(extraction.positions[v as usize]);
                    self.borders.push(extraction.borders[v as usize]);
                    self.on_rim.push(false);
                    self.arcs.push(Some(arcs[extraction.components[f] as usize]));
                }
                *n
            });
            self.faces.push(face);
            self.caps.push(extraction.caps[f]);
            let cap = extraction.caps[f];
            sides.extend((0..3).map(|i| (face[i], face[(i + 1) % 3], cap)));
        }
        sides.sort_unstable();
        let open: Vec<Side> = sides
            .iter()
            .filter(|s| sides.binary_search_by_key(&(s.1, s.0), |t| (t.0, t.1)).is_err())
            .copied()
            .collect();
        let rims = rims(&open).map_err(|_| "a rim of the block meets another")?;
        let vertex = |&(v, _, cap): &Side| {
            let position = Vec3::from(self.positions[v as usize]);
            let normal = -sweep.field.gradient(position).normalize_or_zero();
            RimVertex { vertex: v, position, normal, border: self.borders[v as usize], cap }
        };
        Ok(rims.iter().map(|rim| rim.iter().map(vertex).collect()).collect())
    }

    /// The components, one per arc, each with the arc's topology.
    fn components(self, sweep: &Sweep, arcs: &[usize]) -> Result<Vec<Stitched>, String> {
        let mut sets = DisjointSets::new(self.positions.len());
        for &[a, b, c] in &self.faces {
            sets.join(a, b);
            sets.join(b, c);
        }
        let mut arc_of_root: Vec<Option<usize>> = vec![None; self.positions.len()];
        for v in 0..self.positions.len() as u32 {
            if let Some(arc) = self.arcs[v as usize] {
                let entry = &mut arc_of_root[sets.find(v) as usize];
                if entry.is_some_and(|a| a != arc) {
                    return Err("components of two arcs are joined".into());
                }
                *entry = Some(arc);
            }
        }
        // A component that the block does not reach belongs to the only arc there is, if any.
        let only = (arcs.len() == 1).then(|| arcs[0]);
        let of_face: Vec<Option<usize>> =
            self.faces.iter().map(|f| arc_of_root[sets.find(f[0]) as usize].or(only)).collect();
        if of_face.contains(&None) {
            return Err("a component belongs to no arc".into());
        }
        arcs.iter().map(|&arc| self.component(sweep, arc, &of_face)).collect()
    }

    fn component(
        &self,
        sweep: &Sweep,
        arc: usize,
        of_face: &[Option<usize>],
    ) -> Result<Stitched, String> {
        let mut number = vec![u32::MAX; self.positions.len()];
        let mine: Vec<usize> = (0..self.faces.len()).filter(|&f| of_face[f] == Some(arc)).collect();
        for v in mine.iter().flat_map(|&f| self.faces[f]) {
            number[v as usize] = 0;
        }
        // In the order of all vertices, so that those that stay come first.
        let (mut vertices, mut kept_vertices) = (Vec::new(), Vec::new());
        for (v, n) in number.iter_mut().enumerate().filter(|(_, n)| **n == 0) {
            *n = vertices.len() as u32;
            vertices.push(v);
            kept_vertices.extend(self.kept_vertices.get(v));
        }
        let triangles: Vec<[u32; 3]> =
            mine.iter().map(|&f| self.faces[f].map(|v| number[v as usize])).collect();
        let positions: Vec<[f32; 3]> = vertices.iter().map(|&v| self.positions[v]).collect();
        let borders: Vec<u8> = vertices.iter().map(|&v| self.borders[v]).collect();
        let caps: Vec<bool> = mine.iter().map(|&f| self.caps[f]).collect();
        let mesh = Mesh::from_triangles(&positions, &borders, &triangles, &caps)
            .map_err(|e| e.to_string())?;
        let euler = sweep.topology.arcs[arc].euler;
        if mesh.euler() != euler {
            return Err(format!("Euler characteristic {}, expected {euler}", mesh.euler()));
        }
        Ok(Stitched {
            arc,
            mesh,
            kept_vertices,
            kept_faces: mine.iter().filter_map(|&f| self.kept_faces.get(f).copied()).collect(),
            on_rim: vertices.iter().map(|&v| self.on_rim[v]).collect(),
        })
    }
}
