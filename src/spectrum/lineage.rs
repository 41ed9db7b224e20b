//! Births and deaths of the components of an isosurface, from the connectivity of the spectrum alone.
//!
//! # Theory
//!
//! Triangles that share a vertex belong to one component while both are alive. So the components at an isovalue
//! are tracked upwards (or downwards) by uniting the vertices of every triangle that is added. A component
//! dies at a point when its last triangle is removed. Where two meet, the larger one at the start isovalue
//! continues and the smaller one ends: this is the branch decomposition of the contour tree, larger branches first
//! (Pascucci, Cole-McLaughlin and Scorzelli, "Multi-resolution computation and
//! presentation of contour trees", 2004, with the volume as importance). A component that splits lives until the last of
//! its pieces dies.
//!
//! Where a component is extracted anew, all its vertices are new. It then continues in those triangles added at the
//! same isovalue that are nearest to most of its last ones.

use std::collections::{BTreeMap, HashMap, HashSet};

use glam::{IVec3, Vec3};

use super::components::Components;
use super::data::Spectrum;
use crate::disjoint_sets::DisjointSets;

/// Largest distance of a component's last triangles from those that replace them, voxels: both are meshes of one
/// isosurface, whose vertices are about a voxel apart.
const MAX_DISTANCE: f32 = 0.8;

/// A component vanishes at a point if its last bounding box is smaller than this, voxels.
const MAX_POINT_SIZE: f32 = 0.05;

/// An end of a component's life.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct End {
    /// The isovalue.
    pub isovalue: f64,
    /// The number of the larger component that it joins; none if it vanishes.
    pub joins: Option<u32>,
}

/// The life of a component; `None` where it reaches the end of the spectrum's range.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct Lineage {
    /// At lower isovalues: where it appears, or splits off a larger one.
    pub birth: Option<End>,
    /// At higher isovalues: where it vanishes, or merges with a larger one.
    pub death: Option<End>,
}

/// The lives of the components of the isosurface at an isovalue. `components` are those of
/// [`Spectrum::mesh_at`].
///
/// # Errors
///
/// [`Error::Range`](crate::Error::Range) outside [`Spectrum::range`].
pub fn lineages(
    spectrum: &Spectrum,
    isovalue: f64,
    components: &Components,
) -> crate::Result<Vec<Lineage>> {
    spectrum.check_isovalue(isovalue)?;
    let n = components.list.len();
    let Some(rank) = spectrum.rank_at(isovalue) else { return Ok(vec![Lineage::default(); n]) };
    let end = |upward| Tracker::new(spectrum, rank, components, upward).run(rank);
    let (births, deaths) = (end(false), end(true));
    Ok(births.into_iter().zip(deaths).map(|(birth, death)| Lineage { birth, death }).collect())
}

/// Points with their triangles, by cell of a grid.
type PointGrid = HashMap<IVec3, Vec<(Vec3, u32)>>;

/// A set of connected vertices.
#[derive(Clone, Copy, Default)]
struct ConnectedSet {
    /// The number of its triangles that are alive at the current rank.
    n_alive: u32,
    /// The component of the start isovalue in this set, plus one; 0 if there is none, or it has ended.
    component: u32,
}

/// Tracks components from one isovalue in one direction. Each that has not ended is one set of vertices.
struct Tracker<'a> {
    spectrum: &'a Spectrum,
    upward: bool,
    sets: DisjointSets,
    /// By representative.
    connected: Vec<ConnectedSet>,
    ends: Vec<Option<End>>,
    /// The number of components that have not ended.
    n_left: usize,
}

impl<'a> Tracker<'a> {
    fn new(spectrum: &'a Spectrum, rank: u32, components: &Components, upward: bool) -> Self {
        let n = components.list.len();
        let n_vertices = spectrum.n_vertices();
        let mut tracker = Tracker {
            spectrum,
            upward,
            sets: DisjointSets::new(n_vertices),
            connected: vec![ConnectedSet::default(); n_vertices],
            ends: vec![None; n],
            n_left: n,
        };
        let alive = spectrum.triangles().iter().filter(|t| t.birth <= rank && rank < t.death);
        for (triangle, &component) in alive.zip(&components.of_triangle) {
            let [a, b, c] = triangle.vertices;
            let root = [b, c].into_iter().fold(a, |root, v| tracker.unite(root, v, f64::NAN));
            let set = &mut tracker.connected[root as usize];
            set.n_alive += 1;
            set.component = component + 1;
        }
        tracker
    }

