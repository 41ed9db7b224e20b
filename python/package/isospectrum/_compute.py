"""From volumes and files to spectra."""

from __future__ import annotations

import os
import re
from collections.abc import Sequence
from typing import Any

from . import _bricks, _native, _ome_zarr, _progress
from ._errors import UsageError
from ._sources import lazy_and_frame, name_of, told_frame, volume
from ._spectrum import Isovalue, Spectrum, as_text

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
    backend: str = "auto",
    adapter: str | None = None,
    threads: int | None = None,
    progress: _progress.Progress = True,
    **parameters: Any,
) -> Spectrum:
    """Compute the spectrum of a volume: every isosurface as one tracked mesh.

    Other Python threads run meanwhile; Ctrl-C stops it.

    Parameters
    ----------
    a
        The samples, ``a[z, y, x]``: an array of numbers of any type and order in memory, or whatever is one for NumPy (dask,
        zarr, h5py, torch on the CPU); an xarray, whose coordinates tell where it lies; a SimpleITK, nibabel or PyVista
        image with its frame; an image of OME-Zarr (a Zarr group) with its scale and unit; or the path of a file that the program
        reads, or of a Zarr array or group. The samples are copied once, into the volume; an array of 64-bit whole numbers, of half
        floats or in foreign byte order is converted first.
    spacing
        Distance between samples along x, y, z. Replaces what the source tells, as do the next four.
    origin
        World position of the first sample, x, y, z.
    direction
        Matrix of 3 x 3 numbers whose columns are the unit vectors of the grid's x, y, z in the world.
    space
        ``"LPS"`` or ``"RAS"`` where the axes of the world are a patient's; the spectrum is then in millimetres.
    unit
        ``"m"``, ``"cm"``, ``"mm"``, ``"um"``, ``"nm"`` or ``"angstrom"``.
    name
        What the volume is called.
    nan_as
        Number in place of NaN and infinities, which are an error otherwise.
    error
        Tolerance: how far triangles should be from the isosurface at most, in voxels (the smallest spacing); 0.1.
    range
        Lowest and highest isovalue to cover; all of the volume's.
    persistence
        Take noise out first: no minimum or maximum is left that is closer than this in value to the saddle that ends it; a
        value, or ``"2%"`` of the range of what is left after the steps below.
    min_component
        Leave dust out: parts, and cavities, that never have so many voxels before they meet a larger one.
    crop
        Keep a region: three parts along x, y, z, each ``None``, a slice, or a pair (from, up to but not including) of samples
        or of lengths such as ``"10mm"`` from the first sample. A text is read as on the command line.
    median, smooth, downsample
        Filters, after the crop and in this order: the median of the samples up to so many away, a Gaussian of this standard
        deviation (voxels, or a length such as ``"1.5mm"``), means of blocks of so many samples along every axis.
    mask
        End surfaces where this mask does: what can be a volume, of as many samples, of which those that are not zero are
        inside. Meshes are then open by themselves.
    start
        Isovalue to start from.
    brick
        Compute in bricks of about this many cells along a side: takes less memory for what is swept at a time, and more time.
        Parts lie in a folder among the temporary ones meanwhile; the result is the same whichever way they are joined.
    max_memory
        Compute in bricks where the whole is expected to take more than this, bytes or a text such as ``"8GB"``. The samples
        stay in memory, and so does the spectrum in the end.
    client
        Compute in bricks on this cluster of ``dask.distributed``: one task per brick, whose samples and those beside it are all that
        is read of a dask or Zarr array, or of another that has chunks. Without a word the client that there is, if the array is
        dask's or Zarr's and nothing is to be done to the whole volume before. The package must be installed where the workers are.
        The array is read three times: ``persist`` what is slow to compute.
    parts
        The folder for the parts of these bricks; those that are there already are left. Else a temporary one.
    to
        Write the spectrum there as it is made: a file (``.isp``), or a folder of its parts (``.ispt``), which need not be in memory
        at once, nor the array: with ``client``, ``parts`` or ``to`` a chunked array is never loaded whole.
    level, channel, frame
        Which level of an OME-Zarr image's pyramid (0 is the finest), and which of its channels and frames in time.
    backend, adapter, threads
        Where it runs: ``"auto"``, ``"gpu"`` or ``"cpu"``; the adapter by a part of its name; threads on the CPU.
    progress
        ``True`` for a bar of tqdm where there is one, ``False`` for none, or a callable that is told the share done (0 to 1)
        and what is being done, in the thread that called.
    **parameters
        The sweep's others, as flags of ``isospectrum compute`` with ``_`` for ``-``: ``step``, ``samples``, ``min_quality``,
        ``min_area``, ``refine_area``, ``max_edge``, ``relax``, ``relax_force``, ``relax_iterations``, ``initial_mesh``.

    Raises
    ------
    isospectrum.InputError
        For a volume that is none: a sample that is not finite, fewer than two along an axis, all equal, complex numbers.
    isospectrum.UsageError
        For arguments that make no sense.
    isospectrum.GpuError
        Where ``backend="gpu"`` finds none.
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
    told_start = None if start is None else as_text(start)
    placed = {"spacing": spacing, "origin": origin, "direction": direction, "space": space, "unit": unit}
    of_whole = {
        "crop": crop, "median": median, "smooth": smooth, "downsample": downsample, "mask": mask, "persistence": persistence,
        "min_component": min_component, "max_memory": max_memory, "initial_mesh": parameters.get("initial_mesh"),
    }  # fmt: skip
    given = [what for what, value in of_whole.items() if value is not None]
    is_asked = not (client is None and parts is None and to is None)
    if is_asked or (not given and _bricks.has_client()):
        array, place = (None, None) if isinstance(a, (str, os.PathLike, _native.Volume)) else lazy_and_frame(a)
        if client is None and not given:
            client = _bricks.client_of(array)
        if is_asked and not _bricks.is_chunked(array):
            raise UsageError("client, parts and to are for arrays that are read by chunks: dask, Zarr, HDF5")
        if is_asked and given:
            raise UsageError(f"{given[0]} wants the whole volume in memory, expected no client, parts or to")
        if is_asked or client is not None:
            with _progress.shown(progress, "computing") as told:
                return Spectrum(
                    _bricks.compute(
                        array, told_frame(place, **placed), client=client, name=name or name_of(a), nan_as=nan_as,
                        parameters=parameters, ends=ends, start=told_start, brick=brick, runs=(backend, adapter, threads),
                        parts=parts, to=to, told=told,
                    )  # fmt: skip
                )
    whole = volume(a, **placed, name=name, nan_as=nan_as)
    with _progress.shown(progress, "computing") as told:
        native = _native.compute(
            whole,
            parameters,
            ends,
            told_start,
            None if crop is None else _region(crop, whole),
            median,
            None if smooth is None else _sigma(smooth, whole),
            downsample,
            None if mask is None else _mask(mask),
            None if persistence is None else _persistence(persistence),
            min_component,
            brick,
            None if max_memory is None else _bytes(max_memory),
            backend,
            adapter,
            threads,
            told,
        )
    return Spectrum(native)


def open(path: str | os.PathLike[str]) -> Spectrum:  # noqa: A001 (as PIL.Image.open, h5py.File: read by its full name)
    """Read a spectrum from a file (``.isp``, or ``.thesis``), or a folder of parts (``.ispt``), of which those are read that meshes
    ask for, and dropped again when they are many.

    Raises
    ------
    isospectrum.FileError
        Where it cannot be read.
    isospectrum.InputError
        If it is damaged, or no spectrum.
    """
    return Spectrum(_native.Spectrum.open(os.fspath(path)))


#: The parameters of a sweep, each with what holds for it.
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


def _split(length: Length, what: str) -> tuple[float, str]:
    """A length's number and its unit, empty where it is a number of samples or voxels."""
    text = str(length).strip()
    match = re.fullmatch(r"([-+0-9.eE]+?)\s*([^\W\d_]*)", text)
    try:
        number = float(match[1]) if match else float("nan")
    except ValueError:
        number = float("nan")
    if match and match[2] and _native.unit_in_mm(match[2]) is None:
        raise UsageError(f"{what} {length!r}, expected a unit such as mm, um or angstrom")
    if not 0 <= number < float("inf"):
        raise UsageError(f"{what} {length!r}, expected a number such as 1.5 or 2mm")
    return number, match[2] if match else ""


