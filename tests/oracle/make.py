"""Writes small volumes with the programs that users write them with, and what those programs read back.

    python3 -m venv venv && venv/bin/pip install numpy nibabel SimpleITK vtk mrcfile gemmi ase tifffile imagecodecs pillow scipy pydicom
    venv/bin/python tests/oracle/make.py [FOLDER_OF_REAL_VOLUMES]

Everything goes into this folder: the files, and `values.json`, which `tests/library/oracle.rs` compares with what isospectrum
reads: dimensions, a checksum of all samples (CRC-32 of them as 64-bit floats, x fastest), a few samples, and the world
positions of the eight corners. With a folder of real volumes, `real.json` as well.
"""

import gzip
import json
import shutil
import sys
import tempfile
import zlib
from pathlib import Path

import ase
import ase.io.cube
import gemmi
import imagecodecs
import mrcfile
import nibabel as nib
import numpy as np
import pydicom
import SimpleITK as sitk
import tifffile
import vtk
from PIL import Image
from scipy import ndimage
from vtk.util import numpy_support

HERE = Path(__file__).parent
DIMS = (5, 4, 3)
BOHR = 0.529177210903


def pattern(dtype, shift=0):
    """Samples [x, y, z], all different along every axis."""
    x, y, z = np.meshgrid(*map(np.arange, DIMS), indexing="ij")
    values = (7 * x + 31 * y + 17 * z * z + x * y * z + shift) % 101
    if np.dtype(dtype).kind == "i":
        values = values - 50
    if np.dtype(dtype).kind == "f":
        values = values / 7 - 3
    return values.astype(dtype)


def entry(file, oracle, samples, corner, space, unit, **options):
    """`samples` [x, y, z]; `corner` maps an index to the world."""
    flat = np.ascontiguousarray(samples.transpose(2, 1, 0)).astype("<f8").ravel()
    dims = samples.shape
    corners = []
    for c in range(8):
        index = [(c >> a & 1) * (dims[a] - 1) for a in range(3)]
        corners.append([float(v) for v in corner(index)])
    return {
        "file": file,
        "oracle": oracle,
        "options": options,
        "dims": list(dims),
        "crc32": zlib.crc32(flat.tobytes()),
        "first": [float(v) for v in flat[:4]],
        "corners": corners,
        "space": space,
        "unit": unit,
    }


# NIfTI: nibabel


def affine_corner(affine, scale=1.0):
    return lambda index: (affine @ [*index, 1])[:3] * scale


def nifti_entry(file, frame=None, channel=None, scale=1.0, path=None):
    image = nib.load(path or HERE / file)
    data = np.asanyarray(image.dataobj)
    options = {}
    if data.dtype.fields:
        options["channel"] = channel
        data = data[data.dtype.names[channel]]
    if data.ndim == 4:
        options["frame"] = frame
        data = data[..., frame]
    # Scaled samples of few bits are kept in 32.
    on_disk = image.header.get_data_dtype()
    if data.dtype == np.float64 and on_disk.itemsize <= 2:
        data = data.astype(np.float32)
    version = nib.__version__
    return entry(file, f"nibabel {version}", data, affine_corner(image.affine, scale), "RAS", "mm", **options)


def nifti():
    shear = np.array([[1.5, 0.2, 0.1, -20], [0, 2.0, 0.3, 30.25], [0.1, 0, 2.5, -7.5], [0, 0, 0, 1]])
    entries = []

    def save(image, name, **options):
        nib.save(image, HERE / name)
        entries.append(nifti_entry(name, **options))

    for kind in ["i1", "u2", "u4", "i8", "u8", "f8"]:
        image = nib.Nifti1Image(pattern(kind), shear, dtype=kind)
        save(image, f"nifti_{kind}.nii")
    image = nib.Nifti1Image(pattern("i2"), shear)
    image.header.set_slope_inter(2.5, -3)
    save(image, "nifti_scaled.nii")
    header = nib.Nifti1Header(endianness=">")
    header.set_data_dtype(">f4")
    save(nib.Nifti1Image(pattern(">f4"), shear, header), "nifti_big_endian.nii.gz")
    image = nib.Nifti1Image(pattern("u1"), None)
    image.header["pixdim"][:4] = [-1, 0.5, 0.75, 3]
    image.header["qform_code"] = 1
    image.header["quatern_b"], image.header["quatern_c"], image.header["quatern_d"] = 0.1, -0.3, 0.5
    image.header["qoffset_x"], image.header["qoffset_y"], image.header["qoffset_z"] = 1.5, -2.5, 100
    image = nib.Nifti1Image(pattern("u1"), None, image.header)
    image.header.set_sform(None, 0)
    save(image, "nifti_qform.nii")
    nib.save(nib.Nifti1Pair(pattern("i4"), shear), HERE / "nifti_pair.hdr")
    entries.append(nifti_entry("nifti_pair.hdr"))
    series = np.stack([pattern("f4", shift) for shift in range(3)], axis=3)
    image = nib.Nifti2Image(series, shear)
    image.header.set_xyzt_units("micron", "sec")
    # The world is in millimetres here, as in ITK.
    save(image, "nifti_2_series.nii.gz", frame=2, scale=1e-3)
    colours = np.zeros(DIMS, dtype=[("R", "u1"), ("G", "u1"), ("B", "u1")])
    for shift, name in enumerate("RGB"):
        colours[name] = pattern("u1", 10 * shift)
    save(nib.Nifti1Image(colours, shear), "nifti_colours.nii", channel=1)
    return entries


# MetaImage: ITK


def itk_corner(image):
    return lambda index: image.TransformContinuousIndexToPhysicalPoint([float(i) for i in index])


def itk_entry(file, channel=None, frame=None, path=None):
    image = sitk.ReadImage(str(path or HERE / file))
    options = {}
    data = sitk.GetArrayFromImage(image)
    place = image
    if frame is not None:
        options["frame"] = frame
        data = data[frame]
        place = image[:, :, :, 0]
        origin, spacing, direction = image.GetOrigin()[:3], image.GetSpacing()[:3], np.reshape(image.GetDirection(), (4, 4))[:3, :3]
        place.SetOrigin(origin), place.SetSpacing(spacing), place.SetDirection(direction.ravel())
    if channel is not None:
        options["channel"] = channel
        data = data[..., channel]
    version = sitk.Version.VersionString()
    return entry(file, f"ITK {version}", data.transpose(2, 1, 0), itk_corner(place), "LPS", "mm", **options)


def itk_image(samples):
    image = sitk.GetImageFromArray(samples.transpose(2, 1, 0, *range(3, samples.ndim)), isVector=samples.ndim > 3)
    a, b = np.deg2rad([20, 35])
    rotation = np.array([[np.cos(a), -np.sin(a), 0], [np.sin(a), np.cos(a), 0], [0, 0, 1]])
    rotation = rotation @ np.array([[1, 0, 0], [0, np.cos(b), -np.sin(b)], [0, np.sin(b), np.cos(b)]])
    image.SetDirection(rotation.ravel())
    image.SetSpacing([0.7, 0.9, 2.5])
    image.SetOrigin([-110.5, 12.25, 1e3 / 3])
    return image


