"""Sources of volumes: every type and order of arrays, and the objects of other packages with their frames."""

from __future__ import annotations

import functools
import importlib

import isospectrum
import numpy as np
import pytest
from isospectrum import _sources

from .conftest import ROOT, blobs, topology


def frame(s: isospectrum.Spectrum) -> dict:
    return s.volume["placement"]


def compute(source, **options) -> isospectrum.Spectrum:
    return isospectrum.compute(source, **{"backend": "cpu", "error": 0.4, "progress": False, **options})


@pytest.fixture(scope="module")
def array() -> np.ndarray:
    return blobs((9, 10, 12))


def bytes_of(source, **options) -> bytes:
    """The file of the spectrum of a source, independent of its name."""
    return compute(source, name="same", **options)._native.to_bytes()


def whole(dtype, shape=(9, 10, 11)) -> np.ndarray:
    """Integers from 0 to 100, which every type holds."""
    return np.rint(100 * blobs(shape) / blobs(shape).max()).astype(dtype)


# Array types and their sample types.
TYPES = {
    "u1": "u1", "i1": "i1", "u2": "u2", "i2": "i2", "u4": "u4", "i4": "i4", "f4": "f4", "f8": "f8",
    "u8": "i4", "i8": "i4", "f2": "f4", "longdouble": "f8",
    ">u2": "u2", ">i2": "i2", ">u4": "u4", ">i4": "i4", ">u8": "i4", ">i8": "i4", ">f2": "f4", ">f4": "f4", ">f8": "f8",
}  # fmt: skip


@pytest.mark.parametrize("dtype", TYPES)
def test_every_real_type_is_read(dtype, expected_of):
    a = whole(np.dtype(dtype))
    s = compute(a, name="same")
    assert s.volume["sample_type"] == np.dtype(TYPES[dtype]).name
    if dtype == TYPES[dtype]:
        # The same isosurface as that of bytes: as many components and handles, in the same box.
        for c in (20.5, 50.25, 80):
            m, expected = s.mesh(c), expected_of("u1").mesh(c)
            assert topology(m.triangles, m.n_vertices) == topology(expected.triangles, expected.n_vertices)
            sides = [m.vertices.min(0) - expected.vertices.min(0), m.vertices.max(0) - expected.vertices.max(0)]
            assert np.abs(sides).max() < 2 * s.tolerance
    else:
        assert s._native.to_bytes() == expected_of(TYPES[dtype])._native.to_bytes()


@pytest.fixture(scope="module")
def expected_of():
    """The spectrum of the same numbers in another type."""
    return functools.cache(lambda dtype: compute(whole(np.dtype(dtype)), name="same"))


def test_types_are_converted_to_sample_types():
    kinds = {"u8": "uint32", "i8": "int32", "f2": "float32", "longdouble": "float64", "?": "uint8", ">i2": "int16"}
    for dtype, expected in kinds.items():
        a = whole(np.uint8) > 50 if dtype == "?" else whole(np.dtype(dtype))
        assert _sources.sample_array(a).dtype == ("int32" if dtype == "u8" else expected), dtype
    large = whole(np.uint64) + np.uint64(2**31)
    assert _sources.sample_array(large).dtype == np.uint32
    larger = whole(np.int64) - 2**40
    assert _sources.sample_array(larger).dtype == np.float64
    assert (_sources.sample_array(larger) == larger).all()
    with pytest.raises(isospectrum.InputError, match="2\\^53"):
        _sources.sample_array(whole(np.int64) + 2**60)
    for dtype in ("c8", "M8[s]", "O", "U3"):
        with pytest.raises(isospectrum.InputError, match="expected numbers"):
            compute(np.zeros((3, 3, 3), dtype))


def test_a_mask_is_a_volume():
    s = compute(blobs() > 0.4)
    assert s.range == (0.0, 1.0)
    assert len(s.mesh(0.5).triangles) > 100


