"""The compiled part: what of the library the package calls. Not for use from outside."""

import os
from collections.abc import Callable
from typing import Any, Literal, TypedDict, final

import numpy as np
import numpy.typing as npt

__all__ = [
    "Picture",
    "Plan",
    "Spectrum",
    "Surface",
    "Volume",
    "WorkFolder",
    "after_fork",
    "analyze",
    "compute",
    "cut",
    "default_parameters",
    "extract",
    "film",
    "forecast",
    "run_program",
    "short_number",
    "tally",
    "unit_in_mm",
    "write_file",
    "write_morph",
]

_Kept = tuple[int | None, float, float, tuple[float, float, float] | None]
_Report = Callable[[float, str], object] | None
_Triple = tuple[float, float, float]
_Numbers = tuple[int, int, int]
_Ids = tuple[npt.NDArray[np.uint32], npt.NDArray[np.uint32]]

def unit_in_mm(name: str) -> float | None:
    """Length of a unit in millimetres, by its name or symbol; ``None`` for an unknown name."""

def short_number(x: float) -> str:
    """A number as reports and labels show it: five significant digits."""

def write_file(path: str | os.PathLike[str], bytes: bytes) -> None:
    """Write a file atomically."""

def after_fork() -> None:
    """Tell the compiled part that this process is the child of a fork."""

def run_program(arguments: list[str]) -> int:
    """Run the program, and return its exit code."""

def default_parameters() -> str:
    """The default parameters of a sweep, as JSON."""

def analyze(volume: Volume) -> tuple[list[tuple[float, Literal["otsu", "persistence"], int | None]], dict[str, Any]]:
    """Isovalues of interest, and the columns of all events."""

def forecast(volume: Volume, range: tuple[str, str] | None, error: float) -> tuple[float, float, int]:
    """Expected triangles, memory in bytes, and events."""

class _Reading(TypedDict):
    dims: _Numbers | None
    type: str | None
    endian: str | None
    frame: int | None
    channel: int | None
    array: str | None
    series: str | None
    slices: str | None
    spacing: _Triple | None
    origin: _Triple | None
    nan_as: float | None
    outside: str
    name: str | None

@final
class Volume:
    """A scalar field on a regular grid."""

    def __new__(
        cls,
        array: npt.NDArray[Any],
        name: str,
        origin: _Triple,
        spacing: _Triple,
        direction: tuple[_Triple, ...],
        space: str,
        unit: str,
        nan_as: float | None,
        outside: str,
    ) -> Volume: ...
    @staticmethod
    def read(path: str, options: _Reading) -> Volume: ...
    @staticmethod
    def phantom(name: str, outside: str) -> Volume: ...
    @property
    def dims(self) -> tuple[int, int, int]: ...
    @property
    def spacing(self) -> _Triple: ...
    @property
    def unit(self) -> str: ...
    @property
    def range(self) -> tuple[float, float]: ...

@final
class Picture:
    """A picture: red, green, blue, alpha; one byte each."""

    @property
    def shape(self) -> tuple[int, int]: ...
    def pixels(self) -> npt.NDArray[np.uint8]: ...
    def png(self) -> bytes: ...
    def save(self, path: str) -> None: ...

@final
class Spectrum:
    """A spectrum in memory or in a file, and the index for queries, which is built on first use."""

    @staticmethod
    def open(path: str) -> Spectrum: ...
    @staticmethod
    def from_bytes(bytes: bytes) -> Spectrum: ...
    def to_bytes(self) -> bytes: ...
    def save(self, path: str) -> None: ...
    def about(self) -> str: ...
    def isovalue(self, text: str) -> float: ...
    def surface(self, isovalue: float, open: bool, keep: _Kept | None, is_turned: bool, has_ids: bool) -> Surface: ...
    def fill(
        self,
        isovalue: float,
        open: bool,
        keep: _Kept | None,
        is_turned: bool,
        vertices: npt.NDArray[np.float32],
        triangles: npt.NDArray[np.int32],
        normals: npt.NDArray[np.float32],
    ) -> tuple[int, int]: ...
    def trajectory(self, vertex: int) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]: ...
    def lifetimes(self, of_triangles: bool) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]: ...
    def curves(self, n: int, range: tuple[float, float]) -> dict[str, Any]: ...
    def events(self) -> dict[str, Any]: ...
    def components(self, isovalue: float, keep: _Kept | None) -> dict[str, Any]: ...
    def verify(self, volume: Volume, n: int, events: int, seed: int, progress: _Report) -> str: ...
    def render(
        self,
        surfaces: list[tuple[float, int | None, float | None]],
        pictured: dict[str, Any],
        appearance: dict[str, Any],
        volume: Volume | None,
        color_by: Volume | None,
    ) -> Picture: ...
    def html(
        self,
        surfaces: list[tuple[float, int | None, float | None]],
        title: str | None,
        caption: str | None,
        credit: str | None,
        marks: list[tuple[float, str]],
        range: tuple[float, float] | None,
        tolerance: float,
        step: float | None,
        appearance: dict[str, Any],
        volume: Volume | None,
        color_by: Volume | None,
        has_slice: bool,
        has_still: bool,
    ) -> str: ...