    /// The rank at which a triangle is added.
    fn added_at(&self, triangle: u32) -> u32 {
        let triangle = &self.spectrum.triangles()[triangle as usize];
        if self.upward { triangle.birth } else { triangle.death }
    }

    /// The rank at which a triangle is removed.
    fn removed_at(&self, triangle: u32) -> u32 {
        let triangle = &self.spectrum.triangles()[triangle as usize];
        if self.upward { triangle.death } else { triangle.birth }
    }

    /// The triangles for which `at` is beyond `rank` in the direction of tracking, in the order of tracking.
    fn beyond(&self, rank: u32, at: impl Fn(u32) -> u32) -> Vec<u32> {
        let is_beyond = |r: u32| if self.upward { r > rank } else { r <= rank };
        let numbers = 0..self.spectrum.triangles().len() as u32;
        let mut list: Vec<u32> = numbers.filter(|&i| is_beyond(at(i))).collect();
        list.sort_unstable_by_key(|&i| (if self.upward { at(i) } else { u32::MAX - at(i) }, i));
        list
    }

    fn run(mut self, rank: u32) -> Vec<Option<End>> {
        let to_add = self.beyond(rank, |i| self.added_at(i));
        let to_remove = self.beyond(rank, |i| self.removed_at(i));
        let (mut to_add, mut to_remove) = (&to_add[..], &to_remove[..]);
        while self.n_left > 0
            && let Some(&first) = to_remove.first()
        {
            let rank = self.removed_at(first);
            if self.is_outside(self.spectrum.isovalues()[rank as usize]) {
                // The remaining components reach the end of the range.
                break;
            }
            let is_due = |i: &u32| {
                if self.upward { self.added_at(*i) <= rank } else { self.added_at(*i) >= rank }
            };
            let (added, later) = to_add.split_at(to_add.partition_point(is_due));
            added.iter().for_each(|&i| self.add(i));
            let (removed, left) =
                to_remove.split_at(to_remove.partition_point(|&i| self.removed_at(i) == rank));
            self.remove(removed, added, rank);
            (to_add, to_remove) = (later, left);
        }
        self.ends
    }

    fn is_outside(&self, isovalue: f64) -> bool {
        let (low, high) = self.spectrum.range();
        if self.upward { isovalue > high } else { isovalue <= low }
    }

    /// Adds a triangle.
    fn add(&mut self, triangle: u32) {
        let isovalue = self.spectrum.isovalues()[self.added_at(triangle) as usize];
        let [a, b, c] = self.spectrum.triangles()[triangle as usize].vertices;
        let root = [b, c].into_iter().fold(a, |root, v| self.unite(root, v, isovalue));
        let root = self.sets.find(root) as usize;
        self.connected[root].n_alive += 1;
    }

    /// Unites the sets of two vertices; of two components the smaller one ends. Returns the representative.
    fn unite(&mut self, a: u32, b: u32, isovalue: f64) -> u32 {
        let [p, q] = [a, b].map(|v| self.sets.find(v));
        if p == q {
            return p;
        }
        let (x, y) = (self.connected[p as usize], self.connected[q as usize]);
        let (less, more) = (x.component.min(y.component), x.component.max(y.component));
        if less > 0 && less < more && !isovalue.is_nan() {
            self.end(more, End { isovalue, joins: Some(less - 1) });
        }
        self.sets.join(p, q);
        let component = if less > 0 { less } else { more };
        let root = self.sets.find(p);
        self.connected[root as usize] = ConnectedSet { n_alive: x.n_alive + y.n_alive, component };
        root
    }

    fn end(&mut self, component: u32, end: End) {
        self.ends[component as usize - 1] = Some(end);
        self.n_left -= 1;
    }

