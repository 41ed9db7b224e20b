//! Kinds of CUBE, OpenDX and VTK files that other programs write, against bytes written here.

use std::path::Path;

use isospectrum::volume::{ReadOptions, Samples, Volume, read_volume};

use crate::volumes::{assert_mentions, folder, gzipped, message, message_with, read_ok, write};

fn array(path: &Path, name: &str) -> Volume {
    let options = ReadOptions { array: Some(name.to_owned()), ..ReadOptions::default() };
    read_volume(path, &options).unwrap_or_else(|e| panic!("{e}"))
}

/// A CUBE file of one atom and 2x3x4 samples, whose numbers are the given text.
fn cube(atoms: &str, numbers: &str) -> String {
    format!(
        "title\ncomment\n {atoms} -10.000000-120.500000   0.000000\n 2 1.0 0.0 0.0\n 3 0.0 1.0 0.0\n 4 0.0 0.0 1.0\n 1 1.0 0.0 0.0 0.0\n{numbers}"
    )
}

#[test]
fn cube_numbers_of_fortran_programs_are_read() {
    let folder = folder();
    // Columns of 13 characters, which negative numbers fill; exponents without letter, and with D.
    let filled: String = (1..=24).map(|i| format!("-{i}.00000E-003")).collect::<Vec<_>>().join("");
    let volume = read_ok(&write(&folder, "a.cub", cube("1", &filled).as_bytes()));
    // z is the fastest in the file.
    assert_eq!((volume.sample(0, 0, 0), volume.sample(0, 0, 1)), (-1e-3, -2e-3));
    assert_eq!((volume.sample(1, 0, 0), volume.sample(1, 2, 3)), (-13e-3, -24e-3));
    let origin = volume.placement().origin;
    assert!((origin[1] + 120.5 * 0.529_177_210_903).abs() < 1e-9, "{origin:?}");
    let plain = " 8.07941E-04".repeat(22);
    let mixed = cube("1", &format!("  1.50000-105  0.25D+01{plain}"));
    let volume = read_ok(&write(&folder, "b.cube", mixed.as_bytes()));
    assert_eq!((volume.sample(0, 0, 0), volume.sample(0, 0, 1)), (1.5e-105, 2.5));
    let stars = cube("1", &format!("*************{plain}"));
    let printed = message(&write(&folder, "c.cube", stars.as_bytes()));
    assert_mentions(&printed, &["'*************' as number 0"]);
    let long = cube("1", &(filled + "-1.0"));
    assert_mentions(&message(&write(&folder, "d.cube", long.as_bytes())), &["more than the 24"]);
}

#[test]
fn packed_cube_files_and_an_unannounced_line_of_orbitals_are_read() {
    let folder = folder();
    let numbers: String = (0..24).map(|i| format!(" {i}.5")).collect();
    let plain = read_ok(&write(&folder, "a.cube", cube("1", &numbers).as_bytes()));
    for name in ["a.cube.gz", "a.CUB.GZ"] {
        let packed = gzipped(cube("1", &numbers).as_bytes());
        let volume = read_ok(&write(&folder, name, &packed));
        assert_eq!(volume.samples(), plain.samples());
        let printed = message(&write(&folder, name, &packed[..packed.len() / 2]));
        assert_mentions(&printed, &["ends early"]);
    }
    // Molden counts orbitals after a positive number of atoms.
    let molden = cube("1", &format!("1    1\n{numbers}"));
    let volume = read_ok(&write(&folder, "b.cube", molden.as_bytes()));
    assert_eq!(volume.samples(), plain.samples());
    let two: String = (0..24).map(|i| format!(" {i}.5 -{i}.0")).collect();
    let molden = write(&folder, "c.cube", cube("1", &format!("2 3 7\n{two}")).as_bytes());
    let options = ReadOptions { channel: Some(0), ..ReadOptions::default() };
    let volume = read_volume(&molden, &options).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(volume.samples(), plain.samples());
    // Samples that are integers are no orbitals.
    let integers: String = (0..24).map(|i| format!(" {}", 1 + i % 2)).collect();
    let volume = read_ok(&write(&folder, "d.cube", cube("1", &integers).as_bytes()));
    assert_eq!((volume.sample(0, 0, 0), volume.sample(0, 0, 1)), (1.0, 2.0));
}

