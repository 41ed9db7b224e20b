//! Files that must be refused with one line: no panic, and no allocation that their length does not justify.

use isospectrum::Error;
use isospectrum::volume::{ReadOptions, read_volume};

use crate::volumes::{
    N, assert_mentions, folder, gzipped, message, message_with, npy_bytes, nrrd_header, read,
    read_ok, write,
};

#[test]
fn missing_files_folders_and_unknown_extensions_are_one_line() {
    let folder = folder();
    let missing = folder.path().join("missing_2x2x2_uint8.raw");
    assert!(matches!(read(&missing), Err(Error::Io { .. })));
    assert_mentions(&message(&missing), &["missing_2x2x2_uint8.raw"]);
    assert_mentions(&message(folder.path()), &["a folder without slices"]);
    let other = write(&folder, "a.xyz", b"");
    assert_mentions(&message(&other), &["'xyz'", ".nrrd, .nhdr, .nii", "--dims"]);
    let other = write(&folder, "a.h5", b"");
    assert_mentions(&message(&other), &["'h5'", "h5py", "numpy.save"]);
    let dicom = [&[0; 128][..], b"DICM", &[0; 50]].concat();
    let other = write(&folder, "IM0001", &dicom);
    assert_mentions(&message(&other), &["no DICOM element"]);
    let nameless = write(&folder, "a.raw", b"");
    assert_mentions(&message(&nameless), &["no dimensions", "--dims"]);
    let typeless = write(&folder, "a_2x2x2.raw", b"");
    assert_mentions(&message(&typeless), &["no sample type", "--type"]);
    let options = ReadOptions { sample_type: Some("uint9".to_owned()), ..ReadOptions::default() };
    assert_mentions(&message_with(&typeless, &options), &["'uint9'", "uint8"]);
}

#[test]
fn a_wrong_size_names_bytes_found_and_expected() {
    let folder = folder();
    let raw = write(&folder, "a_2x3x4_uint16.raw", &[0; 47]);
    assert_mentions(&message(&raw), &["47 bytes, expected 48 for 2x3x4 uint16"]);
    let npy = write(&folder, "a.npy", &npy_bytes("<u2", "False", "(4, 3, 2)", &[0; 49]));
    assert_mentions(&message(&npy), &["49 bytes", "expected 48", "[4, 3, 2] uint16"]);
    let header = nrrd_header("uchar", "encoding: raw\n");
    for (extra, found) in [(23, "23 bytes"), (25, "25 bytes")] {
        let path = write(&folder, "a.nrrd", &[&header[..], &vec![1; extra]].concat());
        assert_mentions(&message(&path), &[found, "expected 24 for 2x3x4 uint8"]);
    }
}

#[test]
fn the_content_of_every_reader_ends_where_its_file_ends() {
    let folder = folder();
    let data: Vec<u8> = (0..N as u8).collect();
    let text = nrrd_header("uchar", "encoding: text\n");
    let numbers = data.iter().map(|v| format!("{v} ")).collect::<String>() + "\n";
    let raw = nrrd_header("uchar", "encoding: raw\n");
    let gz = nrrd_header("uchar", "encoding: gzip\n");
    // The number of bytes at the end that no reader needs.
    for (name, bytes, n_spare) in [
        ("a_2x3x4_uint8.raw", data.clone(), 0),
        ("a.npy", npy_bytes("|u1", "False", "(4, 3, 2)", &data), 0),
        ("a.nrrd", [raw, data.clone()].concat(), 0),
        ("a.nrrd", [gz, gzipped(&data)].concat(), 0),
        // "22 23 \n": the last number loses a digit only at the fourth byte from the end.
        ("a.nrrd", [text, numbers.into_bytes()].concat(), 3),
    ] {
        read_ok(&write(&folder, name, &bytes));
        for n in 0..bytes.len() - n_spare {
            message(&write(&folder, name, &bytes[..n]));
        }
        message(&write(&folder, name, &[&bytes[..], b"1"].concat()));
    }
}

#[test]
fn no_changed_byte_makes_a_reader_panic() {
    let folder = folder();
    let data: Vec<u8> = (0..N as u8).collect();
    let fields = "space: RAS\nspace directions: (1,0,0) (0,1,0) (0,0,1)\nspace origin: (0,0,0)\nkinds: domain domain domain\nline skip: 0\nbyte skip: 0\nencoding: ";
    let raw = nrrd_header("uchar", &format!("{fields}raw\n"));
    let gz = nrrd_header("uchar", &format!("{fields}gzip\n"));
    for (name, bytes) in [
        ("a.npy", npy_bytes("|u1", "True", "(4, 3, 2)", &data)),
        ("a.nrrd", [raw, data.clone()].concat()),
        ("a.nrrd", [gz, gzipped(&data)].concat()),
    ] {
        for i in 0..bytes.len() {
            for byte in [b'9', b'\n', bytes[i] ^ 1] {
                let mut changed = bytes.clone();
                changed[i] = byte;
                let path = write(&folder, name, &changed);
                if let Ok(v) = read(&path) {
                    assert_eq!(v.samples().len(), N, "byte {i} as {byte}");
                }
            }
        }
    }
}

