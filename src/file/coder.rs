//! An adaptive binary range coder.
//!
//! # Theory
//!
//! A range coder (Martin 1979) with binary decisions: each divides the range in proportion to the probability that its model predicts. A model
//! predicts the mean of two adaptive estimates, a fast and a slow one. [`ColumnModels::number`] is the same code for writer and reader,
//! so they cannot differ.
//!
//! # Invariants
//!
//! No probability is below 1/1024. All arithmetic is on integers, so it is the same everywhere.

/// Adaptation rates of a model's estimates: in the end a decision changes them by 1/16 and 1/128 of their error.
const FAST_SHIFT: u32 = 4;
const SLOW_SHIFT: u32 = 7;

/// Bits of a probability.
const PROBABILITY_BITS: u32 = 15;

/// The range is extended by a byte if it is smaller than this.
const MIN_RANGE: u32 = 1 << 24;

/// Bytes that a decoder reads ahead.
const LOOKAHEAD: usize = 5;

/// A model counts up to so many decisions. Until then its estimates change by more, as a mean of all decisions would.
const MAX_COUNT: u8 = (1 << SLOW_SHIFT) - 3;

/// A model of a decision: two estimates of the probability of 0, in units of 2^-16.
#[derive(Clone, Copy, Debug)]
pub(super) struct Model {
    fast: u16,
    slow: u16,
    /// Decisions so far, at most [`MAX_COUNT`].
    count: u8,
}

impl Model {
    pub(super) const NEW: Model = Model { fast: 1 << 15, slow: 1 << 15, count: 0 };

    /// The probability of 0, in units of 2^-15.
    fn probability(self) -> u32 {
        (u32::from(self.fast) + u32::from(self.slow)) >> 2
    }

    fn learn(&mut self, decision: bool) {
        let early = (u32::from(self.count) + 4).ilog2();
        self.count = MAX_COUNT.min(self.count + 1);
        for (estimate, shift) in [(&mut self.fast, FAST_SHIFT), (&mut self.slow, SLOW_SHIFT)] {
            let (x, shift) = (u32::from(*estimate), shift.min(early));
            let x = if decision { x - (x >> shift) } else { x + (((1 << 16) - x) >> shift) };
            *estimate = x as u16;
        }
    }
}

/// An encoder or a decoder of decisions. An encoder writes the decisions that it is given and returns them; a decoder ignores these
/// arguments and returns the decisions that it reads.
pub(super) trait Coder {
    /// Whether the decision is in the part of the range beyond `bound`.
    fn is_beyond(&mut self, bound: u32, given: bool) -> bool;

    fn range(&mut self) -> &mut u32;

    /// Writes or reads the next byte.
    fn shift(&mut self);

    /// Codes a decision with a model.
    fn decide(&mut self, model: &mut Model, decision: bool) -> bool {
        let bound = (*self.range() >> PROBABILITY_BITS) * model.probability();
        let decision = self.is_beyond(bound, decision);
        *self.range() = if decision { *self.range() - bound } else { bound };
        model.learn(decision);
        self.normalise();
        decision
    }

    /// Codes the lowest `n` bits of a value without a model.
    fn bits(&mut self, n: u32, value: u64) -> u64 {
        let mut coded = 0;
        for i in (0..n).rev() {
            *self.range() >>= 1;
            let bound = *self.range();
            let bit = self.is_beyond(bound, value >> i & 1 == 1);
            coded = coded << 1 | u64::from(bit);
            self.normalise();
        }
        coded
    }

    /// Extends the range until it is large enough for a decision.
    fn normalise(&mut self) {
        while *self.range() < MIN_RANGE {
            *self.range() <<= 8;
            self.shift();
        }
    }
}

/// Encodes decisions.
#[derive(Debug)]
pub(super) struct Encoder {
    bytes: Vec<u8>,
    /// The start of the range. Bit 32 is a carry into the bytes before.
    low: u64,
    range: u32,
    /// The bytes that a carry can still change: the first of them, and their number. All but the first are 255.
    pending: u8,
    n_pending: usize,
}

impl Encoder {
    pub(super) fn new() -> Encoder {
        Encoder { bytes: Vec::new(), low: 0, range: u32::MAX, pending: 0, n_pending: 1 }
    }

    /// The bytes of all decisions.
    pub(super) fn end(mut self) -> Vec<u8> {
        (0..LOOKAHEAD).for_each(|_| self.shift());
        self.bytes
    }
}

