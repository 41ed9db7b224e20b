"""Computing spectra and opening their files."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Literal, SupportsFloat, SupportsIndex, Union

from . import _bricks, _native, _preparation, _progress
from ._arguments import choice, number, optional, path_of, public, whole
from ._errors import PromiseWarning, UsageError
from ._isovalue import Isovalue, as_text, two
from ._sources import FILE_ARGUMENTS, chosen, lazy_and_frame, name_of, overridden_frame, volume
from ._spectrum import Spectrum
from ._warnings import warn

if TYPE_CHECKING:
    import numpy.typing as npt

#: A number of samples or voxels, or a length such as ``"1.5mm"``.
Length = Union[SupportsFloat, str]

#: Numbers along x, y, z, or one for all.
Triple = Union["Sequence[SupportsFloat]", "npt.NDArray[Any]"]


@public
def compute(
    a: Any = None,
    *,
    phantom: str | None = None,
    spacing: Triple | SupportsFloat | None = None,
    origin: Triple | None = None,
    direction: npt.ArrayLike | None = None,
    space: Literal["LPS", "RAS"] | None = None,
    unit: Literal["m", "cm", "mm", "um", "nm", "angstrom"] | None = None,
    name: str | None = None,
    nan_as: SupportsFloat | None = None,
    outside: Literal["low", "high"] = "low",
    dims: Sequence[SupportsIndex] | str | None = None,
    type: str | None = None,  # noqa: A002 (as --type)
    endian: Literal["little", "big"] | None = None,
    array: str | None = None,
    series: int | str | None = None,
    channel: SupportsIndex | None = None,
    frame: SupportsIndex | None = None,
    level: SupportsIndex | None = None,
    slices: Literal["channels", "frames"] | None = None,
    crop: Any = None,
    median: SupportsIndex | None = None,
    smooth: Length | None = None,
    downsample: SupportsIndex | None = None,
    mask: Any = None,
    min_component: SupportsIndex | None = None,
    persistence: SupportsFloat | str | None = None,
    range: Sequence[Isovalue] | npt.NDArray[Any] | str | None = None,
    error: SupportsFloat = 0.1,
    samples: SupportsIndex | None = None,
    step: SupportsFloat | None = None,
    start: Isovalue | None = None,
    starts: SupportsIndex | None = None,
    initial_mesh: str | os.PathLike[str] | None = None,
    max_edge: SupportsFloat = 4.0,
    min_quality: SupportsFloat = 0.3,
    min_area: SupportsFloat = 0.0002,
    refine_area: SupportsFloat = 0.001,
    relax: SupportsFloat = 0.6,
    relax_force: SupportsFloat = 1e-4,
    relax_iterations: SupportsIndex = 6,
    max_triangles: SupportsFloat | None = None,
    max_memory: SupportsFloat | str | None = None,
    brick: SupportsIndex | None = None,
    client: Any = None,
    parts: str | os.PathLike[str] | None = None,
    to: str | os.PathLike[str] | None = None,
    check: bool = True,
    backend: Literal["auto", "gpu", "cpu"] = "auto",
    adapter: str | None = None,
    threads: SupportsIndex | None = None,
    progress: _progress.Progress = True,
) -> Spectrum:
    """Compute the spectrum of a volume: every isosurface as one tracked mesh.

    Releases the interpreter's lock; Ctrl-C stops the computation. Arguments have the names of the flags of ``isospectrum compute``.

    Parameters
    ----------
    a : array, image, or path
        The samples, ``a[z, y, x]``: an array of numbers of any real type and memory order, or anything NumPy converts to one (dask,
        zarr, h5py, torch on the CPU); an xarray, whose coordinates give its frame; an image of SimpleITK, ITK, nibabel, PyVista, VTK or
        gridData, or a layer of napari, with its frame; an OME-Zarr image (a Zarr group) with its scale and unit; or the path of a file
        in a format of the program, or of a Zarr array or group. The samples are copied once, into the volume; 64-bit integers, half
        floats and foreign byte orders are converted first.
    phantom : str, optional
        In place of ``a``, a built-in volume such as ``"hydrogen:48"``: sphere, torus, blobs, gyroid, noise or hydrogen, and a size.
    spacing : three floats or one, optional
        Distance between samples along x, y, z. Like the next four, it overrides the frame of the source.
    origin : three floats, optional
        World position of the first sample, x, y, z.
    direction : (3, 3) array, optional
        Matrix whose columns are the unit vectors of the grid's x, y, z in the world.
    space : {"LPS", "RAS"}, optional
        The meaning of the axes of the world if they are those of a patient; the spectrum is then in millimetres.
    unit : {"m", "cm", "mm", "um", "nm", "angstrom"}, optional
        Unit of spacing and origin.
    name : str, optional
        Name of the volume.
    nan_as : float, optional
        Replacement for NaN and infinities, which are otherwise an error.
    outside : {"low", "high"}, default "low"
        Side of the isosurface that surrounds the volume. Surfaces close around the other side, and normals point out of it: ``"high"``
        is for fields that are low inside, such as distances.
    dims : three ints, optional
        Numbers of samples along x, y, z of a RAW file whose name does not have them.
    type : str, optional
        Sample type of a RAW file: ``"uint8"``, ``"int16"``, ``"float32"``, ...
    endian : {"little", "big"}, optional
        Byte order of a RAW file.
    array : str, optional
        Name of one array of a VTK file, an ``xarray.Dataset`` or a PyVista image.
    series : int or str, optional
        Number, from 0, or identifier of one series of a folder of DICOM files.
    channel, frame : int, optional
        One number of each sample, and one time step, from 0, of a file or an OME-Zarr image.
    level : int, optional
        Level of an OME-Zarr image's pyramid; 0, the finest, is the default.
    slices : {"channels", "frames"}, optional
        Read these of a TIFF file as its slices.
    crop : three ranges or str, optional
        Region to keep: three parts along x, y, z, each ``None``, a slice, or a pair (first, end) of sample numbers, the end not
        included and negative ones counted from the end, or of lengths such as ``"10mm"`` from the first sample; or a text as on the
        command line.
    median, smooth, downsample : int, float or str, int, optional
        Filters, after the crop and in this order: a median filter of this radius (samples), a Gaussian of this standard deviation
        (voxels, or a length such as ``"1.5mm"``), and means of blocks of this many samples along each axis.
    mask : array, image, or path, optional
        Mask at whose border surfaces end: a volume with as many samples, whose non-zero samples are inside. Meshes are then open by
        default.
    min_component : int, optional
        Remove components and cavities that never have this many voxels before they merge with a larger one.
    persistence : float or str, optional
        Remove noise first: minima and maxima whose persistence is below this value, or below a percentage such as ``"2%"`` of the
        range after the crop and the filters.
    range : two isovalues, optional
        Lowest and highest isovalue to cover; default is the range of the volume. A range that exceeds it is cut to it, with a warning.
    error : float, default 0.1
        Tolerance: intended largest distance of triangles from the isosurface, in voxels (the smallest spacing).
    samples, step : int, float, optional
        Number of sampling isovalues over the range, or distance between them; by default they are adapted to the motion of the surface.
    start : isovalue, optional
        Isovalue to start from.
    starts : int, optional
        Number of starts, each with a part of the range of its own; by default by the expected size.
    initial_mesh : path, optional
        PLY file of a closed mesh at ``start``, to start from.
    max_edge : float, default 4
        Refine: longest edge, voxels.
    min_quality, min_area : float, default 0.3 and 0.0002
        Simplify: triangles of a lower radius ratio, or a smaller area divided by the smallest dimension, are removed.
    refine_area : float, default 0.001
        Refine only triangles above this area, divided by the smallest dimension.
    relax, relax_force, relax_iterations : float, float, int, default 0.6, 1e-4, 6
        Relax: share of the tangential force per iteration, the force below which it ends (voxels), and the most iterations in a step.
    max_triangles : float, optional
        Refuse a computation that is expected to have more triangles.
    max_memory : float or str, optional
        Compute in bricks if the whole is expected to take more memory than this, bytes or a text such as ``"8GB"``. The samples and
        the resulting spectrum stay in memory.
    brick : int, optional
        Compute in bricks of about this many cells along a side, which takes less memory and more time. Parts are kept in a temporary
        folder meanwhile.
    client : dask.distributed.Client, optional
        Cluster on which to compute in bricks, one task per brick. The array must be chunked (dask, Zarr, HDF5), and a task reads only
        the samples of its brick and its neighbourhood. The package must be installed on the workers. The array is read three times:
        ``persist`` one that is slow to compute. Without a client, a chunked array is loaded and computed here.
    parts : path, optional
        Folder for the parts of these bricks, where complete parts are reused; by default a temporary one.
    to : path, optional
        File (``.isp``) to write. Neither the spectrum nor the array needs to fit in memory: with ``client``, ``parts`` or ``to`` a
        chunked array is never loaded as a whole.
    check : bool, default True
        Verify the spectrum at a few isovalues, unless it is computed in bricks, and warn with a
        :class:`isospectrum.PromiseWarning` if it does not keep all promises, or may not keep them at other isovalues.
    backend : {"auto", "gpu", "cpu"}, default "auto"
        Where vertices are moved. ``"auto"`` is a GPU for volumes of 32^3 samples and more if there is one, which is looked for once.
    adapter : str, optional
        A part of the name of the GPU adapter.
    threads : int, optional
        Number of CPU threads, at most four for each processor.
    progress : bool or callable, default True
        ``True`` for a tqdm bar if tqdm is installed, ``False`` for none, or a callable that takes the finished share (0 to 1) and the
        current stage, and is called in the calling thread.

    Returns
    -------
    Spectrum
        The isosurfaces at all isovalues of the range.

    Raises
    ------
    isospectrum.InputError
        For an invalid volume: samples that are not finite, fewer than two along an axis, all equal, or complex.
    isospectrum.UsageError
        For invalid arguments.
    isospectrum.GpuError
        If ``backend="gpu"`` finds no adapter.

    See Also
    --------
    open : Opens a spectrum that has been saved.
    analyze : Isovalues of interest, without computing a spectrum.

    Examples
    --------
    >>> import isospectrum, numpy as np
    >>> z, y, x = np.mgrid[-1:1:12j, -1:1:12j, -1:1:12j]
    >>> s = isospectrum.compute(1 - np.sqrt(x**2 + y**2 + z**2), spacing=2 / 11, progress=False)
    >>> s.mesh(0.5).euler, len(s.events)
    (2, 1)
    """
    given = locals()
    if samples is not None and step is not None:
        raise UsageError(f"samples {samples!r} and step {step!r}, expected one of them")
    parameters = _preparation.sweep(given)
    ends = None
    if range is not None:
        low, high = two(range, "range")
        ends = (as_text(low), as_text(high))
    start_text = None if start is None else as_text(start)
    nan_as = optional(number, nan_as, "nan_as", "a finite number", lambda x: abs(x) < float("inf"))
    threads = optional(whole, threads, "threads", 1)
    brick = optional(whole, brick, "brick", 1)
    choice(outside, "outside", ("low", "high"))
    choice(backend, "backend", ("auto", "gpu", "cpu"))
    of_file = {key: given[key] for key in FILE_ARGUMENTS}
    if phantom is not None:
        if a is not None:
            raise UsageError(f"a volume and phantom {phantom!r}, expected one of them")
        a = _native.Volume.phantom(phantom, outside)
    a, of_file = chosen(a, of_file)
    placed: dict[str, Any] = {"spacing": spacing, "origin": origin, "direction": direction, "space": space, "unit": unit}
    if phantom is not None:
        _refuse({**placed, "name": name, "nan_as": nan_as}, "with a phantom")
    if not (client is None and parts is None and to is None):
        of_whole = ("crop", "median", "smooth", "downsample", "mask", "min_component", "persistence", "initial_mesh", "max_memory", "max_triangles")
        _refuse({key: given[key] for key in of_whole}, "needs the whole volume in memory, with client, parts or to")
        if client is not None and not hasattr(client, "scheduler_info"):
            raise UsageError(f"client {client!r}, expected a dask.distributed.Client, which connects to an address")
        lazy, place = (None, None) if isinstance(a, (str, os.PathLike, _native.Volume)) else lazy_and_frame(a)
        if place is None or not _bricks.is_chunked(lazy):
            raise UsageError("client, parts and to need an array that is read by chunks: dask, Zarr, HDF5")
        with _progress.shown(progress, "computing") as report:
            return Spectrum(
                _bricks.compute(
                    lazy, overridden_frame(place, **placed), client=client, name=name or name_of(a), nan_as=nan_as, outside=outside,
                    parameters=parameters, ends=ends, start=start_text, brick=brick, runs=(backend, adapter, threads),
                    parts=parts, to=to, report=report,
                )  # fmt: skip
            )
    whole_volume = volume(a, **placed, name=name, nan_as=nan_as, outside=outside, **of_file)
    preparation: _native._Preparation = {
        "crop": None if crop is None else _preparation.region(crop, whole_volume.dims),
        "median": optional(whole, median, "median"),
        "smooth": _preparation.text(smooth, "smooth"),
        "downsample": optional(whole, downsample, "downsample", 1),
        "mask": None if mask is None else _preparation.mask(mask),
        "persistence": _preparation.text(persistence, "persistence"),
        "min_component": optional(whole, min_component, "min_component"),
    }
    execution: _native._Execution = {
        "brick": brick, "max_memory": _preparation.text(max_memory, "max_memory"),
        "max_triangles": optional(number, max_triangles, "max_triangles", *_preparation.POSITIVE),
        "backend": backend, "adapter": adapter, "threads": threads, "check": bool(check),
    }  # fmt: skip
    with _progress.shown(progress, "computing") as report:
        made, broken = _native.compute(whole_volume, parameters, ends, start_text, preparation, execution, report)
    if broken is not None:
        warn(broken, PromiseWarning)
    return Spectrum(made)


def _refuse(arguments: dict[str, Any], why: str) -> None:
    """Refuse arguments that would have no effect."""
    for key, value in arguments.items():
        if value is not None:
            raise UsageError(f"{key} {value!r} {why}, expected none")


@public
def open(path: str | os.PathLike[str]) -> Spectrum:  # noqa: A001 (as PIL.Image.open, h5py.File: read by its full name)
    """Open a spectrum.

    Chunks of a ``.isp`` file are read when a mesh needs them, and a limited number is kept in memory; a damaged one is an error then.

    Parameters
    ----------
    path : path
        A file (``.isp`` or ``.thesis``).

    Returns
    -------
    Spectrum
        The isosurfaces at all isovalues of its range.

    Raises
    ------
    isospectrum.FileError
        If it cannot be read.
    isospectrum.InputError
        If it is damaged or not a spectrum.

    See Also
    --------
    compute : Computes a spectrum.

    Examples
    --------
    >>> import isospectrum
    >>> isospectrum.compute(phantom="sphere:8", progress=False).save("sphere.isp")
    >>> isospectrum.open("sphere.isp")
    <isospectrum.Spectrum of sphere:8: -0.770027 to 0.79029, 5815 triangles>
    """
    return Spectrum(_native.Spectrum.open(path_of(path)))
