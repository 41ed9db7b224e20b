"""Images of other packages have their samples and their places: a landmark is where the package says it is."""

from __future__ import annotations

import importlib

import isospectrum
import numpy as np
import pytest

from .conftest import blobs

FAST = {"backend": "cpu", "error": 0.4, "progress": False, "check": False}
SHAPE = (9, 10, 12)


@pytest.fixture(scope="module")
def array() -> np.ndarray:
    return blobs(SHAPE)


def top(s: isospectrum.Spectrum) -> np.ndarray:
    """Where the largest sample is."""
    event = s.events[-1]
    assert event["kind"] == "vanish"
    return np.array([event[axis] for axis in "xyz"])


def index_of_top(array: np.ndarray) -> tuple[int, int, int]:
    z, y, x = np.unravel_index(array.argmax(), array.shape)
    return int(x), int(y), int(z)


def test_images_of_itk(array):
    itk = importlib.import_module("itk")
    image = itk.image_from_array(array)
    image.SetSpacing((0.5, 1.0, 2.0))
    image.SetOrigin((10.0, -20.0, 5.0))
    image.SetDirection(itk.matrix_from_array(np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])))
    s = isospectrum.compute(image, **FAST)
    assert s.volume["placement"]["space"] == "LPS" and s.volume["placement"]["unit"] == "mm"
    assert np.allclose(top(s), image.TransformIndexToPhysicalPoint(index_of_top(array)))


def test_images_of_vtk(array):
    core = importlib.import_module("vtkmodules.vtkCommonDataModel")
    support = importlib.import_module("vtkmodules.util.numpy_support")
    image = core.vtkImageData()
    image.SetExtent(3, 14, -2, 7, 0, 8)
    image.SetSpacing(0.5, 1, 2)
    image.SetOrigin(10, -20, 5)
    image.SetDirectionMatrix(0, -1, 0, 1, 0, 0, 0, 0, 1)
    with pytest.raises(isospectrum.InputError, match="without scalars"):
        isospectrum.compute(image, **FAST)
    image.GetPointData().SetScalars(support.numpy_to_vtk(array.ravel(), deep=True))
    s = isospectrum.compute(image, **FAST)
    assert np.allclose(top(s), image.GetPoint(int(array.argmax())))


def test_rectilinear_grids_of_vtk_and_pyvista(array):
    pyvista = importlib.import_module("pyvista")
    grid = pyvista.RectilinearGrid(10 + 0.5 * np.arange(12), -20 + np.arange(10.0), 5 + 2.0 * np.arange(9))
    grid["density"] = array.ravel()
    grid.set_active_scalars("density")
    s = isospectrum.compute(grid, **FAST)
    assert np.allclose(top(s), grid.points[array.argmax()])
    uneven = pyvista.RectilinearGrid(np.arange(12.0) ** 2, np.arange(10.0), np.arange(9.0))
    uneven["density"] = array.ravel()
    uneven.set_active_scalars("density")
    with pytest.raises(isospectrum.InputError, match="axis x, expected evenly spaced"):
        isospectrum.compute(uneven, **FAST)
    structured = pyvista.StructuredGrid(*np.meshgrid(np.arange(3.0), np.arange(3.0), np.arange(3.0)))
    structured["a"] = np.arange(27.0)
    structured.set_active_scalars("a")
    with pytest.raises(isospectrum.InputError, match="vtkStructuredGrid, expected samples on a regular grid"):
        isospectrum.compute(structured, **FAST)


def test_layers_of_napari(array):
    layers = importlib.import_module("napari.layers")
    layer = layers.Image(array, scale=(2, 1, 0.5), translate=(5, -20, 10), rotate=[[1, 0, 0], [0, 0, -1], [0, 1, 0]], name="cells")
    s = isospectrum.compute(layer, **FAST)
    at = np.array(np.unravel_index(array.argmax(), array.shape))
    # The world of napari is z, y, x.
    assert np.allclose(top(s), np.asarray(layer.data_to_world(at))[::-1])
    assert s.volume["name"] == "cells"
    with pytest.raises(isospectrum.InputError, match="a layer of 2 axes"):
        isospectrum.compute(layers.Image(array[0]), **FAST)


def test_grids_of_grid_data(array):
    grid_data = importlib.import_module("gridData")
    grid = grid_data.Grid(array.T.copy(), origin=(10, -20, 5), delta=(0.5, 1, 2))
    s = isospectrum.compute(grid, **FAST)
    i, j, k = index_of_top(array)
    assert np.allclose(top(s), [grid.midpoints[0][i], grid.midpoints[1][j], grid.midpoints[2][k]])