impl Coder for Encoder {
    fn is_beyond(&mut self, bound: u32, given: bool) -> bool {
        if given {
            self.low += u64::from(bound);
        }
        given
    }

    fn range(&mut self) -> &mut u32 {
        &mut self.range
    }

    fn shift(&mut self) {
        let carry = (self.low >> 32) as u8;
        let top = (self.low >> 24) as u8;
        if carry > 0 || top < u8::MAX {
            self.bytes.push(self.pending.wrapping_add(carry));
            self.bytes.extend((1..self.n_pending).map(|_| u8::MAX.wrapping_add(carry)));
            (self.pending, self.n_pending) = (top, 0);
        }
        self.n_pending += 1;
        self.low = (self.low & 0x00FF_FFFF) << 8;
    }
}

/// Decodes decisions. After the last byte it reads zeros.
#[derive(Debug)]
pub(super) struct Decoder<'a> {
    bytes: &'a [u8],
    next: usize,
    range: u32,
    /// The offset of the decisions in the range.
    code: u32,
}

impl<'a> Decoder<'a> {
    pub(super) fn new(bytes: &'a [u8]) -> Decoder<'a> {
        let mut decoder = Decoder { bytes, next: 0, range: u32::MAX, code: 0 };
        (0..LOOKAHEAD).for_each(|_| decoder.shift());
        decoder
    }

    /// The bytes that were not read; `None` if more were read than there are.
    pub(super) fn rest(&self) -> Option<&'a [u8]> {
        self.bytes.get(self.next..)
    }
}

impl Coder for Decoder<'_> {
    fn is_beyond(&mut self, bound: u32, _: bool) -> bool {
        let is_beyond = self.code >= bound;
        if is_beyond {
            self.code -= bound;
        }
        is_beyond
    }

    fn range(&mut self) -> &mut u32 {
        &mut self.range
    }

    fn shift(&mut self) {
        let byte = self.bytes.get(self.next).copied().unwrap_or(0);
        self.next += 1;
        self.code = self.code << 8 | u32::from(byte);
    }
}

/// Numbers of up to `SHORT` bits are modelled completely; of longer ones only the first `MODELLED_OF_LONG` bits after the leading one.
const SHORT: u32 = 7;
const MODELLED_OF_LONG: u32 = 3;

/// The models of a column of numbers.
///
/// A number is coded as its length in bits, in unary, and then its bits after the leading one. The context is the kinds of the two
/// numbers before it.
#[derive(Debug)]
pub(super) struct ColumnModels {
    /// By context, then by length.
    lengths: Vec<[Model; 65]>,
    /// By context, length, and the bits before the one that is coded.
    short: Vec<[[Model; 1 << (SHORT - 1)]; SHORT as usize + 1]>,
    /// By length, and the bits before the one that is coded.
    long: [[Model; 1 << MODELLED_OF_LONG]; 65],
    previous_kinds: [usize; 2],
}

/// Number of kinds that are distinguished of the previous number, and of the one before it.
const KINDS: [usize; 2] = [16, 8];

impl ColumnModels {
    pub(super) fn new() -> ColumnModels {
        let n = KINDS[0] * KINDS[1];
        ColumnModels {
            lengths: vec![[Model::NEW; 65]; n],
            short: vec![[[Model::NEW; 1 << (SHORT - 1)]; SHORT as usize + 1]; n],
            long: [[Model::NEW; 1 << MODELLED_OF_LONG]; 65],
            previous_kinds: [0; 2],
        }
    }

    /// Codes a number.
    pub(super) fn number(&mut self, coder: &mut impl Coder, value: u64) -> u64 {
        let context = self.previous_kinds[0] * KINDS[1] + self.previous_kinds[1].min(KINDS[1] - 1);
        let given = length(value);
        let mut n = 0;
        while n < 64 && coder.decide(&mut self.lengths[context][n as usize], n < given) {
            n += 1;
        }
        let value = self.mantissa(coder, context, n, value);
        self.previous_kinds = [kind(value), self.previous_kinds[0]];
        value
    }

    /// Codes the bits after the leading one of a number of `n` bits.
    fn mantissa(&mut self, coder: &mut impl Coder, context: usize, n: u32, value: u64) -> u64 {
        if n < 2 {
            return n.into();
        }
        let is_long = n > SHORT;
        let n_modelled = if is_long { MODELLED_OF_LONG } else { n - 1 };
        let models = match is_long {
            true => &mut self.long[n as usize][..],
            false => &mut self.short[context][n as usize][..],
        };
        let mut known = 1;
        for i in 0..n_modelled {
            let bit = value >> (n - 2 - i) & 1 == 1;
            known = known << 1 | usize::from(coder.decide(&mut models[known], bit));
        }
        let n_left = n - 1 - n_modelled;
        let left = if n_left > 0 { value & (u64::MAX >> (64 - n_left)) } else { 0 };
        (known as u64) << n_left | coder.bits(n_left, left)
    }
}