#[test]
fn regular_grids_of_opendx_are_read() {
    let folder = folder();
    let numbers: Vec<String> = (0..24).map(|i| format!("{i}.25")).collect();
    let numbers: Vec<String> = numbers.chunks(3).map(|three| three.join(" ")).collect();
    let text = |kind: &str, items: usize| {
        format!(
            "# Data from APBS\n#\nobject 1 class gridpositions counts 2 3 4\norigin -1.5 2.0e+00 3\ndelta 0.5 0 0\ndelta 0 0.25 0\ndelta 0 0 1\nobject 2 class gridconnections counts 2 3 4\nobject 3 class array type {kind} rank 0 items {items} data follows\n{}\nattribute \"dep\" string \"positions\"\nobject \"regular positions regular connections\" class field\n",
            numbers.join("\n")
        )
    };
    let path = write(&folder, "a.dx", text("double", 24).as_bytes());
    let volume = read_ok(&path);
    assert_eq!(volume.dims(), [2, 3, 4]);
    assert_eq!((volume.sample(0, 0, 1), volume.sample(1, 2, 3)), (1.25, 23.25));
    let placement = volume.placement();
    assert_eq!((placement.origin, placement.spacing), ([-1.5, 2.0, 3.0], [0.5, 0.25, 1.0]));
    let packed = write(&folder, "a.dx.gz", &gzipped(text("float", 24).as_bytes()));
    assert_eq!(read_ok(&packed).samples().type_name(), "float32");
    let wrong = write(&folder, "b.dx", text("double", 25).as_bytes());
    assert_mentions(&message(&wrong), &["expected the items of 2x3x4"]);
    let cut = text("double", 24);
    let cut = write(&folder, "c.dx", cut.split(" 20.25").next().expect("a start").as_bytes());
    assert_mentions(&message(&cut), &["numbers, expected 24"]);
}

/// A VTI file of 2x3x4 samples with these elements in its arrays of points.
fn vti(attributes: &str, arrays: &str) -> String {
    format!(
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"ImageData\" version=\"0.1\" byte_order=\"LittleEndian\" header_type=\"UInt32\">\n<ImageData WholeExtent=\"0 1 0 2 0 3\" {attributes}><Piece Extent=\"0 1 0 2 0 3\"><PointData>{arrays}</PointData><CellData></CellData></Piece></ImageData></VTKFile>"
    )
}

