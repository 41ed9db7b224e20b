//! Events and arcs against a count of the isosurface from the grid at one isovalue.
//!
//! The count knows nothing of events: it traces the isosurface over faces and cells (loops,
//! tunnels) and sums the Euler characteristic of each component by inclusion and exclusion. The
//! two share the predicates of `topology::exact` and nothing else.

use std::collections::BTreeMap;

use isospectrum::spectrum::EventKind;
use isospectrum::topology::Topology;
use isospectrum::topology::exact::ExactField;
use isospectrum::volume::{Outside, Placement, Samples, Volume};

/// A small generator of random numbers (splitmix64): the tests' grids are the same on every run.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    fn below(&mut self, n: u64) -> u64 {
        self.next() % n
    }

    fn unit(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1u64 << 53) as f64
    }
}

fn volume(dims: [usize; 3], samples: Samples) -> Option<Volume> {
    Volume::new("grid", dims, samples, Placement::default()).ok()
}

fn from_function(n: usize, f: impl Fn([f64; 3]) -> f64) -> Volume {
    let mut samples = Vec::new();
    for k in 0..n {
        for j in 0..n {
            for i in 0..n {
                samples.push(f([i as f64, j as f64, k as f64]));
            }
        }
    }
    volume([n; 3], Samples::F64(samples)).expect("a valid volume")
}

/// A union-find over lattice edges, which are numbered 3 * lower vertex + axis.
#[derive(Default)]
struct Components {
    parent: BTreeMap<u32, u32>,
}

impl Components {
    fn find(&mut self, edge: u32) -> u32 {
        let mut root = edge;
        while let Some(&p) = self.parent.get(&root) {
            if p == root {
                break;
            }
            root = p;
        }
        self.parent.insert(edge, root);
        root
    }

    fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.find(a), self.find(b));
        self.parent.insert(a, b);
    }
}

/// One component of the isosurface as the grid counts it.
struct Counted {
    euler: i64,
    /// Every lattice edge it crosses: the end not above the isovalue, the end above.
    edges: Vec<[u32; 2]>,
}

/// The isosurface of one isovalue key, counted from the grid.
struct Count<'a> {
    field: &'a ExactField<'a>,
    key: i128,
    components: Components,
    /// Contributions to the Euler characteristic: a crossed edge, and how much.
    euler: Vec<(u32, i64)>,
    crossed: Vec<(u32, [u32; 2])>,
}

impl<'a> Count<'a> {
    fn of(field: &'a ExactField<'a>, isovalue: f64) -> Vec<Counted> {
        let mut count = Count {
            field,
            key: field.isovalue_key(isovalue),
            components: Components::default(),
            euler: Vec::new(),
            crossed: Vec::new(),
        };
        let dims = field.dims();
        for v in 0..field.n_vertices() as u32 {
            let p = field.position(v).map(|p| (p + 1) as usize);
            for axis in 0..3 {
                if p[axis] + 1 < dims[axis] {
                    count.visit_edge(v, axis);
                }
                let (i, j) = ((axis + 1) % 3, (axis + 2) % 3);
                if p[i] + 1 < dims[i] && p[j] + 1 < dims[j] {
                    let arcs = count.face_arcs(v, axis);
                    count.euler.extend(arcs.into_iter().map(|[edge, _]| (edge, -1)));
                }
            }
            if (0..3).all(|a| p[a] + 1 < dims[a]) {
                count.visit_cell(v);
            }
        }
        count.collect()
    }

    fn is_above(&self, v: u32) -> bool {
        self.field.key(v) > self.key
    }

    fn visit_edge(&mut self, v: u32, axis: usize) {
        let w = v + self.field.strides()[axis];
        let ends = match (self.is_above(v), self.is_above(w)) {
            (false, true) => [v, w],
            (true, false) => [w, v],
            _ => return,
        };
        let edge = 3 * v + axis as u32;
        self.crossed.push((edge, ends));
        self.euler.push((edge, 1));
    }

    /// The edge between two neighbouring vertices.
    fn edge(&self, a: u32, b: u32) -> u32 {
        let axis = self.field.strides().iter().position(|&s| s == a.abs_diff(b));
        3 * a.min(b) + axis.expect("neighbours") as u32
    }

