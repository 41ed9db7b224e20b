//! Cells become exact, and cells become tracked, at one isovalue.
//!
//! # Theory
//!
//! *Release*: the exact extraction's triangles in cells that are no longer exact are taken into the mesh as they are.
//! They share the seam's vertices, so nothing has to be matched.
//!
//! *Yield*: the mesh is cut along the lattice squares around cells that become exact, by edge splits only, and what lies
//! inside goes. Its boundary there is then a polyline on those squares. It becomes the one of the exact extraction in
//! two moves. Where the mesh has a sample on the wrong side, which may be where the isosurface is nearer to that sample
//! than the mesh to the isosurface, the boundary passes it, as it does when the isovalue goes by. Then every
//! vertex moves along its lattice edge to where the exact extraction has it.
//!
//! Where the mesh crosses a lattice edge more than once, or joins its crossings otherwise than the exact extraction,
//! nothing is done: the caller makes more cells exact there and tries again, at last all, which needs no exchange.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use glam::Vec3;

use super::check::{Change, open_part, unlike_before};
use super::clusters::Cluster;
use super::part::Part;
use super::region::{Grid, LatticeEdge, Link, Region, Square};
use super::tracked::{Changes, Tracked, boundary, parted, place_of, place_on};
use crate::disjoint_sets::DisjointSets;
use crate::extract::extract_cell;
use crate::mesh::{Edge, Face, Mesh, Vertex, area, bounds};
use crate::topology::exact::ExactField;

/// How near to a square, as a share of the lattice's edges, an edge of the mesh may pass by it and is split all the same.
const NEAR: f32 = 1e-3;

/// Samples that the mesh has on the wrong side lie together in groups of at most so many.
const MOST_WRONG: usize = 8;

/// A part of the mesh of a smaller area, in square voxels, that crosses no lattice edge is none of the isosurface.
const SMALL_PART: f32 = 3.0;

/// Why an exchange was not made, and the samples around which cells are to be exact; none if more of the mesh is to take part.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Refused {
    pub(super) why: &'static str,
    pub(super) samples: Vec<u32>,
}

impl Refused {
    fn at(why: &'static str, samples: impl IntoIterator<Item = u32>) -> Refused {
        Refused { why, samples: samples.into_iter().collect() }
    }
}

/// Reasons to refuse an exchange.
#[derive(Default)]
struct Refusals {
    why: Option<&'static str>,
    samples: Vec<u32>,
}

impl Refusals {
    fn add(&mut self, why: &'static str, samples: impl IntoIterator<Item = u32>) {
        let before = self.samples.len();
        self.samples.extend(samples);
        if self.samples.len() > before {
            self.why.get_or_insert(why);
        }
    }

    fn none(self) -> Result<(), Refused> {
        self.why.map_or(Ok(()), |why| Err(Refused { why, samples: self.samples }))
    }
}

/// What an exchange has made of a part of the mesh.
pub(super) struct Exchanged {
    pub(super) part: Part,
    pub(super) made: Tracked,
    /// Per vertex slot, as far as it goes: the vertex of the whole that it is.
    pub(super) origin: Vec<Option<Vertex>>,
    /// Per face slot: the face of the whole that it was, if it is one of those.
    pub(super) was: Vec<Option<Face>>,
}

