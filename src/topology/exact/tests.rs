use std::cmp::Ordering;

use num_bigint::BigInt;

use super::*;
use crate::volume::{Outside, Placement, Samples, Volume};
use random::Random;

#[allow(dead_code, reason = "the tests in tests/ use more of it")]
#[path = "../../../tests/common/random.rs"]
mod random;

fn volume(dims: [usize; 3], samples: Samples) -> Volume {
    Volume::new("test", dims, samples, Placement::default()).expect("a valid volume")
}

/// A 4x5x4 volume of one of several sample types and degrees of tie.
fn random_volume(random: &mut Random, kind: u64) -> Volume {
    let dims = [4, 5, 4];
    let mut draw = |n: u64| {
        let mut s: Vec<u64> = (0..80).map(|_| random.below(n)).collect();
        (s[0], s[1]) = (0, n - 1);
        s
    };
    let samples = match kind % 5 {
        0 => Samples::U8(draw(4).iter().map(|&x| x as u8).collect()),
        1 => Samples::U8(draw(256).iter().map(|&x| x as u8).collect()),
        2 => Samples::I16(draw(65536).iter().map(|&x| (x as i64 - 32768) as i16).collect()),
        3 => Samples::F32(draw(1 << 24).iter().map(|&x| x as f32 * 1e-7 - 0.5).collect()),
        _ => Samples::U32(draw(1 << 32).iter().map(|&x| x as u32).collect()),
    };
    let outside = if kind.is_multiple_of(2) { Outside::Low } else { Outside::High };
    volume(dims, samples).with_outside(outside)
}

#[test]
fn a_floating_point_sample_of_few_digits_has_a_higher_level_than_all_below_it() {
    let mut samples: Vec<f32> = (0..27).map(|i| i as f32 * 0.375).collect();
    samples[26] = 9.0;
    let volume = volume([3; 3], Samples::F32(samples.clone()));
    let field = ExactField::new(&volume).expect("a field");
    for (i, &sample) in samples.iter().enumerate() {
        let position = [i % 3, i / 3 % 3, i / 9].map(|p| p as i64);
        let level = field.level(field.vertex(position));
        let sample = f64::from(sample);
        assert_eq!(field.isovalue_level(sample), level, "{sample}");
        assert!(field.isovalue_level(sample - 1e-14 * sample.max(1.0)) < level, "{sample}");
    }
}

#[test]
fn an_event_has_happened_from_its_isovalue_on_and_not_before() {
    let mut random = Random(11);
    for kind in 0..40 {
        let volume = random_volume(&mut random, kind);
        let field = ExactField::new(&volume).expect("a field");
        let check = |isovalue: f64, is_above: &dyn Fn(i128) -> bool| {
            let [before, after] = [isovalue.next_down(), isovalue].map(|c| field.isovalue_key(c));
            assert!(is_above(before) && !is_above(after), "kind {kind}: {isovalue}");
        };
        for v in vertices_below(&field, [1; 3]) {
            if !field.is_in_layer(v) {
                check(field.vertex_value(v), &|key| field.key(v) > key);
            }
            for s in (0..3).filter_map(|axis| field.face_saddle(v, axis)) {
                check(field.face_saddle_value(&s), &|key| s.is_above(key));
            }
            for s in field.body_saddles(v) {
                check(field.body_saddle_value(&s), &|key| s.is_above(key));
            }
        }
    }
}

#[test]
fn the_least_power_of_two_from_a_number_on() {
    let each = [
        (1.0, 1.0),
        (1.5, 2.0),
        (0.25, 0.25),
        (5.0, 8.0),
        // 2^-1028: `powi` overflows on its way, unless the compiler evaluates it.
        (3e-310, f64::from_bits(1 << (1074 - 1028))),
        (0.0, 5e-324),
    ];
    for (x, expected) in each {
        assert_eq!(power_of_two_from(x), expected, "{x}");
    }
    assert!(power_of_two_from(8.9e307).is_finite());
}

/// All vertices whose positions leave room for `size` further samples along each axis.
fn vertices_below(field: &ExactField, size: [usize; 3]) -> Vec<u32> {
    (0..field.n_vertices() as u32)
        .filter(|&v| {
            let p = field.position(v);
            (0..3).all(|a| ((p[a] + 1) as usize) + size[a] < field.dims()[a])
        })
        .collect()
}