    /// The curves of the isosurface on a face, each as the two edges it joins.
    fn face_arcs(&self, corner: u32, axis: usize) -> Vec<[u32; 2]> {
        let strides = self.field.strides();
        let (si, sj) = (strides[(axis + 1) % 3], strides[(axis + 2) % 3]);
        let ring = [corner, corner + si, corner + si + sj, corner + sj];
        let crossings: Vec<u32> = (0..4)
            .filter(|&n| self.is_above(ring[n]) != self.is_above(ring[(n + 1) % 4]))
            .map(|n| self.edge(ring[n], ring[(n + 1) % 4]))
            .collect();
        match crossings.len() {
            0 => Vec::new(),
            2 => vec![[crossings[0], crossings[1]]],
            _ => {
                // Above the saddle's value the high corners are cut off, else the low ones.
                let saddle = self.field.face_saddle(corner, axis).expect("an ambiguous face");
                let cut_off_is_above = !saddle.is_above(self.key);
                (0..4)
                    .filter(|&n| self.is_above(ring[n]) == cut_off_is_above)
                    .map(|n| {
                        [
                            self.edge(ring[(n + 3) % 4], ring[n]),
                            self.edge(ring[n], ring[(n + 1) % 4]),
                        ]
                    })
                    .collect()
            }
        }
    }

    fn visit_cell(&mut self, corner: u32) {
        let strides = self.field.strides();
        let mut loops = Components::default();
        for axis in 0..3 {
            for face in [corner, corner + strides[axis]] {
                for [a, b] in self.face_arcs(face, axis) {
                    loops.join(a, b);
                    self.components.join(a, b);
                }
            }
        }
        let edges: Vec<u32> = loops.parent.keys().copied().collect();
        let mut roots: Vec<u32> = edges.iter().map(|&e| loops.find(e)).collect();
        roots.sort_unstable();
        roots.dedup();
        self.euler.extend(roots.iter().map(|&edge| (edge, 1)));
        self.visit_tunnel(corner, &edges, &mut loops);
    }

    /// Joins the two loops of a tunnel, if the cell has one.
    fn visit_tunnel(&mut self, corner: u32, edges: &[u32], loops: &mut Components) {
        let side = self.corner_components(corner);
        let offsets = self.field.cell_offsets();
        let n_sides = [false, true].map(|above| {
            let mut roots: Vec<usize> = (0..8)
                .filter(|&c| self.is_above(corner + offsets[c]) == above)
                .map(|c| side[c])
                .collect();
            roots.sort_unstable();
            roots.dedup();
            roots.len()
        });
        for saddle in self.field.body_saddles(corner) {
            let above = saddle.is_above(self.key);
            let is_tunnel = if saddle.index == 1 {
                !above && n_sides[0] >= 2
            } else {
                above && n_sides[1] >= 2
            };
            if !is_tunnel {
                continue;
            }
            // The loops that border the same component of the other side.
            let other_side_is_above = saddle.index == 1;
            let mut loops_of: BTreeMap<usize, Vec<u32>> = BTreeMap::new();
            for &edge in edges {
                let (v, axis) = (edge / 3, (edge % 3) as usize);
                let w = v + self.field.strides()[axis];
                let end = if self.is_above(v) == other_side_is_above { v } else { w };
                let c = offsets.iter().position(|&o| corner + o == end).expect("a corner");
                loops_of.entry(side[c]).or_default().push(loops.find(edge));
            }
            let mut n_pairs = 0;
            for roots in loops_of.values_mut() {
                roots.sort_unstable();
                roots.dedup();
                if roots.len() == 2 {
                    n_pairs += 1;
                    self.components.join(roots[0], roots[1]);
                    self.euler.push((roots[0], -2));
                }
            }
            assert_eq!(n_pairs, 1, "a tunnel has exactly one pair of loops");
        }
    }

    /// Components of a cell's corners over its edges and decided faces.
    fn corner_components(&self, corner: u32) -> [usize; 8] {
        let offsets = self.field.cell_offsets();
        let mut side: [usize; 8] = std::array::from_fn(|c| c);
        let mut join = |a: usize, b: usize| {
            let (from, to) = (side[a], side[b]);
            side.iter_mut().filter(|s| **s == from).for_each(|s| *s = to);
        };
        for a in 0..8usize {
            for bit in [1, 2, 4] {
                let b = a ^ bit;
                if self.is_above(corner + offsets[a]) == self.is_above(corner + offsets[b]) {
                    join(a, b);
                }
            }
        }
        for axis in 0..3 {
            for upper in [0, 1 << axis] {
                let Some(saddle) = self.field.face_saddle(corner + offsets[upper], axis) else {
                    continue;
                };
                let place =
                    |v: u32| offsets.iter().position(|&o| corner + o == v).expect("a corner");
                let diagonal = if saddle.is_above(self.key) { saddle.high } else { saddle.low };
                let [a, b] = diagonal.map(place);
                if self.is_above(diagonal[0]) == self.is_above(diagonal[1]) {
                    join(a, b);
                }
            }
        }
        side
    }

