//! The spectrum file: what is written comes back.

mod synthetic;

use isospectrum::file::{from_bytes, to_bytes};
use synthetic::{Growth, growing_sphere};

#[test]
fn measure() {
    for (i, growth) in [
        Growth { subdivisions: 6, n_steps: 250, splits: 400, flips: 1000, knot_distance: 80 },
        Growth { subdivisions: 6, n_steps: 250, splits: 100, flips: 100, knot_distance: 20 },
    ]
    .into_iter()
    .enumerate()
    {
        let mut s = growing_sphere(&growth);
        if i == 2 {
            s.triangles.sort_by_key(|t| t.death);
        }
        s.check().unwrap();
        let t = std::time::Instant::now();
        let bytes = to_bytes(&s).unwrap();
        println!(
            "{} vertices {} knots {} triangles: {} bytes, {:?}",
            s.n_vertices(),
            s.knots.len(),
            s.triangles.len(),
            bytes.len(),
            t.elapsed()
        );
        let mut at = 16;
        while at < bytes.len() {
            let n = u64::from_le_bytes(bytes[at + 8..at + 16].try_into().unwrap()) as usize;
            println!(
                "  {} {n} {}",
                bytes[at..at + 4].escape_ascii(),
                u64::from_le_bytes(bytes[at + 16..at + 24].try_into().unwrap())
            );
            at += 28 + n;
        }
        let t = std::time::Instant::now();
        let back = from_bytes(&bytes).unwrap();
        println!("read {:?}", t.elapsed());
        assert!(back == isospectrum::file::arranged(&s.quantised()).unwrap());
        assert!(to_bytes(&back).unwrap() == bytes);
    }
}