def metaimage():
    entries = []

    def save(image, name, packed=False, **options):
        sitk.WriteImage(image, str(HERE / name), packed)
        entries.append(itk_entry(name, **options))

    save(itk_image(pattern("i2")), "meta_local.mha")
    save(itk_image(pattern("f4")), "meta_packed.mha", True)
    save(itk_image(pattern("u2")), "meta_external.mhd")
    save(itk_image(pattern("f8")), "meta_external_packed.mhd", True)
    vectors = np.stack([pattern("f4", shift) for shift in range(2)], axis=3)
    save(itk_image(vectors), "meta_vectors.mha", channel=1)
    series = sitk.JoinSeries([itk_image(pattern("u1", shift)) for shift in range(3)])
    save(series, "meta_series.mha", frame=1)
    # What ITK reads and does not write: slices, the other byte order, text.
    head = "ObjectType = Image\nNDims = 3\nDimSize = 5 4 3\nElementSpacing = 1 2 3\nOffset = 4 5 6\n"
    turned = "TransformMatrix = 0 1 0 1 0 0 0 0 -1\n"
    data = pattern("i2").transpose(2, 1, 0)
    for i, slice_ in enumerate(data):
        (HERE / f"meta_slice{i + 1}.raw").write_bytes(slice_.astype(">i2").tobytes())
    big = "BinaryData = True\nBinaryDataByteOrderMSB = True\nElementType = MET_SHORT\n"
    names = "".join(f"meta_slice{i + 1}.raw\n" for i in range(3))
    (HERE / "meta_list.mhd").write_text(head + turned + big + "ElementDataFile = LIST\n" + names)
    (HERE / "meta_pattern.mhd").write_text(head + big + "ElementDataFile = meta_slice%d.raw 1 3 1\n")
    text = " ".join(map(str, data.ravel()))
    (HERE / "meta_text.mha").write_text(head + "BinaryData = False\nElementType = MET_INT\nElementDataFile = LOCAL\n" + text + "\n")
    entries.extend(itk_entry(name) for name in ["meta_list.mhd", "meta_pattern.mhd", "meta_text.mha"])
    return entries


# VTK


def vtk_image(arrays, of_cells=False):
    image = vtk.vtkImageData()
    # Extents need not begin at 0.
    image.SetExtent(2, 6, -1, 2, 3, 5)
    image.SetOrigin(10.5, -3, 0.25)
    image.SetSpacing(0.5, 0.25, 2)
    image.SetDirectionMatrix(0, 0, 1, 1, 0, 0, 0, 1, 0)
    holder = image.GetCellData() if of_cells else image.GetPointData()
    for name, samples in arrays.items():
        flat = samples.transpose(2, 1, 0, *range(3, samples.ndim)).reshape(-1, *samples.shape[3:])
        array = numpy_support.numpy_to_vtk(np.ascontiguousarray(flat), deep=True)
        array.SetName(name)
        holder.AddArray(array)
    holder.SetActiveScalars(next(iter(arrays)))
    return image


def vtk_entry(file, array=None, channel=None, of_cells=False, path=None):
    legacy = file.endswith(".vtk")
    reader = vtk.vtkStructuredPointsReader() if legacy else vtk.vtkXMLImageDataReader()
    if legacy:
        reader.ReadAllScalarsOn(), reader.ReadAllVectorsOn(), reader.ReadAllFieldsOn()
    reader.SetFileName(str(path or HERE / file))
    reader.Update()
    image = reader.GetOutput()
    holder = image.GetCellData() if of_cells else image.GetPointData()
    found = holder.GetArray(array) if array else holder.GetScalars()
    samples = numpy_support.vtk_to_numpy(found)
    if channel is not None:
        samples = samples[:, channel]
    extent = np.array(image.GetExtent()).reshape(3, 2)
    cells = int(of_cells)
    dims = extent[:, 1] - extent[:, 0] + 1 - cells
    samples = samples.reshape(dims[::-1]).transpose(2, 1, 0)

    def corner(index):
        point = [0.0] * 3
        image.TransformContinuousIndexToPhysicalPoint(*(extent[:, 0] + index + 0.5 * cells), point)
        return point

    options = {k: v for k, v in {"array": array, "channel": channel}.items() if v is not None}
    return entry(file, f"VTK {vtk.VTK_VERSION}", samples, corner, "UNKNOWN", "unknown", **options)


def vtis():
    entries = []

    def save(name, arrays, setup, of_cells=False, **options):
        writer = vtk.vtkXMLImageDataWriter()
        writer.SetFileName(str(HERE / name))
        writer.SetInputData(vtk_image(arrays, of_cells))
        writer.SetCompressorTypeToNone()
        writer.SetHeaderTypeToUInt32()
        for call in setup:
            getattr(writer, call)()
        writer.Write()
        entries.append(vtk_entry(name, of_cells=of_cells, **options))

    several = {"density": pattern("f4"), "velocity": np.stack([pattern("f8", i) for i in range(3)], axis=3)}
    zlib_, raw = "SetCompressorTypeToZLib", "EncodeAppendedDataOff"
    save("vti_text.vti", {"a": pattern("i2")}, ["SetDataModeToAscii"])
    save("vti_base64.vti", {"a": pattern("u1")}, ["SetDataModeToBinary"])
    save("vti_base64_packed.vti", {"a": pattern("f4")}, ["SetDataModeToBinary", zlib_])
    save("vti_raw.vti", several, ["SetDataModeToAppended", raw, "SetHeaderTypeToUInt64"], array="density")
    save("vti_raw_packed.vti", several, ["SetDataModeToAppended", raw, zlib_], array="velocity", channel=2)
    save("vti_appended_base64.vti", several, ["SetDataModeToAppended", zlib_, "SetHeaderTypeToUInt64"], array="velocity", channel=0)
    save("vti_appended_base64_plain.vti", several, ["SetDataModeToAppended"], array="density")
    save("vti_big_endian.vti", {"a": pattern("f8")}, ["SetDataModeToAppended", raw, "SetByteOrderToBigEndian"])
    cells = {"c": pattern("u2")[:4, :3, :2]}
    save("vti_cells.vti", cells, ["SetDataModeToBinary"], of_cells=True, array="c")
    # One block for each few samples.
    writer = vtk.vtkXMLImageDataWriter()
    writer.SetFileName(str(HERE / "vti_blocks.vti"))
    writer.SetInputData(vtk_image({"a": pattern("i4")}))
    writer.SetBlockSize(104)
    writer.EncodeAppendedDataOff()
    writer.Write()
    entries.append(vtk_entry("vti_blocks.vti"))
    return entries


def legacy_vtk():
    entries = []
    several = {"density": pattern("f4"), "velocity": np.stack([pattern("f8", i) for i in range(3)], axis=3)}
    for name, call in [("vtk_text.vtk", "SetFileTypeToASCII"), ("vtk_binary.vtk", "SetFileTypeToBinary")]:
        image = vtk_image(several)
        # The format keeps no direction.
        image.SetDirectionMatrix(1, 0, 0, 0, 1, 0, 0, 0, 1)
        image.SetExtent(0, 4, 0, 3, 0, 2)
        writer = vtk.vtkStructuredPointsWriter()
        writer.SetFileName(str(HERE / name))
        writer.SetInputData(image)
        getattr(writer, call)()
        writer.Write()
        entries.append(vtk_entry(name, array="density"))
        entries.append(vtk_entry(name, array="velocity", channel=1))
    return entries


