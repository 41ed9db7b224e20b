//! Saddles inside cells, by closed form.
//!
//! With f = a + b x + c y + d z + e xy + f xz + g yz + h xyz and A = hb - ef, B = hc - eg,
//! G = hd - fg, D = -ABG, a cell with h != 0 has critical points iff D > 0, for s = 1 and s = -1:
//!
//! x = (-g + s sqrt(D) / A) / h,  y = (-f + s sqrt(D) / B) / h,  z = (-e + s sqrt(D) / G) / h,
//! value = a + (2 efg - (bg + cf + de) h + 2 s sqrt(D)) / h^2.
//!
//! The Hessian has a zero diagonal, so s = 1 is always of index 1 and s = -1 of index 2. For
//! h = 0 and efg != 0 there is one, at x = (bg - cf - de) / (2ef) and so on, of index 2 if
//! efg > 0, else 1, with the value a + (bx + cy + dz) / 2. Predicates use the floating point filter
//! of `estimate` first, and big integers if the filter cannot determine a sign.

use std::cmp::Ordering;

use num_bigint::BigInt;

use super::estimate::Estimate;
use super::face::first_key;
use super::field::{ExactField, ORDER_BITS};

/// Coefficients of the trilinear field of one cell, in V units.
#[derive(Clone, Copy, Debug)]
pub struct Trilinear {
    /// a: the key of the lowest corner.
    pub(super) a: i128,
    /// b, c, d: linear in x, y, z.
    linear: [i128; 3],
    /// g, f, e: of yz, xz, xy; entry n is that of the two axes other than n.
    bilinear: [i128; 3],
    /// h: of xyz.
    pub(super) h: i128,
}

/// A saddle inside a cell.
#[derive(Clone, Copy, Debug)]
pub struct BodySaddle {
    /// The cell's lowest vertex.
    pub corner: u32,
    /// 1 (components of lower values meet) or 2 (of higher values).
    pub index: u8,
    cell: Trilinear,
}

impl Trilinear {
    /// The trilinear field through eight corner keys (x + 2 y + 4 z).
    pub fn new(v: &[i128; 8]) -> Self {
        let a = v[0];
        let (b, c, d) = (v[1] - a, v[2] - a, v[4] - a);
        let e = v[3] - v[1] - v[2] + a;
        let f = v[5] - v[1] - v[4] + a;
        let g = v[6] - v[2] - v[4] + a;
        let h = v[7] - v[6] - v[5] - v[3] + v[1] + v[2] + v[4] - a;
        Trilinear { a, linear: [b, c, d], bilinear: [g, f, e], h }
    }

    /// The indices (1, 2) of the body saddles strictly inside the cell: at most one of each.
    pub fn body_saddle_indices(&self) -> [Option<u8>; 2] {
        if self.h == 0 {
            let index =
                self.product_of_bilinear_sign().map(|positive| if positive { 2 } else { 1 });
            return [index.filter(|_| self.is_flat_saddle_inside()), None];
        }
        let minors = self.minors();
        let discriminant = -(minors[0] * minors[1] * minors[2]);
        match discriminant.sign() {
            Some(Ordering::Greater) => {}
            Some(_) => return [None; 2],
            None => {
                let exact = self.exact_discriminant();
                let has = |s: i8| exact > BigInt::ZERO && self.is_inside_exactly(s, &exact);
                return [has(1).then_some(1), has(-1).then_some(2)];
            }
        }
        let root = discriminant.sqrt();
        let has = |s: i8| match self.is_inside(s, minors, root) {
            Some(inside) => inside,
            None => self.is_inside_exactly(s, &self.exact_discriminant()),
        };
        [has(1).then_some(1), has(-1).then_some(2)]
    }

    /// A, B, G.
    fn minors(&self) -> [Estimate; 3] {
        let [g, f, e] = self.bilinear;
        let [b, c, d] = self.linear;
        [(b, e, f), (c, e, g), (d, f, g)].map(|(l, p, q)| Estimate::minor(self.h, l, p, q))
    }

    /// A, B, G exactly.
    fn exact_minors(&self) -> [BigInt; 3] {
        let [g, f, e] = self.bilinear;
        let [b, c, d] = self.linear;
        [(b, e, f), (c, e, g), (d, f, g)]
            .map(|(l, p, q)| BigInt::from(self.h) * l - BigInt::from(p) * q)
    }

