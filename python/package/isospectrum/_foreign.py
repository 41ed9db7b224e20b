"""Images of VTK, ITK, napari, gridData, and data sets of several arrays. No package is imported that the user has not imported already."""

from __future__ import annotations

from typing import Any

import numpy as np

from ._errors import InputError, UsageError
from ._frame import Frame, even, triple

#: Names of units of napari and ours.
UNITS = {"nanometer": "nm", "micrometer": "um", "millimeter": "mm", "centimeter": "cm", "meter": "m"}


def array_and_frame(source: Any) -> tuple[Any, Frame] | None:
    """The array ``[z, y, x]`` and the frame of an image; ``None`` for another object."""
    if hasattr(source, "GetLargestPossibleRegion") and hasattr(source, "GetDirection"):
        return of_itk(source)
    if hasattr(source, "GetPointData") and hasattr(source, "GetDimensions"):
        return of_vtk(source)
    if hasattr(source, "as_layer_data_tuple"):
        return of_napari(source)
    if hasattr(source, "grid") and hasattr(source, "delta") and hasattr(source, "origin"):
        return of_grid_data(source)
    return None


def of_itk(image: Any) -> tuple[np.ndarray, Frame]:
    """An image of ITK: LPS, millimetres."""
    if image.GetImageDimension() != 3 or image.GetNumberOfComponentsPerPixel() != 1:
        raise InputError(
            f"an image of {image.GetImageDimension()} axes and {image.GetNumberOfComponentsPerPixel()} numbers a sample, expected 3 and 1"
        )
    direction = image.GetDirection().GetVnlMatrix()
    matrix = [[direction.get(row, column) for column in range(3)] for row in range(3)]
    spacing = tuple(float(s) for s in image.GetSpacing())
    return np.asarray(image), Frame.of_matrix([float(x) for x in image.GetOrigin()], matrix, spacing=spacing, space="LPS", unit="mm")


def of_vtk(grid: Any) -> tuple[np.ndarray, Frame]:
    """The scalars of the points of a vtkImageData or a vtkRectilinearGrid with even coordinates."""
    from vtkmodules.util.numpy_support import vtk_to_numpy

    if not hasattr(grid, "GetDirectionMatrix") and not hasattr(grid, "GetXCoordinates"):
        raise InputError(f"a {grid.GetClassName()}, expected samples on a regular grid: pyvista's sample() makes a vtkImageData")
    scalars = grid.GetPointData().GetScalars()
    if scalars is None:
        raise InputError(f"a {grid.GetClassName()} without scalars of points, expected some: GetPointData().SetActiveScalars(name)")
    if scalars.GetNumberOfComponents() != 1:
        raise InputError(f"scalars of {scalars.GetNumberOfComponents()} numbers a sample, expected one")
    array = vtk_to_numpy(scalars).reshape(tuple(grid.GetDimensions())[::-1])
    if hasattr(grid, "GetXCoordinates"):
        along = [vtk_to_numpy(axis) for axis in (grid.GetXCoordinates(), grid.GetYCoordinates(), grid.GetZCoordinates())]
        ends = [even(name, one) for name, one in zip("xyz", along)]
        axes = np.diag([np.sign(step) for _, step in ends])
        return array, Frame.of_matrix([first for first, _ in ends], axes, spacing=tuple(abs(step) for _, step in ends))
    direction = grid.GetDirectionMatrix()
    matrix = np.array([[direction.GetElement(row, column) for column in range(3)] for row in range(3)])
    spacing, extent = np.array(grid.GetSpacing()), grid.GetExtent()
    origin = np.array(grid.GetOrigin()) + matrix @ (spacing * np.array(extent[::2]))
    return array, Frame.of_matrix(origin, matrix, spacing=tuple(spacing.tolist()))


def of_napari(layer: Any) -> tuple[Any, Frame]:
    """An image or labels layer of napari ``[z, y, x]``, with its place in the world."""
    data = layer.data
    if getattr(layer, "rgb", False) or getattr(data, "ndim", 0) != 3:
        raise InputError(f"a layer of {getattr(data, 'ndim', 0)} axes, expected 3 without colours: z, y, x")
    origin = np.asarray(layer.data_to_world((0, 0, 0)))
    # Columns are the steps along z, y, x; all are turned to x, y, z.
    steps = np.stack([np.asarray(layer.data_to_world(one)) - origin for one in np.eye(3)], axis=1)[::-1, ::-1]
    spacing = np.linalg.norm(steps, axis=0)
    units = {str(unit) for unit in getattr(layer, "units", None) or ()}
    unit = UNITS.get(units.pop(), "") if len(units) == 1 else ""
    return data, Frame.of_matrix(origin[::-1], steps / spacing, spacing=tuple(spacing.tolist()), unit=unit)


def of_grid_data(grid: Any) -> tuple[np.ndarray, Frame]:
    """A grid of gridData ``[x, y, z]``."""
    delta = np.asarray(grid.delta, dtype=float)
    if delta.ndim == 2:
        if np.any(delta != np.diag(np.diag(delta))):
            raise InputError(f"a grid with steps {delta.tolist()}, expected perpendicular axes")
        delta = np.diag(delta)
    return np.asarray(grid.grid).T, Frame(triple(grid.origin, "origin"), triple(delta, "spacing"))


def has_named_arrays(source: Any) -> bool:
    """True for a data set of xarray or an image of PyVista, which hold several arrays."""
    return hasattr(source, "data_vars") or (hasattr(source, "set_active_scalars") and hasattr(source, "array_names"))


def named(source: Any, name: str | None) -> Any:
    """One of several arrays by its name; without a name the only one of a data set, or the active one of an image."""
    if hasattr(source, "data_vars"):
        names = [str(key) for key in source.data_vars]
        if name is None and len(names) == 1:
            name = names[0]
        if name not in names:
            given = "no array=" if name is None else f"array {name!r}"
            raise UsageError(f"{given}, expected one of the data set's {', '.join(names) or 'arrays, of which there are none'}")
        return source[name]
    if name is None:
        return source
    if name not in source.array_names:
        raise UsageError(f"array {name!r}, expected one of {', '.join(source.array_names)}")
    source = source.copy(deep=False)
    source.set_active_scalars(name)
    return source
