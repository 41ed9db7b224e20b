//! Stitching: the faces that stay, the extraction inside the block, and the strips between them.

use glam::Vec3;

use super::block::Block;
use super::cut::{Moved, sides};
use super::excursion::join;
use super::handle::where_they_differ;
use super::incoming::{Adjacency, Incoming};
use super::near::Near;
use super::rim::{Gap, RimVertex, Side, bridged, gaps, rims};
use super::zip::StripTriangle;
use super::{Front, Sweep};
use crate::disjoint_sets::DisjointSets;
use crate::extract::Extraction;
use crate::mesh::{Face, Mesh, Vertex};

/// Distance, voxels, that the extraction keeps from what stays.
const GAP: f32 = 0.3;

/// Faces that stay are looked at within this distance from the block, voxels.
const NEAR_BLOCK: f32 = 5.0;

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

/// Why a surgery is not possible with a block, and where it should be larger; everywhere if nowhere.
pub(super) struct Trouble {
    pub(super) why: String,
    /// Voxel frame.
    pub(super) points: Vec<Vec3>,
}

impl Trouble {
    fn everywhere(why: impl Into<String>) -> Trouble {
        Trouble { why: why.into(), points: Vec::new() }
    }
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
    (extraction, arcs, adjacency): (&Extraction, &[usize], &Adjacency),
    block: &Block,
) -> Result<Vec<Stitched>, Trouble> {
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
    let mut beside = Vec::new();
    let staying = parts.add_staying(fronts, moved, block, &mut beside)?;
    let near = Near::of(beside, GAP);
    let incoming = parts.add_extraction((extraction, arcs, adjacency), block, &near)?;
    let gaps = gaps(&staying, &incoming).map_err(|points| {
        let why = format!("{} rims stay, {} come in", staying.len(), incoming.len());
        Trouble { why, points }
    })?;
    let mut points = Vec::new();
    for gap in &gaps {
        let of = |numbers: &[usize], rims: &[Vec<RimVertex>]| {
            bridged(&numbers.iter().map(|&i| &rims[i][..]).collect::<Vec<_>>())
        };
        match (of(&gap.staying, &staying), of(&gap.incoming, &incoming)) {
            (Some(stays), Some(comes)) => match join(&stays, &comes) {
                Ok(strip) => parts.add_strip(strip),
                Err(folds) => points.extend(folds),
            },
            _ => points.extend(apart(gap, &staying, &incoming)),
        }
    }
    if !points.is_empty() {
        return Err(Trouble { why: "no strip joins two rims".into(), points });
    }
    for v in staying.iter().chain(&incoming).flatten() {
        parts.on_rim[v.vertex as usize] = true;
    }
    parts.components(sweep, extraction, arcs)
}

/// The vertices of the rims that share a gap with one that is nearer to it.
fn apart(gap: &Gap, staying: &[Vec<RimVertex>], incoming: &[Vec<RimVertex>]) -> Vec<Vec3> {
    let stay = gap.staying.iter().skip(1).flat_map(|&i| &staying[i]);
    let come = gap.incoming.iter().skip(1).flat_map(|&i| &incoming[i]);
    stay.chain(come).map(|v| v.position).collect()
}

