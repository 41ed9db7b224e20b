//! Tests of the recorder.

use super::*;
use crate::mesh::Edge;
use crate::mesh::shapes;
use crate::spectrum::Patch;
use crate::sweep::glide::{Edits, glides, split_edge_of};
use glam::Vec3;

fn octahedron() -> Mesh {
    shapes::octahedron(Vec3::ZERO, 1.0)
}

/// Records that the mesh, as it is, lies there at an isovalue.
fn knots(recorder: &mut Recorder, mesh: &Mesh, isovalue: f64) {
    let compacted = mesh.compacted();
    let normals = vec![[0.0, 0.0, 1.0]; compacted.vertices.len()];
    recorder.knots(&compacted.vertices, &compacted.positions, &normals, isovalue);
}

/// The log of the start, and recorders for both ways from it.
fn begun(mesh: &Mesh, isovalue: f64) -> (Log, [Recorder; 2]) {
    let vertices: Vec<Vertex> = mesh.vertices().collect();
    let normals = vec![[0.0, 0.0, 1.0]; vertices.len()];
    let start = Recorder::begin(mesh, &normals, &vertices, isovalue, 0);
    let ways = [Run::Up, Run::Down].map(|run| start.branch(run.of_arc(0)));
    (start.into_log(), ways)
}

/// The patch of a start and what followed.
fn patch(mut start: Log, ways: impl IntoIterator<Item = Log>) -> Patch {
    ways.into_iter().for_each(|log| start.append(log));
    start.patch(0.0)
}

/// How many triangles live from one isovalue to another.
fn n_living(patch: &Patch, from: f64, to: f64) -> usize {
    let at = |rank: u32| patch.isovalues[rank as usize];
    patch.triangles.iter().filter(|t| (at(t.birth), at(t.death)) == (from, to)).count()
}

fn knot_isovalues(patch: &Patch, v: usize) -> Vec<f64> {
    let knots = patch.first_knot[v] as usize..patch.first_knot[v + 1] as usize;
    patch.knots[knots].iter().map(|k| patch.isovalues[k.rank as usize]).collect()
}

#[test]
fn a_triangle_of_the_start_lives_on_both_sides_of_it() {
    let mesh = octahedron();
    let (start, [mut up, mut down]) = begun(&mesh, 1.0);
    knots(&mut up, &mesh, 3.0);
    knots(&mut down, &mesh, 0.0);
    let patch = patch(start, [up.finish(3.0), down.finish(0.0)]);
    assert_eq!((patch.triangles.len(), n_living(&patch, 0.0, 3.0)), (8, 8));
    for v in 0..6 {
        assert_eq!(knot_isovalues(&patch, v), [0.0, 1.0, 3.0]);
    }
}

#[test]
fn a_flip_ends_two_triangles_and_begins_two() {
    let start = octahedron();
    let (log, [mut up, mut down]) = begun(&start, 1.0);
    let mut mesh = start.clone();
    knots(&mut up, &mesh, 2.0);
    mesh.flip(Edge(0));
    up.edits(&mesh, &[], 2.0, Direction::Up);
    knots(&mut up, &mesh, 3.0);
    knots(&mut down, &start, 0.0);
    let patch = patch(log, [up.finish(3.0), down.finish(0.0)]);
    assert_eq!(patch.triangles.len(), 10);
    assert_eq!(n_living(&patch, 0.0, 3.0), 6);
    assert_eq!(n_living(&patch, 0.0, 2.0), 2);
    assert_eq!(n_living(&patch, 2.0, 3.0), 2);
}

#[test]
fn a_vertex_between_a_split_and_a_collapse_has_a_trajectory_of_its_own() {
    for (direction, [split, middle, collapse, end]) in
        [(Direction::Up, [2.0, 2.5, 3.0, 4.0]), (Direction::Down, [-2.0, -2.5, -3.0, -4.0])]
    {
        let mut mesh = octahedron();
        let (start, [mut recorder, _]) = begun(&mesh, 0.0);
        knots(&mut recorder, &mesh, split);
        let added = mesh.split_edge(Edge(0), Vec3::ZERO).vertex;
        recorder.edits(&mesh, &[], split, direction);
        knots(&mut recorder, &mesh, middle);
        recorder.edits(&mesh, &[], middle, direction);
        knots(&mut recorder, &mesh, collapse);
        let spoke = mesh.outgoing(added);
        let target = mesh.to(spoke);
        assert!(mesh.can_collapse(spoke));
        mesh.collapse(spoke);
        recorder.edits(&mesh, &[(added, target)], collapse, direction);
        knots(&mut recorder, &mesh, end);
        let patch = patch(start, [recorder.finish(end)]);
        let living = |a: f64, b: f64| n_living(&patch, f64::min(a, b), f64::max(a, b));
        // The split cuts two faces in two, the collapse puts the two back together.
        assert_eq!(living(0.0, end), 6, "{direction:?}");
        assert_eq!(living(0.0, split), 2, "{direction:?}");
        assert_eq!(living(split, collapse), 4, "{direction:?}");
        assert_eq!(living(collapse, end), 2, "{direction:?}");
        assert_eq!(patch.triangles.len(), 14, "{direction:?}");
        let mut expected = [split, middle, collapse];
        expected.sort_by(f64::total_cmp);
        assert_eq!(knot_isovalues(&patch, 6), expected);
        let [recorded] = patch.collapses[..] else { panic!("one collapse: {patch:?}") };
        assert_eq!((recorded.vertex, recorded.target), (6, target.0));
        assert_eq!(patch.isovalues[recorded.rank as usize], collapse);
        assert_eq!(recorded.upward, direction == Direction::Up);
    }
}

