//! Where the components of an isosurface begin and end, by what hangs together in the spectrum.
//!
//! # Theory
//!
//! Triangles that share a vertex belong to one component while both live, so going from an isovalue up (or down) the
//! components that are found there are followed by uniting the vertices of every triangle that comes. A component
//! ends where none of its triangles is left: there it vanishes. Where two meet, the larger one at the isovalue from
//! which they are followed goes on and the smaller one ends: this is the branch of the contour tree in which a
//! component lies, larger branches first (Pascucci, Cole-McLaughlin and Scorzelli, "Multi-resolution computation and
//! presentation of contour trees", 2004, with the volume as importance). One that splits goes on until the last of
//! its pieces has ended.
//!
//! Where a component is extracted afresh all of its vertices are new. It then goes on in the triangles that came at the
//! same isovalue where most of its last ones were.

use std::collections::{BTreeMap, HashMap, HashSet};

use glam::{IVec3, Vec3};

use super::{Components, Spectrum};
use crate::disjoint_sets::DisjointSets;

/// How far a component's last triangles may be from those that take over from it, voxels: two meshes of one
/// isosurface, whose vertices are about a voxel apart.
const NEAR: f32 = 0.8;

/// A component whose box is smaller than this is at its end, voxels.
const POINT: f32 = 0.05;

/// Where a component ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct End {
    /// The isovalue.
    pub isovalue: f64,
    /// The larger component that it joins there, by number; none where it just vanishes.
    pub joins: Option<u32>,
}

/// Where a component begins and ends; none where it reaches the end of the spectrum's range.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct Lineage {
    /// Towards lower isovalues: where it appears, or splits off a larger one.
    pub birth: Option<End>,
    /// Towards higher isovalues: where it vanishes, or merges with a larger one.
    pub death: Option<End>,
}

/// Of each component of the isosurface at an isovalue, where it begins and ends. `components` are those of
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
    let end = |upward| Follower::new(spectrum, rank, components, upward).run(rank);
    let (births, deaths) = (end(false), end(true));
    Ok(births.into_iter().zip(deaths).map(|(birth, death)| Lineage { birth, death }).collect())
}

/// Places with the triangle that each belongs to, by cell.
type Places = HashMap<IVec3, Vec<(Vec3, u32)>>;

/// What is known of the set of a vertex that represents it.
#[derive(Clone, Copy, Default)]
struct Kin {
    /// How many triangles it has where the follower is.
    n_alive: u32,
    /// The component of the first isovalue that it is, plus one; 0 where there was none, or where it has ended.
    component: u32,
}

/// Follows components from one isovalue in one direction. Each that has not ended is one set of vertices.
struct Follower<'a> {
    spectrum: &'a Spectrum,
    upward: bool,
    sets: DisjointSets,
    /// By representative.
    kin: Vec<Kin>,
    ends: Vec<Option<End>>,
    /// How many components have not ended.
    n_left: usize,
}

impl<'a> Follower<'a> {
    fn new(spectrum: &'a Spectrum, rank: u32, components: &Components, upward: bool) -> Self {
        let n = components.list.len();
        let n_vertices = spectrum.n_vertices();
        let mut follower = Follower {
            spectrum,
            upward,
            sets: DisjointSets::new(n_vertices),
            kin: vec![Kin::default(); n_vertices],
            ends: vec![None; n],
            n_left: n,
        };
        let alive = spectrum.triangles().iter().filter(|t| t.birth <= rank && rank < t.death);
        for (triangle, &component) in alive.zip(&components.of_triangle) {
            let [a, b, c] = triangle.vertices;
            let root = [b, c].into_iter().fold(a, |root, v| follower.unite(root, v, f64::NAN));
            let kin = &mut follower.kin[root as usize];
            kin.n_alive += 1;
            kin.component = component + 1;
        }
        follower
    }

    /// Rank at which a triangle comes on the way.
    fn comes(&self, triangle: u32) -> u32 {
        let triangle = &self.spectrum.triangles()[triangle as usize];
        if self.upward { triangle.birth } else { triangle.death }
    }

    /// Rank at which it goes.
    fn goes(&self, triangle: u32) -> u32 {
        let triangle = &self.spectrum.triangles()[triangle as usize];
        if self.upward { triangle.death } else { triangle.birth }
    }

    /// The triangles for which `at` lies beyond `rank`, in the order in which they are met.
    fn beyond(&self, rank: u32, at: impl Fn(u32) -> u32) -> Vec<u32> {
        let is_beyond = |r: u32| if self.upward { r > rank } else { r <= rank };
        let numbers = 0..self.spectrum.triangles().len() as u32;
        let mut list: Vec<u32> = numbers.filter(|&i| is_beyond(at(i))).collect();
        list.sort_unstable_by_key(|&i| (if self.upward { at(i) } else { u32::MAX - at(i) }, i));
        list
    }

    fn run(mut self, rank: u32) -> Vec<Option<End>> {
        let coming = self.beyond(rank, |i| self.comes(i));
        let going = self.beyond(rank, |i| self.goes(i));
        let (mut coming, mut going) = (&coming[..], &going[..]);
        while self.n_left > 0
            && let Some(&first) = going.first()
        {
            let rank = self.goes(first);
            if self.is_outside(self.spectrum.isovalues()[rank as usize]) {
                // What is still there reaches the end of the range.
                break;
            }
            let is_due = |i: &u32| {
                if self.upward { self.comes(*i) <= rank } else { self.comes(*i) >= rank }
            };
            let (due, later) = coming.split_at(coming.partition_point(is_due));
            due.iter().for_each(|&i| self.take_in(i));
            let (gone, left) = going.split_at(going.partition_point(|&i| self.goes(i) == rank));
            self.let_go(gone, due, rank);
            (coming, going) = (later, left);
        }
        self.ends
    }

