"""Computing spectra and opening their files."""

from __future__ import annotations

import os
import warnings
from collections.abc import Sequence
from typing import Any

from . import _bricks, _native, _ome_zarr, _progress
from ._errors import PromiseWarning, UsageError
from ._isovalue import Isovalue, as_text
from ._sources import lazy_and_frame, name_of, overridden_frame, volume
from ._spectrum import Spectrum

#: A number of samples or voxels, or a length such as ``"1.5mm"``.
Length = float | int | str


def compute(
    a: Any,
    *,
    spacing: Sequence[float] | float | None = None,
    origin: Sequence[float] | None = None,
    direction: Any = None,
    space: str | None = None,
    unit: str | None = None,
    name: str | None = None,
    nan_as: float | None = None,
    error: float | None = None,
    range: Sequence[Isovalue] | None = None,
    persistence: float | str | None = None,
    min_component: int | None = None,
    crop: Any = None,
    median: int | None = None,
    smooth: Length | None = None,
    downsample: int | None = None,
    mask: Any = None,
    start: Isovalue | None = None,
    brick: int | None = None,
    max_memory: float | str | None = None,
    client: Any = None,
    parts: str | os.PathLike[str] | None = None,
    to: str | os.PathLike[str] | None = None,
    level: int = 0,
    channel: int | None = None,
    frame: int | None = None,
    slices: str | None = None,
    check: bool = True,
    backend: str = "auto",
    adapter: str | None = None,
    threads: int | None = None,
    progress: _progress.Progress = True,
    **parameters: Any,
) -> Spectrum:
    """Compute the spectrum of a volume: every isosurface as one tracked mesh.

    Releases the interpreter's lock; Ctrl-C stops the computation.

    Parameters
    ----------
    a
        The samples, ``a[z, y, x]``: an array of numbers of any real type and memory order, or anything NumPy converts to one (dask,
        zarr, h5py, torch on the CPU); an xarray, whose coordinates give its frame; a SimpleITK, nibabel or PyVista image with its
        frame; an OME-Zarr image (a Zarr group) with its scale and unit; or the path of a file in a format of the program, or of a
        Zarr array or group. The samples are copied once, into the volume; 64-bit integers, half floats and foreign byte orders are
        converted first.
    spacing
        Distance between samples along x, y, z. Like the next four, it overrides the frame of the source.
    origin
        World position of the first sample, x, y, z.
    direction
        3 x 3 matrix whose columns are the unit vectors of the grid's x, y, z in the world.
    space
        ``"LPS"`` or ``"RAS"`` if the axes of the world are those of a patient; the spectrum is then in millimetres.
    unit
        ``"m"``, ``"cm"``, ``"mm"``, ``"um"``, ``"nm"`` or ``"angstrom"``.
    name
        Name of the volume.
    nan_as
        Replacement for NaN and infinities, which are otherwise an error.
    error
        Tolerance: intended largest distance of triangles from the isosurface, in voxels (the smallest spacing); default 0.1.
    range
        Lowest and highest isovalue to cover; default is the range of the volume.
    persistence
        Remove noise first: minima and maxima whose persistence is below this value, or below a percentage such as ``"2%"`` of the
        range after the crop and the filters.
    min_component
        Remove components and cavities that never have this many voxels before they merge with a larger one.
    crop
        Region to keep: three parts along x, y, z, each ``None``, a slice, or a pair (first, end) of sample numbers, the end not
        included, or of lengths such as ``"10mm"`` from the first sample; or a text as on the command line.
    median, smooth, downsample
        Filters, after the crop and in this order: a median filter of this radius (samples), a Gaussian of this standard deviation
        (voxels, or a length such as ``"1.5mm"``), and means of blocks of this many samples along each axis.
    mask
        Mask at whose border surfaces end: a volume with as many samples, whose non-zero samples are inside. Meshes are then open by
        default.
    start
        Isovalue to start from.
    brick
        Compute in bricks of about this many cells along a side, which takes less memory and more time. Parts are kept in a temporary
        folder meanwhile.
    max_memory
        Compute in bricks if the whole is expected to take more memory than this, bytes or a text such as ``"8GB"``. The samples and
        the resulting spectrum stay in memory.
    client
        Client of a ``dask.distributed`` cluster on which to compute in bricks, one task per brick. The array must be chunked (dask,
        Zarr, HDF5), and a task reads only the samples of its brick and its neighbourhood. The default is the current client, if the
        array is dask's or Zarr's and the volume needs no preparation. The package must be installed on the workers. The array is
        read three times: ``persist`` one that is slow to compute.
    parts
        Folder for the parts of these bricks, where complete parts are reused; by default a temporary one.
    to
        File (``.isp``) to write. Neither the spectrum nor the array needs to fit in memory: with ``client``, ``parts`` or ``to`` a
        chunked array is never loaded as a whole.
    level, channel, frame
        Level of an OME-Zarr image's pyramid (0 is the finest), its channel, and its frame in time.
    slices
        Read the ``"channels"`` or the ``"frames"`` of a TIFF file as its slices.
    check
        Verify the spectrum at a few isovalues, unless it is computed in bricks, and warn with a
        :class:`isospectrum.PromiseWarning` if it does not keep all promises.
    backend, adapter, threads
        Backend ``"auto"``, ``"gpu"`` or ``"cpu"``; GPU adapter by a part of its name; number of CPU threads.
    progress
        ``True`` for a tqdm bar if tqdm is installed, ``False`` for none, or a callable that takes the finished share (0 to 1) and the
        current stage, and is called in the calling thread.
    **parameters
        Further parameters of the sweep, as flags of ``isospectrum compute`` with ``_`` for ``-``: ``step``, ``samples``, ``min_quality``,
        ``min_area``, ``refine_area``, ``max_edge``, ``relax``, ``relax_force``, ``relax_iterations``, ``starts``,
        ``initial_mesh``.

    Raises
    ------
    isospectrum.InputError
        For an invalid volume: samples that are not finite, fewer than two along an axis, all equal, or complex.
    isospectrum.UsageError
        For invalid arguments.
    isospectrum.GpuError
        If ``backend="gpu"`` finds no adapter.
    """
    if error is not None:
        parameters["error"] = error
    for key, value in parameters.items():
        if key not in _KNOWN:
            raise TypeError(f"compute() got an unexpected keyword argument {key!r}")
        _check(key, value)
    ends = None
    if range is not None:
        try:
            low, high = range
        except (TypeError, ValueError):
            raise UsageError(f"range {range!r}, expected the lowest and the highest isovalue") from None
        ends = (as_text(low), as_text(high))
    a = _ome_zarr.opened(a)
    if _ome_zarr.is_group(a):
        a = _ome_zarr.image(a, level, channel, frame)
    start_text = None if start is None else as_text(start)
    placed = {"spacing": spacing, "origin": origin, "direction": direction, "space": space, "unit": unit}
    of_whole = {
        "slices": slices, "crop": crop, "median": median, "smooth": smooth, "downsample": downsample, "mask": mask, "persistence": persistence,
        "min_component": min_component, "max_memory": max_memory, "initial_mesh": parameters.get("initial_mesh"),
    }  # fmt: skip
    given = [key for key, value in of_whole.items() if value is not None]
    is_asked = not (client is None and parts is None and to is None)
    if is_asked or (not given and _bricks.has_client()):
        array, place = (None, None) if isinstance(a, (str, os.PathLike, _native.Volume)) else lazy_and_frame(a)
        if client is None and not given:
            client = _bricks.client_of(array)
        if is_asked and not _bricks.is_chunked(array):
            raise UsageError("client, parts and to need an array that is read by chunks: dask, Zarr, HDF5")
        if is_asked and given:
            raise UsageError(f"{given[0]} needs the whole volume in memory, expected no client, parts or to")
        if is_asked or client is not None:
            with _progress.shown(progress, "computing") as report:
                return Spectrum(
                    _bricks.compute(
                        array, overridden_frame(place, **placed), client=client, name=name or name_of(a), nan_as=nan_as,
                        parameters=parameters, ends=ends, start=start_text, brick=brick, runs=(backend, adapter, threads),
                        parts=parts, to=to, report=report,
                    )  # fmt: skip
                )
    whole = volume(a, **placed, name=name, nan_as=nan_as, slices=slices)
    preparation: _native._Preparation = {
        "crop": None if crop is None else _region(crop, whole),
        "median": median,
        "smooth": _text(smooth),
        "downsample": downsample,
        "mask": None if mask is None else _mask(mask),
        "persistence": _text(persistence),
        "min_component": min_component,
    }
    execution: _native._Execution = {
        "brick": brick, "max_memory": _text(max_memory), "backend": backend, "adapter": adapter, "threads": threads, "check": check,
    }  # fmt: skip
    with _progress.shown(progress, "computing") as report:
        made, broken = _native.compute(whole, parameters, ends, start_text, preparation, execution, report)
    if broken is not None:
        warnings.warn(broken, PromiseWarning, stacklevel=2)
    return Spectrum(made)