impl Parts {
    /// Adds what stays of the meshes, and its triangles beside the block to `beside`. Returns its rims.
    fn add_staying(
        &mut self,
        fronts: &[Front],
        moved: &[Moved],
        block: &Block,
        beside: &mut Vec<[Vec3; 3]>,
    ) -> Result<Vec<Vec<RimVertex>>, Trouble> {
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
                if block.touches_triangle(moved.corners(mesh, f), NEAR_BLOCK) {
                    beside.push(moved.corners(mesh, f));
                }
            }
            let rims = rims(&sides(mesh, &stays)).map_err(|pinched| Trouble {
                why: "a rim that stays meets another".into(),
                points: pinched.iter().map(|&v| moved.positions[v as usize]).collect(),
            })?;
            let vertex =
                |&(v, _, cap): &Side| moved.rim_vertex(mesh, Vertex(v), number[v as usize], cap);
            all.extend(rims.iter().map(|rim| rim.iter().map(vertex).collect::<Vec<_>>()));
        }
        self.on_rim = vec![false; self.positions.len()];
        self.arcs = vec![None; self.positions.len()];
        Ok(all)
    }

    /// Adds the extraction inside the block, and around it up to near what stays. Returns its rims.
    fn add_extraction(
        &mut self,
        (extraction, arcs, adjacency): (&Extraction, &[usize], &Adjacency),
        block: &Block,
        near: &Near,
    ) -> Result<Vec<Vec<RimVertex>>, Trouble> {
        let incoming = Incoming::new(extraction, adjacency, block, near);
        let mut number = vec![u32::MAX; extraction.positions.len()];
        for f in (0..extraction.faces.len()).filter(|&f| incoming.comes_in[f]) {
            let face = extraction.faces[f].map(|v| {
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
        }
        let rims = rims(&incoming.sides()).map_err(|pinched| Trouble {
            why: "a rim of the block meets another".into(),
            points: pinched.iter().map(|&v| extraction.positions[v as usize].into()).collect(),
        })?;
        let vertex = |&(v, _, cap): &Side| RimVertex {
            vertex: number[v as usize],
            position: Vec3::from(extraction.positions[v as usize]),
            normal: adjacency.normals[v as usize],
            border: extraction.borders[v as usize],
            cap,
        };
        Ok(rims.iter().map(|rim| rim.iter().map(vertex).collect()).collect())
    }

    fn add_strip(&mut self, strip: Vec<StripTriangle>) {
        for (t, cap) in strip {
            self.faces.push(t);
            self.caps.push(cap);
        }
    }

    /// The components, one per arc, each with the arc's topology.
    fn components(
        self,
        sweep: &Sweep,
        extraction: &Extraction,
        arcs: &[usize],
    ) -> Result<Vec<Stitched>, Trouble> {
        let mut sets = joined(&self.faces, self.positions.len());
        let mut arc_of_root: Vec<Option<usize>> = vec![None; self.positions.len()];
        for v in 0..self.positions.len() as u32 {
            if let Some(arc) = self.arcs[v as usize] {
                let entry = &mut arc_of_root[sets.find(v) as usize];
                if entry.is_some_and(|a| a != arc) {
                    return Err(Trouble::everywhere("components of two arcs are joined"));
                }
                *entry = Some(arc);
            }
        }
        // A component that the block does not reach belongs to the only arc there is, if any.
        let only = (arcs.len() == 1).then(|| arcs[0]);
        let of_face: Vec<Option<usize>> =
            self.faces.iter().map(|f| arc_of_root[sets.find(f[0]) as usize].or(only)).collect();
        if of_face.contains(&None) {
            return Err(Trouble::everywhere("a component belongs to no arc"));
        }
        let component = |&arc: &usize| {
            let stitched = self.component(arc, &of_face)?;
            let (euler, expected) = (stitched.mesh.euler(), sweep.topology.arcs[arc].euler);
            if euler == expected {
                return Ok(stitched);
            }
            let why = format!("Euler characteristic {euler}, expected {expected}");
            Err(Trouble { why, points: wrong_places(&stitched.mesh, extraction, arcs, arc) })
        };
        arcs.iter().map(component).collect()
    }

    fn component(&self, arc: usize, of_face: &[Option<usize>]) -> Result<Stitched, Trouble> {
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
        let mesh = Mesh::from_triangles(&positions, &borders, &triangles, &caps).map_err(|e| {
            let points =
                doubled_sides(&triangles).into_iter().map(|v| positions[v as usize].into());
            Trouble { why: e.to_string(), points: points.collect() }
        })?;
        Ok(Stitched {
            arc,
            mesh,
            kept_vertices,
            kept_faces: mine.iter().filter_map(|&f| self.kept_faces.get(f).copied()).collect(),
            on_rim: vertices.iter().map(|&v| self.on_rim[v]).collect(),
        })
    }
}

/// Where the mesh of an arc is other than its component of the extraction: a part of it that lies apart, or a handle that
/// only one of both has.
fn wrong_places(mesh: &Mesh, extraction: &Extraction, arcs: &[usize], arc: usize) -> Vec<Vec3> {
    let of_mesh = mesh.compacted();
    let faces = of_mesh.connectivity.faces;
    let apart = beside_largest(&faces, of_mesh.positions.len());
    if !apart.is_empty() {
        return apart.into_iter().map(|v| of_mesh.positions[v as usize].into()).collect();
    }
    let is_its = |&f: &usize| arcs[extraction.components[f] as usize] == arc;
    let of_arc = (0..extraction.faces.len()).filter(is_its).map(|f| extraction.faces[f]);
    let of_arc: Vec<[u32; 3]> = of_arc.collect();
    where_they_differ((&of_mesh.positions, &faces), (&extraction.positions, &of_arc))
}

/// The vertices of each component as one set.
fn joined(triangles: &[[u32; 3]], n_vertices: usize) -> DisjointSets {
    let mut sets = DisjointSets::new(n_vertices);
    for &[a, b, c] in triangles {
        sets.join(a, b);
        sets.join(b, c);
    }
    sets
}

/// The vertices that are not joined to most: what should be one component fell apart there.
fn beside_largest(triangles: &[[u32; 3]], n_vertices: usize) -> Vec<u32> {
    let mut sets = joined(triangles, n_vertices);
    let mut sizes = vec![0u32; n_vertices];
    (0..n_vertices as u32).for_each(|v| sizes[sets.find(v) as usize] += 1);
    // Of equal ones the first: `max_by_key` takes the last, so reversed.
    let largest = (0..n_vertices as u32).rev().max_by_key(|&v| sizes[v as usize]);
    (0..n_vertices as u32).filter(|&v| Some(sets.find(v)) != largest).collect()
}

/// The ends of sides that two triangles have in the same direction: they cannot be one surface there.
fn doubled_sides(triangles: &[[u32; 3]]) -> Vec<u32> {
    let mut sides: Vec<[u32; 2]> =
        triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]).collect();
    sides.sort_unstable();
    let doubled = sides.windows(2).filter(|w| w[0] == w[1]);
    doubled.flat_map(|w| w[0]).collect()
}
