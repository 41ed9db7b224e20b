//! Events and arcs against a count of the isosurface from the grid at one isovalue.
//!
//! The count knows nothing of events: it traces the isosurface over faces and cells (loops,
//! tunnels) and sums the Euler characteristic of each component by inclusion and exclusion. The
//! two share the predicates of `topology::exact` and nothing else.

use std::collections::BTreeMap;

use isospectrum::spectrum::EventKind;
use isospectrum::topology::Topology;
use isospectrum::topology::curves::ContourSpectrum;
use isospectrum::topology::exact::ExactField;
use isospectrum::topology::plot::contour_spectrum_svg;
use isospectrum::topology::regions::critical_regions;
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

fn topology(volume: &Volume) -> Topology {
    let field = ExactField::new(volume).expect("a field");
    Topology::compute(&field).expect("a topology")
}

#[test]
fn an_event_has_happened_at_its_own_isovalue() {
    let mut random = Random(2);
    for n in 0..200 {
        let volume = random_volume(&mut random, n % 6);
        let topology = topology(&volume);
        for (i, event) in topology.events.iter().enumerate() {
            assert!(topology.n_events_until(event.isovalue) > i, "grid {n}, event {i}: {event:?}");
        }
        assert!(topology.events.is_sorted_by_key(|e| e.key));
        assert!(topology.events.is_sorted_by(|a, b| a.isovalue <= b.isovalue));
    }
}

#[test]
fn turning_the_field_upside_down_keeps_the_isosurfaces() {
    let mut random = Random(3);
    for n in 0..300 {
        let volume = random_volume(&mut random, [0, 1, 3, 4][n % 4]);
        let values: Vec<f64> =
            (0..volume.samples().len()).map(|i| volume.samples().get(i)).collect();
        let outside = volume.outside();
        let turned = Samples::F64(values.iter().map(|v| -v).collect());
        let upright = Samples::F64(values);
        let opposite = match outside {
            Outside::Low => Outside::High,
            Outside::High => Outside::Low,
        };
        let a = self::volume(volume.dims(), upright).expect("valid").with_outside(outside);
        let b = self::volume(volume.dims(), turned).expect("valid").with_outside(opposite);
        let (a, b) = (topology(&a), topology(&b));
        let (low, high) = volume.range();
        for _ in 0..10 {
            // The ramp is another one after the turn; an isovalue drawn from a continuum misses
            // the range of 10^-6 of a level in which that shows.
            let c = low + random.unit() * (high - low);
            assert_eq!(a.n_components_at(c), b.n_components_at(-c), "grid {n} at {c}");
            assert_eq!(a.euler_at(c), b.euler_at(-c), "grid {n} at {c}");
        }
    }
}

#[test]
fn a_ball_has_one_sphere_at_every_isovalue() {
    let volume = from_function(13, |p| -p.iter().map(|x| (x - 6.1).powi(2)).sum::<f64>());
    let topology = topology(&volume);
    assert_eq!(topology.events.len(), 1);
    assert_eq!(topology.events[0].kind, EventKind::Vanish);
    let (low, high) = volume.range();
    for i in 0..20 {
        let c = low + (high - low) * i as f64 / 20.0;
        assert_eq!((topology.n_components_at(c), topology.euler_at(c)), (1, 2), "at {c}");
    }
    assert_eq!(topology.n_components_at(high), 0);
}

#[test]
fn two_blobs_split_once_and_vanish_twice() {
    let blob = |p: [f64; 3], x: f64, width: f64| {
        (-((p[0] - x).powi(2) + (p[1] - 7.2).powi(2) + (p[2] - 6.9).powi(2)) / width).exp()
    };
    let volume = from_function(15, |p| blob(p, 3.7, 9.0) + 0.8 * blob(p, 10.4, 9.0));
    let topology = topology(&volume);
    let kinds: Vec<EventKind> = topology.events.iter().map(|e| e.kind).collect();
    assert_eq!(kinds, [EventKind::Split, EventKind::Vanish, EventKind::Vanish]);
    let split = topology.events[0];
    assert!((split.position[0] - 7.2).abs() < 1.0, "{split:?}");
    assert_eq!(topology.arcs.len(), 3);
    assert!(topology.arcs.iter().all(|a| a.euler == 2));
    let [trunk, left, right] = topology.arcs[..] else { panic!("three arcs") };
    assert_eq!((trunk.birth_event, trunk.death_event), (None, Some(0)));
    assert_eq!((left.birth_event, right.birth_event), (Some(0), Some(0)));
    let between = 0.5 * (split.isovalue + topology.events[1].isovalue);
    assert_eq!(topology.n_components_at(between), 2);
}

