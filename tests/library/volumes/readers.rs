//! Every reader, type and byte order against bytes written by the test.

use std::fs;
use std::path::Path;

use isospectrum::Error;
use isospectrum::volume::{ReadOptions, Samples, Space, Unit, files_of, read_volume};

use crate::volumes::{
    DIMS, N, assert_mentions, folder, gzipped, message, message_with, npy_bytes, nrrd_header, read,
    read_ok, write,
};

/// A sample type: its name, its NRRD name, its NumPy code, known samples in both byte orders (little, big), and the
/// samples of the volume.
struct Kind {
    name: &'static str,
    nrrd: &'static str,
    npy: &'static str,
    bytes: [Vec<u8>; 2],
    samples: Samples,
}

/// The known samples of one type: from the smallest up in uneven steps.
macro_rules! kind {
    ($name:literal, $nrrd:literal, $npy:literal, $t:ty, $variant:ident) => {
        kind!($name, $nrrd, $npy, $t, $variant, <$t>::MIN)
    };
    ($name:literal, $nrrd:literal, $npy:literal, $t:ty, $variant:ident, $low:expr) => {{
        let values: Vec<$t> = (0..N).map(|i| $low + (i * i / 5) as $t).collect();
        Kind {
            name: $name,
            nrrd: $nrrd,
            npy: $npy,
            bytes: [
                values.iter().flat_map(|v| v.to_le_bytes()).collect(),
                values.iter().flat_map(|v| v.to_be_bytes()).collect(),
            ],
            samples: Samples::$variant(values.iter().map(|&v| v as _).collect()),
        }
    }};
}

fn kinds() -> Vec<Kind> {
    vec![
        kind!("uint8", "unsigned char", "u1", u8, U8),
        kind!("int8", "signed char", "i1", i8, I8),
        kind!("uint16", "ushort", "u2", u16, U16),
        kind!("int16", "short", "i2", i16, I16),
        kind!("uint32", "unsigned int", "u4", u32, U32),
        kind!("int32", "int32_t", "i4", i32, I32),
        kind!("uint64", "ulonglong", "u8", u64, F64),
        kind!("int64", "long long int", "i8", i64, F64, -(1 << 53)),
        kind!("float32", "float", "f4", f32, F32, -7.25),
        kind!("float64", "double", "f8", f64, F64, -1e15 + 0.125),
    ]
}

#[test]
fn every_type_and_byte_order_is_read_by_every_reader() {
    let folder = folder();
    for kind in kinds() {
        for (big, endian, mark) in [(0, "little", '<'), (1, "big", '>')] {
            let data = &kind.bytes[big];
            let check = |path: &Path, options: &ReadOptions| {
                let v = read_volume(path, options).unwrap_or_else(|e| panic!("{e}"));
                assert_eq!(v.dims(), DIMS, "{}", kind.name);
                assert_eq!(*v.samples(), kind.samples, "{} {endian} {path:?}", kind.name);
            };
            let options = ReadOptions { big_endian: big == 1, ..ReadOptions::default() };
            check(&write(&folder, &format!("a_2x3x4_{}.raw", kind.name), data), &options);

            let none = ReadOptions::default();
            let raw = nrrd_header(kind.nrrd, &format!("endian: {endian}\nencoding: raw\n"));
            check(&write(&folder, "a.nrrd", &[&raw[..], data].concat()), &none);
            let gz = nrrd_header(kind.nrrd, &format!("endian: {endian}\nencoding: gzip\n"));
            check(&write(&folder, "a.nrrd", &[gz, gzipped(data)].concat()), &none);

            let npy = npy_bytes(&format!("{mark}{}", kind.npy), "False", "(4, 3, 2)", data);
            check(&write(&folder, "a.npy", &npy), &none);
        }
    }
}

#[test]
fn text_nrrd_is_read_in_every_type() {
    let folder = folder();
    for kind in kinds() {
        // Such as U8([1, 2]).
        let variant = format!("{:?}", kind.samples);
        let numbers = variant.split_once('(').expect("a variant").1.trim_end_matches(')');
        let text = numbers.trim_matches(['[', ']']).replace(".0,", ",").replace(".0", "");
        let header = nrrd_header(kind.nrrd, "encoding: ascii\n");
        let path = write(&folder, "a.nrrd", &[&header[..], text.as_bytes(), b"\n"].concat());
        assert_eq!(*read_ok(&path).samples(), kind.samples, "{}", kind.name);
    }
}