#[test]
fn headers_cannot_cause_allocations_larger_than_their_file_justifies() {
    let folder = folder();
    for dims in ["1000000x1000000x1000000", "4294967296x4294967296x4294967296"] {
        let raw = write(&folder, &format!("a_{dims}_float64.raw"), &[0; 64]);
        assert_mentions(&message(&raw), &["64 bytes, expected ", dims]);
        let axes: Vec<&str> = dims.split('x').collect();
        let npy = npy_bytes("<f8", "False", &format!("({})", axes.join(", ")), &[0; 64]);
        assert_mentions(&message(&write(&folder, "a.npy", &npy)), &["64 bytes", axes[0]]);
        for encoding in ["raw", "gzip", "text"] {
            let header = format!(
                "NRRD0004\ntype: double\nendian: little\ndimension: 3\nsizes: {}\nencoding: {encoding}\n\n",
                axes.join(" ")
            );
            let bytes = [header.as_bytes(), &gzipped(&[0; 64])].concat();
            assert_mentions(&message(&write(&folder, "a.nrrd", &bytes)), &[dims]);
        }
    }
    let long = [b"\x93NUMPY\x02\x00\xff\xff\xff\xff", &[b' '; 100][..]].concat();
    assert_mentions(&message(&write(&folder, "long.npy", &long)), &["header of 4294967295 bytes"]);
    let endless = [b"NRRD0004\ncontent: ", &vec![b'x'; 1 << 21][..]].concat();
    let endless = write(&folder, "endless.nrrd", &endless);
    assert_mentions(&message(&endless), &["header", "1048576 bytes"]);
}

#[test]
fn gzip_data_longer_than_the_header_declares_are_not_inflated() {
    let folder = folder();
    let header = nrrd_header("uchar", "encoding: gzip\n");
    let bomb = gzipped(&vec![7; 1 << 24]);
    let path = write(&folder, "a.nrrd", &[&header[..], &bomb].concat());
    assert_mentions(&message(&path), &["more than the 24 bytes"]);
    let mut wrong_checksum = gzipped(&[7; N]);
    let n = wrong_checksum.len();
    wrong_checksum[n - 8] ^= 1;
    let path = write(&folder, "a.nrrd", &[header, wrong_checksum].concat());
    assert_mentions(&message(&path), &["damaged"]);
}

#[test]
fn samples_that_are_not_finite_are_named_or_replaced() {
    let folder = folder();
    for (bad, shown) in [(f64::NAN, "NaN"), (f64::INFINITY, "inf"), (f64::NEG_INFINITY, "-inf")] {
        let mut values: Vec<f64> = (0..N).map(|i| i as f64).collect();
        // Sample (1, 2, 3) of 2 x 3 x 4 is the last one, (0, 1, 2) has the index 14.
        values[14] = bad;
        values[23] = bad;
        let f64s: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
        let f32s: Vec<u8> = values.iter().flat_map(|&v| (v as f32).to_le_bytes()).collect();
        for (name, data) in [("a_2x3x4_float64.raw", f64s), ("a_2x3x4_float32.raw", f32s)] {
            let path = write(&folder, name, &data);
            let expected = format!("sample (0, 1, 2) is {shown}");
            assert_mentions(&message(&path), &[&expected, "--nan-as"]);
            let with = |value| ReadOptions { nan_as: Some(value), ..ReadOptions::default() };
            let v = read_volume(&path, &with(-4.5)).expect("all samples are finite now");
            assert_eq!((v.sample(0, 1, 2), v.sample(1, 2, 3)), (-4.5, -4.5));
            assert_eq!(v.range(), (-4.5, 22.0));
            assert!(matches!(read_volume(&path, &with(bad)), Err(Error::Usage(_))));
        }
    }
}

#[test]
fn constant_and_flat_volumes_are_refused() {
    let folder = folder();
    let constant = write(&folder, "a_2x3x4_uint8.raw", &[5; N]);
    assert_mentions(&message(&constant), &["every sample is 5.0"]);
    for (dims, n) in [("1x3x4", 12), ("2x1x4", 8), ("2x3x1", 6), ("0x3x4", 0)] {
        let data: Vec<u8> = (0..n).collect();
        let path = write(&folder, &format!("a_{dims}_uint8.raw"), &data);
        assert_mentions(&message(&path), &[dims, "at least 2"]);
    }
}

#[test]
fn integers_beyond_2_to_the_53_are_refused_not_rounded() {
    let folder = folder();
    let mut values = [0i64; N];
    values[7] = (1 << 53) + 1;
    let data: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
    let raw = write(&folder, "a_2x3x4_int64.raw", &data);
    assert_mentions(&message(&raw), &["9007199254740993", "2^53"]);
    let header = nrrd_header("int64", "endian: little\nencoding: gzip\n");
    let gz = write(&folder, "a.nrrd", &[header, gzipped(&data)].concat());
    assert_mentions(&message(&gz), &["9007199254740993", "2^53"]);
}

#[test]
fn ranges_beyond_float64_are_refused() {
    let folder = folder();
    let values: Vec<u8> =
        (0..N).flat_map(|i| if i == 0 { -1e308f64 } else { 1e308 }.to_le_bytes()).collect();
    let path = write(&folder, "a_2x3x4_float64.raw", &values);
    assert_mentions(&message(&path), &["-1e308", "1e306"]);
}