@pytest.mark.parametrize("dtype", ["u1", "i2", "f4", "f8", ">f4", "?"])
def test_every_memory_order_gives_the_same_volume(dtype):
    a = whole(np.uint8) > 50 if dtype == "?" else whole(np.dtype(dtype))
    expected = bytes_of(a)
    padded = np.zeros((12, 21, 15), a.dtype)
    padded[2:11, 1::2, 3:14] = a
    backwards = np.ascontiguousarray(a[::-1, ::-1, ::-1])
    between = np.empty((11, 9, 10), a.dtype)
    between.transpose(1, 2, 0)[:] = a
    shifted = np.frombuffer(b"\0" + a.tobytes(), np.uint8)[1:].view(a.dtype).reshape(a.shape)
    read_only = a.copy()
    read_only.flags.writeable = False
    sources = {
        "Fortran": np.asfortranarray(a),
        "a part": padded[2:11, 1::2, 3:14],
        "backwards": backwards[::-1, ::-1, ::-1],
        "axes swapped": between.transpose(1, 2, 0),
        "not aligned": shifted,
        "read-only": read_only,
        "buffer": memoryview(a) if dtype not in (">f4", "?") else a,
    }
    for name, source in sources.items():
        before = np.asarray(source).tobytes()
        assert bytes_of(source) == expected, name
        assert np.asarray(source).tobytes() == before, name


@pytest.mark.parametrize("view", [
    lambda a: a, np.asfortranarray, lambda a: a[:, ::2], lambda a: a[::-1], lambda a: a.T, lambda a: a > 50,
])  # fmt: skip
def test_nothing_is_copied_before_the_compiled_part(view):
    """The compiled part copies once, into the volume. Before it, arrays in any order are passed without a copy."""
    source = view(whole(np.int16))
    assert np.shares_memory(_sources.sample_array(_sources.array_and_frame(source)[0]), source)


@pytest.mark.parametrize("source, message", [
    (np.zeros((0, 4, 4)), "dimensions 4x4x0, expected at least 2 samples along each axis"),
    (np.zeros((4, 4, 1)), "dimensions 1x4x4, expected at least 2 samples"),
    (np.zeros((4, 4, 4)), "every sample is 0.0, expected at least two different values"),
    (np.zeros((4, 4)), "an array of 2 axes, expected 3: z, y, x"),
    (np.zeros((2, 3, 4, 4)), "an array of 4 axes, expected 3"),
    ([[1, 2], [3, 4]], "an array of 2 axes"),
    (3.0, "an array of 0 axes"),
    (None, "None, expected an array of numbers"),
    (np.ma.masked_greater(np.arange(27).reshape(3, 3, 3), 20), "without masked samples"),
])  # fmt: skip
def test_an_invalid_volume_is_an_error_of_one_line(source, message):
    with pytest.raises(isospectrum.Error, match=message) as raised:
        compute(source)
    assert "\n" not in str(raised.value)
    assert isinstance(raised.value, ValueError)