#[test]
fn half_precision_arrays_become_float32() {
    // 0x3c00 is 1 and each of the next steps of 0x0400 doubles it, up to 2^15 and back to 2^0.
    let bits: Vec<u16> = (0..N as u16).map(|i| 0x3c00 + 0x400 * (i % 16)).collect();
    let data: Vec<u8> = bits.iter().flat_map(|b| b.to_le_bytes()).collect();
    let expected: Vec<f32> = (0..N as i32).map(|i| 2f32.powi(i % 16)).collect();
    let folder = folder();
    let path = write(&folder, "a.npy", &npy_bytes("<f2", "False", "(4, 3, 2)", &data));
    assert_eq!(*read_ok(&path).samples(), Samples::F32(expected));
}

#[test]
fn fortran_order_arrays_are_the_same_volume_as_their_c_order_copies() {
    let folder = folder();
    let [nx, ny, nz] = [5, 40, 70];
    let value = |x: usize, y: usize, z: usize| (x + 10 * y + 1000 * z) as i32;
    let (mut c, mut fortran) = (Vec::new(), Vec::new());
    for z in 0..nz {
        for y in 0..ny {
            c.extend((0..nx).map(|x| value(x, y, z)));
        }
    }
    for x in 0..nx {
        for y in 0..ny {
            fortran.extend((0..nz).map(|z| value(x, y, z)));
        }
    }
    let shape = format!("({nz}, {ny}, {nx})");
    for (is_fortran, data) in [("False", c), ("True", fortran)] {
        let data: Vec<u8> = data.into_iter().flat_map(i32::to_le_bytes).collect();
        let bytes = npy_bytes("<i4", is_fortran, &shape, &data);
        let v = read_ok(&write(&folder, "a.npy", &bytes));
        assert_eq!(v.dims(), [nx, ny, nz]);
        for (x, y, z) in [(0, 0, 0), (4, 0, 0), (0, 39, 0), (0, 0, 69), (3, 33, 65)] {
            let what = format!("fortran_order {is_fortran} ({x}, {y}, {z})");
            assert_eq!(v.sample(x, y, z), f64::from(value(x, y, z)), "{what}");
        }
    }
}

#[test]
fn raw_options_win_over_the_file_name() {
    let folder = folder();
    let data: Vec<u8> = (0..48).collect();
    let path = write(&folder, "a_9x9x9_float64.raw", &data);
    let options = ReadOptions {
        dims: Some([2, 3, 4]),
        sample_type: Some("uint16".to_owned()),
        spacing: Some([1.0, 2.0, 3.0]),
        origin: Some([-1.0, 0.0, 5.0]),
        ..ReadOptions::default()
    };
    let v = read_volume(&path, &options).expect("a valid file");
    assert_eq!(v.sample(1, 0, 0), f64::from(0x0302));
    assert_eq!(v.placement().spacing, [1.0, 2.0, 3.0]);
    assert_eq!(v.placement().origin, [-1.0, 0.0, 5.0]);
    let other = write(&folder, "a.dat", &data);
    assert_eq!(read_volume(&other, &options).expect("a valid file").samples(), v.samples());
    let npy = write(&folder, "a.npy", &npy_bytes("|u1", "False", "(4, 3, 2)", &data[..N]));
    assert!(matches!(read_volume(&npy, &options), Err(Error::Usage(_))));
}

#[test]
fn detached_nrrd_data_are_found_next_to_the_header_after_skipped_bytes() {
    let folder = folder();
    let data: Vec<u8> = (0..N as u8).collect();
    fs::create_dir(folder.path().join("sub")).expect("a writable temporary folder");
    write(&folder, "sub/plain.raw", &data);
    write(&folder, "sub/lines.raw", &[b"one\ntwo\nxyz", &data[..]].concat());
    write(
        &folder,
        "sub/junk.gz",
        &[b"one\n", &gzipped(&[b"abc", &data[..]].concat())[..]].concat(),
    );
    for (name, rest) in [
        ("plain", "encoding: raw\ndata file: ./plain.raw"),
        ("parent", "encoding: raw\ndatafile: ../sub/plain.raw"),
        ("skip", "encoding: raw\nline skip: 2\nbyte skip: 3\ndata file: lines.raw"),
        ("end", "encoding: raw\nbyteskip: -1\ndata file: lines.raw"),
        ("gzip", "encoding: gz\nlineskip: 1\nbyte skip: 3\ndata file: junk.gz"),
        ("crlf", "encoding: raw\r\ndata file: plain.raw\r"),
        ("notes", "# note\nkey:=value: x\ncontent: a\nencoding: RAW\ndata file: plain.raw"),
    ] {
        let path = write(&folder, &format!("sub/{name}.nhdr"), &nrrd_header("uchar", rest));
        assert_eq!(*read_ok(&path).samples(), Samples::U8(data.clone()), "{name}");
    }
    let missing = nrrd_header("uchar", "encoding: raw\ndata file: missing.raw");
    let path = write(&folder, "sub/missing.nhdr", &missing);
    let error = read(&path).expect_err("the data file is missing");
    assert!(matches!(&error, Error::Io { path, .. } if path.ends_with("missing.raw")), "{error}");
}

