//! Unit normals in two 16-bit numbers: the octahedral map.
//!
//! # Theory
//!
//! The unit sphere is projected onto the octahedron |x| + |y| + |z| = 1 and its lower half is
//! folded outwards, so that the square [-1, 1]^2 covers the sphere (Meyer et al. 2010, "On
//! floating-point normal vectors"; Cigolle et al. 2014, "A survey of efficient representations for
//! independent unit vectors"). The components of the square are stored as `round(32767 * s)`.

/// The largest code: 1.0 in either component.
pub const ONE: i16 = i16::MAX;

/// The code of the direction of `n`, which need not have length one. A vector without a direction
/// (zero, or not finite) gets the code of +z.
pub fn encode(n: [f32; 3]) -> [i16; 2] {
    let [x, y, z] = n.map(f64::from);
    let length = x.abs() + y.abs() + z.abs();
    if !(length > 0.0 && length.is_finite()) {
        return [0, 0];
    }
    let (x, y) = (x / length, y / length);
    let (u, v) = if z < 0.0 { fold(x, y) } else { (x, y) };
    [u, v].map(|s| (s * f64::from(ONE)).round() as i16)
}

/// The unit vector of a code. In single precision and with one root and one division, as every
/// vertex of every mesh is decoded twice; 24 bits are plenty for codes of 16.
#[inline]
pub fn decode(code: [i16; 2]) -> [f32; 3] {
    let [u, v] = code.map(|s| (f32::from(s) / f32::from(ONE)).max(-1.0));
    let z = 1.0 - u.abs() - v.abs();
    // How far the lower half was folded outwards.
    let folded = (-z).max(0.0);
    let (x, y) = (u - folded.copysign(u), v - folded.copysign(v));
    let scale = 1.0 / (x * x + y * y + z * z).sqrt();
    [x * scale, y * scale, z * scale]
}

/// Mirrors the lower half of the octahedron outwards over the edges of the upper one.
fn fold(x: f64, y: f64) -> (f64, f64) {
    ((1.0 - y.abs()).copysign(x), (1.0 - x.abs()).copysign(y))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rounding moves a component of the square by at most 0.5 / 32767. The map back to the sphere
    /// stretches lengths at most by 3 (largest at the centres of the octahedron's faces, where
    /// the radius is 1/sqrt(3), times sqrt(3) for the slope of the face), and there are two components.
    const LARGEST_ANGLE: f64 = 3.0 * std::f64::consts::SQRT_2 * 0.5 / 32767.0;

    fn angle(a: [f32; 3], b: [f32; 3]) -> f64 {
        // From the chord: the cosine loses all digits at small angles.
        let d = (0..3).map(|i| f64::from(a[i] - b[i]).powi(2)).sum::<f64>().sqrt();
        2.0 * (d / 2.0).asin()
    }

    fn sphere() -> impl Iterator<Item = [f32; 3]> {
        // A Fibonacci spiral covers the sphere evenly.
        let n = 20_000;
        (0..n).map(move |i| {
            let z = 1.0 - (2 * i + 1) as f64 / n as f64;
            let (s, c) = (i as f64 * 2.399_963_229_728_653).sin_cos();
            let r = (1.0 - z * z).sqrt();
            [(r * c) as f32, (r * s) as f32, z as f32]
        })
    }

    #[test]
    fn the_error_of_a_decoded_normal_is_within_the_bound_of_rounding() {
        // Single precision adds at most 3e-7 to the chord.
        let largest = sphere().map(|n| angle(n, decode(encode(n)))).fold(0.0, f64::max);
        assert!(largest < LARGEST_ANGLE + 3e-7, "{largest} radians");
        assert!(largest > LARGEST_ANGLE / 8.0, "the bound is far too wide: {largest} radians");
    }

    #[test]
    fn encoding_a_decoded_normal_returns_the_code() {
        for n in sphere() {
            let code = encode(n);
            assert_eq!(encode(decode(code)), code);
        }
    }

    #[test]
    fn axes_are_exact() {
        for axis in 0..3 {
            for sign in [-1.0, 1.0] {
                let mut n = [0.0f32; 3];
                n[axis] = sign;
                assert_eq!(decode(encode(n)), n);
            }
        }
    }

    #[test]
    fn a_vector_without_direction_gets_a_unit_normal() {
        for n in [[0.0; 3], [f32::NAN, 0.0, 0.0], [f32::INFINITY, 1.0, 0.0]] {
            assert_eq!(decode(encode(n)), [0.0, 0.0, 1.0]);
        }
    }
}
