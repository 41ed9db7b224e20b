//! The measurements of one verification, in the order of their isovalues: a mesh then needs few chunks of a file that the one before did not.

use std::collections::BTreeMap;

use super::confidence::{Tallies, Tally};
use super::distribution::{Distribution, Summary};
use super::findings::{Continuity, Row};
use super::isovalues::{
    Draw, Sampling, event_isovalues, neighbours, random_isovalues, spread_isovalues,
};
use super::jump::{Jump, jump};
use super::manifold::mesh_topology;
use super::measure::{self, Geometry};
use super::meshes::Meshes;
use super::promise::{Bounds, Limits};
use super::report::Report;
use super::triangle_grid::TriangleGrid;
use super::vertex_set::VertexSet;
use crate::error::{Error, Result};
use crate::extract::count::count;
use crate::progress::Progress;
use crate::random::Random;
use crate::spectrum::Mesh;
use crate::topology::exact::ExactField;
use crate::volume::Volume;

/// Kinds of isovalues, in the order of the report.
const SINGLE: usize = 0;
const AT_EVENTS: usize = 1;
const ELSEWHERE: usize = 2;
const NEIGHBOURS: usize = 3;

/// The share of the range between two meshes of which the common vertices are counted.
const TRACKED_SHARE_STEP: f64 = 1.0 / 256.0;

/// What is measured at an isovalue.
#[derive(Clone, Copy)]
enum Task {
    /// All but jumps.
    Single,
    /// The vertices, to be compared with those a step higher.
    Vertices(usize),
    /// Which of these vertices are still there.
    Tracked(usize),
    /// A jump to the second isovalue, of a kind.
    Jump(usize, f64),
    /// Topology alone.
    Neighbour,
}

/// Measures a spectrum, which is that of the volume, at the isovalues of one verification. Returns also what of each promise is beyond its
/// limit where.
pub(super) fn measured(
    meshes: Meshes,
    volume: &Volume,
    (sampling, draw): (Sampling, Draw),
    limits: Limits,
    progress: &dyn Progress,
) -> Result<(Report, Tallies)> {
    let field = ExactField::new(volume)?;
    let about = meshes.about();
    let range = about.range();
    let mut random = Random::new(sampling.seed);
    let single = match draw {
        Draw::Random => random_isovalues,
        Draw::Spread => spread_isovalues,
    }(volume, range, sampling.n_random, &mut random);
    let at_events = event_isovalues(about.events(), range, sampling.n_events, &mut random);
    let neighbours = neighbours(volume, about, sampling.n_events, &mut random);
    // Jumps elsewhere are not known yet: about as many as at events.
    let n_all = single.len() + 4 * at_events.len() + neighbours.len();
    let tolerance = meshes.about().tolerance();
    let bounds = Bounds::new(&limits, tolerance);
    let mut run = Run {
        meshes,
        field,
        most: sampling.max_measured,
        progress,
        n_all: n_all.max(1),
        n_done: 0,
        bounds,
        rows: Default::default(),
        tallies: Tallies::new(bounds),
        pooled: Geometry::new(),
        jumps: [Jumps::new(), Jumps::new()],
        earlier: BTreeMap::new(),
        n_tracked: (0, 0),
    };
    run.perform(tasks(range, &single, &at_events, &neighbours))?;
    let lifetimes = run.meshes.lifetimes()?;
    let (elsewhere, coherence) =
        (lifetimes.busiest_elsewhere(sampling.n_events), lifetimes.coherence());
    drop(lifetimes);
    run.n_all = run.n_done + 2 * elsewhere.len();
    run.perform(jumps(ELSEWHERE, &elsewhere).collect())?;
    let Run { meshes, rows, mut tallies, pooled, jumps, n_tracked: (alive, survived), .. } = run;
    let [at_events, elsewhere] = jumps;
    let rows = rows.concat();
    for row in rows.iter().filter(|row| row.finite && !row.is_neighbour) {
        tallies.add_crossing(row.self_intersecting, row.n_triangles);
    }
    tallies.add_jumps(elsewhere.tallies);
    let continuity = Continuity {
        at_events: at_events.found,
        beyond_at_events: at_events.beyond.summary(),
        elsewhere: elsewhere.found,
        beyond_elsewhere: elsewhere.beyond.summary(),
        coherence,
        tracked_share: (alive > 0).then(|| survived as f64 / alive as f64),
    };
    let report = Report::new(meshes.about(), sampling, limits, rows, &pooled, continuity);
    Ok((report, tallies))
}

/// The tasks that the volume and the events alone decide, by isovalue. Those of a kind are in its order.
fn tasks(
    (low, high): (f64, f64),
    single: &[f64],
    at_events: &[(f64, f64)],
    neighbours: &[f64],
) -> Vec<(f64, Task)> {
    let step = (high - low) * TRACKED_SHARE_STEP;
    let mut tasks = Vec::new();
    for (i, &c) in single.iter().enumerate() {
        tasks.push((c, Task::Single));
        if c + step < high {
            tasks.extend([(c, Task::Vertices(i)), (c + step, Task::Tracked(i))]);
        }
    }
    tasks.extend(jumps(AT_EVENTS, at_events));
    tasks.extend(neighbours.iter().map(|&c| (c, Task::Neighbour)));
    tasks.sort_by(|a, b| a.0.total_cmp(&b.0));
    tasks
}

/// The jumps of a kind across some isovalues.
fn jumps(kind: usize, pairs: &[(f64, f64)]) -> impl Iterator<Item = (f64, Task)> {
    pairs.iter().map(move |&(before, after)| (before, Task::Jump(kind, after)))
}