/// A ring of eight samples of value 0 in a volume of value 9.
fn ring() -> Volume {
    let mut samples = vec![9u8; 7 * 7 * 5];
    for (i, j) in [(2, 2), (3, 2), (4, 2), (4, 3), (4, 4), (3, 4), (2, 4), (2, 3)] {
        samples[i + 7 * (j + 7 * 2)] = 0;
    }
    volume([7, 7, 5], Samples::U8(samples)).expect("a valid volume")
}

#[test]
fn a_ring_plateau_emits_a_torus() {
    let volume = ring();
    let field = ExactField::new(&volume).expect("a field");
    let topology = Topology::compute(&field).expect("a topology");
    // The surface of the volume and the torus around the ring.
    assert_eq!((topology.n_components_at(0.5), topology.euler_at(0.5)), (2, 2));
    assert_eq!(topology.n_sides_at(0.5), (2, 1));
    let regions = critical_regions(&field, &topology);
    let ring = regions.iter().find(|r| r.isovalue == 0.0).expect("the ring");
    assert_eq!(ring.n_samples, 8);
    assert_eq!((ring.components_change, ring.euler_change), (1, 0));
    let field_of_nines = regions.iter().find(|r| r.isovalue == 9.0).expect("the surroundings");
    assert_eq!(field_of_nines.n_samples, 7 * 7 * 5 - 8);
    let total: i64 = regions.iter().map(|r| r.components_change).sum();
    // All events but the closing of the torus, which a saddle between 0 and 9 may do.
    assert!(topology.events.iter().any(|e| e.isovalue == 9.0) && total <= 1);
}

#[test]
fn threads_do_not_change_the_result() {
    let mut random = Random(4);
    let samples = Samples::U8((0..16 * 17 * 18).map(|_| random.below(6) as u8).collect());
    let volume = volume([16, 17, 18], samples).expect("a valid volume");
    let with_threads = |n: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(n).build().expect("a pool");
        pool.install(|| {
            let topology = topology(&volume);
            let spectrum = ContourSpectrum::new(&volume, &topology, 32);
            (topology.events, topology.arcs, spectrum)
        })
    };
    let alone = with_threads(1);
    assert!(alone.0.len() > 1000);
    assert_eq!(alone, with_threads(4));
}

#[test]
fn area_and_volume_of_a_sphere_are_those_of_the_formula() {
    // Second order in the cell size over the radius: 1 / 10^2, with a factor below one half.
    const TOLERANCE: f64 = 0.5 / 100.0;
    let volume =
        from_function(26, |p| 12.0 - p.iter().map(|x| (x - 12.4).powi(2)).sum::<f64>().sqrt());
    let placement = Placement { spacing: [0.5, 0.5, 0.5], ..Placement::default() };
    let volume = Volume::new("sphere", volume.dims(), volume.samples().clone(), placement)
        .expect("a valid volume");
    let topology = topology(&volume);
    let spectrum = ContourSpectrum::new(&volume, &topology, 64);
    let mut n_checked = 0;
    for (i, &c) in spectrum.isovalues.iter().enumerate() {
        let radius = 0.5 * (12.0 - c);
        if !(4.5..6.0).contains(&radius) {
            continue;
        }
        n_checked += 1;
        let area = 4.0 * std::f64::consts::PI * radius * radius;
        let inside = area * radius / 3.0;
        assert!(
            (spectrum.area[i] / area - 1.0).abs() < TOLERANCE,
            "area {} at {c}: {area}",
            spectrum.area[i]
        );
        assert!(
            (spectrum.volume[i] / inside - 1.0).abs() < TOLERANCE,
            "volume {} at {c}: {inside}",
            spectrum.volume[i]
        );
        assert_eq!((spectrum.n_components[i], spectrum.euler[i], spectrum.genus[i]), (1, 2, 0));
        assert_eq!(spectrum.n_cavities[i], 0);
    }
    assert!(n_checked > 3);
}

