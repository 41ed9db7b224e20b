"""The compiled part: what of the library the package calls. Not for use from outside."""

import os
from collections.abc import Callable
from typing import Any, final

import numpy as np
import numpy.typing as npt

__all__ = ["Picture", "Plan", "Spectrum", "Volume", "compute", "cut", "tally", "unit_in_mm", "write_file"]

_Kept = tuple[int | None, float, float, tuple[float, float, float] | None]
_Told = Callable[[float, str], object] | None
_Triple = tuple[float, float, float]

def unit_in_mm(name: str) -> float | None:
    """How long a unit is in millimetres, by its name or sign; none of what is no unit."""

def write_file(path: str | os.PathLike[str], bytes: bytes) -> None:
    """Writes a file beside its place, and moves it there when it is complete."""

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
    ) -> Volume: ...
    @staticmethod
    def read(path: str, spacing: _Triple | None, origin: _Triple | None, nan_as: float | None) -> Volume: ...
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
    """A spectrum, with what answers queries on it once that was asked for."""

    @staticmethod
    def open(path: str) -> Spectrum: ...
    @staticmethod
    def from_bytes(bytes: bytes) -> Spectrum: ...
    def to_bytes(self) -> bytes: ...
    def save(self, path: str) -> None: ...
    def about(self) -> str: ...
    def isovalue(self, text: str) -> float: ...
    def mesh(
        self, isovalue: float, open: bool, keep: _Kept | None
    ) -> tuple[npt.NDArray[np.float32], npt.NDArray[np.uint32], npt.NDArray[np.float32], npt.NDArray[np.bool_]]: ...
    def vertices_f64(self, isovalue: float, open: bool, keep: _Kept | None) -> npt.NDArray[np.float64]: ...
    def save_mesh(self, isovalue: float, open: bool, keep: _Kept | None, path: str) -> None: ...
    def curves(self, n: int) -> dict[str, Any]: ...
    def events(self) -> dict[str, Any]: ...
    def components(self, isovalue: float, keep: _Kept | None) -> dict[str, Any]: ...
    def verify(self, volume: Volume, n: int, events: int, seed: int, progress: _Told) -> str: ...
    def render(
        self,
        surfaces: list[tuple[float, int | None, float | None]],
        size: tuple[int, int],
        sight: dict[str, Any],
        legend: bool,
        scale_bar: bool,
        label: str | None,
        fit_volume: bool,
        volume: Volume | None,
        color_by: Volume | None,
        adapter: str | None,
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
        sight: dict[str, Any],
        volume: Volume | None,
        color_by: Volume | None,
        has_still: bool,
    ) -> str: ...

def compute(
    volume: Volume,
    parameters: dict[str, Any],
    range: tuple[str, str] | None,
    start: str | None,
    crop: list[tuple[int, int]] | None,
    median: int | None,
    smooth: _Triple | None,
    downsample: int | None,
    mask: Volume | None,
    persistence: tuple[float, bool] | None,
    min_component: int | None,
    brick: int | None,
    max_memory: float | None,
    backend: str,
    adapter: str | None,
    threads: int | None,
    progress: _Told,
) -> Spectrum: ...

_Numbers = tuple[int, int, int]

def cut(dims: _Numbers, brick: int | None) -> list[tuple[_Numbers, _Numbers]]:
    """The blocks that a volume is cut into: the first sample of each and the one behind its last."""

def tally(array: npt.NDArray[Any], range: tuple[float, float]) -> bytes:
    """What samples tell of the statistics of a volume of a range."""

@final
class Plan:
    """A computation in bricks."""

    def __new__(
        cls,
        name: str,
        dims: _Numbers,
        sample_type: str,
        limits: tuple[float, float],
        frame: tuple[_Triple, _Triple, tuple[_Triple, ...], str, str],
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
    def needed(self, number: int) -> tuple[_Numbers, _Numbers]: ...
    def part(
        self, number: int, array: npt.NDArray[Any], backend: str, adapter: str | None, threads: int | None
    ) -> bytes: ...
    def is_there(self, folder: str | os.PathLike[str], number: int) -> bool: ...
    def keep(self, folder: str | os.PathLike[str], number: int, bytes: bytes) -> None: ...
    def merge(
        self,
        folder: str | os.PathLike[str],
        blocks: Callable[[_Numbers, _Numbers], npt.NDArray[Any]],
        to: str | os.PathLike[str] | None,
        progress: _Told,
    ) -> Spectrum: ...