/// Makes the mesh near some blocks that of another region, at an isovalue.
pub(super) fn exchange(
    before: &Tracked,
    cluster: &Cluster,
    [old, new]: [&Region; 2],
    field: &ExactField,
    isovalue: f64,
) -> Result<Exchanged, Refused> {
    let part = Part::of(before, &cluster.faces);
    let cut = Cut::new(cluster, [old, new], field);
    let whole_key = |v: u32| part.origin[v as usize].and_then(|o| before.key(o));
    let of_part =
        Tracked::of(part.positions.clone(), part.triangles.clone(), whole_key, &mut Vec::new());
    let mut tracked = of_part.map_err(|p| Refused::at("no part", cut.cell(p)))?;
    cut.split(&mut tracked.mesh);
    let removed = cut.removed(&tracked, &part.is_rim);
    let mut pieces = Pieces {
        positions: (0..tracked.mesh.vertex_slots() as u32)
            .map(|v| tracked.mesh.position(Vertex(v)).to_array())
            .collect(),
        origin: part.origin.clone(),
        rim: part.is_rim.clone(),
        ..Pieces::default()
    };
    // Slots of the part's hubs are no vertices of the whole.
    pieces.origin.resize(pieces.positions.len(), None);
    pieces.rim.resize(pieces.positions.len(), false);
    let mut was = Vec::new();
    for f in tracked.mesh.faces().filter(|f| !tracked.mesh.is_cap(*f)) {
        if !removed[f.0 as usize] {
            pieces.triangles.push(tracked.mesh.face_vertices(f).map(|v| v.0));
            was.push(part.faces.get(f.0 as usize).copied());
        }
    }
    pieces.part_pinched();
    let nodes = cut.nodes(&pieces, &tracked, &[old, new])?;
    pieces.bound = nodes.iter().map(|(e, v)| (*v, *e)).collect();
    release(&nodes, &cut.released, field, isovalue, &mut pieces);
    was.resize(pieces.triangles.len(), None);
    pieces.part_pinched();
    let nodes = cut.nodes(&pieces, &tracked, &[new])?;
    let nodes = if pieces.close_loops(&nodes, &mut was) {
        pieces.part_pinched();
        cut.nodes(&pieces, &tracked, &[new])?
    } else {
        nodes
    };
    let (wrong, unclear) = cut.wrong(&nodes, isovalue);
    let bound: HashMap<u32, LatticeEdge> = nodes.iter().map(|(e, v)| (*v, *e)).collect();
    let key = |v: u32| bound.get(&v).copied();
    let made = Tracked::of(pieces.positions, pieces.triangles, key, &mut Vec::new());
    let mut made = made.map_err(|p| Refused::at("no manifold", cut.cell(p)))?;
    was.resize(made.mesh.face_slots(), None);
    let mut changes = Changes::default();
    let at = |mesh: &Mesh, v: Vertex| mesh.position(v);
    // All that is wrong is told at once: every attempt costs.
    let mut refused = Refusals::default();
    refused.add("sides unclear", unclear);
    refused.add("not straightened", cut.straighten(&mut made, &pieces.rim, &mut changes));
    let mut passed = |made: &mut Tracked, &sample: &u32| {
        made.pass(new, sample, place_of(field, sample), &at, &mut changes).is_err()
    };
    let stuck: Vec<u32> = wrong.into_iter().filter(|s| passed(&mut made, s)).collect();
    refused.add("not passed", stuck);
    let bound: Vec<(Vertex, LatticeEdge)> = made.bound().collect();
    for &(v, e) in &bound {
        let ends = new.grid.ends(e).map(|s| field.key(s) > field.isovalue_key(isovalue));
        if ends[0] == ends[1] {
            refused.add("bound to no crossing", new.grid.ends(e));
        } else if made.vertex_at(e) != Some(v) {
            refused.add("bound twice", new.grid.ends(e));
        }
        made.mesh.set_position(v, place_on(field, e, isovalue));
    }
    let squares = cut.squares.iter().copied();
    refused.add("another polyline", made.other_polylines(new, field, squares, isovalue));
    refused.none()?;
    let mut refused = Refusals::default();
    let vertices: Vec<Vertex> = bound.iter().map(|b| b.0).collect();
    made.cure_chords(new, &vertices, &at, &mut changes);
    was.resize(made.mesh.face_slots(), None);
    let exchanged = Exchanged { part, made, origin: pieces.origin, was };
    if !exchanged.has_rim() {
        return Err(Refused { why: "part too small", samples: Vec::new() });
    }
    let change = Change { field, isovalue, regions: [old, new], blocks: &cluster.blocks };
    refused.add("open", open_part(before, &exchanged, &change));
    refused.add("unlike", unlike_before(before, &exchanged, &change));
    refused.none()?;
    Ok(exchanged)
}