#[test]
fn keys_bits_and_separate_lengths_in_vti_arrays_are_read() {
    let folder = folder();
    let numbers: String = (0..48).map(|i| format!("{i} ")).collect();
    let key = "<InformationKey name=\"L2_NORM_RANGE\" location=\"vtkDataArray\" length=\"2\"><Value index=\"0\">0.115</Value><Value index=\"1\">1.47</Value></InformationKey>";
    let vectors = format!(
        "<DataArray type=\"Int16\" Name=\"v\" NumberOfComponents=\"2\" format=\"ascii\">{key}{numbers}</DataArray>"
    );
    let path = write(&folder, "a.vti", vti("", &vectors).as_bytes());
    let options = ReadOptions { channel: Some(1), ..ReadOptions::default() };
    let volume = read_volume(&path, &options).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(*volume.samples(), Samples::I16((0..24).map(|i| 2 * i + 1).collect()));

    // 24 bytes in base64 after their number, as one text and as two.
    let data = "AAECAwQFBgcICQoLDA0ODxAREhMUFRYX";
    for start in [format!("GAAAAA=={data}"), "GAAAAAABAgMEBQYHCAkKCwwNDg8QERITFBUWFw==".to_owned()]
    {
        let array =
            format!("<DataArray type=\"UInt8\" Name=\"p\" format=\"binary\">{start}</DataArray>");
        let volume = read_ok(&write(&folder, "b.vti", vti("", &array).as_bytes()));
        assert_eq!(*volume.samples(), Samples::U8((0..24).collect()), "{start}");
    }
    let short = "<DataArray type=\"UInt8\" Name=\"p\" format=\"binary\">GAAAAA==AAEC</DataArray>";
    assert_mentions(
        &message(&write(&folder, "c.vti", vti("", short).as_bytes())),
        &["bytes of samples, expected 24"],
    );

    // Bits: the first is the highest of its byte. 3 bytes: 0b1000_0001, 0, 0xff.
    let text = "1 0 0 0 0 0 0 1 ".to_owned() + &"0 ".repeat(8) + &"1 ".repeat(8);
    let expected: Vec<u8> = text.split_whitespace().map(|b| b.parse().expect("a bit")).collect();
    for (format, content) in [("ascii", text.as_str()), ("binary", "AwAAAIEA/w==")] {
        let array =
            format!("<DataArray type=\"Bit\" Name=\"m\" format=\"{format}\">{content}</DataArray>");
        let volume = read_ok(&write(&folder, "d.vti", vti("", &array).as_bytes()));
        assert_eq!(*volume.samples(), Samples::U8(expected.clone()), "{format}");
    }
}

#[test]
fn a_negative_spacing_is_an_axis_in_the_opposite_direction() {
    let folder = folder();
    let numbers: String = (0..24).map(|i| format!("{i} ")).collect();
    let array =
        format!("<DataArray type=\"UInt8\" Name=\"p\" format=\"ascii\">{numbers}</DataArray>");
    let attributes = "Origin=\"1 2 3\" Spacing=\"1 1 -2\"";
    let xml = write(&folder, "a.vti", vti(attributes, &array).as_bytes());
    let legacy = format!(
        "# vtk DataFile Version 3.0\nt\nASCII\nDATASET STRUCTURED_POINTS\nDIMENSIONS 2 3 4\nSPACING 1 1 -2\nORIGIN 1 2 3\nPOINT_DATA 24\nSCALARS p unsigned_char\nLOOKUP_TABLE default\n{numbers}\n"
    );
    let legacy = write(&folder, "a.vtk", legacy.as_bytes());
    let nrrd = |fields: &str| {
        format!(
            "NRRD0004\ntype: uchar\ndimension: 3\nsizes: 2 3 4\nencoding: text\n{fields}\n\n{numbers}\n"
        )
    };
    let spacings = nrrd("spacings: 1 1 -2\nspace origin: (1,2,3)");
    let spacings = write(&folder, "a.nrrd", spacings.as_bytes());
    let mins = write(&folder, "b.nrrd", nrrd("axis mins: 1 2 3\naxis maxs: 2 4 -3").as_bytes());
    for path in [xml, legacy, spacings, mins] {
        let volume = read_ok(&path);
        let placement = volume.placement();
        assert_eq!(placement.spacing, [1.0, 1.0, 2.0], "{path:?}");
        assert_eq!(placement.world([0.0; 3]), [1.0, 2.0, 3.0], "{path:?}");
        assert_eq!(placement.world([1.0, 2.0, 3.0]), [2.0, 4.0, -3.0], "{path:?}");
        assert_eq!(*volume.samples(), Samples::U8((0..24).collect()), "{path:?}");
    }
}

/// A legacy VTK file with these arrays of 2x3x4 points.
fn vtk(kind: &str, arrays: &[u8]) -> Vec<u8> {
    let head = format!(
        "# vtk DataFile Version 5.1\nvtk output\n{kind}\nDATASET STRUCTURED_POINTS\nDIMENSIONS 2 3 4\nSPACING 1 1 1\nORIGIN 0 0 0\nPOINT_DATA 24\n"
    );
    [head.as_bytes(), arrays].concat()
}