/// Change of the Euler characteristic of the sublevel set at a vertex: one minus that of its
/// lower link in the octahedron of its neighbours.
fn vertex_jump(field: &ExactField, v: u32) -> i64 {
    let p = field.position(v);
    let lower: [[i64; 2]; 3] = std::array::from_fn(|a| {
        [-1, 1].map(|s| {
            let mut q = p;
            q[a] += s;
            let inside = q[a] >= -1 && q[a] + 1 < field.dims()[a] as i64;
            i64::from(inside && field.key(field.vertex(q)) < field.key(v))
        })
    });
    let n = lower.map(|l| l[0] + l[1]);
    let (points, triangles) = (n[0] + n[1] + n[2], n[0] * n[1] * n[2]);
    1 - points + n[0] * n[1] + n[1] * n[2] + n[2] * n[0] - triangles
}

#[test]
fn jumps_of_all_critical_points_add_up_to_the_euler_characteristic_of_a_box() {
    let mut random = Random(1);
    for n in 0..200 {
        let volume = random_volume(&mut random, n);
        let field = ExactField::new(&volume).expect("a small volume");
        let mut euler: i64 = (0..field.n_vertices() as u32).map(|v| vertex_jump(&field, v)).sum();
        let mut jump = |index: u8| euler += if index == 1 { -1 } else { 1 };
        for axis in 0..3 {
            let mut size = [1; 3];
            size[axis] = 0;
            for v in vertices_below(&field, size) {
                if let Some(saddle) = field.face_saddle(v, axis) {
                    assert!(field.face_inward(&saddle, false).is_some(), "a saddle on the border");
                    field.face_saddle_index(&saddle).into_iter().for_each(&mut jump);
                }
            }
        }
        for v in vertices_below(&field, [1; 3]) {
            field.body_saddles(v).for_each(|saddle| jump(saddle.index));
        }
        assert_eq!(euler, 1, "grid {n}");
    }
}

#[test]
fn a_sample_is_inside_exactly_if_it_exceeds_the_isovalue() {
    let mut random = Random(2);
    for n in 0..50 {
        let volume = random_volume(&mut random, n);
        let field = ExactField::new(&volume).expect("a small volume");
        for _ in 0..20 {
            let sample = volume.samples().get(random.below(80) as usize);
            for isovalue in [sample, sample.next_down(), sample + 0.37, sample - 1e-9] {
                let key = field.isovalue_key(isovalue);
                for v in 0..field.n_vertices() as u32 {
                    let is_inside = field.key(v) > key;
                    assert_eq!(is_inside, field.level(v) > field.isovalue_level(isovalue));
                    // Floating point samples have different levels from 2^-44 of the range on.
                    let f = field.sample(v);
                    if volume.samples().is_integer() || (f - isovalue).abs() > 1e-12 {
                        assert_eq!(is_inside, f > isovalue, "sample {f} at {isovalue}");
                    }
                    assert!(!is_inside || f != isovalue, "a sample at the isovalue is outside");
                }
            }
        }
    }
}

#[test]
fn the_value_of_an_integer_key_is_the_sample() {
    let mut random = Random(3);
    for n in [0, 1, 2, 4] {
        let volume = random_volume(&mut random, n);
        let field = ExactField::new(&volume).expect("a small volume");
        for v in 0..field.n_vertices() as u32 {
            assert_eq!(field.value(field.key(v)), field.sample(v));
            assert_eq!(field.vertex(field.position(v)), v);
        }
    }
}

#[test]
fn face_saddles_agree_with_rational_arithmetic() {
    let mut random = Random(4);
    let mut n_saddles = 0;
    for n in 0..100 {
        let volume = random_volume(&mut random, n);
        let field = ExactField::new(&volume).expect("a small volume");
        for v in vertices_below(&field, [1; 3]) {
            let axis = random.below(3) as usize;
            let Some(saddle) = field.face_saddle(v, axis) else { continue };
            n_saddles += 1;
            let [l0, l1] = saddle.low.map(|v| BigInt::from(field.key(v)));
            let [h0, h1] = saddle.high.map(|v| BigInt::from(field.key(v)));
            let (num, den) = (&h0 * &h1 - &l0 * &l1, h0 + h1 - l0 - l1);
            let order = saddle.order_key();
            assert!(BigInt::from(order) * &den <= &num << ORDER_BITS);
            assert!(BigInt::from(order + 1) * &den > &num << ORDER_BITS);
            let near = order >> ORDER_BITS;
            for isovalue in [near - 1, near, near + 1, near + (1 << 50), near - (1 << 50)] {
                assert_eq!(saddle.is_above(isovalue), num > &den * isovalue);
            }
            let value = field.face_saddle_value(&saddle);
            assert!(!saddle.is_above(field.isovalue_key(value)), "the event precedes its value");
            let size = volume.range().1 - volume.range().0;
            let expected = field.value(near);
            assert!((value - expected).abs() <= 1e-6 * size, "{value} is not {expected}");
        }
    }
    assert!(n_saddles > 1000);
}

