//! An adaptive arithmetic coder: numbers told by decisions, each of which costs what it surprises.
//!
//! # Theory
//!
//! Martin's range coder (1979), of decisions between two: the range is parted as the decision's model expects it. A model keeps two
//! estimates, one of what happened lately and one of longer ago, and expects their mean.
//! [`Coder::number`] is the same for writer and reader, so they cannot differ.
//!
//! # Invariants
//!
//! An expectation is never less than 1/1024, and none is needed to be exact: all is done in whole numbers, the same everywhere.

/// How fast the estimates of a model follow what happens: by 1/16 and 1/128 of what they miss.
const FAST: u32 = 4;
const SLOW: u32 = 7;

/// Bits of an expectation.
const EXPECTATION: u32 = 15;

/// Below this the range gets a further byte.
const LEAST_RANGE: u32 = 1 << 24;

/// Bytes of a decoder's window.
const WINDOW: usize = 5;

/// What a decision is expected to be: two estimates of how often it is 0, of 2^16.
#[derive(Clone, Copy, Debug)]
pub(super) struct Model {
    fast: u16,
    slow: u16,
}

impl Model {
    pub(super) const NEW: Model = Model { fast: 1 << 15, slow: 1 << 15 };

    /// How often it is 0, of 2^15.
    fn expected(self) -> u32 {
        (u32::from(self.fast) + u32::from(self.slow)) >> 2
    }

    fn learn(&mut self, decision: bool) {
        for (estimate, speed) in [(&mut self.fast, FAST), (&mut self.slow, SLOW)] {
            let x = u32::from(*estimate);
            let x = if decision { x - (x >> speed) } else { x + (((1 << 16) - x) >> speed) };
            *estimate = x as u16;
        }
    }
}

/// Tells decisions, or is told them.
pub(super) trait Coder {
    /// Whether what comes lies beyond a bound in the range: a writer is given it.
    fn is_beyond(&mut self, bound: u32, given: bool) -> bool;

    fn range(&mut self) -> &mut u32;

    /// Goes on by a byte.
    fn shift(&mut self);

    /// The next decision: a writer's is the one it is given.
    fn decide(&mut self, model: &mut Model, decision: bool) -> bool {
        let bound = (*self.range() >> EXPECTATION) * model.expected();
        let decision = self.is_beyond(bound, decision);
        *self.range() = if decision { *self.range() - bound } else { bound };
        model.learn(decision);
        self.narrowed();
        decision
    }

    /// So many bits about which nothing is expected: a writer's are the lowest of what it is given.
    fn bits(&mut self, n: u32, value: u64) -> u64 {
        let mut told = 0;
        for i in (0..n).rev() {
            *self.range() >>= 1;
            let bound = *self.range();
            let bit = self.is_beyond(bound, value >> i & 1 == 1);
            told = told << 1 | u64::from(bit);
            self.narrowed();
        }
        told
    }

    /// Goes on until the range is wide enough for a decision.
    fn narrowed(&mut self) {
        while *self.range() < LEAST_RANGE {
            *self.range() <<= 8;
            self.shift();
        }
    }
}

/// Writes decisions.
#[derive(Debug)]
pub(super) struct Encoder {
    bytes: Vec<u8>,
    /// Where the range begins; above 32 bits it carries into what is written.
    low: u64,
    range: u32,
    /// The byte that a carry may still change, and how many there are, it and the full ones behind it.
    last: u8,
    n_open: usize,
}

impl Encoder {
    pub(super) fn new() -> Encoder {
        Encoder { bytes: Vec::new(), low: 0, range: u32::MAX, last: 0, n_open: 1 }
    }

    /// The bytes of all decisions.
    pub(super) fn end(mut self) -> Vec<u8> {
        (0..WINDOW).for_each(|_| self.shift());
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
            self.bytes.push(self.last.wrapping_add(carry));
            self.bytes.extend((1..self.n_open).map(|_| u8::MAX.wrapping_add(carry)));
            (self.last, self.n_open) = (top, 0);
        }
        self.n_open += 1;
        self.low = (self.low & 0x00FF_FFFF) << 8;
    }
}

/// Reads decisions. Behind the last byte it reads zeros.
#[derive(Debug)]
pub(super) struct Decoder<'a> {
    bytes: &'a [u8],
    next: usize,
    range: u32,
    /// Where in the range the decisions are.
    code: u32,
}