# MRC: mrcfile for the samples, gemmi for the cell


def mrc_entry(file, frame=None, path=None):
    path = path or HERE / file
    with mrcfile.open(path) as mrc:
        header, data = mrc.header, mrc.data
        options = {}
        if frame is not None:
            options["frame"] = frame
            data = data[frame]
        axes = [int(header[k]) - 1 for k in ("mapc", "mapr", "maps")]
        cell = gemmi.UnitCell(*(float(header.cella[k]) for k in "xyz"), *(float(header.cellb[k]) for k in ("alpha", "beta", "gamma")))
        intervals = [int(header[k]) for k in ("mx", "my", "mz")]
        start = [int(header[k]) for k in ("nxstart", "nystart", "nzstart")]
        origin = np.array([float(header.origin[k]) for k in "xyz"])
        samples = np.moveaxis(data.transpose(2, 1, 0), [0, 1, 2], axes)
        first = [0] * 3
        for i, axis in enumerate(axes):
            first[axis] = start[i]

        def corner(index):
            at = index if origin.any() else np.add(first, index)
            place = cell.orthogonalize(gemmi.Fractional(*(a / n for a, n in zip(at, intervals))))
            return np.array([place.x, place.y, place.z]) + origin

        oracle = f"mrcfile {mrcfile.__version__}, gemmi {gemmi.__version__}"
        return entry(file, oracle, np.array(samples, dtype="f8"), corner, "UNKNOWN", "angstrom", **options)


def mrc():
    entries = []
    for kind in ["i1", "i2", "f4", "u2", "f2"]:
        name = f"mrc_{kind}.mrc"
        with mrcfile.new(HERE / name, overwrite=True) as file:
            file.set_data(np.ascontiguousarray(pattern(kind).transpose(2, 1, 0)))
            file.voxel_size = (1.25, 1.5, 2)
            file.header.origin = (-10.5, 3.25, 7)
        entries.append(mrc_entry(name))
    with mrcfile.new(HERE / "mrc_swapped.map", overwrite=True) as file:
        file.set_data(np.ascontiguousarray(pattern("f4").transpose(2, 1, 0)))
        header = file.header
        header.mapc, header.mapr, header.maps = 3, 1, 2
        header.mx, header.my, header.mz = 40, 30, 20
        header.cella.x, header.cella.y, header.cella.z = 60, 50, 44
        header.cellb.alpha, header.cellb.beta, header.cellb.gamma = 80, 100, 120
        header.nxstart, header.nystart, header.nzstart = -3, 5, 11
    entries.append(mrc_entry("mrc_swapped.map"))
    with mrcfile.new(HERE / "mrc_stack.mrc.gz", overwrite=True, compression="gzip") as file:
        stack = np.stack([pattern("i2", shift).transpose(2, 1, 0) for shift in range(2)])
        file.set_data(stack)
        file.voxel_size = 1.5
        file.set_extended_header(np.zeros(160, dtype="V1"))
    entries.append(mrc_entry("mrc_stack.mrc.gz", frame=1))
    big = (HERE / "mrc_f4.mrc").read_bytes()
    words = np.frombuffer(big[:208], "<u4").astype(">u4").tobytes()
    data = np.frombuffer(big[1024:], "<f4").astype(">f4").tobytes()
    rest = np.frombuffer(big[216:224], "<u4").astype(">u4").tobytes()
    (HERE / "mrc_big_endian.mrc").write_bytes(words + b"MAP \x11\x11\0\0" + rest + big[224:1024] + data)
    entries.append(mrc_entry("mrc_big_endian.mrc"))
    return entries


# CUBE: ASE


def cube_entry(file):
    with open(HERE / file) as opened:
        read = ase.io.cube.read_cube(opened, read_data=True)
    data, origin, steps = read["data"], read["origin"], read["spacing"]
    return entry(file, f"ASE {ase.__version__}", data, lambda i: origin + np.dot(i, steps), "UNKNOWN", "angstrom")


def cube():
    cell = [[3, 0, 0], [1, 4, 0], [0.5, 0.25, 5]]
    atoms = ase.Atoms("OH", [[0, 0, 0], [0, 0, 1]], cell=cell, pbc=True)
    with open(HERE / "cube_sheared.cube", "w") as file:
        ase.io.cube.write_cube(file, atoms, pattern("f8"), origin=[1, -2, 0.5])
    lines = ["orbitals", "of two", " -1 0.5 -1.0 2.0", " 5 0.3 0 0", " 4 0 0.4 0", " 3 0 0 0.5", " 1 1.0 0 0 0", " 2 7 8"]
    both = np.stack([pattern("f8"), pattern("f8", 5)], axis=3).reshape(5, 4, -1)
    for row in both.reshape(-1, both.shape[2]):
        lines += [" ".join(f"{v:.5E}" for v in row[i : i + 6]) for i in range(0, len(row), 6)]
    (HERE / "cube_orbitals.cube").write_text("\n".join(lines) + "\n")
    # ASE reads no second orbital: these are the numbers that were written.
    written = np.array([[[float(f"{v:.5E}") for v in row] for row in plane] for plane in both[:, :, 1::2]])
    corner = lambda i: (np.array([0.5, -1, 2]) + np.array(i) * [0.3, 0.4, 0.5]) * BOHR
    orbital = entry("cube_orbitals.cube", "by hand", written, corner, "UNKNOWN", "angstrom", channel=1)
    return [cube_entry("cube_sheared.cube"), orbital]


# NumPy: arrays of a volume are [z, y, x]


def archives():
    one, other = pattern("i2").transpose(2, 1, 0), pattern("f4", 3).transpose(2, 1, 0)
    np.savez_compressed(HERE / "npz_packed.npz", density=one, potential=np.asfortranarray(other))
    np.savez(HERE / "npz_one.npz", other.astype("u2"))
    np.save(HERE / "npy_c.npy", np.ascontiguousarray(one))
    np.save(HERE / "npy_fortran.npy", np.asfortranarray(other))
    entries = []
    for file in ["npy_c.npy", "npy_fortran.npy"]:
        read = np.load(HERE / file)
        entries.append(entry(file, f"NumPy {np.__version__}", read.transpose(2, 1, 0), lambda i: i, "UNKNOWN", "unknown"))
    for file, name, array in [("npz_packed.npz", "density", "density"), ("npz_packed.npz", "potential", "potential"), ("npz_one.npz", "arr_0", None)]:
        read = np.load(HERE / file)[name]
        options = {"array": array} if array else {}
        entries.append(entry(file, f"NumPy {np.__version__}", read.transpose(2, 1, 0), lambda i: i, "UNKNOWN", "unknown", **options))
    return entries


# NRRD in several files: headers by hand, ITK reads them


