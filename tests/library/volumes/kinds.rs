//! Kinds of NRRD, NIfTI, MRC and DICOM files that other programs write, against bytes written here.

use std::path::{Path, PathBuf};

use isospectrum::volume::{ReadOptions, Samples, Volume, read_volume};
use tempfile::TempDir;

use crate::volumes::{
    assert_mentions, folder, gzipped, message, message_with, nrrd_header, read, read_ok, write,
};

fn frame(path: &Path, frame: usize) -> Volume {
    let options = ReadOptions { frame: Some(frame), ..ReadOptions::default() };
    read_volume(path, &options).unwrap_or_else(|e| panic!("{e}"))
}

fn channel(path: &Path, channel: usize) -> Volume {
    let options = ReadOptions { channel: Some(channel), ..ReadOptions::default() };
    read_volume(path, &options).unwrap_or_else(|e| panic!("{e}"))
}

#[test]
fn types_of_nrrd_are_in_any_case_and_compressed_samples_may_be_at_the_end() {
    let folder = folder();
    let data: Vec<u8> = (0..48).collect();
    let header = nrrd_header("Unsigned  SHORT", "endian: Little\nencoding: raw\n");
    let volume = read_ok(&write(&folder, "a.nrrd", &[&header[..], &data].concat()));
    assert_eq!(volume.sample(1, 0, 0), f64::from(0x0302));
    // As of a NIfTI file, whose samples follow a header.
    for n_before in [0, 352] {
        let packed = gzipped(&[&vec![9; n_before][..], &data].concat());
        write(&folder, "b.nii.gz", &packed);
        let fields = "endian: little\nencoding: gzip\nbyte skip: -1\ndata file: b.nii.gz\n";
        let detached = write(&folder, "b.nhdr", &nrrd_header("ushort", fields));
        assert_eq!(read_ok(&detached).samples(), volume.samples(), "{n_before}");
    }
    write(&folder, "b.nii.gz", &gzipped(&data[1..]));
    let printed = read(&folder.path().join("b.nhdr")).expect_err("too short").to_string();
    assert_mentions(&printed, &["b.nii.gz", "end early", "48 bytes"]);
}

/// A 4-D NRRD header of bytes.
fn nrrd_4d(sizes: &str, rest: &str) -> Vec<u8> {
    format!("NRRD0004\ntype: uchar\ndimension: 4\nsizes: {sizes}\n{rest}\n").into_bytes()
}

#[test]
fn one_frame_or_channel_of_a_4d_nrrd_is_read() {
    let folder = folder();
    let data: Vec<u8> = (0..72).collect();
    let last: Vec<u8> = (48..72).collect();
    let every_third: Vec<u8> = (0..24).map(|i| 3 * i + 2).collect();
    let space = "space: left-posterior-superior\nspace origin: (1,2,3)\n";
    let directions = "(2,0,0) (0,3,0) (0,0,4)";
    for (encoding, bytes) in [
        ("raw", data.clone()),
        ("gzip", gzipped(&data)),
        ("text", data.iter().map(|v| format!("{v} ")).collect::<String>().into_bytes()),
    ] {
        let end = format!("encoding: {encoding}\n");
        let slow =
            nrrd_4d("2 3 4 3", &format!("{space}space directions: {directions} none\n{end}"));
        let path = write(&folder, "slow.nrrd", &[slow, bytes.clone()].concat());
        let volume = frame(&path, 2);
        assert_eq!(*volume.samples(), Samples::U8(last.clone()), "{encoding}");
        assert_eq!(volume.placement().spacing, [2.0, 3.0, 4.0]);
        assert_eq!(frame(&path, 0).sample(1, 0, 0), 1.0);
        assert_mentions(&message(&path), &["3 frames", "--frame 0 to 2"]);
        let kinds = "kinds: vector domain domain domain\nspacings: nan 2 3 4\n";
        let fast = nrrd_4d("3 2 3 4", &format!("{kinds}{end}"));
        let path = write(&folder, "fast.nrrd", &[fast, bytes].concat());
        let volume = channel(&path, 2);
        assert_eq!(*volume.samples(), Samples::U8(every_third.clone()), "{encoding}");
        assert_eq!(volume.placement().spacing, [2.0, 3.0, 4.0]);
    }
    // Without a word on the axes the last one is time. Frames in files of their own.
    for (i, part) in data.chunks(24).enumerate() {
        write(&folder, &format!("f{i}.raw"), part);
    }
    let list = "encoding: raw\ndata file: LIST 3\nf0.raw\nf1.raw\nf2.raw\n";
    let path = write(&folder, "list.nhdr", &nrrd_4d("2 3 4 3", list));
    assert_eq!(*frame(&path, 2).samples(), Samples::U8(last));
    let middle = nrrd_4d("2 3 3 4", "kinds: domain domain list domain\nencoding: raw\n");
    let path = write(&folder, "middle.nrrd", &[middle, data.clone()].concat());
    assert_mentions(&message(&path), &["axis 2", "first or the last"]);
    let short = nrrd_4d("2 3 4 4", "encoding: raw\n");
    let path = write(&folder, "short.nrrd", &[short, data].concat());
    let options = ReadOptions { frame: Some(0), ..ReadOptions::default() };
    assert_mentions(&message_with(&path, &options), &["72 bytes", "96"]);
}