impl<'a> Decoder<'a> {
    pub(super) fn new(bytes: &'a [u8]) -> Decoder<'a> {
        let mut decoder = Decoder { bytes, next: 0, range: u32::MAX, code: 0 };
        (0..WINDOW).for_each(|_| decoder.shift());
        decoder
    }

    /// The bytes that were not read; none if more were read than there are.
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

/// Numbers up to so many bits are learnt as a whole; of longer ones so many bits behind the first.
const LEARNT: u32 = 7;
const LEARNT_OF_LONG: u32 = 3;

/// The models of a row of numbers.
///
/// A number is told by its length in bits, one by one, and then its bits behind the first. What is expected depends on the two
/// numbers before it.
#[derive(Debug)]
pub(super) struct Row {
    lengths: Vec<[Model; 65]>,
    /// By what came before; number n of up to [`LEARNT`] bits has its bits at 1, 1b, 1bb ... in the binary numbers of its length.
    short: Vec<[[Model; 1 << (LEARNT - 1)]; LEARNT as usize + 1]>,
    long: [[Model; 1 << LEARNT_OF_LONG]; 65],
    before: [usize; 2],
}

/// Kinds of numbers that are told apart as the last one, and as the one before that.
const KINDS: [usize; 2] = [16, 8];

impl Row {
    pub(super) fn new() -> Row {
        let n = KINDS[0] * KINDS[1];
        Row {
            lengths: vec![[Model::NEW; 65]; n],
            short: vec![[[Model::NEW; 1 << (LEARNT - 1)]; LEARNT as usize + 1]; n],
            long: [[Model::NEW; 1 << LEARNT_OF_LONG]; 65],
            before: [0; 2],
        }
    }

    /// The next number: a writer's is the one it is given.
    pub(super) fn number(&mut self, coder: &mut impl Coder, value: u64) -> u64 {
        let at = self.before[0] * KINDS[1] + self.before[1].min(KINDS[1] - 1);
        let given = length(value);
        let mut n = 0;
        while n < 64 && coder.decide(&mut self.lengths[at][n as usize], n < given) {
            n += 1;
        }
        let value = self.mantissa(coder, at, n, value);
        self.before = [kind(value), self.before[0]];
        value
    }

    /// The bits behind the first of a number of `n`.
    fn mantissa(&mut self, coder: &mut impl Coder, at: usize, n: u32, value: u64) -> u64 {
        if n < 2 {
            return n.into();
        }
        let is_long = n > LEARNT;
        let n_learnt = if is_long { LEARNT_OF_LONG } else { n - 1 };
        let models = match is_long {
            true => &mut self.long[n as usize][..],
            false => &mut self.short[at][n as usize][..],
        };
        let mut known = 1;
        for i in 0..n_learnt {
            let bit = value >> (n - 2 - i) & 1 == 1;
            known = known << 1 | usize::from(coder.decide(&mut models[known], bit));
        }
        let n_left = n - 1 - n_learnt;
        let left = if n_left > 0 { value & (u64::MAX >> (64 - n_left)) } else { 0 };
        (known as u64) << n_left | coder.bits(n_left, left)
    }
}

/// Bits of a number, without zeros in front.
fn length(value: u64) -> u32 {
    64 - value.leading_zeros()
}

/// Numbers below 8 are kinds of their own; others are told apart by their length, up to eight of these.
fn kind(value: u64) -> usize {
    if value < 8 { value as usize } else { 8 + (length(value) as usize - 4).min(7) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    /// Writes rows of numbers and reads them again. Returns how many bytes they take.
    #[track_caller]
    fn assert_come_back(rows: &[Vec<u64>]) -> usize {
        let mut encoder = Encoder::new();
        for numbers in rows {
            let mut row = Row::new();
            numbers.iter().for_each(|&x| assert_eq!(row.number(&mut encoder, x), x));
        }
        let bytes = encoder.end();
        let mut decoder = Decoder::new(&bytes);
        for numbers in rows {
            let mut row = Row::new();
            for (i, &x) in numbers.iter().enumerate() {
                assert_eq!(row.number(&mut decoder, 0), x, "number {i}");
            }
        }
        assert_eq!(decoder.rest(), Some(&[][..]), "all bytes are read, and no more");
        bytes.len()
    }

    #[test]
    fn numbers_of_any_size_come_back() {
        let mut random = Random::new(3);
        let mut row = vec![0, 1, 2, 3, 7, 8, 127, 128, 129, u64::MAX, u64::MAX - 1, 1 << 63, 0];
        row.extend((0..20_000).map(|_| {
            let n = random.below(64) as u32;
            random.next_u64() >> n
        }));
        assert_come_back(&[row, vec![], vec![0; 1000], vec![u64::MAX; 300]]);
    }

    #[test]
    fn a_carry_goes_through_full_bytes() {
        // Raw bits of ones, then what comes last is added to them: the encoder holds back full bytes for long.
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
    fn rare_numbers_cost_what_they_surprise() {
        let mut random = Random::new(5);
        let n = 100_000;
        // One in 50 is not 0: that is .141 bits each.
        let rare: Vec<u64> = (0..n).map(|_| u64::from(random.below(50) == 0)).collect();
        let bytes = assert_come_back(&[rare]);
        assert!((1700..2100).contains(&bytes), "{bytes} bytes, expected some 1770");
        let equal: Vec<u64> = (0..n).map(|_| random.below(200) as u64).collect();
        // 7.64 bits each.
        let bytes = assert_come_back(&[equal]);
        assert!((95_500..101_000).contains(&bytes), "{bytes} bytes, expected some 95,540");
        let alternating: Vec<u64> = (0..n).map(|i| [0, 5, 90][i % 3]).collect();
        let bytes = assert_come_back(&[alternating]);
        assert!(bytes < 1000, "{bytes} bytes for what is known from the numbers before");
    }

    #[test]
    fn what_is_cut_off_is_known() {
        let mut encoder = Encoder::new();
        let mut row = Row::new();
        (0..1000).for_each(|i| {
            row.number(&mut encoder, i * i % 777);
        });
        let bytes = encoder.end();
        let mut decoder = Decoder::new(&bytes[..bytes.len() / 2]);
        let mut row = Row::new();
        (0..1000).for_each(|_| {
            row.number(&mut decoder, 0);
        });
        assert_eq!(decoder.rest(), None);
    }
}
