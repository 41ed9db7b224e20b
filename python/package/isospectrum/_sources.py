"""Conversion of arrays and images of other packages to volumes.

Every source becomes an array ``a[z, y, x]`` of one of the eight sample types and a :class:`Frame`. Objects of other packages are
recognised by their attributes, so no package is imported that the user has not imported already.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from . import _foreign, _native, _ome_zarr
from ._arguments import nearest, optional, path_of, whole
from ._errors import ArgumentError, InputError, UsageError
from ._frame import Frame, even, triple

#: Sample types of a volume; all others are converted, or refused if they do not fit.
NATIVE = tuple(np.dtype(t) for t in ("u1", "i1", "u2", "i2", "u4", "i4", "f4", "f8"))

#: Arguments that say what of a file is read.
FILE_ARGUMENTS = ("dims", "type", "endian", "series", "slices", "array", "channel", "frame", "level")

#: Arguments that describe a volume from any source.
FRAME_ARGUMENTS = ("spacing", "origin", "direction", "space", "unit", "name", "nan_as", "outside")

#: Those that OME-Zarr images have, and those that sources with several named arrays have.
OME_ZARR_ARGUMENTS = ("level", "channel", "frame")
NAMED_ARGUMENTS = ("array",)


def volume(
    source: Any,
    *,
    spacing: Any = None,
    origin: Any = None,
    direction: Any = None,
    space: str | None = None,
    unit: str | None = None,
    name: str | None = None,
    nan_as: float | None = None,
    outside: str = "low",
    **parts: Any,
) -> _native.Volume:
    """Convert a source to a volume; arguments override the frame of the source. ``parts`` are ``FILE_ARGUMENTS``."""
    if isinstance(source, _native.Volume):
        return source
    source, parts = chosen(source, parts)
    if isinstance(source, (str, os.PathLike)):
        return of_file(source, spacing, origin, {"direction": direction, "space": space, "unit": unit}, parts, name, nan_as, outside)
    array, frame = array_and_frame(source)
    frame = overridden_frame(frame, spacing=spacing, origin=origin, direction=direction, space=space, unit=unit)
    samples = sample_array(array)
    return _native.Volume(
        samples, name or name_of(source), frame.origin, frame.spacing, frame.axes, frame.space, frame.unit, nan_as, outside
    )


def of_file(
    path: Any, spacing: Any, origin: Any, of_frame: dict[str, Any], parts: dict[str, Any], name: str | None, nan_as: float | None, outside: str
) -> _native.Volume:
    """Read a file in a format of the program."""
    path = path_of(path)
    if os.path.splitext(path)[1] in (".isp", ".thesis"):
        raise UsageError(f"{path}: is a spectrum, expected a volume: isospectrum.open reads spectra")
    for argument, value in of_frame.items():
        if value is not None:
            raise UsageError(f"{argument} {value!r} with a file, which has its own, expected none; read it into an array to replace it")
    dims = parts.get("dims")
    options: _native._Reading = {
        "dims": None if dims is None else sizes(dims),
        "type": parts.get("type"),
        "endian": parts.get("endian"),
        "series": optional(str, parts.get("series")),
        "slices": parts.get("slices"),
        "array": parts.get("array"),
        "channel": optional(whole, parts.get("channel"), "channel"),
        "frame": optional(whole, parts.get("frame"), "frame"),
        "spacing": optional(triple, spacing, "spacing"),
        "origin": optional(triple, origin, "origin"),
        "nan_as": nan_as,
        "outside": outside,
        "name": name,
    }
    return _native.Volume.read(path, options)


def sizes(dims: Any) -> tuple[int, int, int]:
    """Numbers of samples along x, y, z, as numbers or as ``"128x128x64"``."""
    try:
        x, y, z = (int(n) for n in dims.split("x")) if isinstance(dims, str) else dims
        return whole(x, "dims", 1), whole(y, "dims", 1), whole(z, "dims", 1)
    except (TypeError, ValueError):
        raise UsageError(f"dims {dims!r}, expected three numbers of samples: x, y, z") from None


def chosen(source: Any, parts: dict[str, Any]) -> tuple[Any, dict[str, Any]]:
    """A source after the choice among its parts, and the arguments that are left for a file.

    Raises
    ------
    UsageError
        For an argument that the source does not have.
    """
    for key in parts:
        if key not in FILE_ARGUMENTS:
            raise ArgumentError(f"a volume has no argument {key!r}{nearest(key, [*FILE_ARGUMENTS, *FRAME_ARGUMENTS])}")
    given = {key: value for key, value in parts.items() if value is not None}
    if isinstance(source, _native.Volume):
        kind, has = "a volume", _NONE
    elif isinstance(source, (str, os.PathLike)) and not _ome_zarr.is_folder(source):
        kind, has = "a file", tuple(a for a in FILE_ARGUMENTS if a != "level")
    else:
        source = _ome_zarr.opened(source)
        if _ome_zarr.is_group(source):
            kind, has = "an OME-Zarr image", OME_ZARR_ARGUMENTS
        elif _foreign.has_named_arrays(source):
            kind, has = "named arrays", NAMED_ARGUMENTS
        else:
            kind, has = "an array", _NONE
    for key, value in given.items():
        if key not in has:
            remedy = "; index it, as in a[2], for one of several" if kind == "an array" and key in ("frame", "channel") else ""
            raise UsageError(f"{key} {value!r} with {kind}, expected none: {_FOR[key]}{remedy}")
    if kind == "an OME-Zarr image":
        return _ome_zarr.image(source, given.get("level", 0), given.get("channel"), given.get("frame")), {}
    if kind == "named arrays":
        return _foreign.named(source, given.get("array")), {}
    return source, given


_NONE: tuple[str, ...] = ()

#: What the arguments are for.
_FOR = {
    "dims": "it is for RAW files", "type": "it is for RAW files", "endian": "it is for RAW files", "series": "it is for folders of DICOM files",
    "slices": "it is for TIFF files", "array": "it is for files and data sets with named arrays",
    "channel": "it is for files and OME-Zarr images", "frame": "it is for files and OME-Zarr images",
    "level": "it is for OME-Zarr images, where it is a level of the pyramid; isovalues are arguments of mesh()",
}  # fmt: skip


def overridden_frame(
    frame: Frame,
    *,
    spacing: Any = None,
    origin: Any = None,
    direction: Any = None,
    space: str | None = None,
    unit: str | None = None,
) -> Frame:
    """A frame with some of its fields replaced."""
    if spacing is not None:
        frame = replace(frame, spacing=triple(spacing, "spacing"))
    if origin is not None:
        frame = replace(frame, origin=triple(origin, "origin"))
    if direction is not None:
        if np.size(direction) != 9:
            raise UsageError(f"direction of {np.size(direction)} numbers, expected a matrix of 3 x 3")
        frame = replace(frame, axes=Frame.of_matrix(0, direction).axes)
    if space is not None:
        frame = replace(frame, space=space)
    if unit is not None:
        frame = replace(frame, unit=unit)
    return frame


def name_of(source: Any) -> str:
    """Name of a source: that of an xarray or a data set, else ``"array"``."""
    # The name of a dask array is a token of its task.
    is_token = hasattr(source, "__dask_graph__") and not hasattr(source, "coords")
    name = None if is_token else getattr(source, "name", None)
    return name.rsplit("/", 1)[-1] if isinstance(name, str) and name.strip("/") else "array"


def array_and_frame(source: Any) -> tuple[np.ndarray, Frame]:
    """The array ``[z, y, x]`` of a source, in memory, and its frame."""
    array, frame = lazy_and_frame(source)
    return of_array(array), frame


def lazy_and_frame(source: Any) -> tuple[Any, Frame]:
    """The array ``[z, y, x]`` of a source, which may not be in memory yet, and its frame."""
    if hasattr(source, "GetDirection") and hasattr(source, "GetPixelIDTypeAsString"):
        return of_simple_itk(source)
    if hasattr(source, "dataobj") and hasattr(source, "affine"):
        return of_nibabel(source)
    if hasattr(source, "direction_matrix") and hasattr(source, "active_scalars"):
        return of_pyvista(source)
    if hasattr(source, "dims") and hasattr(source, "coords") and hasattr(source, "values"):
        return of_xarray(source)
    foreign = _foreign.array_and_frame(source)
    if foreign is not None:
        return foreign
    return (source.array, source.frame) if isinstance(source, _ome_zarr.Image) else (source, Frame())


def of_array(source: Any) -> np.ndarray:
    """Convert an object by NumPy's array protocol, the buffer protocol or DLPack."""
    if isinstance(source, np.ma.MaskedArray) and np.ma.is_masked(source):
        raise InputError("a masked array, expected one without masked samples: .filled(value) makes one")
    if hasattr(source, "__array__") or hasattr(source, "__array_interface__"):
        return np.asarray(source)
    if hasattr(source, "__dlpack__"):
        return np.from_dlpack(source)
    array = np.asarray(source)
    if array.dtype == object:
        kind = type(source)
        raise InputError(f"{'None' if source is None else f'a {kind.__module__}.{kind.__qualname__}'}, expected an array of numbers a[z, y, x], an image with a frame, or the path of a file")
    return array