_Parts = tuple[
    npt.NDArray[np.float32],
    npt.NDArray[np.float32],
    npt.NDArray[np.uint32],
    npt.NDArray[np.bool_],
    _Ids | None,
    str,
]

@final
class Surface:
    """A mesh that stands by itself."""

    @staticmethod
    def from_parts(
        positions: npt.NDArray[np.float32],
        normals: npt.NDArray[np.float32],
        triangles: npt.NDArray[np.uint32],
        caps: npt.NDArray[np.bool_],
        ids: _Ids | None,
        volume: str,
    ) -> Surface: ...
    def parts(self) -> _Parts: ...
    def arrays(
        self,
    ) -> tuple[npt.NDArray[np.float32], npt.NDArray[np.uint32], npt.NDArray[np.float32], npt.NDArray[np.bool_]]: ...
    def ids(self) -> _Ids | None: ...
    def vertices_f64(self) -> npt.NDArray[np.float64]: ...
    def labels(self) -> npt.NDArray[np.uint32]: ...
    def sample(self, volume: Volume) -> npt.NDArray[np.float64]: ...
    def save(self, path: str) -> None: ...
    def encoded(self, format: str) -> bytes: ...

class _Volumes(TypedDict):
    volume: Volume | None
    color_by: Volume | None
    inputs: list[str]

def extract(
    spectrum: Spectrum,
    path: str,
    format: str | None,
    surfaces: list[tuple[float, int | None, float | None]],
    is_sweep: bool,
    appearance: dict[str, Any],
    volumes: _Volumes,
    progress: _Report,
) -> list[tuple[float, str, int, int]]:
    """Write meshes; their isovalues, files, and numbers of vertices and triangles."""

def write_morph(
    spectrum: Spectrum, path: str, isovalues: list[float], appearance: dict[str, Any], progress: _Report
) -> tuple[int, int, float]:
    """Write a mesh with morph targets; its vertices and triangles, and its largest distance from the isosurface."""

def film(
    spectrum: Spectrum,
    path: str,
    fps: int | None,
    sweep: list[tuple[float, str | None]],
    surfaces: list[tuple[float, int | None, float | None]],
    turntable: int | None,
    pictured: dict[str, Any],
    appearance: dict[str, Any],
    volumes: _Volumes,
    progress: _Report,
) -> None:
    """Write a film or numbered pictures."""

class _Preparation(TypedDict):
    crop: str | list[str | tuple[str | None, str | None]] | None
    median: int | None
    smooth: str | None
    downsample: int | None
    mask: Volume | None
    persistence: str | None
    min_component: int | None

class _Execution(TypedDict):
    brick: int | None
    max_memory: str | None
    max_triangles: float | None
    backend: str
    adapter: str | None
    threads: int | None
    check: bool

def compute(
    volume: Volume,
    parameters: dict[str, Any],
    range: tuple[str, str] | None,
    start: str | None,
    preparation: _Preparation,
    execution: _Execution,
    progress: _Report,
) -> tuple[Spectrum, str | None]: ...

def cut(dims: _Numbers, brick: int | None) -> list[tuple[_Numbers, _Numbers]]:
    """The blocks into which a volume is cut: the first sample of each and the one after its last."""

def tally(array: npt.NDArray[Any], range: tuple[float, float]) -> bytes:
    """A tally of samples, from which statistics are summed up."""

@final
class WorkFolder:
    """A folder for parts next to the file of the result. It is removed at the end, and by the next run for the same file after a kill."""

    def __new__(cls, to: str | os.PathLike[str] | None) -> WorkFolder: ...
    def __enter__(self) -> str | os.PathLike[str]: ...
    def __exit__(self, _kind: object, _error: object, _traceback: object) -> None: ...

@final
class Plan:
    """The plan of a computation in bricks."""

    def __new__(
        cls,
        name: str,
        dims: _Numbers,
        sample_type: str,
        limits: tuple[float, float],
        frame: tuple[_Triple, _Triple, tuple[_Triple, ...], str, str],
        outside: str,
        tallies: list[bytes],
        checksums: list[int],
        brick: int | None,
        parameters: dict[str, Any],
        range: tuple[str, str] | None,
        start: str | None,
        blocks: Callable[[_Numbers, _Numbers], npt.NDArray[Any]],
    ) -> Plan: ...
    @staticmethod
    def from_bytes(bytes: bytes) -> Plan: ...
    def to_bytes(self) -> bytes: ...
    @property
    def n(self) -> int: ...
    def required_samples(self, number: int) -> tuple[_Numbers, _Numbers]: ...
    def part(
        self, number: int, array: npt.NDArray[Any], backend: str, adapter: str | None, threads: int | None
    ) -> bytes: ...
    def is_complete(self, folder: str | os.PathLike[str], number: int) -> bool: ...
    def store(self, folder: str | os.PathLike[str], number: int, bytes: bytes) -> None: ...
    def merge(
        self,
        folder: str | os.PathLike[str],
        blocks: Callable[[_Numbers, _Numbers], npt.NDArray[Any]],
        to: str | os.PathLike[str] | None,
        progress: _Report,
    ) -> Spectrum: ...
