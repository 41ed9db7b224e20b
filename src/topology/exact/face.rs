//! Saddles on cell faces: existence, value, and whether they are critical in space.
//!
//! On a face the field is bilinear. With corners p00, p10, p01, p11 it has a saddle inside the
//! face iff one diagonal lies wholly below the other; its value is
//! (p00 p11 - p10 p01) / (p00 + p11 - p10 - p01), whose sign against an isovalue is the asymptotic
//! decider (Nielson and Hamann, "The asymptotic decider", Visualization 1991). In space it is
//! critical iff in both adjacent cells the field along the normal through the saddle rises away from
//! the face (index 1) or falls away from it (index 2).

use std::cmp::Ordering;

use num_bigint::BigInt;

use super::field::{ExactField, ORDER_BITS, RAMP_WEIGHTS};

/// A saddle of the bilinear field on a face of the grid.
#[derive(Clone, Copy, Debug)]
pub struct FaceSaddle {
    /// The face's lowest vertex.
    pub corner: u32,
    /// The axis the face is normal to.
    pub axis: usize,
    /// The diagonal below the saddle.
    pub low: [u32; 2],
    /// The diagonal above the saddle.
    pub high: [u32; 2],
    /// Keys of p00, p10, p01, p11; the first in-plane axis is `axis + 1`, the second `axis + 2`,
    /// cyclically.
    keys: [i128; 4],
}

impl FaceSaddle {
    /// Whether p00 and p11 are the low diagonal.
    fn is_main_diagonal_low(&self) -> bool {
        self.low[0] == self.corner
    }

    /// The low diagonal's keys, then the high one's.
    fn diagonals(&self) -> ([i128; 2], [i128; 2]) {
        let [p00, p10, p01, p11] = self.keys;
        if self.is_main_diagonal_low() {
            ([p00, p11], [p10, p01])
        } else {
            ([p10, p01], [p00, p11])
        }
    }

    /// Whether the saddle lies above an isovalue's key; exactly on it is not above.
    pub fn is_above(&self, isovalue_key: i128) -> bool {
        let (low, high) = self.diagonals();
        is_saddle_above(low, high, isovalue_key)
    }

    /// x, y and x + y - z of the saddle value l + x y / (x + y - z) above one low corner l.
    fn above_low(&self) -> (i128, i128, i128, i128) {
        let (low, high) = self.diagonals();
        let (x, y, z) = (high[0] - low[0], high[1] - low[0], low[1] - low[0]);
        (low[0], x, y, x + y - z)
    }

    /// The saddle value in V units times 2^[`ORDER_BITS`], rounded down: exact.
    pub fn order_key(&self) -> i128 {
        let (low, x, y, den) = self.above_low();
        let narrow = x.checked_mul(y).filter(|xy| xy.leading_zeros() > ORDER_BITS);
        let above = match narrow {
            Some(xy) => (xy << ORDER_BITS) / den,
            None => {
                let above = ((BigInt::from(x) * y) << ORDER_BITS) / den;
                i128::try_from(above).expect("a saddle lies between the corners of its face")
            }
        };
        (low << ORDER_BITS) + above
    }

    /// The saddle value in V units times 2^`bits`, rounded down: exact, for ties of order keys.
    pub(crate) fn scaled_value(&self, bits: u32) -> BigInt {
        let (low, x, y, den) = self.above_low();
        (BigInt::from(low) << bits) + ((BigInt::from(x) * y) << bits) / den
    }

    /// Position in the face along its two in-plane axes, 0 to 1.
    pub fn parameters(&self) -> [f64; 2] {
        let [p00, p10, p01, p11] = self.keys;
        let den = (p00 + p11 - p10 - p01) as f64;
        [(p00 - p01) as f64 / den, (p00 - p10) as f64 / den]
    }
}

/// The least isovalue key at which a saddle of an order key is not above.
pub(super) fn first_key(order_key: i128, is_above: impl Fn(i128) -> bool) -> i128 {
    // The order key is rounded down.
    let key = order_key >> ORDER_BITS;
    if is_above(key) { key + 1 } else { key }
}

/// Whether the saddle between two separated diagonals lies above an isovalue key. Compares the
/// products of the distances to it, exactly, in 256 bits.
///
/// The saddle is (h0 h1 - l0 l1) / (h0 + h1 - l0 - l1) after shifting the isovalue to zero.
#[inline]
pub(crate) fn is_saddle_above(low: [i128; 2], high: [i128; 2], isovalue_key: i128) -> bool {
    let [l0, l1] = low.map(|l| isovalue_key - l);
    let [h0, h1] = high.map(|h| h - isovalue_key);
    // The isovalue is not between the diagonals: below or above both.
    if l0 < 0 || l1 < 0 {
        return true;
    }
    if h0 <= 0 || h1 <= 0 {
        return false;
    }
    product(h0 as u128, h1 as u128) > product(l0 as u128, l1 as u128)
}

/// The 256 bit product of two numbers, high half first.
pub(super) fn product(a: u128, b: u128) -> (u128, u128) {
    const HALF: u128 = u64::MAX as u128;
    let (a1, a0, b1, b0) = (a >> 64, a & HALF, b >> 64, b & HALF);
    let (low, middle, high) = (a0 * b0, a1 * b0, a1 * b1);
    // Neither sum overflows: each is at most (2^64 - 1)^2 + 2 (2^64 - 1).
    let carry = (low >> 64) + (middle & HALF);
    let carry_middle = a0 * b1 + (carry & HALF);
    let high = high + (middle >> 64) + (carry >> 64) + (carry_middle >> 64);
    (high, carry_middle << 64 | low & HALF)
}