def nrrd_parts():
    samples = pattern("u2").transpose(2, 1, 0)
    geometry = "type: ushort\ndimension: 3\nspace: left-posterior-superior\nsizes: 5 4 3\nspace directions: (0.5,0,0) (0,0.75,0) (0,0.25,2)\nspace origin: (1,-2,3)\nspace units: \"mm\" \"mm\" \"mm\"\nendian: little\n"
    for i, part in enumerate(samples):
        (HERE / f"nrrd_part{i + 8:02}.raw").write_bytes(part.tobytes())
        (HERE / f"nrrd_part{i + 8:02}.gz").write_bytes(gzip.compress(part.tobytes(), mtime=0))
    names = "\n".join(f"nrrd_part{i + 8:02}.gz" for i in range(3))
    (HERE / "nrrd_list.nhdr").write_text(f"NRRD0004\n{geometry}encoding: gzip\ndata file: LIST\n{names}\n")
    (HERE / "nrrd_pattern.nhdr").write_text(f"NRRD0004\n{geometry}encoding: raw\ndata file: nrrd_part%02d.raw 8 10 1 2\n")
    return [itk_entry(name) for name in ["nrrd_list.nhdr", "nrrd_pattern.nhdr"]]


# TIFF: tifffile; folders of slices: tifffile and Pillow


def tiff_entry(file, spacing=(1, 1, 1), unit="unknown", **options):
    with tifffile.TiffFile(HERE / file) as opened:
        series = opened.series[0]
        data, axes = series.asarray(), series.axes
    for axis, option in [("T", "frame"), ("C", "channel"), ("S", "channel")]:
        if axis in axes:
            data = np.take(data, options[option], axis=axes.index(axis))
            axes = axes.replace(axis, "")
    assert data.ndim == 3, axes
    corner = lambda index: np.array(index) * spacing
    oracle = f"tifffile {tifffile.__version__}"
    return entry(file, oracle, data.transpose(2, 1, 0), corner, "UNKNOWN", unit, **options)


def tiff():
    def zyx(kind, shift=0):
        return np.ascontiguousarray(pattern(kind, shift).transpose(2, 1, 0))

    entries = []

    def save(name, data, entry_options={}, **options):
        tifffile.imwrite(HERE / name, data, **options)
        entries.append(tiff_entry(name, **entry_options))

    plain = {"photometric": "minisblack", "metadata": None}
    save("tiff_pages.tif", zyx("u1"), **plain)
    save("tiff_i2.tif", zyx("i2"), byteorder=">", **plain)
    save("tiff_f2.tif", zyx("f2"), **plain)
    save("tiff_f8.tif", zyx("f8"), **plain)
    save("tiff_lzw_big.tif", zyx("f4"), bigtiff=True, compression="lzw", predictor=3, **plain)
    save("tiff_deflate.tif", zyx("u2"), compression="zlib", predictor=2, **plain)
    colours = np.stack([zyx("u1", shift) for shift in range(3)], axis=3)
    save("tiff_colours.tif", colours, {"channel": 2}, photometric="rgb", metadata=None)
    hyper = np.stack([np.stack([zyx("u2", 2 * t + c) for c in range(2)], axis=1) for t in range(2)])
    sizes = {"PhysicalSizeX": 0.25, "PhysicalSizeY": 0.5, "PhysicalSizeZ": 2, "PhysicalSizeZUnit": "µm"}
    save("tiff_ome.ome.tif", hyper, {"channel": 1, "frame": 1, "spacing": (0.25, 0.5, 2), "unit": "um"},
         metadata={"axes": "TZCYX", **sizes}, photometric="minisblack")
    save("tiff_imagej.tif", hyper, {"channel": 1, "frame": 0, "spacing": (0.25, 0.5, 3), "unit": "um"},
         imagej=True, resolution=(4, 2), metadata={"axes": "TZCYX", "spacing": 3, "unit": "um"})
    save("tiff_imagej_run_on.tif", zyx("f4"), {"spacing": (0.5, 0.5, 0.1), "unit": "mm"}, imagej=True, truncate=True,
         resolution=(2, 2), metadata={"axes": "ZYX", "spacing": 0.1, "unit": "mm"})
    for name, kind in [("slices_tif", "i2"), ("slices_png", "u2")]:
        (HERE / name).mkdir(exist_ok=True)
        data = zyx(kind)
        for i, slice_ in enumerate(data):
            # As many digits as the number has: 10 comes after 9.
            if kind == "i2":
                tifffile.imwrite(HERE / name / f"s{i + 9}.tif", slice_, **plain)
            else:
                Image.fromarray(slice_).save(HERE / name / f"s{2 * i + 8}.png")
        read = tifffile.imread if kind == "i2" else lambda path: np.array(Image.open(path))
        paths = sorted((HERE / name).iterdir(), key=lambda path: int(path.stem[1:]))
        stack = np.stack([read(path) for path in paths])
        oracle = f"tifffile {tifffile.__version__}, Pillow {Image.__version__}"
        entries.append(entry(name, oracle, stack.transpose(2, 1, 0), lambda i: i, "UNKNOWN", "unknown"))
    return entries