impl Exchanged {
    /// The lattice edge that a vertex is bound to, if need be by what it was: of the fans at a vertex of the rim only one
    /// is bound.
    pub(super) fn key(&self, before: &Tracked, v: Vertex) -> Option<LatticeEdge> {
        let origin = || self.origin.get(v.0 as usize).copied().flatten();
        self.made.key(v).or_else(|| before.key(origin()?))
    }

    /// Whether an edge of the boundary is one of the part's rim.
    pub(super) fn is_rim(&self, ends: [Vertex; 2]) -> bool {
        let origin = |v: Vertex| self.origin.get(v.0 as usize).copied().flatten();
        matches!(ends.map(origin), [Some(a), Some(b)] if self.part.rim.contains(&(a, b)))
    }

    /// Whether all of the rim is there: it is not where a part was too small for what had to go.
    fn has_rim(&self) -> bool {
        let mesh = &self.made.mesh;
        let boundary = mesh.faces().filter(|&f| !mesh.is_cap(f)).flat_map(|f| {
            let own = mesh.face_halfedges(f).into_iter();
            own.filter(|&h| self.made.is_boundary(h)).map(|h| [mesh.from(h), mesh.to(h)])
        });
        boundary.filter(|&ends| self.is_rim(ends)).count() == self.part.rim.len()
    }
}

/// Triangles to make a mesh of.
#[derive(Default)]
struct Pieces {
    positions: Vec<[f32; 3]>,
    triangles: Vec<[u32; 3]>,
    /// The vertices bound to lattice edges.
    bound: HashMap<u32, LatticeEdge>,
    /// By vertex, as far as it goes: that of the whole mesh.
    origin: Vec<Option<Vertex>>,
    /// By vertex, as far as it goes: whether it is on the part's rim.
    rim: Vec<bool>,
}

impl Pieces {
    /// Where triangles are joined in a vertex only, they become several parts with a vertex each.
    fn part_pinched(&mut self) {
        for v in parted(&mut self.triangles, self.positions.len()) {
            let copy = self.positions.len() as u32;
            self.positions.push(self.positions[v as usize]);
            if let Some(&e) = self.bound.get(&v) {
                self.bound.insert(copy, e);
            }
            let rim = self.is_rim(v);
            self.origin.resize(copy as usize, None);
            self.origin.push(self.origin[v as usize].filter(|_| rim));
            self.rim.resize(copy as usize, false);
            self.rim.push(rim);
        }
    }

    /// The lattice edge that a vertex is bound to, or was in the mesh before.
    fn bound_by(&self, before: &Tracked, v: u32) -> Option<LatticeEdge> {
        self.bound.get(&v).copied().or_else(|| before.key(Vertex(v)))
    }

    fn is_rim(&self, v: u32) -> bool {
        self.rim.get(v as usize).copied().unwrap_or(false)
    }
}

impl Pieces {
    /// Loops of the boundary that cross no lattice edge: what they bound is filled, or taken away where it is small. Returns
    /// whether there was one.
    fn close_loops(
        &mut self,
        nodes: &BTreeMap<LatticeEdge, u32>,
        was: &mut Vec<Option<Face>>,
    ) -> bool {
        let Ok(next) = boundary(&self.triangles) else { return false };
        let is_node: BTreeSet<u32> = nodes.values().copied().collect();
        let mut seen: BTreeSet<u32> = BTreeSet::new();
        let mut loops: Vec<Vec<u32>> = Vec::new();
        for &first in next.keys() {
            if !seen.insert(first) {
                continue;
            }
            let (mut around, mut a) = (vec![first], next[&first]);
            while a != first {
                seen.insert(a);
                around.push(a);
                a = next[&a];
            }
            if !around.iter().any(|v| is_node.contains(v) || self.is_rim(*v)) {
                loops.push(around);
            }
        }
        if loops.is_empty() {
            return false;
        }
        let mut sets = DisjointSets::new(self.positions.len());
        for [a, b, c] in &self.triangles {
            sets.join(*a, *b);
            sets.join(*a, *c);
        }
        let at_rim: BTreeSet<u32> =
            (0..self.rim.len() as u32).filter(|&v| self.is_rim(v)).map(|v| sets.find(v)).collect();
        let place = |v: u32| Vec3::from(self.positions[v as usize]);
        let mut areas: HashMap<u32, f32> = HashMap::new();
        for t in &self.triangles {
            *areas.entry(sets.find(t[0])).or_default() += area(t.map(place));
        }
        let mut gone: BTreeSet<u32> = BTreeSet::new();
        let mut filled: Vec<(Vec3, Vec<u32>)> = Vec::new();
        for around in loops {
            let set = sets.find(around[0]);
            if areas[&set] < SMALL_PART && !at_rim.contains(&set) {
                gone.insert(set);
            } else {
                let middle = around.iter().map(|&v| place(v)).sum::<Vec3>() / around.len() as f32;
                filled.push((middle, around));
            }
        }
        let mut kept = self.triangles.iter().map(|t| !gone.contains(&sets.find(t[0])));
        let kept: Vec<bool> = kept.by_ref().collect();
        let mut keep = kept.iter();
        self.triangles.retain(|_| *keep.next().expect("one each"));
        let mut keep = kept.iter();
        was.retain(|_| *keep.next().expect("one each"));
        for (middle, around) in filled {
            let v = self.positions.len() as u32;
            self.positions.push(middle.to_array());
            for (i, &a) in around.iter().enumerate() {
                self.triangles.push([around[(i + 1) % around.len()], a, v]);
                was.push(None);
            }
        }
        true
    }
}