    /// D exactly.
    pub(super) fn exact_discriminant(&self) -> BigInt {
        let [a, b, g] = self.exact_minors();
        -(a * b * g)
    }

    /// Whether the saddle of sign `s` lies inside, by the filter. With P a minor and K its
    /// bilinear coefficient, the coordinate (-K P + s sqrt(D)) / (P h) must lie in (0, 1).
    fn is_inside(&self, s: i8, minors: [Estimate; 3], root: Estimate) -> Option<bool> {
        let root = if s > 0 { root } else { -root };
        let h = Estimate::of(self.h);
        let mut all_known = true;
        for (p, k) in minors.into_iter().zip(self.bilinear) {
            let span = p * h;
            let from_low = root - Estimate::of(k) * p;
            let from_high = from_low - span;
            match (span.sign(), from_low.sign(), from_high.sign()) {
                (Some(span), Some(low), _) if low != span => return Some(false),
                (Some(span), _, Some(high)) if high != span.reverse() => return Some(false),
                (Some(_), Some(_), Some(_)) => {}
                _ => all_known = false,
            }
        }
        all_known.then_some(true)
    }

    /// [`Self::is_inside`] in big integers; exactly on a face of the cell is outside.
    pub(super) fn is_inside_exactly(&self, s: i8, discriminant: &BigInt) -> bool {
        self.exact_minors().into_iter().zip(self.bilinear).all(|(p, k)| {
            let span = &p * self.h;
            let from_low = -&p * k;
            let from_high = &from_low - &span;
            let sign = span.cmp(&BigInt::ZERO);
            sign_with_root(&from_low, s, discriminant) == sign
                && sign_with_root(&from_high, s, discriminant) == sign.reverse()
        })
    }

    /// Whether efg is positive; `None` if it is zero.
    fn product_of_bilinear_sign(&self) -> Option<bool> {
        let sign: i128 = self.bilinear.iter().map(|k| k.signum()).product();
        (sign != 0).then_some(sign > 0)
    }

    /// For h = 0: the numerator and denominator of coordinate n.
    ///
    /// With l the linear and k the bilinear coefficients, x = (b g - c f - d e) / (2 e f).
    fn flat_coordinate(&self, n: usize) -> ([(i128, i128); 3], (i128, i128)) {
        let (p, q) = ((n + 1) % 3, (n + 2) % 3);
        let (l, k) = (self.linear, self.bilinear);
        ([(l[n], k[n]), (-l[p], k[p]), (-l[q], k[q])], (k[p], k[q]))
    }

    /// For h = 0: whether the saddle lies inside; on a face of the cell is outside.
    fn is_flat_saddle_inside(&self) -> bool {
        (0..3).all(|n| {
            let (numerator, (p, q)) = self.flat_coordinate(n);
            let sum = numerator
                .map(|(l, k)| Estimate::of(l) * Estimate::of(k))
                .into_iter()
                .reduce(|x, y| x + y)
                .expect("three terms");
            let den = Estimate::of(p) * Estimate::of(q) * Estimate::of(2);
            let sign = (p.signum() * q.signum()).cmp(&0);
            match (sum.sign(), (sum - den).sign()) {
                (Some(low), _) if low != sign => false,
                (_, Some(high)) if high != sign.reverse() => false,
                (Some(_), Some(_)) => true,
                _ => {
                    let sum: BigInt = numerator.iter().map(|&(l, k)| BigInt::from(l) * k).sum();
                    let den: BigInt = BigInt::from(p) * q * 2;
                    sum.cmp(&BigInt::ZERO) == sign && sum.cmp(&den) == sign.reverse()
                }
            }
        })
    }

    /// Whether the body saddle of an index lies above an isovalue's key; exactly on it is not
    /// above. The cell must have that saddle.
    pub fn is_body_saddle_above(&self, index: u8, isovalue_key: i128) -> bool {
        let s = if index == 1 { 1i8 } else { -1 };
        let offset = self.a - isovalue_key;
        let (numerator, den) = self.value_estimate(offset);
        let estimate = if self.h == 0 {
            if den.value > 0.0 { numerator } else { -numerator }
        } else {
            let minors = self.minors();
            let discriminant = -(minors[0] * minors[1] * minors[2]);
            if discriminant.sign() != Some(Ordering::Greater) {
                return self.exact_sign(s, offset) == Ordering::Greater;
            }
            let root = discriminant.sqrt() * Estimate::of(2);
            if s > 0 { numerator + root } else { numerator - root }
        };
        estimate.sign().unwrap_or_else(|| self.exact_sign(s, offset)) == Ordering::Greater
    }

