//! Bytes as letters that stand in a page: 122 of the 128 codes of ASCII.
//!
//! # Theory
//!
//! Two letters have 122^2 = 14,884 values, between 2^13 and 2^14. As in basE91 (Henke 2006) a pair
//! takes 14 bits where its value is large enough for that and 13 otherwise: 13.8 of 16 on average,
//! where base64 has 12. A page is 13 % smaller for it.
//!
//! # Invariants
//!
//! No letter is changed by the parser of a page (NUL, carriage return), ends the element (`<`), or is
//! lost where a file is taken for text (line feed, end of file, escape). All are ASCII, so the page
//! may be read as UTF-8 or as any other usual encoding.

/// Codes below 128 that are no letters.
const NO_LETTERS: [u8; 6] = [0, b'\n', b'\r', 0x1a, 0x1b, b'<'];

const N_LETTERS: u32 = 128 - NO_LETTERS.len() as u32;

/// Pairs whose low 13 bits are below this hold 14 bits.
const LONG_PAIRS: u32 = N_LETTERS * N_LETTERS - (1 << 13);

/// The letters of bytes.
pub(super) fn letters(bytes: &[u8]) -> String {
    let letters: Vec<char> =
        (0..128u8).filter(|code| !NO_LETTERS.contains(code)).map(char::from).collect();
    let mut text = String::with_capacity(bytes.len() * 7 / 6 + 4);
    let letter = |value: u32| letters[value as usize];
    let (mut queue, mut n_bits) = (0u32, 0);
    for &byte in bytes {
        queue |= u32::from(byte) << n_bits;
        n_bits += 8;
        if n_bits < 14 {
            continue;
        }
        let n = if queue & 8191 < LONG_PAIRS { 14 } else { 13 };
        let pair = queue & ((1 << n) - 1);
        text.extend([letter(pair % N_LETTERS), letter(pair / N_LETTERS)]);
        queue >>= n;
        n_bits -= n;
    }
    // At most 13 bits are left: a pair, or a single letter for up to six of them. Neither has room for
    // another byte.
    match n_bits {
        0 => {}
        1..=6 => text.push(letter(queue)),
        _ => text.extend([letter(queue % N_LETTERS), letter(queue / N_LETTERS)]),
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// The way back, as `page/letters.js` has it.
    fn bytes(text: &str) -> Vec<u8> {
        let letters: Vec<u8> = (0..128u8).filter(|code| !NO_LETTERS.contains(code)).collect();
        let value = |letter: u8| letters.binary_search(&letter).expect("a letter") as u32;
        let (mut queue, mut n_bits, mut bytes) = (0u32, 0, Vec::new());
        for pair in text.as_bytes().chunks(2) {
            let second = pair.get(1).map(|&letter| value(letter));
            let pair = value(pair[0]) + N_LETTERS * second.unwrap_or(0);
            queue |= pair << n_bits;
            n_bits += match second {
                None => 6,
                Some(_) if pair & 8191 < LONG_PAIRS => 14,
                Some(_) => 13,
            };
            while n_bits >= 8 {
                bytes.push(queue as u8);
                queue >>= 8;
                n_bits -= 8;
            }
        }
        bytes
    }

    proptest! {
        #[test]
        fn bytes_come_back_exactly(
            original in prop::collection::vec(any::<u8>(), 0..200),
        ) {
            let text = letters(&original);
            prop_assert!(text.bytes().all(|code| code < 128 && !NO_LETTERS.contains(&code)));
            prop_assert_eq!(bytes(&text), original);
        }
    }

    #[test]
    fn letters_are_short() {
        let mut state = 1u32;
        let random = |_| {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 24) as u8
        };
        let bytes: Vec<u8> = (0..100_000).map(random).collect();
        // 16 / 13.817, and what chance adds.
        let ratio = letters(&bytes).len() as f64 / bytes.len() as f64;
        assert!((ratio - 1.158).abs() < 0.002, "{ratio}");
    }
}
