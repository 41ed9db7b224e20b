//! Events and arcs against a count of the isosurface from the grid at one isovalue.
//!
//! The count uses no events: it traces the isosurface over faces and cells (loops, tunnels) and sums the Euler
//! characteristic of each component by inclusion and exclusion. The two share only the predicates of
//! `topology::exact`. It is slow; on larger volumes the extraction is counted instead.

mod grid_count;
mod real_volumes;

use crate::common::random::Random;
use grid_count::Count;
use isospectrum::spectrum::EventKind;
use isospectrum::unstable::extract::count::count;
use isospectrum::unstable::topology::Topology;
use isospectrum::unstable::topology::exact::ExactField;
use isospectrum::volume::{Outside, Placement, Samples, Volume};

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

/// Compares the topology at one isovalue with the count.
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

/// Isovalues at samples, at events, just below them, between them, and in the layer.
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

fn check_random_grids(n_grids: u64, seed: u64) {
    let mut random = Random(seed);
    for n in 0..n_grids {
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

#[test]
fn events_and_arcs_agree_with_the_count_from_the_grid() {
    check_random_grids(200, 1);
}

mod long {
    #[test]
    #[ignore = "long: run by scripts/test --long"]
    fn events_and_arcs_of_many_grids_agree_with_the_count_from_the_grid() {
        super::check_random_grids(3000, 8);
    }
}

fn topology(volume: &Volume) -> Topology {
    let field = ExactField::new(volume).expect("a field");
    Topology::compute(&field).expect("a topology")
}

#[test]
fn events_at_an_isovalue_count_as_passed() {
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
        let negated = Samples::F64(values.iter().map(|v| -v).collect());
        let upright = Samples::F64(values);
        let opposite = match outside {
            Outside::Low => Outside::High,
            Outside::High => Outside::Low,
        };
        let a = self::volume(volume.dims(), upright).expect("valid").with_outside(outside);
        let b = self::volume(volume.dims(), negated).expect("valid").with_outside(opposite);
        let (a, b) = (topology(&a), topology(&b));
        let (low, high) = volume.range();
        for _ in 0..10 {
            // The ramp changes with the sign, by 10^-6 of a level; a random isovalue is not within that of a sample.
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
#[test]
fn both_events_of_a_pair_have_its_persistence() {
    let mut random = Random(91);
    for _ in 0..40 {
        let volume = random_volume(&mut random, 0);
        let topology = topology(&volume);
        let events = topology.net_events();
        let of = |kinds: [EventKind; 2]| {
            let known = events.iter().filter(|e| kinds.contains(&e.kind));
            let mut known: Vec<f64> = known.filter_map(|e| e.persistence).collect();
            known.sort_by(f64::total_cmp);
            known
        };
        let pairs = topology.extremum_pairs();
        let mut all: Vec<f64> =
            pairs.iter().map(|pair| pair.persistence).filter(|&p| p > 0.0).collect();
        all.sort_by(f64::total_cmp);
        assert_eq!(of([EventKind::Emerge, EventKind::Vanish]), all, "at extrema");
        assert_eq!(of([EventKind::Merge, EventKind::Split]), all, "at saddles");
    }
}

#[test]
fn the_smaller_of_two_blobs_has_the_height_above_their_saddle() {
    let blob = |p: [f64; 3], x: f64| {
        (-((p[0] - x).powi(2) + (p[1] - 5.0).powi(2) + (p[2] - 5.0).powi(2)) / 8.0).exp()
    };
    let volume = from_function(11, |p| 100.0 * blob(p, 2.0) + 80.0 * blob(p, 8.0));
    let events = topology(&volume).net_events();
    let of = |kind: EventKind| events.iter().filter(move |e| e.kind == kind);
    let split = of(EventKind::Split).next_back().expect("one");
    let vanish: Vec<_> = of(EventKind::Vanish).collect();
    let lower = vanish[vanish.len() - 2];
    assert!((lower.isovalue - 80.0).abs() < 3.0, "{lower:?}");
    assert_eq!(lower.persistence, Some(lower.isovalue - split.isovalue));
    assert_eq!(split.persistence, lower.persistence);
    assert_eq!(vanish[vanish.len() - 1].persistence, None, "the highest has no saddle");
}

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
}

#[test]
fn net_events_have_the_effect_of_all_events() {
    let mut random = Random(5);
    let (mut n_net, mut n_all) = (0, 0);
    for n in 0..600 {
        let volume = random_volume(&mut random, n % 6);
        let topology = topology(&volume);
        let net = topology.net_events();
        n_net += net.len();
        n_all += topology.events.len();
        assert!(net.is_sorted_by(|a, b| a.isovalue <= b.isovalue));
        let (low, high) = volume.range();
        for _ in 0..10 {
            // Drawn from a continuum, so never among the events of one cluster.
            let c = low + random.unit() * (high - low);
            let (mut components, mut euler) = match volume.outside() {
                Outside::Low => (1, 2),
                Outside::High => (0, 0),
            };
            for event in net.iter().filter(|e| e.isovalue <= c) {
                let (b, e) = match event.kind {
                    EventKind::Emerge | EventKind::Split => (1, 2),
                    EventKind::Merge | EventKind::Vanish => (-1, -2),
                    EventKind::HandleOpen => (0, -2),
                    EventKind::HandleClose => (0, 2),
                };
                components += b;
                euler += e;
            }
            assert_eq!(topology.n_components_at(c), components as u32, "grid {n} at {c}");
            assert_eq!(topology.euler_at(c), euler, "grid {n} at {c}");
        }
    }
    assert!(n_net < n_all);
}

#[test]
fn a_ring_plateau_is_five_net_events() {
    let volume = ring();
    let topology = topology(&volume);
    let net: Vec<(f64, EventKind)> =
        topology.net_events().iter().map(|e| (e.isovalue, e.kind)).collect();
    // The torus emerges; at 9, the value of everything else, it merges with the surface of the
    // volume, its hole closes, and the rest vanishes.
    let expected = [
        (0.0, EventKind::Emerge),
        (0.0, EventKind::HandleOpen),
        (9.0, EventKind::Merge),
        (9.0, EventKind::HandleClose),
        (9.0, EventKind::Vanish),
    ];
    assert_eq!(net, expected);
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
            (topology.events, topology.arcs)
        })
    };
    let alone = with_threads(1);
    assert!(alone.0.len() > 1000);
    assert_eq!(alone, with_threads(4));
}