def of_simple_itk(image: Any) -> tuple[np.ndarray, Frame]:
    """A SimpleITK image, without a copy: LPS, millimetres."""
    import SimpleITK

    if image.GetDimension() != 3 or image.GetNumberOfComponentsPerPixel() != 1:
        raise InputError(
            f"an image of {image.GetDimension()} axes and {image.GetNumberOfComponentsPerPixel()} numbers a sample, "
            "expected 3 and 1"
        )
    frame = Frame.of_matrix(
        image.GetOrigin(), image.GetDirection(), spacing=tuple(image.GetSpacing()), space="LPS", unit="mm"
    )
    return SimpleITK.GetArrayViewFromImage(image), frame


def of_nibabel(image: Any) -> tuple[np.ndarray, Frame]:
    """A nibabel image ``[x, y, z]`` with its affine: RAS, with the scaling of its file applied."""
    array = np.asanyarray(image.dataobj)
    while array.ndim > 3 and array.shape[-1] == 1:
        array = array[..., 0]
    if array.ndim != 3:
        raise InputError(f"an image of {array.ndim} axes, expected 3: .slicer[..., i] takes one volume of several")
    affine = np.asarray(image.affine, dtype=float)
    steps = affine[:3, :3]
    spacing = np.linalg.norm(steps, axis=0)
    if not (spacing > 0).all():
        raise InputError(f"affine {affine.tolist()}, expected three axes")
    unit = "mm"
    if hasattr(image.header, "get_xyzt_units"):
        unit = {"meter": "m", "micron": "um"}.get(image.header.get_xyzt_units()[0], "mm")
    return array.T, Frame.of_matrix(
        affine[:3, 3], steps / spacing, spacing=tuple(spacing.tolist()), space="RAS", unit=unit
    )