def open(path: str | os.PathLike[str]) -> Spectrum:  # noqa: A001 (as PIL.Image.open, h5py.File: read by its full name)
    """Open a spectrum in a file (``.isp`` or ``.thesis``). Chunks of a ``.isp`` file are read when a mesh needs them, and a limited number is
    kept in memory; a damaged one is an error then.

    Raises
    ------
    isospectrum.FileError
        If it cannot be read.
    isospectrum.InputError
        If it is damaged or not a spectrum.
    """
    return Spectrum(_native.Spectrum.open(os.fspath(path)))


#: The parameters of a sweep, each with a description and a check of valid values.
_KNOWN = {
    "error": ("a number above 0", lambda x: 0 < x < float("inf")),
    "step": ("a number above 0", lambda x: 0 < x < float("inf")),
    "samples": ("2 or more", lambda x: x >= 2),
    "min_quality": ("a number from 0 to 1", lambda x: 0 <= x <= 1),
    "min_area": ("0 or a number above", lambda x: 0 <= x < float("inf")),
    "refine_area": ("0 or a number above", lambda x: 0 <= x < float("inf")),
    "max_edge": ("a number above 0", lambda x: 0 < x < float("inf")),
    "relax": ("a number from 0 to 1", lambda x: 0 <= x <= 1),
    "relax_force": ("0 or a number above", lambda x: 0 <= x < float("inf")),
    "relax_iterations": ("a whole number", lambda x: x >= 0),
    "starts": ("1 to 256", lambda x: 1 <= x <= 256),
    "initial_mesh": ("the path of a PLY file", lambda x: isinstance(x, (str, os.PathLike))),
}