def _steps(length: Length, step: float, whole: _native.Volume, what: str) -> tuple[float, bool]:
    """How many steps of the volume's unit a length is, and whether it has a unit."""
    number, unit = _split(length, what)
    if not unit:
        return number, False
    own, mm = _native.unit_in_mm(whole.unit), _native.unit_in_mm(unit)
    if own is None or mm is None:
        raise UsageError(f"{what} in {unit}, but the volume tells no unit, expected a number without one")
    return number * mm / (own * step), True


def _sigma(smooth: Length, whole: _native.Volume) -> tuple[float, float, float]:
    """Standard deviations along x, y, z in samples."""
    voxel = min(whole.spacing)
    voxels, _ = _steps(smooth, voxel, whole, "smooth")
    x, y, z = (voxels * voxel / s for s in whole.spacing)
    return (x, y, z)


def _bytes(size: float | str) -> float:
    """Bytes, as the command line reads them: with a unit of thousands, or of 1024."""
    match = re.fullmatch(r"\s*([0-9.]+(?:e\+?[0-9]+)?)\s*((?:[kmgt]i?)?)b?\s*", str(size), re.IGNORECASE)
    try:
        number = float(match[1]) if match else float("nan")
    except ValueError:
        number = float("nan")
    if not match or not 0 < number < float("inf"):
        raise UsageError(f"max_memory {size!r}, expected bytes, or a size such as '8GB'")
    unit = match[2].lower()
    base = 1024 if unit.endswith("i") else 1000
    return number * base ** ("kmgt".index(unit[0]) + 1 if unit else 0)