def of_pyvista(grid: Any) -> tuple[np.ndarray, Frame]:
    """The active scalars of a PyVista (or VTK) image, of points or at the centres of cells."""
    scalars = grid.active_scalars
    if scalars is None:
        raise InputError("an image without active scalars, expected some: set_active_scalars")
    if scalars.ndim != 1:
        raise InputError(f"scalars of {scalars.shape[-1]} numbers a sample, expected one")
    dims = np.array(grid.dimensions)
    origin = np.array(grid.origin, dtype=float)
    matrix = np.asarray(grid.direction_matrix, dtype=float)
    if len(scalars) != dims.prod():
        dims = np.maximum(dims - 1, 1)
        origin = origin + matrix @ (0.5 * np.array(grid.spacing))
    # Indices of VTK's arrays may not start at 0.
    offset = np.array(getattr(grid, "offset", (0, 0, 0)))
    if offset.any() and not hasattr(grid, "bounds_origin_includes_offset"):
        origin = origin + matrix @ (np.array(grid.spacing) * offset)
    return np.asarray(scalars).reshape(dims[::-1]), Frame.of_matrix(origin, matrix, spacing=tuple(grid.spacing))


def of_xarray(array: Any) -> tuple[Any, Frame]:
    """An xarray with three axes: those named x, y and z in any order, or otherwise taken as z, y, x. Evenly spaced coordinates give
    origin, spacing and direction, and their attribute ``units`` the unit."""
    dims = list(array.dims)
    if len(dims) != 3:
        raise InputError(f"an array of the axes {', '.join(map(str, dims))}, expected 3: .sel or .isel take one")
    named = {str(dim).lower(): dim for dim in dims}
    order = [named[axis] for axis in "zyx"] if set(named) == set("xyz") else dims
    array = array.transpose(*order)
    origin, spacing, axes, units = [], [], [], []
    for number, dim in enumerate(reversed(order)):
        first, step = 0.0, 1.0
        if dim in array.coords and len(array.coords[dim]) > 1:
            along = array.coords[dim]
            first, step = even(dim, np.asarray(along.values))
            units.append(along.attrs.get("units"))
        origin.append(first)
        spacing.append(abs(step))
        axes.append(tuple(np.sign(step) * np.eye(3)[number]))
    unit = units[0] if len(units) == 3 and len(set(units)) == 1 and units[0] else ""
    if not isinstance(unit, str) or _native.unit_in_mm(unit) is None:
        unit = ""
    return array.data if hasattr(array.data, "__array__") else array, Frame(
        triple(origin, "origin"), triple(spacing, "spacing"), tuple(axes), unit=unit
    )


def sample_array(array: np.ndarray) -> np.ndarray:
    """Convert an array to a sample type, without a copy if it has one already. Only ``float128`` is rounded, integers never."""
    array = np.asarray(array)
    if array.ndim != 3:
        raise UsageError(f"an array of {array.ndim} axes, expected 3: z, y, x")
    dtype = sample_type(array.dtype, lambda: (int(array.min()), int(array.max())) if array.size else (0, 0))
    if array.dtype.kind == "b" and array.flags.aligned:
        return array.view(np.uint8)
    return array if array.dtype == dtype and array.flags.aligned else array.astype(dtype)


def sample_type(dtype: np.dtype, limits: Callable[[], tuple[int, int]]) -> np.dtype:
    """The sample type for a NumPy type. 64-bit integers, whose smallest and largest value ``limits`` returns, become 32-bit ones if they
    fit, else 64-bit floats if those represent them exactly."""
    kind, size = dtype.kind, dtype.itemsize
    if kind == "b":
        return np.dtype(np.uint8)
    if kind == "f" and size == 2:
        return np.dtype(np.float32)
    if kind == "f" and size > 8:
        return np.dtype(np.float64)
    if kind in "iu" and size == 8:
        low, high = limits()
        for narrow in (np.int32, np.uint32):
            ends = np.iinfo(narrow)
            if ends.min <= low and high <= ends.max:
                return np.dtype(narrow)
        if max(-low, high) <= 2**53:
            return np.dtype(np.float64)
        raise InputError(f"whole numbers from {low} to {high}, expected at most 2^53, which 64-bit floats represent exactly")
    native = dtype.newbyteorder("=")
    if native in NATIVE:
        return native
    raise InputError(f"an array of {dtype}, expected numbers")