    fn collect(mut self) -> Vec<Counted> {
        let mut counted: BTreeMap<u32, Counted> = BTreeMap::new();
        for (edge, ends) in std::mem::take(&mut self.crossed) {
            let root = self.components.find(edge);
            counted.entry(root).or_insert(Counted { euler: 0, edges: Vec::new() }).edges.push(ends);
        }
        for (edge, change) in std::mem::take(&mut self.euler) {
            let root = self.components.find(edge);
            counted.get_mut(&root).expect("a crossed edge").euler += change;
        }
        counted.into_values().collect()
    }
}

/// Checks everything the topology says at one isovalue against the count.
fn check(field: &ExactField<'_>, topology: &Topology, isovalue: f64, what: &str) {
    let counted = Count::of(field, isovalue);
    let what = format!("{what} at {isovalue}");
    assert_eq!(topology.n_components_at(isovalue) as usize, counted.len(), "{what}: components");
    let euler: i64 = counted.iter().map(|c| c.euler).sum();
    assert_eq!(topology.euler_at(isovalue), euler, "{what}: Euler characteristic");
    let mut arcs = Vec::new();
    for component in &counted {
        let arc_of = |&[low, high]: &[u32; 2]| topology.arc_of(low, high, isovalue);
        let arc = arc_of(&component.edges[0]).expect("an arc");
        for edge in &component.edges {
            assert_eq!(arc_of(edge), Some(arc), "{what}: one arc per component");
        }
        assert_eq!(topology.arcs[arc].euler, component.euler, "{what}: arc {arc}");
        arcs.push(arc);
    }
    arcs.sort_unstable();
    assert_eq!(topology.arcs_at(isovalue), arcs, "{what}: arcs");
}

/// A random grid of one of several kinds, most of them full of ties.
fn random_volume(random: &mut Random, kind: u64) -> Volume {
    loop {
        let dims: [usize; 3] = std::array::from_fn(|_| 2 + random.below(4) as usize);
        let n: usize = dims.iter().product();
        let parity = |i: usize| (i % dims[0] + i / dims[0] % dims[1] + i / (dims[0] * dims[1])) % 2;
        let samples = match kind {
            0 => Samples::U8((0..n).map(|_| random.below(4) as u8).collect()),
            1 => Samples::U8((0..n).map(|_| random.below(256) as u8).collect()),
            2 => Samples::F32((0..n).map(|_| random.unit() as f32).collect()),
            3 => Samples::I16(
                (0..n).map(|i| (1 - 2 * parity(i) as i16) * random.below(100) as i16).collect(),
            ),
            4 => Samples::U8((0..n).map(|_| 255 * u8::from(random.below(3) == 0)).collect()),
            _ => Samples::F64(
                (0..n).map(|i| ((i % dims[0]) as f64).sin() + 0.1 * random.unit()).collect(),
            ),
        };
        let outside = if random.below(3) == 0 { Outside::High } else { Outside::Low };
        if let Some(v) = volume(dims, samples) {
            return v.with_outside(outside);
        }
    }
}

/// Isovalues worth trying: at samples, at events, just below them, between, and in the layer.
fn isovalues(random: &mut Random, volume: &Volume, topology: &Topology) -> Vec<f64> {
    let (low, high) = volume.range();
    let mut all = vec![
        low,
        high,
        volume.samples().get(random.below(volume.samples().len() as u64) as usize),
        low + random.unit() * (high - low),
        low + random.unit() * (high - low),
        0.5 * (low + volume.outside_value()),
        0.5 * (high + volume.outside_value()),
    ];
    for _ in 0..3 {
        let event = topology.events[random.below(topology.events.len() as u64) as usize];
        all.extend([event.isovalue, event.isovalue.next_down()]);
    }
    all
}

#[test]
fn events_and_arcs_agree_with_the_count_from_the_grid() {
    let mut random = Random(1);
    for n in 0..3000 {
        let kind = n % 6;
        let volume = random_volume(&mut random, kind);
        let field = ExactField::new(&volume).expect("a field");
        let what = format!("grid {n} of kind {kind}, {:?}, {:?}", volume.dims(), volume.outside());
        let topology = Topology::compute(&field).unwrap_or_else(|e| panic!("{what}: {e}"));
        for isovalue in isovalues(&mut random, &volume, &topology) {
            check(&field, &topology, isovalue, &what);
        }
    }
}