/// A NIfTI-1 file of 2x3x4 bytes; `change` gets its header.
fn nifti(folder: &TempDir, name: &str, change: impl Fn(&mut [u8])) -> PathBuf {
    let mut bytes = vec![0u8; 352];
    bytes[..4].copy_from_slice(&348i32.to_le_bytes());
    for (i, n) in [3i16, 2, 3, 4, 1].into_iter().enumerate() {
        bytes[40 + 2 * i..42 + 2 * i].copy_from_slice(&n.to_le_bytes());
    }
    bytes[70] = 2;
    for (i, spacing) in [1f32, 0.5, 0.75, 2.0].into_iter().enumerate() {
        bytes[76 + 4 * i..80 + 4 * i].copy_from_slice(&spacing.to_le_bytes());
    }
    bytes[108..112].copy_from_slice(&352f32.to_le_bytes());
    bytes[123] = 2;
    bytes[344..348].copy_from_slice(b"n+1\0");
    change(&mut bytes);
    bytes.extend(0..24);
    write(folder, name, &bytes)
}

#[test]
fn an_empty_sform_is_not_used_and_no_frames_are_one() {
    let folder = folder();
    let with_qform = |bytes: &mut [u8]| {
        (bytes[252], bytes[254]) = (1, 1);
        bytes[268..272].copy_from_slice(&7f32.to_le_bytes());
    };
    let placement = *read_ok(&nifti(&folder, "a.nii", with_qform)).placement();
    assert_eq!((placement.spacing, placement.origin), ([0.5, 0.75, 2.0], [7.0, 0.0, 0.0]));
    let spacing_only = nifti(&folder, "b.nii", |bytes| bytes[254] = 1);
    assert_eq!(read_ok(&spacing_only).placement().spacing, [0.5, 0.75, 2.0]);
    let no_frames = |bytes: &mut [u8]| (bytes[40], bytes[48]) = (4, 0);
    assert_eq!(read_ok(&nifti(&folder, "c.nii", no_frames)).dims(), [2, 3, 4]);
    let no_slices = nifti(&folder, "d.nii", |bytes| bytes[46] = 0);
    assert_mentions(&message(&no_slices), &["dimension 3 is 0"]);
}

/// A map of 2x3x4 bytes from 120 on: `stamp` and flags of IMOD, and the smallest and largest value of the header.
fn map(folder: &TempDir, stamp: [i32; 2], range: [f32; 2]) -> PathBuf {
    let mut bytes = vec![0u8; 1024];
    let mut set = |word: usize, value: [u8; 4]| {
        bytes[4 * (word - 1)..4 * word].copy_from_slice(&value);
    };
    for (word, n) in [(1, 2i32), (2, 3), (3, 4), (17, 1), (18, 2), (19, 3)] {
        set(word, n.to_le_bytes());
    }
    (0..2).for_each(|i| set(39 + i, stamp[i].to_le_bytes()));
    (0..2).for_each(|i| set(20 + i, range[i].to_le_bytes()));
    bytes.extend(120..144);
    write(folder, "a.mrc", &bytes)
}

#[test]
fn bytes_of_imod_and_of_itk_have_no_sign() {
    const STAMP: i32 = 1_146_047_817;
    let folder = folder();
    let range_of = |stamp, range| read_ok(&map(&folder, stamp, range)).range();
    assert_eq!(range_of([STAMP, 0], [0.0, 0.0]), (120.0, 143.0));
    assert_eq!(range_of([STAMP, 1], [0.0, 0.0]), (-128.0, 127.0));
    assert_eq!(range_of([0, 0], [0.0, 0.0]), (-128.0, 127.0));
    // No byte with a sign is above 127.
    assert_eq!(range_of([0, 0], [120.0, 143.0]), (120.0, 143.0));
    assert_eq!(range_of([0, 0], [-113.0, 127.0]), (-128.0, 127.0));
    assert_eq!(range_of([0, 0], [0.0, 1e9]), (-128.0, 127.0));
}