def ome_xml(images, order="XYZCT", uuid=""):
    """OME-XML of images: sizes of Z, C and T with the elements for their pages."""
    text = ""
    for i, ((z, c, t), spp, pages) in enumerate(images):
        channels = f'<Channel ID="Channel:{i}:0" SamplesPerPixel="{spp}"/>' * (c // spp)
        text += (f'<Image ID="Image:{i}"><Pixels ID="Pixels:{i}" DimensionOrder="{order}" Type="uint16" SizeX="5" SizeY="4" '
                 f'SizeZ="{z}" SizeC="{c}" SizeT="{t}" PhysicalSizeX="0.5" PhysicalSizeY="0.5" PhysicalSizeZ="2">{channels}{pages}'
                 "</Pixels></Image>")
    return f'<OME xmlns="http://www.openmicroscopy.org/Schemas/OME/2016-06"{uuid}>{text}</OME>'


def tiff_kinds():
    """Kinds of files that microscopes, ImageJ and libtiff write."""
    stack = np.stack([np.ascontiguousarray(pattern("u2", shift).transpose(2, 1, 0)) for shift in range(2)])
    planes = [stack[c, z] for c in range(2) for z in range(3)]
    entries = []

    def save(name, pages, description=None, entry_options={}, channels=(None,), **options):
        with tifffile.TiffWriter(HERE / name) as writer:
            for i, page in enumerate(pages):
                # Bytes, because tifffile writes text as UTF-8.
                text = description if i == 0 else None
                writer.write(page, description=text, metadata=None, contiguous=False, **{"photometric": "minisblack", **options})
        for channel in channels:
            entries.append(tiff_entry(name, **({} if channel is None else {"channel": channel}), **entry_options))

    um = {"spacing": (0.5, 0.5, 2), "unit": "um"}
    # Slices backwards, channels in turn.
    order = [(c, z) for z in range(3) for c in range(2)]
    mapped = "".join(f'<TiffData IFD="{i}" FirstZ="{2 - z}" FirstC="{c}" FirstT="0" PlaneCount="1"/>' for i, (c, z) in enumerate(order))
    save("tiff_mapped.ome.tif", [stack[c, 2 - z] for c, z in order], ome_xml([((3, 2, 1), 1, mapped)]), um, [0, 1])
    two = [((3, 2, 1), 1, '<TiffData IFD="0" PlaneCount="6"/>'), ((1, 1, 1), 1, '<TiffData IFD="6"/>')]
    save("tiff_two_images.ome.tif", planes + [stack[0, 0]], ome_xml(two), um, [0, 1])
    colours = [np.stack([pattern("u1", shift).transpose(2, 1, 0)[z] for shift in range(3)], axis=2) for z in range(3)]
    old = ome_xml([((3, 3, 1), 3, "<TiffData/>")], "XYCZT").replace("uint16", "uint8")
    save("tiff_colours.ome.tif", colours, old, um, [2], photometric="rgb")
    lines = "ImageJ=1.53t\nimages=6\nchannels=2\nslices=3\nhyperstack=true\norder=zct\nunit=\xb5m\nspacing=2\n"
    save("tiff_imagej_order.tif", planes, lines.encode("latin-1"), um, [0, 1], resolution=(2, 2))
    halves = [page.astype("f4") / 4 for page in stack[0]]
    save("tiff_white_is_zero.tif", halves, photometric="miniswhite")
    table = np.arange(3 * 256, dtype="u2").reshape(3, 256)
    # Two pages: each has a table of its own.
    save("tiff_palette.tif", [page.astype("u1") for page in stack[0, :2]], photometric="palette", colormap=table)
    tables = [np.ascontiguousarray(page.transpose(2, 0, 1)) for page in colours]
    save("tiff_planar.tif", tables, channels=[1], photometric="rgb", planarconfig="separate")
    # Tiles that go beyond the border, of one colour each.
    y, x = np.mgrid[:18, :20]
    tiled = [np.stack([x + 3 * y + z + 50 * c for c in range(3)]).astype("u1") for z in range(2)]
    save("tiff_planar_tiles.tif", tiled, channels=[2], photometric="rgb", planarconfig="separate", tile=(16, 16), compression="zlib")
    with tifffile.TiffWriter(HERE / "tiff_thumbnail.tif") as writer:
        for i, page in enumerate([*stack[0], stack[0, 0, ::2, ::2]]):
            writer.write(page, metadata=None, contiguous=False, subfiletype=int(i == 3), photometric="minisblack")
    entries.append(tiff_entry("tiff_thumbnail.tif"))
    # ImageJ stores signed numbers with 2^15 added, and shows them without.
    lines = "ImageJ=1.53t\nimages=3\nslices=3\ncf=0\nc0=-32768.0\nc1=1.0\nvunit=Gray Value\n"
    signed = pattern("i2").transpose(2, 1, 0).astype("i4") * 300
    save("tiff_imagej_signed.tif", list((signed + 32768).astype("u2")), lines)
    entries.pop()
    entries.append(entry("tiff_imagej_signed.tif", "ImageJ 1.53t", signed.transpose(2, 1, 0), lambda i: i, "UNKNOWN", "unknown"))
    # Slices that were saved as channels, for --slices.
    lines = "ImageJ=1.11a\nimages=3\nchannels=3\nhyperstack=true\n"
    save("tiff_imagej_channels.tif", list(pattern("u1").transpose(2, 1, 0)), lines, channels=[])
    return entries


# DICOM: pydicom for the samples, ITK for the frame


def dicom_files(path):
    return sorted(path.iterdir()) if path.is_dir() else [path]


def dicom_entry(file, paths=None, forced=False, packed=False, decode=None, **options):
    """The files of a folder, or those of one series in it, in the order of ITK."""
    paths = paths or dicom_files(HERE / file)
    sets = {str(p): pydicom.dcmread(p, force=forced) for p in paths}
    for data in sets.values() if forced else []:
        data.file_meta.TransferSyntaxUID = pydicom.uid.ImplicitVRLittleEndian
    first = next(iter(sets.values()))
    uid = str(first.SeriesInstanceUID)
    if packed:
        # ITK does not unpack slices this small: it reads what pydicom unpacked.
        folder = Path(tempfile.mkdtemp())
        for path in paths:
            sets[str(folder / path.name)] = plain = sets.pop(str(path))
            if decode:
                frame = next(pydicom.encaps.generate_frames(plain.PixelData, number_of_frames=1))
                plain.file_meta.TransferSyntaxUID = pydicom.uid.ExplicitVRLittleEndian
                plain.PixelData = decode(frame).astype(f"{'i' if plain.PixelRepresentation else 'u'}{plain.BitsAllocated // 8}").tobytes()
                plain["PixelData"].VR, plain["PixelData"].is_undefined_length = "OB" if plain.BitsAllocated == 8 else "OW", False
            else:
                plain.decompress()
            plain.save_as(folder / path.name)
        paths = dicom_files(folder)
    if len(paths) > 1:
        reader = sitk.ImageSeriesReader()
        names = reader.GetGDCMSeriesFileNames(str(paths[0].parent), uid)
        assert set(names) == set(sets), (names, paths)
        reader.SetFileNames(names)
        # A tilt is in the positions.
        reader.ForceOrthogonalDirectionOff()
        image = reader.Execute()
    else:
        names = [str(paths[0])]
        image = sitk.ReadImage(names[0])
    planes = []
    for name in names:
        data = sets[name]
        # Dose and frames: ITK knows of their scales, too.
        stored = data.pixel_array.astype("f8")
        slope = data.get("DoseGridScaling", data.get("RescaleSlope", 1))
        intercept = data.get("RescaleIntercept", 0)
        if "SharedFunctionalGroupsSequence" in data:
            part = data.SharedFunctionalGroupsSequence[0].PixelValueTransformationSequence[0]
            slope, intercept = part.RescaleSlope, part.RescaleIntercept
        if "channel" in options:
            stored = stored[..., options["channel"]]
        # Samples of up to 16 bits are kept in 32 where they are no integers.
        values = stored * float(slope) + float(intercept)
        values = values if float(slope).is_integer() else values.astype("f4").astype("f8")
        planes += [values] if values.ndim == 2 else list(values)
    samples = np.stack(planes)
    axes = np.reshape(image.GetDirection(), (3, 3)).T
    if np.dot(np.cross(axes[0], axes[1]), axes[2]) < 0:
        # ITK leaves frames in the order of the file; here all are sorted along the normal.
        image, samples = image[:, :, ::-1], samples[::-1]
    read = sitk.GetArrayFromImage(image)
    read = read[..., options["channel"]] if "channel" in options else read
    # ITK leaves doses as they are stored.
    read = read * float(first.get("DoseGridScaling", 1))
    assert np.allclose(read, samples, rtol=1e-6), file
    decoder = f"imagecodecs {imagecodecs.__version__}" if decode else f"pydicom {pydicom.__version__}"
    oracle = f"{decoder}, ITK {sitk.Version.VersionString()}"
    return entry(file, oracle, samples.transpose(2, 1, 0), itk_corner(image), "LPS", "mm", **options)


def dicom_set(uid, kind, samples, position, orientation, number, syntax):
    """One slice [y, x]."""
    data = pydicom.Dataset()
    data.file_meta = pydicom.dataset.FileMetaDataset()
    data.file_meta.TransferSyntaxUID = syntax
    data.SOPClassUID = data.file_meta.MediaStorageSOPClassUID = kind
    data.SOPInstanceUID = data.file_meta.MediaStorageSOPInstanceUID = f"{uid}.{number}"
    data.Modality, data.SeriesDescription = "CT", "made by pydicom"
    # A sequence before everything, of a length that must be looked for.
    reference = pydicom.Dataset()
    reference.ReferencedSOPInstanceUID = "1.2.3"
    data.ReferencedImageSequence = pydicom.Sequence([reference])
    data["ReferencedImageSequence"].is_undefined_length = True
    reference.is_undefined_length_sequence_item = number % 2 == 1
    data.StudyInstanceUID, data.SeriesInstanceUID = "1.2.3.4", uid
    data.SeriesNumber, data.InstanceNumber = 1, number
    data.ImagePositionPatient = [f"{v:.6g}" for v in position]
    data.ImageOrientationPatient = [f"{v:.9g}" for v in orientation]
    data.PixelSpacing = [0.75, 0.5]
    data.FrameOfReferenceUID = "1.2.3.5"
    data.Rows, data.Columns = samples.shape[:2]
    data.SamplesPerPixel = samples.shape[2] if samples.ndim > 2 else 1
    data.PhotometricInterpretation = "RGB" if samples.ndim > 2 else "MONOCHROME2"
    bits = 8 * samples.itemsize
    data.BitsAllocated, data.BitsStored, data.HighBit = bits, bits, bits - 1
    data.PixelRepresentation = int(samples.dtype.kind == "i")
    if samples.ndim > 2:
        data.PlanarConfiguration = 0
    order = ">" if syntax == pydicom.uid.ExplicitVRBigEndian else "<"
    data.PixelData = samples.astype(samples.dtype.newbyteorder(order)).tobytes()
    data["PixelData"].VR = "OB" if bits == 8 else "OW"
    return data


CT, PET, COLOUR, ENHANCED, DOSE = ("1.2.840.10008.5.1.4.1.1." + n for n in ["2", "128", "7", "2.1", "481.2"])


def dicom():
    from pydicom.uid import DeflatedExplicitVRLittleEndian, ExplicitVRBigEndian, ExplicitVRLittleEndian, ImplicitVRLittleEndian

    x, y, z = np.meshgrid(*map(np.arange, (8, 7, 4)), indexing="ij")
    values = ((7 * x + 31 * y + 17 * z * z + x * y * z) % 101).transpose(2, 1, 0)
    a = np.deg2rad(25)
    flat, turned = [1, 0, 0, 0, 1, 0], [np.cos(a), np.sin(a), 0, 0, 0, -1]
    normal = np.cross(turned[:3], turned[3:])
    entries = []

    def save(name, uid, samples, step, orientation=flat, kind=CT, syntax=ExplicitVRLittleEndian, change=lambda data, i: None,
             preamble=True, packed=False, encode=None, decode=None, **options):
        (HERE / name).mkdir(exist_ok=True)
        paths = []
        for i, plane in enumerate(samples):
            position = np.array([-12.5, 30.25, 7]) + i * np.array(step)
            data = dicom_set(uid, kind, np.ascontiguousarray(plane), position, orientation, i + 1, syntax)
            change(data, i)
            if encode:
                data.PixelData = pydicom.encaps.encapsulate([encode(np.ascontiguousarray(plane))])
                data["PixelData"].VR, data["PixelData"].is_undefined_length = "OB", True
            elif packed:
                data.compress(pydicom.uid.RLELossless)
            # The names of files do not define the order.
            path = HERE / name / f"{name[6:]}_{(3 * i + 2) % 4}_{uid[-1]}{'.dcm' if i % 2 else ''}"
            if preamble:
                data.save_as(path, enforce_file_format=True)
            else:
                meta = data.file_meta
                del data.file_meta
                data.save_as(path, implicit_vr=meta.TransferSyntaxUID.is_implicit_VR, little_endian=True)
            paths.append(path)
        entries.append(dicom_entry(name, paths, forced=not preamble, packed=packed or bool(encode), decode=decode, **options))

    def hounsfield(data, i):
        data.RescaleSlope, data.RescaleIntercept = 1, -1024

    def twelve_bits(data, i):
        data.BitsStored, data.HighBit = 12, 11

    def counts(data, i):
        data.RescaleSlope, data.RescaleIntercept = [0.5, 0.25, 1.125, 2.5][i], 0

    save("dicom_plain", "1.2.3.4.1", values.astype("i2") - 50, 1.25 * normal, turned, change=hounsfield)
    save("dicom_tilted", "1.2.3.4.2", values.astype("u1"), [0, -0.5, 2])
    save("dicom_implicit", "1.2.3.4.3", values.astype("u2") * 40, [0, 0, -3], syntax=ImplicitVRLittleEndian, change=twelve_bits, preamble=False)
    save("dicom_rescaled", "1.2.3.4.4", values.astype("u2"), [0, 0, 3.27], kind=PET, change=counts)
    save("dicom_big_endian", "1.2.3.4.5", values.astype("i2") * 300, [0, 0, 2], syntax=ExplicitVRBigEndian)
    save("dicom_deflated", "1.2.3.4.6", values.astype("u2"), [0, 0, 2], syntax=DeflatedExplicitVRLittleEndian)
    colours = np.stack([values, values + 10, values + 20], axis=3).astype("u1")
    save("dicom_colours", "1.2.3.4.7", colours, [0, 0, 2], kind=COLOUR, channel=1)
    save("dicom_runs", "1.2.3.4.0", values.astype("i2") // 40 * 300 - 7, [0, 0, 2], packed=True)
    # JPEG, lossless; JPEG 2000, signed and in colours: imagecodecs packs them.
    codecs = lambda name, **options: lambda plane: getattr(imagecodecs, name)(plane, **options)
    save("dicom_jpeg", "1.2.3.4.12", values.astype("u2") * 601, [0, 0, 2], syntax=pydicom.uid.JPEGLosslessSV1,
         encode=codecs("ljpeg_encode", bitspersample=16), decode=imagecodecs.ljpeg_decode)
    j2k = codecs("jpeg2k_encode", codecformat="j2k", reversible=True, level=0)
    save("dicom_jpeg2000", "1.2.3.4.13", values.astype("i2") * 300 - 15000, [0, 0, 2], syntax=pydicom.uid.JPEG2000Lossless,
         encode=j2k, decode=imagecodecs.jpeg2k_decode)
    save("dicom_jpeg2000_colours", "1.2.3.4.14", colours, [0, 0, 2], kind=COLOUR, syntax=pydicom.uid.JPEG2000Lossless,
         encode=j2k, decode=imagecodecs.jpeg2k_decode, channel=2)
    # Decoders differ by one in rounding, so all samples are listed.
    lossy = codecs("jpeg8_encode", level=90)
    save("dicom_lossy", "1.2.3.4.16", values.astype("u1"), [0, 0, 2], syntax=pydicom.uid.JPEGBaseline8Bit, encode=lossy, decode=imagecodecs.jpeg8_decode)
    entries.pop()
    decoded = [imagecodecs.jpeg8_decode(lossy(np.ascontiguousarray(plane))) for plane in values.astype("u1")]
    (HERE / "lossy.json").write_text(json.dumps(np.stack(decoded).ravel().tolist()) + "\n")
    save_times(values, entries)
    save("dicom_two", "1.2.3.4.9", values.astype("u1"), [0, 0, 1], series="1.2.3.4.9")
    save("dicom_two", "1.2.3.4.8", values.astype("u1")[:3] + 1, [0, 0, 1.5], series="0")
    save_frames(values.astype("u2"), flat, entries)
    return entries


def save_times(values, entries):
    """A series of two volumes in time: numbers go on from the first to the second, places do not."""
    folder = HERE / "dicom_times"
    folder.mkdir(exist_ok=True)
    paths = [[], []]
    for i in range(8):
        time, z = divmod(i, 4)
        plane = np.ascontiguousarray((values[z] + 100 * time).astype("u1"))
        syntax = pydicom.uid.ExplicitVRLittleEndian
        data = dicom_set("1.2.3.4.15", CT, plane, [0, 0, 1.5 * z], [1, 0, 0, 0, 1, 0], i + 1, syntax)
        path = folder / f"times_{(5 * i + 3) % 8}"
        data.save_as(path, enforce_file_format=True)
        paths[time].append(path)
    for time in range(2):
        # ITK takes the files of a folder for one volume.
        alone = Path(tempfile.mkdtemp())
        copies = [Path(shutil.copy(path, alone)) for path in paths[time]]
        entries.append({**dicom_entry("dicom_times", sorted(copies)), "options": {"frame": time}})


def save_frames(values, orientation, entries):
    """Several frames in a file: their places in groups, or as offsets."""
    from pydicom.uid import ExplicitVRLittleEndian

    data = dicom_set("1.2.3.4.10", ENHANCED, values[0], [0, 0, 0], orientation, 1, ExplicitVRLittleEndian)
    for name in ["ImagePositionPatient", "ImageOrientationPatient", "PixelSpacing"]:
        del data[name]
    measures, plane, scale, shared = (pydicom.Dataset() for _ in range(4))
    measures.PixelSpacing, measures.SliceThickness = [0.75, 0.5], 2
    plane.ImageOrientationPatient = orientation
    scale.RescaleSlope, scale.RescaleIntercept, scale.RescaleType = 2, -10, "US"
    shared.PixelMeasuresSequence, shared.PlaneOrientationSequence = [measures], [plane]
    shared.PixelValueTransformationSequence = [scale]
    data.SharedFunctionalGroupsSequence = [shared]
    frames = []
    # From the top down.
    for i in range(4):
        position, frame = pydicom.Dataset(), pydicom.Dataset()
        position.ImagePositionPatient = [1.5, -2.5, 10 - 2 * i]
        frame.PlanePositionSequence = [position]
        frames.append(frame)
    data.PerFrameFunctionalGroupsSequence = frames
    data["PerFrameFunctionalGroupsSequence"].is_undefined_length = True
    data.NumberOfFrames, data.PixelData = 4, values.astype("<u2").tobytes()
    data.save_as(HERE / "dicom_enhanced.dcm", enforce_file_format=True)
    entries.append(dicom_entry("dicom_enhanced.dcm"))
    data = dicom_set("1.2.3.4.11", DOSE, values[0], [5, 6, 7], orientation, 1, ExplicitVRLittleEndian)
    data.Modality = "RTDOSE"
    data.NumberOfFrames, data.PixelData = 4, values.astype("<u2").tobytes()
    data.GridFrameOffsetVector, data.DoseGridScaling = [0, 2.5, 5, 7.5], 0.125
    data.FrameIncrementPointer = pydicom.tag.Tag(0x3004, 0x000C)
    data.save_as(HERE / "dicom_dose.dcm", enforce_file_format=True)
    entries.append(dicom_entry("dicom_dose.dcm"))


def adobe_marker(jpeg, transform):
    """A JPEG whose marker of Adobe has the given value, or is left out."""
    at = jpeg.find(b"\xff\xee")
    if at >= 0:
        jpeg = jpeg[:at] + jpeg[at + 2 + int.from_bytes(jpeg[at + 2:at + 4], "big"):]
    if transform is None:
        return jpeg
    return jpeg[:2] + b"\xff\xee\x00\x0eAdobe\x00d\x00\x00\x00\x00" + bytes([transform]) + jpeg[2:]


def lossy_dicom():
    """Colours in JPEG, and JPEG 2000 that leaves its bits: what imagecodecs (libjpeg-turbo, OpenJPEG) reads of the same bytes."""
    x, y = np.meshgrid(np.arange(19), np.arange(11))
    colours = np.stack([12 * x + y, 255 - 9 * x - 3 * y, 128 + 40 * np.sin(x / 3) + 5 * y], axis=2).clip(0, 255).astype("u1")
    noise = np.random.default_rng(1).integers(0, 2, (11, 19)).astype("u2") * 4095
    jpeg = lambda plane, outcolorspace, **options: imagecodecs.jpeg8_encode(
        plane, level=92, colorspace="RGB", outcolorspace=outcolorspace, **options)
    rgb, ycc = jpeg(colours, "RGB"), jpeg(colours, "YCBCR", subsampling="444")
    read = lambda data, space: imagecodecs.jpeg8_decode(data, colorspace=space, outcolorspace=space)
    packed = imagecodecs.jpeg2k_encode(noise, codecformat="j2k", reversible=False, level=30, bitspersample=12)
    cases = {
        "dicom_rgb": ("RGB", adobe_marker(rgb, None), read(rgb, "RGB")),
        "dicom_rgb_marked": ("RGB", adobe_marker(rgb, 0), read(rgb, "RGB")),
        # The marker contradicts the image: the colours are converted.
        "dicom_rgb_converted": ("RGB", adobe_marker(ycc, 1), imagecodecs.jpeg8_decode(ycc)),
        "dicom_ybr": ("YBR_FULL", ycc, read(ycc, "YCBCR")),
        "dicom_ybr_422": ("YBR_FULL_422", data := jpeg(colours, "YCBCR", subsampling="422"), read(data, "YCBCR")),
        "dicom_ybr_420": ("YBR_FULL_422", data := jpeg(colours, "YCBCR", subsampling="420"), read(data, "YCBCR")),
        "dicom_clipped": ("MONOCHROME2", packed, imagecodecs.jpeg2k_decode(packed)),
    }
    expected = {}
    for n, (name, (photometric, frame, samples)) in enumerate(cases.items()):
        (HERE / name).mkdir(exist_ok=True)
        is_grey = photometric == "MONOCHROME2"
        for i in range(2):
            syntax = pydicom.uid.JPEG2000 if is_grey else pydicom.uid.JPEGBaseline8Bit
            data = dicom_set(f"1.2.3.4.{20 + n}", CT if is_grey else COLOUR, samples, [0, 0, i], [1, 0, 0, 0, 1, 0], i, syntax)
            data.PhotometricInterpretation = photometric
            if is_grey:
                data.BitsStored, data.HighBit = 12, 11
            data.PixelData = pydicom.encaps.encapsulate([frame])
            data["PixelData"].VR, data["PixelData"].is_undefined_length = "OB", True
            data.save_as(HERE / name / f"{i}.dcm", enforce_file_format=True)
        planes = samples[..., None] if is_grey else samples
        expected[name] = [planes[..., c].ravel().tolist() for c in range(planes.shape[2])]
    (HERE / "lossy_colours.json").write_text(json.dumps(expected) + "\n")


def dicom_kinds():
    """Kinds of DICOM files that other programs write; pydicom reads the samples."""
    from pydicom.uid import ExplicitVRBigEndian, ExplicitVRLittleEndian, JPEG2000Lossless

    x, y, z = np.meshgrid(np.arange(3), np.arange(3), np.arange(4), indexing="ij")
    values = ((37 * x + 31 * y + 17 * z * z + 5 * x * y * z) % 251).transpose(2, 1, 0)
    flat = [1, 0, 0, 0, 1, 0]
    entries = []

    def add(file, samples, corner=lambda i: np.array(i) * (0.5, 0.75, 2), **options):
        entries.append(entry(file, f"pydicom {pydicom.__version__}", samples.transpose(2, 1, 0), corner, "LPS", "mm", **options))

    def slices(name, number, planes, syntax, change):
        (HERE / name).mkdir(exist_ok=True)
        for i, plane in enumerate(planes):
            data = dicom_set(f"1.2.3.4.{number}", COLOUR if plane.ndim > 2 else CT, plane, [0, 0, 2 * i], flat, i, syntax)
            change(data, plane)
            data.save_as(HERE / name / f"{i}.dcm", enforce_file_format=True)

    # Bytes in words of the other byte order; the number of bytes is odd.
    def as_words(data, plane):
        padded = plane.tobytes() + b"\0"
        data.PixelData = np.frombuffer(padded, "<u2").astype(">u2").tobytes()
        data["PixelData"].VR = "OW"

    colours = np.stack([values, values + 1, values + 2], axis=3).astype("u1")
    slices("dicom_words", 40, colours, ExplicitVRBigEndian, as_words)
    read = np.stack([pydicom.dcmread(HERE / "dicom_words" / f"{i}.dcm").pixel_array for i in range(4)])
    add("dicom_words", read[..., 1], channel=1)

    # JPEG 2000 in the boxes of a JP2 file.
    def in_boxes(data, plane):
        frame = imagecodecs.jpeg2k_encode(np.ascontiguousarray(plane), codecformat="jp2", reversible=True, level=0)
        data.PixelData = pydicom.encaps.encapsulate([frame])
        data["PixelData"].VR, data["PixelData"].is_undefined_length = "OB", True

    slices("dicom_boxes", 41, values.astype("u2"), JPEG2000Lossless, in_boxes)
    add("dicom_boxes", np.stack([pydicom.dcmread(HERE / "dicom_boxes" / f"{i}.dcm").pixel_array for i in range(4)]))

    # A localizer across the slices.
    slices("dicom_localizer", 42, values.astype("u2"), ExplicitVRLittleEndian, lambda data, plane: None)
    across = dicom_set("1.2.3.4.42", CT, values[0].astype("u2"), [1, 0, 0], [0, 1, 0, 0, 0, -1], 9, ExplicitVRLittleEndian)
    across.save_as(HERE / "dicom_localizer" / "localizer.dcm", enforce_file_format=True)
    add("dicom_localizer", values)

    # Frames of which only the first has a position: two fragments each, and floating point.
    def frames(name, number, syntax, pixels):
        data = dicom_set(f"1.2.3.4.{number}", CT, values[0].astype("u2"), [0, 0, 0], flat, 1, syntax)
        data.NumberOfFrames, data.SpacingBetweenSlices = 4, 2
        pixels(data)
        data.save_as(HERE / name, enforce_file_format=True)
        add(name, pydicom.dcmread(HERE / name).pixel_array)

    def in_fragments(data):
        packed = [imagecodecs.jpeg2k_encode(plane, codecformat="j2k", reversible=True, level=0) for plane in np.ascontiguousarray(values.astype("u2"))]
        data.PixelData = pydicom.encaps.encapsulate(packed, fragments_per_frame=2)
        data["PixelData"].VR, data["PixelData"].is_undefined_length = "OB", True

    def as_floats(kind, name, bits):
        def change(data):
            for unused in ["PixelData", "BitsStored", "HighBit", "PixelRepresentation"]:
                del data[unused]
            data.BitsAllocated = bits
            setattr(data, name, (values / 8).astype(kind).tobytes())
        return change

    frames("dicom_fragments.dcm", 43, JPEG2000Lossless, in_fragments)
    frames("dicom_float.dcm", 44, ExplicitVRLittleEndian, as_floats("<f4", "FloatPixelData", 32))
    frames("dicom_double.dcm", 45, ExplicitVRLittleEndian, as_floats("<f8", "DoubleFloatPixelData", 64))
    return entries


# Filters: SciPy and ITK


def filters():
    """What becomes of the samples of nifti_f8.nii, x fastest."""
    samples = pattern("f8")
    image = sitk.GetImageFromArray(samples.transpose(2, 1, 0))
    halved = sitk.GetArrayFromImage(sitk.BinShrink(image, [2, 2, 1])).transpose(2, 1, 0)
    # Blocks along all axes: the third has three samples, of which two make a block, so this is done on twice the volume.
    tall = np.concatenate([samples, samples + 1], axis=2)
    cubes = sitk.GetArrayFromImage(sitk.BinShrink(sitk.GetImageFromArray(tall.transpose(2, 1, 0)), [2, 2, 2]))
    results = {
        "gaussian": ndimage.gaussian_filter(samples, [1.5, 0.75, 0.5], mode="reflect", truncate=4),
        "median": ndimage.median_filter(samples, size=3, mode="reflect"),
        "wide_median": ndimage.median_filter(samples, size=5, mode="reflect"),
        "halved": cubes.transpose(2, 1, 0),
    }
    assert halved.shape == (2, 2, 3)
    return {name: [float(v) for v in values.transpose(2, 1, 0).ravel()] for name, values in results.items()}


def real(folder):
    folder = Path(folder)
    entries = [
        nifti_entry("someones_anatomy.nii.gz", path=folder / "someones_anatomy.nii.gz"),
        itk_entry("HeadMRVolume.mhd", path=folder / "HeadMRVolume.mhd"),
        itk_entry("lung_ct_small_57x78x64_int16.mha", path=folder / "lung_ct_small_57x78x64_int16.mha"),
        itk_entry("flair_124x160x140_uint8.nrrd", path=folder / "flair_124x160x140_uint8.nrrd"),
    ]
    for name in ["hydrogen_orbital_64x64x64_float32.vti", "fuel_64x64x64_float32.vti"]:
        entries.append(vtk_entry(name, path=folder / name))
    for name in ["EMD-3001.map", "EMD-3197.map"]:
        entries.append(mrc_entry(name, path=folder / name))
    return entries


def write(name, entries):
    text = ",\n".join(json.dumps(e) for e in entries)
    (HERE / name).write_text(f"[\n{text}\n]\n")


if __name__ == "__main__":
    write("values.json", nifti() + metaimage() + vtis() + legacy_vtk() + mrc() + cube() + archives() + nrrd_parts() + tiff() + tiff_kinds() + dicom() + dicom_kinds())
    lossy_dicom()
    (HERE / "filters.json").write_text(json.dumps(filters()) + "\n")
    if len(sys.argv) > 1:
        write("real.json", real(sys.argv[1]))