#[test]
fn legacy_vtk_is_read_in_any_case_and_beside_tables_colours_and_texture_coordinates() {
    let folder = folder();
    let numbers: String = (0..24).map(|i| format!("{i} ")).collect();
    let expected = Samples::U8((0..24).collect());
    let lower = format!(
        "# vtk datafile version 2.0\nt\nascii\ndataset structured_points\ndimensions 2 3 4\norigin 0 0 0\nspacing 1 1 2\npoint_data 24\nscalars p unsigned_char 1\nlookup_table default\n{numbers}\n"
    );
    let volume = read_ok(&write(&folder, "a.vtk", lower.as_bytes()));
    assert_eq!((volume.samples(), volume.placement().spacing), (&expected, [1.0, 1.0, 2.0]));

    let text = format!(
        "COLOR_SCALARS rgb 3\n{}\nSCALARS lab unsigned_char\nLOOKUP_TABLE own\n{numbers}\nLOOKUP_TABLE own 2\n1 0 0 1\n0 0 1 1\nTEXTURE_COORDINATES uv 2 float\n{}\nMETADATA\nINFORMATION 0\n\n",
        "0.5 ".repeat(72),
        "0.25 ".repeat(48)
    );
    let path = write(&folder, "b.vtk", &vtk("ASCII", text.as_bytes()));
    assert_eq!(array(&path, "lab").samples(), &expected);
    assert_mentions(&message(&path), &["3 arrays", "rgb, lab, uv"]);

    let values: Vec<u8> = (0..24).collect();
    let coordinates: Vec<u8> = (0..48u16).flat_map(|i| f32::from(i).to_be_bytes()).collect();
    let binary = [
        b"COLOR_SCALARS rgb 3\n".as_slice(),
        &[7; 72],
        b"\nSCALARS lab unsigned_char\nLOOKUP_TABLE own\n",
        &values,
        b"\nLOOKUP_TABLE own 2\n",
        &[10; 8],
        b"\nTEXTURE_COORDINATES uv 2 float\n",
        &coordinates,
        b"\n",
    ];
    let path = write(&folder, "c.vtk", &vtk("BINARY", &binary.concat()));
    assert_eq!(array(&path, "lab").samples(), &expected);
    let options =
        ReadOptions { array: Some("uv".to_owned()), channel: Some(1), ..ReadOptions::default() };
    let volume = read_volume(&path, &options).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!((volume.sample(0, 0, 0), volume.sample(1, 2, 3)), (1.0, 47.0));
    let cut = [b"LOOKUP_TABLE own 400000000000\n".as_slice(), &[10; 8]].concat();
    assert_mentions(&message(&write(&folder, "d.vtk", &vtk("BINARY", &cut))), &["8 bytes"]);
}

#[test]
fn bits_and_encoded_names_of_legacy_vtk_are_read() {
    let folder = folder();
    let text = "1 0 0 0 0 0 0 1 ".to_owned() + &"0 ".repeat(8) + &"1 ".repeat(8);
    let expected: Vec<u8> = text.split_whitespace().map(|b| b.parse().expect("a bit")).collect();
    let head = "SCALARS the%20mask%20(%25) bit\nLOOKUP_TABLE default\n";
    let binary = [head.as_bytes(), &[0x81, 0, 0xff], b"\n"].concat();
    let after = "SCALARS q unsigned_char\nLOOKUP_TABLE default\n".to_owned() + &"3 ".repeat(24);
    for (kind, arrays) in
        [("ASCII", format!("{head}{text}\n{after}\n").into_bytes()), ("BINARY", binary)]
    {
        let path = write(&folder, "a.vtk", &vtk(kind, &arrays));
        for name in ["the mask (%)", "the%20mask%20(%25)"] {
            assert_eq!(
                *array(&path, name).samples(),
                Samples::U8(expected.clone()),
                "{kind} {name}"
            );
        }
        let options = ReadOptions { array: Some("x".to_owned()), ..ReadOptions::default() };
        assert_mentions(&message_with(&path, &options), &["expected one of the mask (%)"]);
    }
}