def _check(key: str, value: Any) -> None:
    expected, holds = _KNOWN[key]
    try:
        if holds(value):
            return
    except TypeError:
        pass
    raise UsageError(f"{key} {value!r}, expected {expected}")


def _text(value: Any) -> str | None:
    """A number or a text as the library parses it."""
    return None if value is None else str(value)


def _mask(mask: Any) -> _native.Volume:
    if getattr(mask, "dtype", None) == bool:
        mask = mask.astype("u1")
    return volume(mask)


def _region(crop: Any, whole: _native.Volume) -> Any:
    """A region as the library parses it: a text, or for x, y and z a text or a pair of texts."""
    if isinstance(crop, str):
        return crop
    expected = f"crop {crop!r}, expected three parts such as (10, 60), None, ('5mm', '30mm')"
    try:
        parts = list(crop)
    except TypeError:
        raise UsageError(expected) from None
    if len(parts) != 3:
        raise UsageError(expected)
    return [_axis(part, n, expected) for part, n in zip(parts, whole.dims)]


def _axis(part: Any, n: int, expected: str) -> str | tuple[str | None, str | None]:
    if isinstance(part, str):
        return part
    if isinstance(part, slice):
        if part.step not in (None, 1):
            raise UsageError(expected)
        part = part.indices(n)[:2]
    try:
        first, end = (None, None) if part is None else part
    except (TypeError, ValueError):
        raise UsageError(expected) from None
    return _text(first), _text(end)