#[test]
fn faces_without_a_saddle_have_no_separated_diagonals() {
    let mut random = Random(5);
    for n in 0..40 {
        let volume = random_volume(&mut random, n);
        let field = ExactField::new(&volume).expect("a small volume");
        let [s0, s1, _] = field.strides();
        for v in vertices_below(&field, [1, 1, 0]) {
            let [a, b, c, d] = [0, s0, s1, s0 + s1].map(|o| field.key(v + o));
            let separated = a.max(d) < b.min(c) || b.max(c) < a.min(d);
            assert_eq!(field.face_saddle(v, 2).is_some(), separated);
        }
    }
}

#[test]
fn body_saddles_are_critical_points_of_their_value() {
    let mut random = Random(6);
    let mut n_saddles = [0; 2];
    for n in 0..200 {
        let volume = random_volume(&mut random, n);
        let field = ExactField::new(&volume).expect("a small volume");
        let size = volume.range().1 - volume.range().0;
        for v in vertices_below(&field, [1; 3]) {
            let mut previous: Option<i128> = None;
            for saddle in field.body_saddles(v) {
                n_saddles[saddle.index as usize - 1] += 1;
                let order = saddle.order_key();
                let near = order >> ORDER_BITS;
                assert!(saddle.is_above(near - 1) && !saddle.is_above(near + 1));
                // Index 1 comes first and is the higher one.
                assert!(previous.is_none_or(|p| p >= order));
                previous = Some(order);
                let value = field.body_saddle_value(&saddle);
                assert!(!saddle.is_above(field.isovalue_key(value)));
                let p = field.body_saddle_position(&saddle);
                // Rounding of the position acts to second order on the value; the ramp and the
                // float levels stay below a millionth of the range of four steps.
                let cell = field.position(v);
                if (0..3).any(|a| cell[a] < 0 || cell[a] + 1 == volume.dims()[a] as i64) {
                    let outside = volume.outside_value();
                    assert!(
                        (value - outside).abs() <= 2e-6 * size.max(1.0),
                        "{value} in the layer"
                    );
                    continue;
                }
                let there = volume.value_at(p);
                assert!((there - value).abs() <= 2e-6 * size.max(1.0), "{there}, not {value}");
            }
        }
    }
    assert!(n_saddles[0] > 100 && n_saddles[1] > 100);
}

#[test]
fn the_filter_of_body_saddles_agrees_with_big_integers() {
    let mut random = Random(7);
    let mut n_cells = 0;
    for n in 0..30_000u64 {
        // Few distinct values, with and without a ramp, meet exact zeros often.
        let (levels, shift, ramp) =
            [(4, 0, 0), (4, 40, 1), (256, 40, 1), (1 << 44, 40, 1)][(n % 4) as usize];
        let keys: [i128; 8] = std::array::from_fn(|c| {
            let slope = (c & 1) + 37 * (c >> 1 & 1) + 1009 * (c >> 2);
            ((random.below(levels) as i128) << shift) - ramp * slope as i128
        });
        let cell = Trilinear::new(&keys);
        if cell.h == 0 {
            continue;
        }
        let discriminant = cell.exact_discriminant();
        let exact = [1, -1].map(|s| {
            let inside = discriminant > BigInt::ZERO && cell.is_inside_exactly(s, &discriminant);
            inside.then_some(if s > 0 { 1 } else { 2 })
        });
        assert_eq!(cell.body_saddle_indices(), exact);
        if exact != [None; 2] {
            n_cells += 1;
            assert!(can_hold_body_saddle(&keys), "the prefilter rejects a saddle");
        }
        for index in exact.into_iter().flatten() {
            let s = if index == 1 { 1 } else { -1 };
            for isovalue in [cell.order_key(index) >> ORDER_BITS, keys[0], keys[7]] {
                let sign = cell.exact_sign(s, cell.a - isovalue);
                assert_eq!(cell.is_body_saddle_above(index, isovalue), sign == Ordering::Greater);
            }
        }
    }
    assert!(n_cells > 2000);
}

#[test]
fn wide_products_carry() {
    let all = u128::MAX;
    assert_eq!(face::product(all, all), (all - 1, 1));
    assert_eq!(face::product(1 << 127, 2), (1, 0));
    assert_eq!(face::product(u64::MAX as u128, 3), (0, u64::MAX as u128 * 3));
}
