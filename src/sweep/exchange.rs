//! Makes cells exact and releases others at one isovalue, in one cluster of blocks.
//!
//! # Theory
//!
//! *Release*: the exact extraction's triangles in cells that are no longer exact become part of the mesh unchanged.
//! They share the seam's vertices, so nothing has to be matched.
//!
//! *Make exact*: the mesh is cut along the lattice squares around cells that become exact, by edge splits only, and its faces
//! inside are removed. Its boundary there is then a polyline on those squares, and becomes the one of the exact extraction in
//! two moves. If the mesh has a sample on the wrong side (the isosurface may be nearer to that sample
//! than the mesh is to the isosurface), the boundary crosses it, as it does when the isovalue passes the sample. Then every
//! vertex moves along its lattice edge to its position in the exact extraction.
//!
//! If the mesh crosses a lattice edge more than once, or connects its crossings otherwise than the exact extraction does,
//! the exchange is refused: the caller makes more cells exact there and tries again. If everything is exact, no exchange is
//! needed.

mod cut;
mod pieces;
mod refused;

pub(super) use refused::Refused;

use std::collections::{BTreeMap, HashMap};

use super::check::open_part;
use super::clusters::Cluster;
use super::exchanged::Exchanged;
use super::part::MeshPart;
use super::region::{LatticeEdge, Region};
use super::tracked::{Changes, Tracked, place_of, place_on};
use crate::mesh::{HalfEdgeMesh, Vertex};
use crate::topology::exact::ExactField;
use cut::Cut;
use pieces::{Pieces, release};
use refused::Refusals;

/// Changes the mesh near some blocks to fit another region, at an isovalue.
pub(super) fn exchange(
    before: &Tracked,
    cluster: &Cluster,
    [old, new]: [&Region; 2],
    field: &ExactField,
    isovalue: f64,
) -> Result<Exchanged, Refused> {
    let part = MeshPart::of(before, &cluster.faces);
    let cut = Cut::new(cluster, [old, new], field);
    let (pieces, nodes) = pieces(before, &part, &cut, isovalue)?;
    let (wrong, unclear) = cut.wrong(&nodes, isovalue);
    let bound: HashMap<u32, LatticeEdge> = nodes.iter().map(|(e, v)| (*v, *e)).collect();
    let key = |v: u32| bound.get(&v).copied();
    let made = Tracked::of(pieces.positions, pieces.triangles, key);
    let mut made = made.map_err(|p| Refused::at("no manifold", cut.cell(p)))?;
    let mut changes = Changes::default();
    let at = |mesh: &HalfEdgeMesh, v: Vertex| mesh.position(v);
    // All reasons are collected, as every attempt is expensive.
    let mut refused = Refusals::default();
    refused.add("sides unclear", unclear);
    refused.add("not straightened", cut.straighten(&mut made, &pieces.rim, &mut changes));
    let mut cannot_cross = |made: &mut Tracked, &sample: &u32| {
        made.cross_sample(new, sample, place_of(field, sample), &at, &mut changes).is_err()
    };
    let stuck: Vec<u32> = wrong.into_iter().filter(|s| cannot_cross(&mut made, s)).collect();
    refused.add("sample not crossed", stuck);
    refused.none()?;
    let bound: Vec<(Vertex, LatticeEdge)> = made.bound().collect();
    for &(v, e) in &bound {
        made.mesh.set_position(v, place_on(field, e, isovalue));
    }
    let bound: Vec<Vertex> = bound.into_iter().map(|b| b.0).collect();
    made.split_bound_chords(new, &bound, &at, &mut changes);
    let mut was = pieces.was;
    was.resize(made.mesh.face_slots(), None);
    let exchanged = Exchanged { part, made, origin: pieces.origin, was };
    if !exchanged.has_rim() {
        return Err(Refused { why: "part too small", samples: Vec::new() });
    }
    let open = open_part(before, &exchanged, &cluster.blocks, [old, new], (field, isovalue));
    if open.is_empty() { Ok(exchanged) } else { Err(Refused::at("open", open)) }
}

/// The triangles of which a part is rebuilt, and the vertices in which their boundary crosses lattice edges.
fn pieces(
    before: &Tracked,
    part: &MeshPart,
    cut: &Cut,
    isovalue: f64,
) -> Result<(Pieces, BTreeMap<LatticeEdge, u32>), Refused> {
    let whole_key = |v: u32| part.origin[v as usize].and_then(|o| before.key(o));
    let of_part = Tracked::of(part.positions.clone(), part.triangles.clone(), whole_key);
    let mut tracked = of_part.map_err(|p| Refused::at("no part", cut.cell(p)))?;
    cut.split(&mut tracked.mesh);
    let mut pieces = Pieces::left(part, &tracked, &cut.removed(&tracked, &part.is_rim));
    pieces.split_pinched();
    let nodes = cut.nodes(&pieces, &tracked, &[cut.old, cut.new])?;
    pieces.bound = nodes.iter().map(|(e, v)| (*v, *e)).collect();
    release(&nodes, &cut.released, cut.field, isovalue, &mut pieces);
    pieces.split_pinched();
    let nodes = cut.nodes(&pieces, &tracked, &[cut.new])?;
    Ok((pieces, nodes))
}