@pytest.mark.parametrize("wrong", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("dtype", ["f2", "f4", "f8"])
def test_values_that_are_not_finite_are_reported_or_replaced(wrong, dtype):
    a = blobs().astype(dtype)
    a[3, 2, 1] = wrong
    with pytest.raises(isospectrum.InputError, match=r"sample \(1, 2, 3\) is .*, expected finite values"):
        compute(a)
    b = a.copy()
    b[3, 2, 1] = 0
    assert bytes_of(a, nan_as=0) == bytes_of(b)
    assert not np.isfinite(a[3, 2, 1])
    with pytest.raises(isospectrum.UsageError, match="finite"):
        compute(a, nan_as=np.inf)


@pytest.mark.parametrize("options, message", [
    ({"spacing": (1, 2)}, "expected three numbers: x, y, z"),
    ({"spacing": (1, 0, 1)}, "expected positive numbers"),
    ({"spacing": "wide"}, "expected three numbers"),
    ({"direction": np.ones((2, 2))}, "expected a matrix of 3 x 3"),
    ({"direction": np.ones((3, 3))}, "expected linearly independent unit vectors"),
    ({"space": "MNI"}, "space 'MNI', expected LPS or RAS"),
    ({"unit": "parsec"}, "unit 'parsec'"),
    ({"error": 0}, "error 0, expected a number above 0"),
    ({"error": "fine"}, "error 'fine'"),
    ({"range": (0.5, 0.2)}, "expected the lower isovalue first"),
    ({"range": 3}, "expected the lowest and the highest isovalue"),
    ({"range": (98, 99)}, "expected one of the volume's"),
    ({"persistence": "-2%"}, "persistence '-2%'"),
    ({"crop": (1, 2)}, "expected three parts"),
    ({"crop": ((0, 99), None, None)}, "99"),
    ({"crop": (("2mm", "3mm"), None, None)}, "the volume has no unit"),
    ({"smooth": "1 parsec"}, "expected a unit such as"),
    ({"smooth": -1}, "smooth '-1', expected a number"),
    ({"backend": "abacus"}, "expected auto, gpu or cpu"),
    ({"start": "half"}, "half"),
    ({"samples": 1}, "samples 1, expected a whole number, 2 to"),
    ({"starts": 0}, "starts 0, expected a whole number, 1 to 256"),
])  # fmt: skip
def test_invalid_arguments_are_errors_of_one_line(options, message):
    with pytest.raises(isospectrum.Error, match=message) as raised:
        compute(blobs((6, 6, 6)), **options)
    assert "\n" not in str(raised.value)


def test_a_range_is_cut_to_that_of_the_volume_without_noise():
    noise = np.random.default_rng(3).standard_normal((8, 8, 8)).astype(np.float32)
    all_of_it = compute(noise, persistence="10%")
    low, high = all_of_it.range
    middle = (low + high) / 2
    assert noise.max() > high
    with pytest.warns(isospectrum.Warning, match="so .* is covered") as found:
        assert compute(noise, persistence="10%", range=(middle, float(noise.max()))).range == (middle, high)
    # At the line that has called the package.
    assert [warning.filename for warning in found] == [__file__]


def test_an_unknown_argument_is_a_type_error():
    with pytest.raises(TypeError, match="tolerance"):
        compute(blobs(), tolerance=0.1)


def test_lengths_have_units(array):
    mm = {"spacing": (0.5, 0.5, 2), "unit": "mm"}
    assert bytes_of(array, **mm, crop=(("1mm", "4.2mm"), None, ("2000um", None))) == bytes_of(
        array, **mm, crop=((2, 9), None, (1, 9))
    )
    assert bytes_of(array, **mm, smooth="0.5mm") == bytes_of(array, **mm, smooth=1)


def test_a_patients_space_is_in_millimetres(array):
    s = compute(array, spacing=200, origin=(1000, 0, 0), unit="um", space="RAS")
    assert (frame(s)["unit"], frame(s)["space"]) == ("mm", "RAS")
    assert frame(s)["spacing"] == pytest.approx([0.2] * 3) and frame(s)["origin"][0] == pytest.approx(1.0)


# Other packages: the same volume and its frame.


def test_simpleitk_images_have_their_frame(array):
    sitk = importlib.import_module("SimpleITK")
    image = sitk.GetImageFromArray(array)
    image.SetSpacing((0.5, 1.0, 2.0))
    image.SetOrigin((10.0, -20.0, 5.0))
    image.SetDirection((0, -1, 0, 1, 0, 0, 0, 0, 1))
    s = compute(image)
    assert (frame(s)["space"], frame(s)["unit"]) == ("LPS", "mm")
    # The largest sample is where SimpleITK has it.
    k, j, i = (int(n) for n in np.unravel_index(array.argmax(), array.shape))
    assert np.allclose([s.events[-1][axis] for axis in "xyz"], image.TransformIndexToPhysicalPoint((i, j, k)))
    assert np.array_equal(
        s.mesh(0.5).vertices,
        compute(array, spacing=(0.5, 1, 2), origin=(10, -20, 5), direction=[[0, -1, 0], [1, 0, 0], [0, 0, 1]])
        .mesh(0.5).vertices,
    )  # fmt: skip
    with pytest.raises(isospectrum.InputError, match="2 axes"):
        compute(image[:, :, 3])


def test_nibabel_images_have_their_affine(array, tmp_path):
    nib = importlib.import_module("nibabel")
    affine = np.array([[-2.0, 0, 0, 90], [0, 0, 1.5, -70], [0, 1.0, 0, 30], [0, 0, 0, 1]])
    image = nib.Nifti1Image(array.T, affine)
    s = compute(image)
    assert (frame(s)["space"], frame(s)["unit"]) == ("RAS", "mm")
    top = s.events[s.events["kind"] == "vanish"][-1]
    index = np.unravel_index(array.T.argmax(), array.T.shape)
    assert np.allclose([top[axis] for axis in "xyz"], nib.affines.apply_affine(affine, index))
    # The program reads the same frame from the file.
    nib.save(image, tmp_path / "image.nii.gz")
    from_file = compute(tmp_path / "image.nii.gz", name=None)
    assert np.allclose(from_file.mesh(0.5).vertices, s.mesh(0.5).vertices, atol=1e-4)
    with pytest.raises(isospectrum.InputError, match="expected 3"):
        compute(nib.Nifti1Image(np.stack([array.T] * 2, axis=-1), affine))


def test_xarrays_have_their_coordinates(array):
    xr = importlib.import_module("xarray")
    mm = {"units": "mm"}
    coords = {
        "z": ("z", 5.0 + 2.0 * np.arange(9), mm),
        "y": ("y", -20.0 - 1.0 * np.arange(10), mm),
        "x": ("x", 10.0 + 0.5 * np.arange(12), mm),
    }
    da = xr.DataArray(array, dims=("z", "y", "x"), coords=coords, name="density")
    s = compute(da)
    assert s.volume["name"] == "density" and frame(s)["unit"] == "mm"
    assert frame(s)["origin"] == [10, -20, 5] and frame(s)["spacing"] == [0.5, 1, 2]
    # y is descending, so the axis of the grid points the other way.
    assert frame(s)["direction"] == [[1, 0, 0], [0, -1, 0], [0, 0, 1]]
    top = da.argmax(...)
    event = s.events[-1]
    assert event["kind"] == "vanish"
    assert all(event[axis] == da[axis][top[axis]] for axis in "xyz")
    # In any order of axes, and with dask.
    assert bytes_of(da.transpose("x", "z", "y")) == bytes_of(da)
    assert bytes_of(da.chunk({"z": 4})) == bytes_of(da)
    with pytest.raises(isospectrum.InputError, match="axis x, expected evenly spaced"):
        compute(da.assign_coords(x=np.arange(12.0) ** 2))
    with pytest.raises(isospectrum.InputError, match="expected 3"):
        compute(da.isel(z=0))


def test_dask_zarr_and_h5py_are_arrays(array, tmp_path):
    expected = bytes_of(array)
    da = importlib.import_module("dask.array")
    assert bytes_of(da.from_array(array, chunks=5)) == expected
    zarr = importlib.import_module("zarr")
    z = zarr.create_array(store=str(tmp_path / "z.zarr"), data=array, chunks=(5, 5, 5))
    assert bytes_of(z) == expected
    h5py = importlib.import_module("h5py")
    with h5py.File(tmp_path / "h.h5", "w") as file:
        file["scan/density"] = array
        assert bytes_of(file["scan/density"]) == expected
        assert compute(file["scan/density"]).volume["name"] == "density"
    np.save(tmp_path / "m.npy", array)
    assert bytes_of(np.load(tmp_path / "m.npy", mmap_mode="r")) == expected


def test_pyvista_images_have_their_frame(array):
    pv = importlib.import_module("pyvista")
    image = pv.ImageData(dimensions=(12, 10, 9), spacing=(0.5, 1, 2), origin=(10, -20, 5))
    image.direction_matrix = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    image["density"] = array.ravel()
    # Through the entry point, without an import.
    s = image.isospectrum.compute(backend="cpu", progress=False)
    assert s.volume["name"] == "density"
    top = s.events[-1]
    assert np.allclose([top[axis] for axis in "xyz"], image.points[array.argmax()])
    # Samples of cells are at their centres.
    cells = pv.ImageData(dimensions=(13, 11, 10), spacing=(0.5, 1, 2), origin=(10, -20, 5))
    cells.cell_data["density"] = array.ravel()
    cells.set_active_scalars("density", preference="cell")
    top = cells.isospectrum.compute(backend="cpu", progress=False).events[-1]
    assert np.allclose([top[axis] for axis in "xyz"], cells.cell_centers().points[array.argmax()])
    with pytest.raises(isospectrum.InputError, match="without active scalars"):
        compute(pv.ImageData(dimensions=(3, 3, 3)))


def test_channels_of_a_tiff_are_read_as_slices():
    folder = ROOT / "tests" / "oracle"
    path = folder / "tiff_imagej_channels.tif"
    with pytest.raises(isospectrum.InputError, match='slices="channels"'):
        compute(path)
    found, wanted = compute(path, slices="channels"), compute(folder / "tiff_pages.tif")
    assert found.volume["dims"] == wanted.volume["dims"] and found.range == wanted.range
    assert len(found.events) == len(wanted.events)
    with pytest.raises(isospectrum.UsageError, match="slices 'z', expected one of channels, frames"):
        compute(path, slices="z")
    with pytest.raises(isospectrum.UsageError, match="with an array, expected none: it is for TIFF files"):
        compute(blobs(), slices="channels")


def test_a_scale_around_no_number_is_refused(array):
    spectrum = compute(array)
    for center in (float("nan"), float("inf")):
        with pytest.raises(isospectrum.UsageError, match="expected finite numbers"):
            spectrum.html(color="curvature", color_center=center)