    /// Numerator (without the root) and denominator of the saddle value plus `offset` minus a.
    fn value_estimate(&self, offset: i128) -> (Estimate, Estimate) {
        let [k0, k1, k2] = self.bilinear.map(Estimate::of);
        let l = self.linear.map(Estimate::of);
        let terms = [l[0] * k0, l[1] * k1, l[2] * k2];
        let product = k0 * k1 * k2;
        let (offset, h, two) = (Estimate::of(offset), Estimate::of(self.h), Estimate::of(2));
        if self.h != 0 {
            let den = h * h;
            return (offset * den + two * product - (terms[0] + terms[1] + terms[2]) * h, den);
        }
        // b (bg-cf-de) g + c (cf-bg-de) f + d (de-bg-cf) e, over 4 efg.
        let squares = terms[0] * terms[0] + terms[1] * terms[1] + terms[2] * terms[2];
        let mixed = terms[0] * terms[1] + terms[1] * terms[2] + terms[2] * terms[0];
        let den = Estimate::of(4) * product;
        (offset * den + squares - two * mixed, den)
    }

    /// [`Self::value_estimate`] in big integers.
    fn exact_value(&self, offset: i128) -> (BigInt, BigInt) {
        let terms: [BigInt; 3] =
            std::array::from_fn(|n| BigInt::from(self.linear[n]) * self.bilinear[n]);
        let [k0, k1, k2] = self.bilinear;
        let product = BigInt::from(k0) * k1 * k2;
        if self.h != 0 {
            let den = BigInt::from(self.h) * self.h;
            let sum: BigInt = terms.iter().sum();
            return (&den * offset + product * 2 - sum * self.h, den);
        }
        let squares: BigInt = terms.iter().map(|t| t * t).sum();
        let mixed = &terms[0] * &terms[1] + &terms[1] * &terms[2] + &terms[2] * &terms[0];
        let den = product * 4;
        (&den * offset + squares - mixed * 2, den)
    }

    /// The sign of the saddle value plus `offset` minus a.
    pub(super) fn exact_sign(&self, s: i8, offset: i128) -> Ordering {
        let (numerator, den) = self.exact_value(offset);
        if self.h == 0 {
            let sign = numerator.cmp(&BigInt::ZERO);
            return if den > BigInt::ZERO { sign } else { sign.reverse() };
        }
        // numerator + 2 s sqrt(D) = numerator + s sqrt(4 D).
        sign_with_root(&numerator, s, &(self.exact_discriminant() * 4))
    }

    /// The value of the body saddle of an index in V units times 2^`bits`, rounded down.
    fn scaled_value(&self, index: u8, bits: u32) -> BigInt {
        let (numerator, den) = self.exact_value(0);
        let scaled = numerator << bits;
        let (numerator, den) = if self.h == 0 {
            if den > BigInt::ZERO { (scaled, den) } else { (-scaled, -den) }
        } else {
            // floor((n + r) / m) = floor((n + floor(r)) / m) for integers n and m > 0.
            let square: BigInt = (self.exact_discriminant() * 4) << (2 * bits);
            let root = square.sqrt();
            let root = match index {
                1 => root,
                _ if &root * &root == square => -root,
                _ => -root - 1,
            };
            (scaled + root, den)
        };
        (BigInt::from(self.a) << bits) + floor_div(&numerator, &den)
    }

    /// The value of the body saddle of an index in V units times 2^[`ORDER_BITS`], rounded down.
    pub(super) fn order_key(&self, index: u8) -> i128 {
        let value = self.scaled_value(index, ORDER_BITS);
        i128::try_from(value).expect("a saddle lies between the corners of its cell")
    }