/// A verification that is under way.
struct Run<'a> {
    meshes: Meshes<'a>,
    field: ExactField<'a>,
    /// The most triangles, and vertices, that are measured at an isovalue.
    most: usize,
    progress: &'a dyn Progress,
    n_all: usize,
    n_done: usize,
    bounds: Bounds,
    /// By kind of isovalue.
    rows: [Vec<Row>; 4],
    tallies: Tallies,
    pooled: Geometry,
    /// At events, and elsewhere.
    jumps: [Jumps; 2],
    /// The vertices at single isovalues whose vertices a step higher are not known yet.
    earlier: BTreeMap<usize, VertexSet>,
    /// Vertices at single isovalues, and those of them that are there a step higher.
    n_tracked: (u64, u64),
}

/// Jumps of one kind.
struct Jumps {
    found: Vec<Jump>,
    beyond: Distribution,
    tallies: Vec<Tally>,
}

impl Jumps {
    fn new() -> Self {
        let beyond = Distribution::new(measure::MAX_DISTANCE);
        Jumps { found: Vec::new(), beyond, tallies: Vec::new() }
    }
}

impl Run<'_> {
    /// Performs tasks, which are in the order of their isovalues.
    fn perform(&mut self, tasks: Vec<(f64, Task)>) -> Result<()> {
        tasks.into_iter().try_for_each(|(isovalue, task)| {
            self.meshes.see_up_to(isovalue)?;
            self.perform_one(isovalue, task)
        })
    }

    fn perform_one(&mut self, isovalue: f64, task: Task) -> Result<()> {
        match task {
            Task::Single => drop(self.measure(isovalue, SINGLE)?),
            Task::Vertices(i) => {
                self.earlier.insert(i, self.meshes.vertices_at(isovalue)?);
            }
            Task::Tracked(i) => {
                let now = self.meshes.vertices_at(isovalue)?;
                if let Some(earlier) = self.earlier.remove(&i) {
                    self.n_tracked.0 += earlier.len();
                    self.n_tracked.1 += earlier.n_common(&now);
                }
            }
            Task::Jump(kind, after) => {
                let (a, b) = (self.measure(isovalue, kind)?, self.measure(after, kind)?);
                let mut distances = Distribution::new(measure::MAX_DISTANCE);
                let jump = jump(&self.field, (isovalue, &a), (after, &b), &mut distances);
                let jumps = &mut self.jumps[kind - AT_EVENTS];
                jumps.found.push(jump);
                jumps.tallies.push(Tally::of(&distances, self.bounds.jump));
                jumps.beyond.merge(&distances);
            }
            Task::Neighbour => {
                let mesh = self.mesh_at(isovalue)?;
                let row = topology_row(&self.field, isovalue, true, &mesh);
                self.rows[NEIGHBOURS].push(Row { is_neighbour: true, ..row });
            }
        }
        Ok(())
    }

    fn mesh_at(&mut self, isovalue: f64) -> Result<Mesh> {
        self.progress.report(self.n_done as f64 / self.n_all as f64, "verifying");
        self.n_done += 1;
        if self.progress.cancelled() {
            return Err(Error::Interrupted);
        }
        self.meshes.mesh_at(isovalue)
    }

    /// Measures the mesh at an isovalue of a kind.
    fn measure(&mut self, isovalue: f64, kind: usize) -> Result<Mesh> {
        let mesh = self.mesh_at(isovalue)?;
        let (field, is_single) = (&self.field, kind == SINGLE);
        // Topology is found on one thread, geometry on all.
        let (mut row, measured) = rayon::join(
            || topology_row(field, isovalue, !is_single, &mesh),
            || geometry_of(field.volume(), isovalue, &mesh, self.most),
        );
        if let Some((self_intersecting, geometry)) = measured {
            row.self_intersecting = self_intersecting;
            row.barycentre_deviation = geometry.barycentre_deviation.summary();
            row.radius_ratio = geometry.radius_ratio.summary();
            if is_single {
                self.tallies.add(&geometry);
                self.pooled.merge(&geometry);
            }
        }
        self.rows[kind].push(row);
        Ok(mesh)
    }
}

/// The topology at one isovalue.
fn topology_row(field: &ExactField<'_>, isovalue: f64, at_event: bool, mesh: &Mesh) -> Row {
    let (expected, topology) = rayon::join(
        || count(field, isovalue),
        || mesh_topology(mesh.positions.len(), &mesh.triangles),
    );
    Row {
        isovalue,
        at_event,
        is_neighbour: false,
        n_triangles: mesh.triangles.len(),
        expected_components: expected.len(),
        expected_euler: expected.iter().map(|component| component.euler).sum(),
        topology,
        finite: measure::is_placed(field.volume(), mesh),
        self_intersecting: 0,
        barycentre_deviation: Summary::default(),
        radius_ratio: Summary::default(),
    }
}

/// How many triangles cross others, and the geometry; nothing if the mesh is not inside the volume.
fn geometry_of(
    volume: &Volume,
    isovalue: f64,
    mesh: &Mesh,
    most: usize,
) -> Option<(usize, Geometry)> {
    if !measure::is_placed(volume, mesh) {
        return None;
    }
    let grid = TriangleGrid::new(mesh);
    let geometry = measure::measure(volume, isovalue, mesh, &grid, most);
    Some((grid.self_intersecting().len(), geometry))
}