/// Adds the exact extraction's triangles in the cells that are no longer exact, and binds their vertices.
fn release(
    nodes: &BTreeMap<LatticeEdge, u32>,
    released: &[u32],
    field: &ExactField,
    isovalue: f64,
    pieces: &mut Pieces,
) {
    let grid = Grid::of(field);
    let mut made: HashMap<LatticeEdge, u32> = HashMap::new();
    let isovalue_key = field.isovalue_key(isovalue);
    for block in released {
        for cell in grid.cells_of(*block) {
            let offsets = field.cell_offsets();
            let above = offsets.iter().filter(|&&o| field.key(cell + o) > isovalue_key).count();
            if above == 0 || above == 8 {
                continue;
            }
            let surface = extract_cell(field, cell, isovalue);
            let numbers: Vec<u32> = surface
                .crossings
                .iter()
                .zip(&surface.positions)
                .map(|(crossing, &position)| {
                    let Some(ends) = crossing else {
                        pieces.positions.push(position);
                        return pieces.positions.len() as u32 - 1;
                    };
                    let e = grid.edge_between(*ends);
                    let v = nodes.get(&e).copied().unwrap_or_else(|| {
                        *made.entry(e).or_insert_with(|| {
                            pieces.positions.push(place_on(field, e, isovalue).to_array());
                            pieces.positions.len() as u32 - 1
                        })
                    });
                    pieces.bound.insert(v, e);
                    v
                })
                .collect();
            pieces.triangles.extend(surface.faces.iter().map(|f| f.map(|v| numbers[v as usize])));
        }
    }
}

/// The squares that the mesh is cut along.
struct Cut<'a> {
    field: &'a ExactField<'a>,
    grid: Grid,
    old: &'a Region,
    new: &'a Region,
    squares: BTreeSet<Square>,
    /// The blocks that are no longer exact.
    released: Vec<u32>,
    size: Vec3,
}