#[test]
fn nrrd_space_is_the_world_frame() {
    let folder = folder();
    let fields = "space: left-posterior-superior\nspace directions: (0,2,0) (-3,0,0) (0,0,0.5)\nspace origin: (1,-2,3.5)\nencoding: raw\n";
    let data: Vec<u8> = (0..N as u8).collect();
    let path = write(&folder, "a.nrrd", &[nrrd_header("uchar", fields), data].concat());
    let placement = *read_ok(&path).placement();
    assert_eq!(placement.spacing, [2.0, 3.0, 0.5]);
    assert_eq!(placement.direction, [[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]);
    assert_eq!(placement.origin, [1.0, -2.0, 3.5]);
    assert_eq!((placement.space, placement.unit), (Space::Lps, Unit::Mm));
    let place = |fields: &str| {
        let data: Vec<u8> = (0..N as u8).collect();
        write(&folder, "b.nrrd", &[nrrd_header("uchar", fields), data].concat())
    };
    let sheared = "space: scanner-xyz\nspace directions: (1,0,0) (0.1,1,0) (0,0,1)\nspace units: \"um\" \"um\" \"um\"\nencoding: raw\n";
    let placement = *read_ok(&place(sheared)).placement();
    assert!(placement.is_sheared());
    assert_eq!((placement.space, placement.unit), (Space::Unknown, Unit::Um));
    let flat = "space directions: (1,0,0) (0,1,0) (1,1,0)\nencoding: raw\n";
    assert_mentions(&message(&place(flat)), &["axis directions", "linearly independent"]);
    // Left-anterior-superior becomes RAS; world positions are unchanged.
    let las = "space: LAS\nspace directions: (1,0,0) (0,1,0) (0,0,1)\nspace origin: (5,6,7)\nencoding: raw\n";
    let placement = *read_ok(&place(las)).placement();
    assert_eq!((placement.space, placement.origin), (Space::Ras, [-5.0, 6.0, 7.0]));
    assert_eq!(placement.direction[0], [-1.0, 0.0, 0.0]);
}

#[test]
fn raw_data_are_inflated_and_described_by_a_header_file() {
    let folder = folder();
    let data: Vec<u8> = (0..N as u8).collect();
    let packed = write(&folder, "a_2x3x4_uint8.raw.gz", &gzipped(&data));
    assert_eq!(read_ok(&packed).samples(), &Samples::U8(data.clone()));
    for (wrong, part) in [(&data[1..], "end early"), (&[&data[..], &[1]].concat(), "more than")] {
        let path = write(&folder, "b_2x3x4_uint8.raw.gz", &gzipped(wrong));
        assert_mentions(&message(&path), &[part]);
    }
    let raw = write(&folder, "scan.raw", &data);
    assert_mentions(&message(&raw), &["no dimensions"]);
    // The header of another file is not used.
    let head = "NDims = 3\nDimSize = 2 3 4\nElementType = MET_UCHAR\nElementSpacing = 1 2 3\n";
    write(&folder, "scan.mhd", format!("{head}ElementDataFile = other.raw\n").as_bytes());
    assert_mentions(&message(&raw), &["no dimensions"]);
    write(&folder, "scan.mhd", format!("{head}ElementDataFile = scan.raw\n").as_bytes());
    let volume = read_ok(&raw);
    assert_eq!((volume.dims(), volume.placement().spacing), (DIMS, [1.0, 2.0, 3.0]));
    assert_eq!(files_of(&raw), [raw.clone(), folder.path().join("scan.mhd")]);
    let options = ReadOptions { dims: Some([4, 3, 2]), ..ReadOptions::default() };
    assert_mentions(&message_with(&raw, &options), &["scan.mhd", "--dims and --type"]);
}