    fn is_outside(&self, isovalue: f64) -> bool {
        let (low, high) = self.spectrum.range();
        if self.upward { isovalue > high } else { isovalue <= low }
    }

    fn take_in(&mut self, triangle: u32) {
        let isovalue = self.spectrum.isovalues()[self.comes(triangle) as usize];
        let [a, b, c] = self.spectrum.triangles()[triangle as usize].vertices;
        let root = [b, c].into_iter().fold(a, |root, v| self.unite(root, v, isovalue));
        let root = self.sets.find(root) as usize;
        self.kin[root].n_alive += 1;
    }

    /// Unites the sets of two vertices; of two components the smaller one ends. Returns the representative.
    fn unite(&mut self, a: u32, b: u32, isovalue: f64) -> u32 {
        let [p, q] = [a, b].map(|v| self.sets.find(v));
        if p == q {
            return p;
        }
        let (x, y) = (self.kin[p as usize], self.kin[q as usize]);
        let (less, more) = (x.component.min(y.component), x.component.max(y.component));
        if less > 0 && less < more && !isovalue.is_nan() {
            self.end(more, End { isovalue, joins: Some(less - 1) });
        }
        self.sets.join(p, q);
        let component = if less > 0 { less } else { more };
        let root = self.sets.find(p);
        self.kin[root as usize] = Kin { n_alive: x.n_alive + y.n_alive, component };
        root
    }

    fn end(&mut self, component: u32, end: End) {
        self.ends[component as usize - 1] = Some(end);
        self.n_left -= 1;
    }

    /// Takes triangles out that all go at one rank. Components of which nothing is left end, if they are not extracted
    /// afresh among those that just came.
    fn let_go(&mut self, gone: &[u32], came: &[u32], rank: u32) {
        let mut emptied = Vec::new();
        for &i in gone {
            let root = self.root_of(i);
            let kin = &mut self.kin[root as usize];
            kin.n_alive -= 1;
            if kin.n_alive == 0 && kin.component > 0 {
                emptied.push(root);
            }
        }
        if emptied.is_empty() {
            return;
        }
        // Found before any is united: sets have other representatives then.
        let mut last: BTreeMap<u32, Vec<Vec3>> = emptied.iter().map(|&r| (r, Vec::new())).collect();
        for &i in gone {
            if let Some(points) = last.get_mut(&self.root_of(i)) {
                points.extend(self.places_of(i, rank));
            }
        }
        last.retain(|_, points| !is_point(points));
        let came = came.iter().copied().filter(|&i| self.comes(i) == rank);
        let places = self.places(came, rank, &last);
        emptied.sort_unstable_by_key(|&root| self.kin[root as usize].component);
        let isovalue = self.spectrum.isovalues()[rank as usize];
        for root in emptied {
            if let Some(again) = last.get(&root).and_then(|points| self.again(points, &places)) {
                self.unite(root, again, isovalue);
            } else {
                let component = std::mem::take(&mut self.kin[root as usize].component);
                self.end(component, End { isovalue, joins: None });
            }
        }
    }

    /// Where triangles lie at a rank, corners and middles.
    fn places_of(&self, triangle: u32, rank: u32) -> [Vec3; 4] {
        let isovalue = self.spectrum.isovalues()[rank as usize];
        let corners = self.spectrum.triangles()[triangle as usize]
            .vertices
            .map(|v| Vec3::from(self.spectrum.vertex_at(v, rank, isovalue)));
        let [a, b, c] = corners;
        [a, b, c, (a + b + c) / 3.0]
    }

    /// The places of triangles by the cell of a grid, each with the triangle, as far as they may be near to points.
    fn places(
        &self,
        triangles: impl Iterator<Item = u32>,
        rank: u32,
        points: &BTreeMap<u32, Vec<Vec3>>,
    ) -> Places {
        let wanted: HashSet<IVec3> = points.values().flatten().flat_map(|&p| around(p)).collect();
        let mut places = Places::new();
        if wanted.is_empty() {
            return places;
        }
        for i in triangles {
            for p in self.places_of(i, rank).into_iter().filter(|&p| wanted.contains(&cell(p))) {
                places.entry(cell(p)).or_default().push((p, i));
            }
        }
        places
    }

    /// The set of triangles that came where a component's last ones were: most of its surface goes on there, if anything
    /// does.
    fn again(&mut self, points: &[Vec3], places: &Places) -> Option<u32> {
        let mut votes: BTreeMap<u32, usize> = BTreeMap::new();
        let mut n_near = 0;
        for &p in points {
            let near = around(p).filter_map(|c| places.get(&c)).flatten();
            let near = near.map(|&(q, i)| (p.distance_squared(q), i));
            let nearest = near.min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            if let Some((_, i)) = nearest.filter(|n| n.0 < NEAR * NEAR) {
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

/// The cell of the grid that a place lies in: as wide as what counts as near.
fn cell(p: Vec3) -> IVec3 {
    (p / NEAR).floor().as_ivec3()
}

/// That cell and those around it.
fn around(p: Vec3) -> impl Iterator<Item = IVec3> {
    (0..27).map(move |i| cell(p) + IVec3::new(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1))
}

/// Whether points lie in one place.
fn is_point(points: &[Vec3]) -> bool {
    let low = points.iter().copied().reduce(Vec3::min);
    let high = points.iter().copied().reduce(Vec3::max);
    low.zip(high).is_none_or(|(low, high)| (high - low).max_element() < POINT)
}