#[test]
fn a_mesh_put_together_goes_on_with_the_trajectories_and_triangles_that_stay() {
    let mesh = octahedron();
    let (start, [mut up, _]) = begun(&mesh, 0.0);
    knots(&mut up, &mesh, 1.0);
    // All stays but face 0, which is replaced by another with the same vertices.
    let kept_vertices: Vec<(usize, Vertex)> = mesh.vertices().map(|v| (0, v)).collect();
    let kept_faces: Vec<(usize, Face)> = mesh.faces().skip(1).map(|f| (0, f)).collect();
    let mut others = [up];
    let run = Run::Surgery.of_arc(1);
    let mut after = Recorder::resume(&others, &kept_vertices, &kept_faces, None, run);
    others[0].end_face(Face(0), 1.5);
    let positions: Vec<[f32; 3]> = mesh.vertices().map(|v| mesh.position(v).to_array()).collect();
    let mut triangles: Vec<[u32; 3]> =
        mesh.faces().map(|f| mesh.face_vertices(f).map(|v| v.0)).collect();
    triangles.rotate_left(1);
    let replaced =
        Mesh::from_triangles(&positions, &[0; 6], &triangles, &[false; 8]).expect("closed");
    after.edits(&replaced, &[], 1.5, Direction::Up);
    knots(&mut after, &replaced, 2.0);
    let [before] = others;
    let patch = patch(start, [before.into_log(), after.finish(2.0)]);
    assert_eq!((n_living(&patch, 0.0, 2.0), n_living(&patch, 0.0, 1.5)), (7, 1));
    assert_eq!((n_living(&patch, 1.5, 2.0), patch.triangles.len()), (1, 9));
    assert_eq!(patch.first_knot.len(), 7);
}

#[test]
fn the_surface_does_not_jump_where_an_edge_is_split_and_where_it_is_collapsed() {
    let mut mesh = octahedron();
    let (start, [mut recorder, _]) = begun(&mesh, 0.0);
    knots(&mut recorder, &mesh, 1.0);
    let before = mesh.compacted();
    let out = Vec3::new(2.0, 2.0, 0.0);
    let mut born = Vec::new();
    let added = split_edge_of(&mut mesh, Edge(0), out, &mut born);
    let [a, b] = born[0].between.map(|v| mesh.position(v));
    let edits = Edits { born, collapsed: Vec::new() };
    recorder.glide(&mesh, &glides(&before, &edits), 1.0);
    recorder.edits(&mesh, &[], 1.0, Direction::Up);
    knots(&mut recorder, &mesh, 2.0);
    let before = mesh.compacted();
    let spoke = mesh.outgoing(added);
    let target = mesh.to(spoke);
    let end = mesh.position(target);
    assert!(mesh.can_collapse(spoke));
    mesh.collapse(spoke);
    let edits = Edits { born: Vec::new(), collapsed: vec![(added, target)] };
    recorder.glide(&mesh, &glides(&before, &edits), 2.0);
    recorder.edits(&mesh, &[(added, target)], 2.0, Direction::Up);
    knots(&mut recorder, &mesh, 3.0);
    let patch = patch(start, [recorder.finish(3.0)]);
    let own = patch.first_knot[6] as usize..patch.first_knot[7] as usize;
    let places: Vec<Vec3> = patch.knots[own].iter().map(|k| k.position.into()).collect();
    let risen = 1.0 + GLIDE_SHARE;
    let leaves = risen + (1.0 - GLIDE_SHARE) * (2.0 - risen);
    assert_eq!(knot_isovalues(&patch, 6), [1.0, risen, leaves, 2.0]);
    assert_eq!(places, [0.5 * (a + b), out, out, end]);
}

