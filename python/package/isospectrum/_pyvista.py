"""Entry points for PyVista (0.48 and later): ``image.isospectrum.compute()`` and ``pyvista.read("x.isp")``."""

from __future__ import annotations

from typing import Any, cast

import pyvista

import isospectrum

from ._isovalue import Isovalue


@pyvista.register_dataset_accessor("isospectrum", pyvista.ImageData)
class ImageAccessor:
    """The spectrum of an image's scalars."""

    def __init__(self, image: pyvista.ImageData) -> None:
        self._image = image

    def compute(self, scalars: str | None = None, **options: Any) -> isospectrum.Spectrum:
        """Compute the spectrum of the active scalars, or of those named ``scalars``; ``options`` are those of
        :func:`isospectrum.compute`."""
        options.setdefault("name", scalars or self._image.active_scalars_name)
        return isospectrum.compute(self._image, array=scalars, **options)


def read(path: str, isovalue: Isovalue | None = None, **options: Any) -> pyvista.PolyData:
    """The mesh of a spectrum file at an isovalue, by default the one at which a page opens; ``options`` are those of
    :meth:`isospectrum.Spectrum.mesh`."""
    mesh = cast("isospectrum.Mesh", isospectrum.open(path).mesh(isovalue, **options))
    return mesh.to_pyvista()
