//! The readers of volumes against bytes written here, against damaged files and against real ones.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

use flate2::Compression;
use flate2::write::GzEncoder;
use isospectrum::volume::{ReadOptions, Samples, Volume, read_volume};
use isospectrum::{Error, with_samples};

/// Dimensions of the small volumes of these tests: all different, so that swapped axes show.
const DIMS: [usize; 3] = [2, 3, 4];

/// Number of samples of a small volume.
const N: usize = 24;

/// A folder for one test's files.
fn folder() -> tempfile::TempDir {
    tempfile::tempdir().expect("a temporary folder")
}

fn write(folder: &tempfile::TempDir, name: &str, bytes: &[u8]) -> PathBuf {
    let path = folder.path().join(name);
    fs::write(&path, bytes).expect("a writable temporary folder");
    path
}

fn read(path: &Path) -> Result<Volume, Error> {
    read_volume(path, &ReadOptions::default())
}

fn read_ok(path: &Path) -> Volume {
    read(path).unwrap_or_else(|e| panic!("{e}"))
}

/// The message for a file that must not be read: one line, with the file's name in it.
fn message(path: &Path) -> String {
    message_with(path, &ReadOptions::default())
}

fn message_with(path: &Path, options: &ReadOptions) -> String {
    let error = read_volume(path, options).expect_err(&path.display().to_string());
    let text = error.to_string();
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    assert!(!text.contains('\n') && !text.ends_with('.'), "{text}");
    assert!(text.contains(name.as_ref()) || matches!(error, Error::Usage(_)), "{text}");
    text
}

fn assert_mentions(text: &str, parts: &[&str]) {
    for part in parts {
        assert!(text.contains(part), "'{part}' is missing in: {text}");
    }
}

/// One type: its name, its NRRD name, its NumPy code, the known samples in both byte orders
/// (little, big) and what a volume holds of them.
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
        kind!("float64", "double", "f8", f64, F64, -1e300),
    ]
}

fn nrrd_header(nrrd_type: &str, rest: &str) -> Vec<u8> {
    let [x, y, z] = DIMS;
    format!("NRRD0004\ntype: {nrrd_type}\ndimension: 3\nsizes: {x} {y} {z}\n{rest}\n").into_bytes()
}

fn npy_bytes(descr: &str, fortran_order: &str, shape: &str, data: &[u8]) -> Vec<u8> {
    let mut text =
        format!("{{'descr': '{descr}', 'fortran_order': {fortran_order}, 'shape': {shape}, }}");
    while (10 + text.len() + 1) % 64 != 0 {
        text.push(' ');
    }
    text.push('\n');
    let length = u16::try_from(text.len()).expect("a short header").to_le_bytes();
    [b"\x93NUMPY\x01\x00", &length[..], text.as_bytes(), data].concat()
}