impl<'a> Cut<'a> {
    /// The squares between what becomes exact and what stays tracked.
    fn new(cluster: &Cluster, [old, new]: [&'a Region; 2], field: &'a ExactField<'a>) -> Self {
        let grid = new.grid;
        let mut squares = BTreeSet::new();
        for &block in cluster.blocks.iter().filter(|b| new.holds(**b) && !old.holds(**b)) {
            for cell in grid.cells_of(block) {
                for (square, other) in grid.squares_of(cell) {
                    if !new.is_exact(other) && !old.is_exact(other) {
                        squares.insert(square);
                    }
                }
            }
        }
        let is_released = |b: &u32| old.holds(*b) && !new.holds(*b);
        let released = cluster.blocks.iter().copied().filter(is_released).collect();
        let size = Vec3::from(field.volume().voxel_size().map(|x| x as f32));
        Cut { field, grid, old, new, squares, released, size }
    }

    fn is_cut(&self, s: Square) -> bool {
        self.squares.contains(&s)
    }

    /// A lattice plane, voxel frame.
    fn plane(&self, axis: usize, index: i64) -> f32 {
        (index as f64 * self.field.volume().voxel_size()[axis]) as f32
    }

    /// The index of the lattice plane across an axis in which a coordinate lies exactly.
    fn plane_of(&self, axis: usize, x: f32) -> Option<i64> {
        let index = (x / self.size[axis]).round() as i64;
        (self.plane(axis, index) == x).then_some(index)
    }

    /// Whether a box meets a cut square in a lattice plane across an axis, or nearly.
    fn meets(&self, axis: usize, index: i64, [low, high]: [Vec3; 2]) -> bool {
        let [b, c] = [1, 2].map(|n| (axis + n) % 3);
        let (x, y) = (low / self.size - NEAR, high / self.size + NEAR);
        let along = |a: usize| {
            let most = self.grid.dims[a] as i64 - 4;
            (x[a].floor() as i64).max(0)..=(y[a].floor() as i64).min(most)
        };
        if index < 0 || index + 3 > self.grid.dims[axis] as i64 {
            return false;
        }
        along(b).any(|i| {
            along(c).any(|j| {
                let mut q = [0; 3];
                (q[axis], q[b], q[c]) = (index, i, j);
                let corner = self.grid.vertex(q.map(|q: i64| q as usize + 1));
                self.is_cut(Square { corner, axis: axis as u8 })
            })
        })
    }

    /// Splits edges until no face near a cut square passes through its plane, and then no edge in a cut square
    /// through a plane across its sides.
    ///
    /// Each stage looks at one family of parallel planes, and what a stage has done no later one undoes, as every face
    /// comes out of one that was there: so it ends.
    fn split(&self, mesh: &mut Mesh) {
        if self.squares.is_empty() {
            return;
        }
        for axis in 0..3 {
            self.split_stage(mesh, axis, |cut, mesh, e, index| {
                let h = e.halfedge();
                [h, h.twin()].map(|h| mesh.face(h)).into_iter().any(|f| {
                    let (low, high) = bounds(mesh.corners(f));
                    !mesh.is_cap(f) && cut.meets(axis, index, [low, high])
                })
            });
        }
        for axis in 0..3 {
            self.split_stage(mesh, axis, |cut, mesh, e, _| {
                let h = e.halfedge();
                let [p, q] = [mesh.from(h), mesh.to(h)].map(|v| mesh.position(v));
                (0..3).filter(|&a| a != axis && p[a] == q[a]).any(|a| {
                    let plane = cut.plane_of(a, p[a]);
                    plane.is_some_and(|i| cut.meets(a, i, [p.min(q), p.max(q)]))
                })
            });
        }
    }

    /// Splits the edges that pass through a lattice plane across an axis, where asked to.
    fn split_stage(
        &self,
        mesh: &mut Mesh,
        axis: usize,
        is_asked: impl Fn(&Cut, &Mesh, Edge, i64) -> bool,
    ) {
        let planes = |mesh: &Mesh, e: Edge| {
            let h = e.halfedge();
            let [p, q] = [mesh.from(h), mesh.to(h)].map(|v| mesh.position(v)[axis]);
            let (low, high) = (p.min(q), p.max(q));
            let first = (low / self.size[axis]).floor() as i64;
            let last = (high / self.size[axis]).ceil() as i64;
            (first..=last).filter(move |&i| low < self.plane(axis, i) && self.plane(axis, i) < high)
        };
        // One plane after the other: what is split at one does not pass through it again.
        let mut edges: BTreeMap<i64, Vec<Edge>> = BTreeMap::new();
        for e in mesh.edges() {
            planes(mesh, e).for_each(|i| edges.entry(i).or_default().push(e));
        }
        while let Some((index, crossing)) = edges.pop_first() {
            for e in crossing {
                let h = e.halfedge();
                let is_cap = [h, h.twin()].iter().any(|&h| mesh.is_cap(mesh.face(h)));
                let passes = !is_cap && planes(mesh, e).any(|i| i == index);
                if !passes || !is_asked(self, mesh, e, index) {
                    continue;
                }
                let [p, q] = [mesh.from(h), mesh.to(h)].map(|v| mesh.position(v));
                let plane = self.plane(axis, index);
                let x = p.lerp(q, (plane - p[axis]) / (q[axis] - p[axis]));
                let mut x = x.clamp(p.min(q), p.max(q));
                x[axis] = plane;
                let s = mesh.split_edge(e, x);
                for e in s.halves.into_iter().chain(s.across) {
                    let above = planes(mesh, e).filter(|&i| i > index);
                    above.for_each(|i| edges.entry(i).or_default().push(e));
                }
            }
        }
    }

    /// The cell of a point, if the volume holds it.
    fn cell(&self, p: Vec3) -> Option<u32> {
        let x = p / self.size;
        let index: [i64; 3] = std::array::from_fn(|a| x[a].floor() as i64);
        let inside = (0..3).all(|a| index[a] >= 0 && index[a] + 3 < self.grid.dims[a] as i64);
        inside.then(|| self.grid.vertex(index.map(|i| i as usize + 1)))
    }

    /// Per face slot, whether it goes: it does in cells that become exact. What strays into cells that were exact already
    /// goes with what it is joined to, for the most part.
    fn removed(&self, tracked: &Tracked, is_rim: &[bool]) -> Vec<bool> {
        let mesh = &tracked.mesh;
        let mut removed = vec![false; mesh.face_slots()];
        let mut strays = Vec::new();
        for f in mesh.faces().filter(|&f| !mesh.is_cap(f)) {
            let cell = self.cell(mesh.corners(f).iter().sum::<Vec3>() / 3.0);
            match cell.filter(|&c| !self.old.is_exact(c)) {
                Some(cell) => removed[f.0 as usize] = self.new.is_exact(cell),
                None => strays.push(f),
            }
        }
        let mut is_stray = vec![false; mesh.face_slots()];
        strays.iter().for_each(|f| is_stray[f.0 as usize] = true);
        for &first in &strays {
            if !is_stray[first.0 as usize] {
                continue;
            }
            is_stray[first.0 as usize] = false;
            let (mut part, mut goes, mut i) = (vec![first], 0.0, 0);
            let (mut at_rim, mut is_alone) = (false, true);
            while i < part.len() {
                let at = |v: Vertex| is_rim.get(v.0 as usize).copied().unwrap_or(false);
                at_rim |= mesh.face_vertices(part[i]).into_iter().any(at);
                for h in mesh.face_halfedges(part[i]) {
                    let g = mesh.face(h.twin());
                    if is_stray[g.0 as usize] {
                        is_stray[g.0 as usize] = false;
                        part.push(g);
                    } else if !mesh.is_cap(g) && !part.contains(&g) {
                        let length = mesh.length(h.edge());
                        is_alone = false;
                        goes += if removed[g.0 as usize] { length } else { -length };
                    }
                }
                i += 1;
            }
            let goes = goes > 0.0 || is_alone && !at_rim;
            part.iter().for_each(|f| removed[f.0 as usize] = goes);
        }
        removed
    }

    /// The vertices in which a boundary crosses lattice edges. Where it crosses one to and fro, only what is left of
    /// that when crossings have cancelled in pairs; the others are no more than bends of the polyline.
    fn nodes(
        &self,
        pieces: &Pieces,
        tracked: &Tracked,
        regions: &[&Region],
    ) -> Result<BTreeMap<LatticeEdge, u32>, Refused> {
        let next = boundary(&pieces.triangles).map_err(|v| {
            Refused::at("no manifold", self.cell(pieces.positions[v as usize].into()))
        })?;
        let mut nodes: BTreeMap<LatticeEdge, Vec<(bool, u32)>> = BTreeMap::new();
        let mut failed = Vec::new();
        let mut at_rim: BTreeSet<Vertex> = BTreeSet::new();
        for &v in next.keys() {
            let bound = pieces.bound_by(tracked, v);
            // A vertex of the rim may be there once for each of its fans.
            let mut is_first = |o: Option<Vertex>| o.is_none_or(|o| at_rim.insert(o));
            if pieces.is_rim(v) && (bound.is_none() || !is_first(pieces.origin[v as usize])) {
                continue;
            }
            let e = match bound {
                Some(e) => Some(e),
                None => match self.lattice_edge(pieces.positions[v as usize].into()) {
                    Ok(e) => e,
                    Err(sample) => {
                        failed.push(sample);
                        continue;
                    }
                },
            };
            if let Some(e) = e.filter(|&e| regions.iter().any(|r| r.is_on_seam(e))) {
                nodes.entry(e).or_default().push((bound.is_none(), v));
            }
        }
        if !failed.is_empty() {
            return Err(Refused::at("through a sample", failed));
        }
        let left = nodes.into_iter().filter(|(_, all)| all.len() % 2 == 1);
        // Those that were bound come first.
        Ok(left
            .map(|(e, mut all)| {
                all.sort_unstable();
                (e, all[0].1)
            })
            .collect())
    }

    /// The lattice edge in which a place lies exactly, if in one; the sample where it lies in that.
    fn lattice_edge(&self, p: Vec3) -> Result<Option<LatticeEdge>, u32> {
        let planes: [Option<i64>; 3] = std::array::from_fn(|a| self.plane_of(a, p[a]));
        if planes.iter().flatten().count() < 2 {
            return Ok(None);
        }
        let x = p / self.size;
        let index: [i64; 3] = std::array::from_fn(|a| planes[a].unwrap_or(x[a].floor() as i64) + 1);
        if (0..3).any(|a| index[a] < 1 || index[a] + 2 > self.grid.dims[a] as i64) {
            return Ok(None);
        }
        let from = self.grid.vertex(index.map(|i| i as usize));
        let axis = planes.iter().position(Option::is_none).ok_or(from)?;
        Ok(Some(LatticeEdge { from, axis: axis as u8 }))
    }

    /// The lattice edges of the cut at a sample, and whether all of the seam around it is cut.
    fn cut_edges(&self, v: u32) -> (Vec<LatticeEdge>, bool) {
        let Link::Cycle(cycle, n) = self.new.link(v) else { return (Vec::new(), false) };
        let cycle = &cycle[..n as usize];
        let (mut edges, mut all) = (BTreeSet::new(), true);
        for i in 0..cycle.len() {
            let [d, e] = [cycle[i], cycle[(i + 1) % cycle.len()]];
            let mut corner = v;
            for x in [d, e] {
                if x % 2 == 0 {
                    corner = self.grid.beside(corner, x);
                }
            }
            if self.is_cut(Square { corner, axis: 3 - d / 2 - e / 2 }) {
                edges.extend([self.grid.edge(v, d), self.grid.edge(v, e)]);
            } else {
                all = false;
            }
        }
        (edges.into_iter().collect(), all)
    }

    /// The samples that the mesh has on the wrong side, in the order of how far the isovalue is from them; and samples at
    /// which that cannot be told.
    fn wrong(&self, nodes: &BTreeMap<LatticeEdge, u32>, isovalue: f64) -> (Vec<u32>, Vec<u32>) {
        let isovalue_key = self.field.isovalue_key(isovalue);
        let is_above = |v: u32| self.field.key(v) > isovalue_key;
        let differs = |e: LatticeEdge| {
            let [a, b] = self.grid.ends(e);
            nodes.contains_key(&e) != (is_above(a) != is_above(b))
        };
        let mut different: BTreeSet<LatticeEdge> = BTreeSet::new();
        for s in &self.squares {
            different.extend(sides(self.grid, *s).into_iter().filter(|&e| differs(e)));
        }
        // Samples joined by edges that agree lie on the same side of the mesh, or all on the wrong one.
        let mut wrong: BTreeSet<u32> = BTreeSet::new();
        let mut right: BTreeSet<u32> = BTreeSet::new();
        for &e in &different {
            for v in self.grid.ends(e) {
                if wrong.contains(&v) || right.contains(&v) {
                    continue;
                }
                let (mut group, mut anchored, mut i) = (vec![v], false, 0);
                while i < group.len() && group.len() <= MOST_WRONG {
                    let (edges, is_all_cut) = self.cut_edges(group[i]);
                    anchored |= !is_all_cut;
                    for e in edges.into_iter().filter(|e| !different.contains(e)) {
                        for w in self.grid.ends(e) {
                            if !group.contains(&w) {
                                group.push(w);
                            }
                        }
                    }
                    i += 1;
                }
                let side = if anchored || i < group.len() { &mut right } else { &mut wrong };
                side.extend(group);
            }
        }
        let failed: Vec<u32> = different
            .iter()
            .map(|&e| self.grid.ends(e))
            .filter(|ends| wrong.contains(&ends[0]) == wrong.contains(&ends[1]))
            .flatten()
            .collect();
        let mut wrong: Vec<u32> = wrong.into_iter().collect();
        // From the mesh outwards would need its distances; the values tell as much.
        let away = |v: &u32| (self.field.sample(*v) - isovalue).abs();
        wrong.sort_by(|a, b| away(a).total_cmp(&away(b)).then(a.cmp(b)));
        (wrong, failed)
    }

    /// Merges the vertices that the boundary has inside squares into those on lattice edges. Returns the cells where it
    /// cannot.
    fn straighten(&self, made: &mut Tracked, rim: &[bool], changes: &mut Changes) -> Vec<u32> {
        let is_rim = |v: &Vertex| rim.get(v.0 as usize).copied().unwrap_or(false);
        let at = |mesh: &Mesh, v: Vertex| mesh.position(v);
        let mut bends: Vec<Vertex> = made
            .mesh
            .vertices()
            .filter(|&v| made.mesh.is_fixed(v) && made.key(v).is_none())
            .filter(|&v| made.along(v, true).is_some() && !is_rim(&v))
            .collect();
        while !bends.is_empty() {
            let before = bends.len();
            let mut left = Vec::new();
            for &v in &bends {
                let ends = [true, false].map(|forward| made.along(v, forward));
                let mut next = ends.into_iter().flatten().filter(|&w| {
                    let h = made.mesh.find_halfedge(v, w);
                    h.is_some_and(|h| made.mesh.is_link_kept(h))
                });
                let target = next.next().or(ends[0]);
                drop(next);
                let done = target.and_then(|w| made.contract(v, w, &at, changes));
                if done.is_none() {
                    left.push(v);
                }
            }
            if left.len() == before {
                let places = left.iter().filter_map(|&v| self.cell(made.mesh.position(v)));
                return places.collect();
            }
            bends = left;
        }
        Vec::new()
    }
}

/// The four sides of a square, in cyclic order.
pub(super) fn sides(grid: Grid, s: Square) -> [LatticeEdge; 4] {
    let [u, v] = [1, 2].map(|n| (s.axis + n) % 3);
    let [a, b, _, d] = grid.corners(s);
    [(a, u), (b, v), (d, u), (a, v)].map(|(from, axis)| LatticeEdge { from, axis })
}

/// The exact extraction's polyline on a square at an isovalue: the ends of each of its edges.
pub(super) fn polyline(
    field: &ExactField,
    grid: Grid,
    s: Square,
    isovalue: f64,
) -> Vec<[LatticeEdge; 2]> {
    let key = field.isovalue_key(isovalue);
    let above = grid.corners(s).map(|v| field.key(v) > key);
    let sides = sides(grid, s);
    let crossed: Vec<usize> = (0..4).filter(|&i| above[i] != above[(i + 1) % 4]).collect();
    match crossed[..] {
        [] => Vec::new(),
        [a, b] => vec![[sides[a], sides[b]]],
        _ => {
            let saddle = field.face_saddle(s.corner, s.axis as usize);
            let saddle_above = saddle.is_some_and(|s| s.is_above(key));
            // What is on the other side than the saddle is cut off.
            let cut = (0..4).filter(|&i| above[i] != saddle_above);
            cut.map(|i| [sides[(i + 3) % 4], sides[i]]).collect()
        }
    }
}
