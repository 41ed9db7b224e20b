//! Real volumes of several formats.

use isospectrum::volume::Volume;

use crate::common::data;
use crate::volumes::read_ok;

fn mean(v: &Volume) -> f64 {
    let n = v.samples().len();
    (0..n).map(|i| v.samples().get(i)).sum::<f64>() / n as f64
}

#[test]
#[ignore = "needs $ISOSPECTRUM_DATA: run by scripts/test"]
fn nucleon_is_the_same_from_its_nrrd_header_and_its_raw_file() {
    let folder = data::folder();
    let nrrd = read_ok(&folder.join("nucleon.nrrd"));
    let raw = read_ok(&folder.join("nucleon_41x41x41_uint8.raw"));
    assert_eq!(nrrd.dims(), [41, 41, 41]);
    assert_eq!(nrrd.samples(), raw.samples());
    assert_eq!(nrrd.placement(), raw.placement());
    assert_eq!(raw.range(), (0.0, 249.0));
    // SOURCES.md gives the mean to three decimals.
    assert!((mean(&raw) - 39.398).abs() <= 0.0005);
}

#[test]
#[ignore = "needs $ISOSPECTRUM_DATA: run by scripts/test"]
fn a_gzip_nrrd_from_medicine_has_the_values_its_source_lists() {
    let folder = data::folder();
    let v = read_ok(&folder.join("flair_124x160x140_uint8.nrrd"));
    assert_eq!(v.dims(), [124, 160, 140]);
    assert_eq!(v.range(), (0.0, 255.0));
    assert!((mean(&v) - 41.486).abs() <= 0.0005, "{}", mean(&v));
    assert_eq!(v.placement().origin[0], 64.898_239_135_742_2);
    // Its spacing is 1 mm, its first axis points to the left, the negative x of LPS reversed.
    for a in 0..3 {
        assert!((v.placement().spacing[a] - 1.0).abs() < 1e-3);
    }
    assert!(v.placement().direction[0][0] < -0.99);
}