#[test]
fn a_linear_field_is_measured_exactly() {
    // Rounding of a few thousand sums of numbers of order one.
    const ROUNDING: f64 = 1e-9;
    let volume = from_function(9, |p| p[0] + 2.0 * p[1] + 2.0 * p[2]);
    let topology = topology(&volume);
    let spectrum = ContourSpectrum::new(&volume, &topology, 40);
    // By symmetry half of the cube lies above the middle, cut by a plane with normal (1, 2, 2) / 3;
    // the plane x + 2 y + 2 z = 20 in [0, 8]^3 projects along z onto the strip
    // 4 <= x + 2 y <= 20 of the square, of area 64 - 4 * 4, and is 3 / 2 as large.
    let low = spectrum.isovalues.iter().position(|&c| c > 20.0).expect("a middle");
    let mean = |v: &[f64]| 0.5 * (v[low - 1] + v[low]);
    assert!((mean(&spectrum.volume) - 256.0).abs() < ROUNDING);
    // Volume falls by area / |gradient| per isovalue.
    let step = spectrum.isovalues[1] - spectrum.isovalues[0];
    let fallen: f64 = spectrum.area.iter().sum::<f64>() * step / 3.0;
    // The midpoint rule on curves of second order at 40 points.
    assert!((fallen / 512.0 - 1.0).abs() < 1e-3, "{fallen}");
}

#[test]
fn cavities_are_counted_on_the_side_of_the_layer() {
    let volume = ring();
    let topology = topology(&volume);
    let spectrum = ContourSpectrum::new(&volume, &topology, 9);
    assert_eq!((spectrum.n_components[0], spectrum.n_cavities[0], spectrum.genus[0]), (2, 1, 1));
    let volume = volume.with_outside(Outside::High);
    let topology = self::topology(&volume);
    let spectrum = ContourSpectrum::new(&volume, &topology, 9);
    assert_eq!((spectrum.n_components[0], spectrum.n_cavities[0], spectrum.genus[0]), (1, 0, 1));
}

#[test]
fn plot_is_well_formed_and_names_what_it_shows() {
    let volume = ring();
    let topology = topology(&volume);
    let spectrum = ContourSpectrum::new(&volume, &topology, 64);
    let svg = contour_spectrum_svg("ring <1 & 2>", &spectrum, &topology.events);
    assert!(svg.starts_with("<svg ") && svg.ends_with("</svg>\n"));
    assert!(svg.contains("ring &lt;1 &amp; 2&gt;"));
    for word in
        ["area", "enclosed volume", "components", "Euler characteristic", "isovalue", "vanish"]
    {
        assert!(svg.contains(word), "{word}");
    }
    assert!(!svg.contains("NaN") && !svg.contains("inf"));
}

/// A volume of the data folder, or a loud line that it is not there.
fn real_volume(file: &str, dims: [usize; 3]) -> Option<Volume> {
    let folder = std::env::var("ISOSPECTRUM_DATA").unwrap_or_else(|_| "../shared/data".to_owned());
    let path = std::path::Path::new(&folder).join(file);
    match std::fs::read(&path) {
        Ok(bytes) => volume(dims, Samples::U8(bytes)),
        Err(error) => {
            eprintln!("NOT RUN: {}: {error} (ISOSPECTRUM_DATA names the folder)", path.display());
            None
        }
    }
}

#[test]
fn real_volumes_agree_with_the_count_from_the_grid() {
    for (file, n) in [("nucleon_41x41x41_uint8.raw", 41), ("fuel_64x64x64_uint8.raw", 64)] {
        let Some(volume) = real_volume(file, [n; 3]) else { continue };
        let field = ExactField::new(&volume).expect("a field");
        let topology = Topology::compute(&field).expect("a topology");
        for isovalue in [0.0, 1.0, 17.5, 90.0, 180.25] {
            check(&field, &topology, isovalue, file);
        }
    }
}
