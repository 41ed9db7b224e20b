//! Section `SEAM` of a chunk, in a file with several trees: the vertices that other trees may contain, too, with their keys.
//!
//! # Invariants
//!
//! Vertices with equal keys are one vertex: in every tree they have the same two knots. A key is the lattice edge of the whole volume on which
//! the vertex is.

use super::column::{Columns, collected, write_column, zigzag};
use crate::error::{Error, Result};

/// The content of the section: the numbers of shared vertices in their chunk, ascending, with their keys.
pub(super) fn write_seam(shared: &[(u32, u64)]) -> Vec<u8> {
    let mut bytes = (shared.len() as u64).to_le_bytes().to_vec();
    let after = std::iter::once(0).chain(shared.iter().map(|s| s.0 + 1));
    let steps: Vec<u64> = shared.iter().zip(after).map(|(s, from)| u64::from(s.0 - from)).collect();
    write_column(&mut bytes, &steps);
    let mut last = 0;
    let steps =
        shared.iter().map(|s| zigzag(s.1.wrapping_sub(std::mem::replace(&mut last, s.1)) as i64));
    write_column(&mut bytes, &steps.collect::<Vec<u64>>());
    bytes
}

/// Reads the section of a chunk with so many vertices.
pub(super) fn read_seam(mut columns: Columns, n_vertices: u32) -> Result<Vec<(u32, u64)>> {
    let n = columns.count()?;
    let steps = columns.column(n, 32)?;
    let keys = columns.column(n, 64)?;
    columns.end()?;
    let (mut next, mut key) = (0u32, 0u64);
    collected(n, |i| {
        let vertex = u32::try_from(steps.get(i)?).ok().and_then(|step| next.checked_add(step));
        let vertex = vertex.filter(|&v| v < n_vertices).ok_or_else(|| {
            Error::input(format!("a shared vertex beyond the {n_vertices} of the chunk"))
        })?;
        next = vertex + 1;
        key = key.wrapping_add(keys.get_signed(i)? as u64);
        Ok((vertex, key))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shared_vertices_are_read_as_written() {
        let all = [(0, 7), (1, u64::MAX), (9, 1 << 40), (10, 3), (4_000_000_000, 2)];
        for shared in [&all[..], &all[..1], &all[..0]] {
            let bytes = write_seam(shared);
            let read = |n_vertices| read_seam(Columns::new(&bytes), n_vertices);
            assert_eq!(read(4_000_000_001).expect("as written"), shared);
            if let Some(last) = shared.last() {
                let error = read(last.0).expect_err("one vertex fewer").to_string();
                assert!(error.contains("beyond"), "{error}");
            }
        }
    }
}