    /// The position of the body saddle of an index in the cell, 0 to 1 along each axis.
    fn position(&self, index: u8) -> [f64; 3] {
        let l = self.linear.map(|x| x as f64);
        let k = self.bilinear.map(|x| x as f64);
        let h = self.h as f64;
        let minors = self.minors().map(|m| m.value);
        let root = (-(minors[0] * minors[1] * minors[2])).max(0.0).sqrt();
        let root = if index == 1 { root } else { -root };
        std::array::from_fn(|n| {
            let (p, q) = ((n + 1) % 3, (n + 2) % 3);
            let straight = -k[n] * minors[n];
            let x = if self.h == 0 {
                (l[n] * k[n] - l[p] * k[p] - l[q] * k[q]) / (2.0 * k[p] * k[q])
            } else if straight * root >= 0.0 {
                (straight + root) / (minors[n] * h)
            } else {
                // The other root's numerator does not cancel; their product is known.
                let product =
                    k[n] * k[n] * l[n] + h * l[p] * l[q] - k[n] * (l[p] * k[p] + l[q] * k[q]);
                product / (straight - root)
            };
            if x.is_finite() { x.clamp(0.0, 1.0) } else { 0.5 }
        })
    }
}

/// The sign of `a + s sqrt(d)` for d >= 0 and s = 1 or -1.
fn sign_with_root(a: &BigInt, s: i8, d: &BigInt) -> Ordering {
    let sign = a.cmp(&BigInt::ZERO);
    let root_sign = if *d == BigInt::ZERO { Ordering::Equal } else { s.cmp(&0) };
    if sign == root_sign || root_sign == Ordering::Equal {
        return sign;
    }
    match sign {
        Ordering::Equal => root_sign,
        Ordering::Greater => (a * a).cmp(d),
        Ordering::Less => d.cmp(&(a * a)),
    }
}

/// The quotient rounded down, for a positive divisor.
fn floor_div(n: &BigInt, m: &BigInt) -> BigInt {
    let quotient = n / m;
    if *n < BigInt::ZERO && &quotient * m != *n { quotient - 1 } else { quotient }
}

impl BodySaddle {
    /// Whether the saddle lies above an isovalue's key; exactly on it is not above.
    pub fn is_above(&self, isovalue_key: i128) -> bool {
        self.cell.is_body_saddle_above(self.index, isovalue_key)
    }

    /// The saddle value in V units times 2^[`ORDER_BITS`], rounded down: exact.
    pub fn order_key(&self) -> i128 {
        self.cell.order_key(self.index)
    }

    /// The saddle value in V units times 2^`bits`, rounded down: exact, for ties of order keys.
    pub(crate) fn scaled_value(&self, bits: u32) -> BigInt {
        self.cell.scaled_value(self.index, bits)
    }
}

impl ExactField<'_> {
    /// The saddles strictly inside the cell whose lowest vertex is `corner`: at most one of each
    /// index, that of index 2 the lower. The cell must lie in the grid.
    pub fn body_saddles(&self, corner: u32) -> impl Iterator<Item = BodySaddle> + use<> {
        let levels = self.levels_at(corner, self.cell_offsets());
        let cell = can_hold_body_saddle(&levels)
            .then(|| self.add_ramp(corner, levels))
            .filter(can_hold_body_saddle)
            .map(|keys| Trilinear::new(&keys));
        cell.into_iter().flat_map(move |cell| {
            cell.body_saddle_indices().into_iter().flatten().map(move |index| BodySaddle {
                corner,
                index,
                cell,
            })
        })
    }

    /// The value of a body saddle in volume units without the ramp (to 10^-6 of a level).
    pub fn body_saddle_value(&self, saddle: &BodySaddle) -> f64 {
        let order_key = saddle.order_key();
        let key = first_key(order_key, |key| saddle.is_above(key));
        self.first_isovalue(self.value(order_key >> ORDER_BITS), key)
    }

    /// The position of a body saddle in the index frame.
    pub fn body_saddle_position(&self, saddle: &BodySaddle) -> [f64; 3] {
        let corner = self.whole_position(saddle.corner);
        let inside = saddle.cell.position(saddle.index);
        std::array::from_fn(|a| corner[a] + inside[a])
    }
}

/// Whether along every axis the four edge differences of a cell have both signs, or a tie: otherwise
/// a partial derivative vanishes nowhere in the cell.
pub(crate) fn can_hold_body_saddle<T: Copy + Ord>(v: &[T; 8]) -> bool {
    [[0, 2, 4, 6], [0, 1, 4, 5], [0, 1, 2, 3]].iter().zip([1, 2, 4]).all(|(edges, step)| {
        let rises = edges.iter().all(|&c| v[c] < v[c + step]);
        let falls = edges.iter().all(|&c| v[c] > v[c + step]);
        !rises && !falls
    })
}