def _mask(mask: Any) -> _native.Volume:
    if getattr(mask, "dtype", None) == bool:
        mask = mask.astype("u1")
    return volume(mask)


def _persistence(persistence: float | str) -> tuple[float, bool]:
    """A number, and whether it is a share."""
    text = str(persistence).strip()
    share = text.endswith("%")
    try:
        value = float(text[:-1] if share else text)
    except ValueError:
        value = float("nan")
    if not 0 < value < float("inf"):
        raise UsageError(f"persistence {persistence!r}, expected a number above 0 or a percentage such as 5%")
    return (value / 100, True) if share else (value, False)


def _region(crop: Any, whole: _native.Volume) -> list[tuple[int, int]]:
    """First samples and those behind the last, along x, y, z."""
    expected = f"crop {crop!r}, expected three parts such as (10, 60), None, ('5mm', '30mm')"
    parts = crop.split(",") if isinstance(crop, str) else crop
    try:
        if len(parts) != 3:
            raise UsageError(expected)
    except TypeError:
        raise UsageError(expected) from None
    region = []
    for part, n, spacing in zip(parts, whole.dims, whole.spacing):
        if isinstance(part, str):
            low_text, _, high_text = part.strip().partition(":")
            # `10:60mm` is 10 mm to 60 mm.
            if low_text and high_text and not _split(low_text, "crop")[1]:
                low_text += _split(high_text, "crop")[1]
            part = (low_text or None, high_text or None)
        elif isinstance(part, slice):
            if part.step not in (None, 1):
                raise UsageError(expected)
            part = part.indices(n)[:2]
        try:
            first, end = (None, None) if part is None else part
        except (TypeError, ValueError):
            raise UsageError(expected) from None
        low, high = 0.0, float(n)
        if first is not None:
            low, is_length = _steps(first, spacing, whole, "crop")
            # A sample at either end of a length is inside.
            low = float(-(-low // 1)) if is_length else low
        if end is not None:
            high, is_length = _steps(end, spacing, whole, "crop")
            high = min(high // 1 + 1, float(n)) if is_length else high
        if low % 1 or high % 1:
            raise UsageError(expected)
        region.append((int(low), int(high)))
    return region