impl ExactField<'_> {
    /// The saddle on the face normal to `axis` whose lowest vertex is `corner`, if it has one.
    /// The face must lie in the grid.
    pub fn face_saddle(&self, corner: u32, axis: usize) -> Option<FaceSaddle> {
        let strides = self.strides();
        let [i, j] = [(axis + 1) % 3, (axis + 2) % 3];
        let offsets = [0, strides[i], strides[j], strides[i] + strides[j]];
        let levels = self.levels_at(corner, offsets);
        let [a, b, c, d] = levels;
        // Levels reject nearly every face: the ramp can only separate diagonals whose levels
        // touch, and it is affine on a face of one level.
        if (a.max(d) > b.min(c) && b.max(c) > a.min(d)) || (a == d && b == c && a == b) {
            return None;
        }
        let ramp = self.ramp(corner);
        let (wi, wj) = (RAMP_WEIGHTS[i], RAMP_WEIGHTS[j]);
        let ramps = [ramp, ramp - wi, ramp - wj, ramp - wi - wj];
        let keys: [i128; 4] =
            std::array::from_fn(|n| ((levels[n] as i128) << self.m_bits) + ramps[n] as i128);
        let [p00, p10, p01, p11] = keys;
        let main = [corner, corner + offsets[3]];
        let other = [corner + offsets[1], corner + offsets[2]];
        if p00.max(p11) < p10.min(p01) {
            Some(FaceSaddle { corner, axis, low: main, high: other, keys })
        } else if p10.max(p01) < p00.min(p11) {
            Some(FaceSaddle { corner, axis, low: other, high: main, keys })
        } else {
            None
        }
    }

    /// How the field changes from a face saddle into an adjacent cell, `upper` the one at higher
    /// coordinates: `Greater` if it rises. `None` if there is no cell.
    pub fn face_inward(&self, saddle: &FaceSaddle, upper: bool) -> Option<Ordering> {
        let at = self.padded_position(saddle.corner)[saddle.axis] as usize;
        let stride = self.strides()[saddle.axis];
        let neighbour = if upper {
            (at + 1 < self.dims[saddle.axis]).then(|| saddle.corner + stride)?
        } else {
            (at > 0).then(|| saddle.corner - stride)?
        };
        let strides = self.strides();
        let [i, j] = [(saddle.axis + 1) % 3, (saddle.axis + 2) % 3];
        let keys = [
            self.key(neighbour),
            self.key(neighbour + strides[i]),
            self.key(neighbour + strides[j]),
            self.key(neighbour + strides[i] + strides[j]),
        ];
        Some(inward(saddle.keys, keys))
    }

    /// The index of a face saddle as a critical point in space: 1 (two components of lower values
    /// meet), 2 (of higher values), or `None` if it is regular, as most are. On the border of
    /// the padded grid, where a face has one cell, there are no saddles.
    pub fn face_saddle_index(&self, saddle: &FaceSaddle) -> Option<u8> {
        match (self.face_inward(saddle, false)?, self.face_inward(saddle, true)?) {
            (Ordering::Greater, Ordering::Greater) => Some(1),
            (Ordering::Less, Ordering::Less) => Some(2),
            _ => None,
        }
    }

    /// The least isovalue at which a face saddle is not above: its value in volume units without the ramp.
    pub fn face_saddle_value(&self, saddle: &FaceSaddle) -> f64 {
        let [l0, l1] = saddle.low.map(|v| self.level(v));
        let [h0, h1] = saddle.high.map(|v| self.level(v));
        let (x, y) = ((h0 - l0) as f64, (h1 - l0) as f64);
        let den = (h0 + h1 - l0 - l1) as f64;
        let above = if den > 0.0 { x * y / den } else { 0.0 };
        let key = first_key(saddle.order_key(), |key| saddle.is_above(key));
        self.first_isovalue(self.scale.value(l0 as f64 + above), key)
    }

    /// The position of a face saddle in the index frame of the whole, if the volume is a block.
    pub fn face_saddle_position(&self, saddle: &FaceSaddle) -> [f64; 3] {
        let mut position = self.whole_position(saddle.corner);
        let [u, w] = saddle.parameters();
        position[(saddle.axis + 1) % 3] += u;
        position[(saddle.axis + 2) % 3] += w;
        position
    }
}

/// The sign of the bilinear field of the opposite face at the saddle of `face`, minus the saddle value.
///
/// With everything relative to p00 and d = |p00 + p11 - p10 - p01|, the saddle lies at
/// (u, w) / d and has the value -s u w / d, so the sign is that of
/// (d-u)(d-w) n00 + u (d-w) n10 + (d-u) w n01 + u w (n11 + s d).
fn inward(face: [i128; 4], opposite: [i128; 4]) -> Ordering {
    let [p00, p10, p01, p11] = face;
    let s = if p00 + p11 > p10 + p01 { 1 } else { -1 };
    let den = s * (p00 + p11 - p10 - p01);
    let (u, w) = (s * (p00 - p01), s * (p00 - p10));
    let (uu, ww) = (den - u, den - w);
    let n = opposite.map(|x| x - p00);
    let terms = [[uu, ww, n[0]], [u, ww, n[1]], [uu, w, n[2]], [u, w, n[3] + s * den]];
    let mut sum = 0.0;
    let mut magnitude = 0.0;
    for t in terms {
        let term = t[0] as f64 * t[1] as f64 * t[2] as f64;
        sum += term;
        magnitude += term.abs();
    }
    // Each term has five roundings and the sum three: 8 half units; the bound is sixteen.
    if f64::abs(sum) > 8.0 * f64::EPSILON * magnitude {
        return if sum > 0.0 { Ordering::Greater } else { Ordering::Less };
    }
    let exact: BigInt = terms.iter().map(|t| BigInt::from(t[0]) * t[1] * t[2]).sum();
    exact.cmp(&BigInt::ZERO)
}