    /// Removes triangles at one rank. Components without triangles end, unless they are extracted
    /// anew among the triangles just added.
    fn remove(&mut self, removed: &[u32], added: &[u32], rank: u32) {
        let mut emptied = Vec::new();
        for &i in removed {
            let root = self.root_of(i);
            let set = &mut self.connected[root as usize];
            set.n_alive -= 1;
            if set.n_alive == 0 && set.component > 0 {
                emptied.push(root);
            }
        }
        if emptied.is_empty() {
            return;
        }
        // Collected before sets are united, which changes representatives.
        let mut last: BTreeMap<u32, Vec<Vec3>> = emptied.iter().map(|&r| (r, Vec::new())).collect();
        for &i in removed {
            if let Some(points) = last.get_mut(&self.root_of(i)) {
                points.extend(self.points_of(i, rank));
            }
        }
        last.retain(|_, points| !is_point(points));
        let added = added.iter().copied().filter(|&i| self.added_at(i) == rank);
        let grid = self.point_grid(added, rank, &last);
        emptied.sort_unstable_by_key(|&root| self.connected[root as usize].component);
        let isovalue = self.spectrum.isovalues()[rank as usize];
        for root in emptied {
            if let Some(next) = last.get(&root).and_then(|points| self.replacement(points, &grid)) {
                self.unite(root, next, isovalue);
            } else {
                let component = std::mem::take(&mut self.connected[root as usize].component);
                self.end(component, End { isovalue, joins: None });
            }
        }
    }

    /// The corners and the barycentre of a triangle at a rank.
    fn points_of(&self, triangle: u32, rank: u32) -> [Vec3; 4] {
        let isovalue = self.spectrum.isovalues()[rank as usize];
        let corners = self.spectrum.triangles()[triangle as usize]
            .vertices
            .map(|v| Vec3::from(self.spectrum.vertex_at(v, rank, isovalue)));
        let [a, b, c] = corners;
        [a, b, c, (a + b + c) / 3.0]
    }

    /// A grid of the points of triangles, without cells that are not near `points`.
    fn point_grid(
        &self,
        triangles: impl Iterator<Item = u32>,
        rank: u32,
        points: &BTreeMap<u32, Vec<Vec3>>,
    ) -> PointGrid {
        let wanted: HashSet<IVec3> = points.values().flatten().flat_map(|&p| around(p)).collect();
        let mut grid = PointGrid::new();
        if wanted.is_empty() {
            return grid;
        }
        for i in triangles {
            for p in self.points_of(i, rank).into_iter().filter(|&p| wanted.contains(&cell(p))) {
                grid.entry(cell(p)).or_default().push((p, i));
            }
        }
        grid
    }

    /// The set that replaces a component with these last points: the one nearest to most of them, if most of them are near an added
    /// triangle.
    fn replacement(&mut self, points: &[Vec3], grid: &PointGrid) -> Option<u32> {
        let mut votes: BTreeMap<u32, usize> = BTreeMap::new();
        let mut n_near = 0;
        for &p in points {
            let near = around(p).filter_map(|c| grid.get(&c)).flatten();
            let near = near.map(|&(q, i)| (p.distance_squared(q), i));
            let nearest = near.min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            if let Some((_, i)) = nearest.filter(|n| n.0 < MAX_DISTANCE * MAX_DISTANCE) {
                n_near += 1;
                *votes.entry(self.root_of(i)).or_default() += 1;
            }
        }
        let best = votes.into_iter().max_by_key(|&(root, n)| (n, std::cmp::Reverse(root)));
        best.filter(|_| 2 * n_near > points.len()).map(|(root, _)| root)
    }

    fn root_of(&mut self, triangle: u32) -> u32 {
        self.sets.find(self.spectrum.triangles()[triangle as usize].vertices[0])
    }
}

/// The cell of the grid at a point. Cells are as wide as the largest distance.
fn cell(p: Vec3) -> IVec3 {
    (p / MAX_DISTANCE).floor().as_ivec3()
}

/// The cell at a point and its neighbours.
fn around(p: Vec3) -> impl Iterator<Item = IVec3> {
    (0..27).map(move |i| cell(p) + IVec3::new(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1))
}

/// Whether the bounding box of points is that of a single point.
fn is_point(points: &[Vec3]) -> bool {
    let low = points.iter().copied().reduce(Vec3::min);
    let high = points.iter().copied().reduce(Vec3::max);
    low.zip(high).is_none_or(|(low, high)| (high - low).max_element() < MAX_POINT_SIZE)
}