/// Where a vertex of a patch is at an isovalue.
fn place_at(patch: &Patch, v: usize, c: f64) -> Vec3 {
    let knots = &patch.knots[patch.first_knot[v] as usize..patch.first_knot[v + 1] as usize];
    let at = |i: usize| patch.isovalues[knots[i].rank as usize];
    let to = (0..knots.len()).find(|&i| at(i) >= c).expect("alive");
    let from = to.saturating_sub(usize::from(at(to) > c));
    let share = if from == to { 0.0 } else { (c - at(from)) / (at(to) - at(from)) };
    Vec3::from(knots[from].position).lerp(knots[to].position.into(), share as f32)
}

#[test]
fn vertices_begin_and_end_on_the_ways_of_others_though_those_have_fewer_knots() {
    let mut mesh = octahedron();
    let (mut start, [mut recorder, _]) = begun(&mesh, 0.0);
    let shake = |mesh: &mut Mesh, by: f32| {
        for v in 0..6 {
            mesh.set_position(Vertex(v), mesh.position(Vertex(v)) + Vec3::splat(by));
        }
    };
    shake(&mut mesh, 0.02);
    knots(&mut recorder, &mesh, 1.0);
    let before = mesh.compacted();
    let mut born = Vec::new();
    let added = split_edge_of(&mut mesh, Edge(0), Vec3::new(2.0, 2.0, 0.0), &mut born);
    let parents = born[0].between.map(|v| v.0 as usize);
    let edits = Edits { born, collapsed: Vec::new() };
    recorder.glide(&mesh, &glides(&before, &edits), 1.0);
    recorder.edits(&mesh, &[], 1.0, Direction::Up);
    shake(&mut mesh, -0.01);
    knots(&mut recorder, &mesh, 2.0);
    let before = mesh.compacted();
    let spoke = mesh.outgoing(added);
    let target = mesh.to(spoke);
    mesh.collapse(spoke);
    let edits = Edits { born: Vec::new(), collapsed: vec![(added, target)] };
    recorder.glide(&mesh, &glides(&before, &edits), 2.0);
    recorder.edits(&mesh, &[(added, target)], 2.0, Direction::Up);
    shake(&mut mesh, -0.01);
    knots(&mut recorder, &mesh, 3.0);
    start.append(recorder.finish(3.0));
    let patch = start.patch(0.05);
    assert_eq!(knot_isovalues(&patch, parents[0]), [0.0, 3.0]);
    let middle = parents.map(|v| place_at(&patch, v, 1.0)).iter().sum::<Vec3>() / 2.0;
    assert!(place_at(&patch, 6, 1.0).distance(middle) < 1e-6);
    assert!(place_at(&patch, 6, 2.0).distance(place_at(&patch, target.0 as usize, 2.0)) < 1e-6);
}

#[test]
fn a_new_vertex_rises_though_others_have_knots_before_it() {
    let mut mesh = octahedron();
    let (start, [mut recorder, _]) = begun(&mesh, 0.0);
    knots(&mut recorder, &mesh, 1.0);
    let before = mesh.compacted();
    let mut born = Vec::new();
    split_edge_of(&mut mesh, Edge(0), Vec3::new(2.0, 2.0, 0.0), &mut born);
    let edits = Edits { born, collapsed: Vec::new() };
    recorder.glide(&mesh, &glides(&before, &edits), 1.0);
    recorder.edits(&mesh, &[], 1.0, Direction::Up);
    recorder.knot_at(&mesh, Vertex(5), mesh.position(Vertex(5)), 1.5);
    knots(&mut recorder, &mesh, 2.0);
    let patch = patch(start, [recorder.finish(2.0)]);
    assert_eq!(knot_isovalues(&patch, 5), [0.0, 1.0, 1.5, 2.0]);
    assert_eq!(knot_isovalues(&patch, 6), [1.0, 1.0 + GLIDE_SHARE, 2.0]);
}

#[test]
fn what_never_shows_is_left_out() {
    let mut mesh = octahedron();
    let (start, [mut recorder, _]) = begun(&mesh, 0.0);
    let added = mesh.split_edge(Edge(0), Vec3::ZERO).vertex;
    recorder.edits(&mesh, &[], 0.0, Direction::Up);
    let spoke = mesh.outgoing(added);
    let target = mesh.to(spoke);
    mesh.collapse(spoke);
    recorder.edits(&mesh, &[(added, target)], 0.0, Direction::Up);
    knots(&mut recorder, &mesh, 1.0);
    let patch = patch(start, [recorder.finish(1.0)]);
    assert_eq!((patch.triangles.len(), n_living(&patch, 0.0, 1.0)), (8, 8));
    assert_eq!((patch.first_knot.len(), patch.collapses.len()), (7, 0));
}