fn gzipped(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::default());
    encoder.write_all(bytes).expect("memory takes all");
    encoder.finish().expect("memory takes all")
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
        let numbers = with_samples!(&kind.samples, s => format!("{s:?}"));
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
fn integers_beyond_2_to_the_53_are_refused_not_rounded() {
    let folder = folder();
    let mut values = vec![0i64; N];
    values[7] = (1 << 53) + 1;
    let data: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
    let raw = write(&folder, "a_2x3x4_int64.raw", &data);
    assert_mentions(&message(&raw), &["9007199254740993", "2^53"]);
    let header = nrrd_header("int64", "endian: little\nencoding: gzip\n");
    let gz = write(&folder, "a.nrrd", &[header, gzipped(&data)].concat());
    assert_mentions(&message(&gz), &["9007199254740993", "2^53"]);
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
    // Written by another implementation of the format.
    for (order, data) in [(npyz::Order::C, c), (npyz::Order::Fortran, fortran)] {
        use npyz::WriterBuilder;
        let mut bytes = Vec::new();
        let shape = [nz as u64, ny as u64, nx as u64];
        let options = npyz::WriteOptions::new().default_dtype().order(order).shape(&shape);
        let mut writer = options.writer(&mut bytes).begin_nd().expect("memory takes all");
        writer.extend(data).expect("memory takes all");
        writer.finish().expect("memory takes all");
        let v = read_ok(&write(&folder, "a.npy", &bytes));
        assert_eq!(v.dims(), [nx, ny, nz]);
        for (x, y, z) in [(0, 0, 0), (4, 0, 0), (0, 39, 0), (0, 0, 69), (3, 33, 65)] {
            assert_eq!(v.sample(x, y, z), f64::from(value(x, y, z)), "{order:?} ({x}, {y}, {z})");
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
fn detached_nrrd_data_lie_beside_the_header_and_behind_what_is_skipped() {
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
    let sheared = "space directions: (1,0,0) (0.1,1,0) (0,0,1)\nencoding: raw\n";
    let data: Vec<u8> = (0..N as u8).collect();
    let path = write(&folder, "b.nrrd", &[nrrd_header("uchar", sheared), data].concat());
    assert_mentions(&message(&path), &["axis directions", "perpendicular"]);
}

#[test]
fn missing_files_folders_and_unknown_extensions_are_one_line() {
    let folder = folder();
    let missing = folder.path().join("missing_2x2x2_uint8.raw");
    assert!(matches!(read(&missing), Err(Error::Io { .. })));
    assert_mentions(&message(&missing), &["missing_2x2x2_uint8.raw"]);
    assert_mentions(&message(folder.path()), &["not a regular file"]);
    let other = write(&folder, "a.vtk", b"");
    assert_mentions(&message(&other), &["'vtk'", ".raw, .nrrd, .nhdr or .npy"]);
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
    // The number of bytes at the end that are white space or repeat nothing a reader needs.
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
            for byte in [0, b'9', b'-', b'(', b'\n', 0xff, bytes[i] ^ 1] {
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
fn headers_cannot_ask_for_memory_their_file_has_not_earned() {
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
    assert_mentions(&message(&endless), &["header does not end"]);
}

#[test]
fn gzip_data_longer_than_the_header_says_are_not_inflated() {
    let folder = folder();
    let header = nrrd_header("uchar", "encoding: gzip\n");
    let bomb = gzipped(&vec![7; 1 << 24]);
    let path = write(&folder, "a.nrrd", &[&header[..], &bomb].concat());
    assert_mentions(&message(&path), &["more than the 24 bytes"]);
    let mut wrong_checksum = gzipped(&[7; N]);
    let n = wrong_checksum.len();
    wrong_checksum[n - 8] ^= 1;
    let path = write(&folder, "a.nrrd", &[header, wrong_checksum].concat());
    assert_mentions(&message(&path), &["damaged gzip data"]);
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
    assert_mentions(&message(&constant), &["every sample is 5"]);
    for (dims, n) in [("1x3x4", 12), ("2x1x4", 8), ("2x3x1", 6), ("0x3x4", 0)] {
        let data: Vec<u8> = (0..n).collect();
        let path = write(&folder, &format!("a_{dims}_uint8.raw"), &data);
        assert_mentions(&message(&path), &[dims, "at least 2"]);
    }
}

/// The folder of real volumes, or `None` (said loudly) where there is none.
fn real_volumes(test: &str) -> Option<PathBuf> {
    let folder = std::env::var_os("ISOSPECTRUM_DATA").map_or_else(
        || Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data"),
        PathBuf::from,
    );
    if folder.is_dir() {
        return Some(folder);
    }
    eprintln!("NOT RUN: {test}: no folder {} (set ISOSPECTRUM_DATA)", folder.display());
    None
}

fn mean(v: &Volume) -> f64 {
    let n = v.samples().len();
    (0..n).map(|i| v.samples().get(i)).sum::<f64>() / n as f64
}

#[test]
fn nucleon_is_the_same_from_its_nrrd_header_and_its_raw_file() {
    let Some(folder) = real_volumes("nucleon") else { return };
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
fn a_gzip_nrrd_from_medicine_has_the_values_its_source_lists() {
    let Some(folder) = real_volumes("flair") else { return };
    let v = read_ok(&folder.join("flair_124x160x140_uint8.nrrd"));
    assert_eq!(v.dims(), [124, 160, 140]);
    assert_eq!(v.range(), (0.0, 255.0));
    assert!((mean(&v) - 41.486).abs() <= 0.0005, "{}", mean(&v));
    assert_eq!(v.placement().origin[0], 64.898239135742202);
    // Its spacing is 1 mm, its first axis points to the left, the negative x of LPS reversed.
    for a in 0..3 {
        assert!((v.placement().spacing[a] - 1.0).abs() < 1e-3);
    }
    assert!(v.placement().direction[0][0] < -0.99);
}