/// The number of bits of a value without leading zeros.
fn length(value: u64) -> u32 {
    64 - value.leading_zeros()
}

/// The kind of a number: itself below 8, else its length, in eight classes.
fn kind(value: u64) -> usize {
    if value < 8 { value as usize } else { 8 + (length(value) as usize - 4).min(7) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    /// Encodes columns of numbers and decodes them again. Returns the number of bytes.
    #[track_caller]
    fn assert_round_trip(columns: &[Vec<u64>]) -> usize {
        let mut encoder = Encoder::new();
        for numbers in columns {
            let mut models = ColumnModels::new();
            numbers.iter().for_each(|&x| assert_eq!(models.number(&mut encoder, x), x));
        }
        let bytes = encoder.end();
        let mut decoder = Decoder::new(&bytes);
        for numbers in columns {
            let mut models = ColumnModels::new();
            for (i, &x) in numbers.iter().enumerate() {
                assert_eq!(models.number(&mut decoder, 0), x, "number {i}");
            }
        }
        assert_eq!(decoder.rest(), Some(&[][..]), "all bytes are read, and no more");
        bytes.len()
    }

    #[test]
    fn numbers_of_any_size_are_decoded_as_encoded() {
        let mut random = Random::new(3);
        let mut row = vec![0, 1, 2, 3, 7, 8, 127, 128, 129, u64::MAX, u64::MAX - 1, 1 << 63, 0];
        row.extend((0..20_000).map(|_| {
            let n = random.below(64) as u32;
            random.next_u64() >> n
        }));
        assert_round_trip(&[row, vec![], vec![0; 1000], vec![u64::MAX; 300]]);
    }

    #[test]
    fn a_carry_passes_through_full_bytes() {
        // Many raw ones keep full bytes pending until a later decision carries into them.
        for n in 0..64 {
            let mut encoder = Encoder::new();
            let mut model = Model::NEW;
            (0..n).for_each(|_| {
                encoder.bits(8, 255);
            });
            let decisions: Vec<bool> = (0..40).map(|i| i % 3 != 1).collect();
            decisions.iter().for_each(|&d| {
                encoder.decide(&mut model, d);
            });
            let bytes = encoder.end();
            let (mut decoder, mut model) = (Decoder::new(&bytes), Model::NEW);
            assert!((0..n).all(|_| decoder.bits(8, 0) == 255));
            assert!(decisions.iter().all(|&d| decoder.decide(&mut model, false) == d));
            assert_eq!(decoder.rest(), Some(&[][..]));
        }
    }

    #[test]
    fn the_length_of_the_code_is_near_the_entropy() {
        let mut random = Random::new(5);
        let n = 100_000;
        // One in 50 is not 0: that is .141 bits each.
        let rare: Vec<u64> = (0..n).map(|_| u64::from(random.below(50) == 0)).collect();
        let bytes = assert_round_trip(&[rare]);
        assert!((1700..2100).contains(&bytes), "{bytes} bytes, expected some 1770");
        let equal: Vec<u64> = (0..n).map(|_| random.below(200) as u64).collect();
        // 7.64 bits each.
        let bytes = assert_round_trip(&[equal]);
        assert!((95_500..101_000).contains(&bytes), "{bytes} bytes, expected some 95,540");
        let alternating: Vec<u64> = (0..n).map(|i| [0, 5, 90][i % 3]).collect();
        let bytes = assert_round_trip(&[alternating]);
        assert!(bytes < 1000, "{bytes} bytes for numbers that the previous ones determine");
    }

    #[test]
    fn a_truncated_code_is_detected() {
        let mut encoder = Encoder::new();
        let mut models = ColumnModels::new();
        (0..1000).for_each(|i| {
            models.number(&mut encoder, i * i % 777);
        });
        let bytes = encoder.end();
        let mut decoder = Decoder::new(&bytes[..bytes.len() / 2]);
        let mut models = ColumnModels::new();
        (0..1000).for_each(|_| {
            models.number(&mut decoder, 0);
        });
        assert_eq!(decoder.rest(), None);
    }
}
