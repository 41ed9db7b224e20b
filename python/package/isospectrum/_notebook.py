"""Spectra and meshes as notebooks show them: a picture where there is a GPU adapter, the main numbers, and a curve."""

from __future__ import annotations

import base64
import html
from typing import Any

import numpy as np

from ._errors import GpuError

#: Isovalues of the curve: enough for its shape.
N_CURVE = 33

#: Width and height of pictures and of the curve, pixels.
PICTURE, CURVE = (240, 180), (240, 60)


def of_spectrum(spectrum: Any) -> str:
    """A :class:`isospectrum.Spectrum`: its picture at the isovalue at which a page opens, its range, its counts, and the area by isovalue."""
    about, (low, high) = spectrum.volume, spectrum.range
    unit = "" if str(about["placement"]["unit"]).lower() == "unknown" else f" {about['placement']['unit']}"
    rows = [
        ("volume", f"{about['name']}, {' x '.join(map(str, about['dims']))} {about['sample_type']}"),
        ("spacing", ", ".join(f"{s:g}" for s in about["placement"]["spacing"]) + unit),
        ("range", f"{low:g} to {high:g}"),
        ("triangles, events", f"{spectrum.n_triangles}, {len(spectrum.events)}"),
        ("tolerance", f"{spectrum.tolerance:g} voxel"),
    ]
    curves = spectrum.curves(N_CURVE)
    shown = f"isovalue {spectrum.isovalue():g}"
    return _page(_picture(spectrum, shown), _table(rows) + _curve(curves["isovalue"], curves["area"], "area by isovalue"))


def of_mesh(mesh: Any) -> str:
    """A :class:`isospectrum.Mesh`: its isovalue, its counts and measures."""
    sizes = " x ".join(f"{size:.4g}" for size in np.ptp(mesh.bounds, axis=0))
    rows = [
        ("isovalue", f"{mesh.isovalue:g}"),
        ("vertices, triangles", f"{mesh.n_vertices}, {mesh.n_triangles}"),
        ("components, Euler characteristic", f"{mesh.n_components}, {mesh.euler}"),
        ("area", f"{mesh.area:.6g}"),
        ("volume", f"{mesh.volume:.6g}" if mesh.is_closed else "open"),
        ("size", sizes if mesh.n_vertices else "empty"),
    ]
    return _page("", _table(rows))


def _page(left: str, right: str) -> str:
    return f'<div style="display:flex;gap:1em;align-items:center">{left}<div>{right}</div></div>'


def _table(rows: list[tuple[str, str]]) -> str:
    cells = (f"<tr><th style='text-align:left'>{html.escape(name)}</th><td>{html.escape(value)}</td></tr>" for name, value in rows)
    return f"<table>{''.join(cells)}</table>"


def _picture(spectrum: Any, title: str) -> str:
    if spectrum._picture is None:
        try:
            png = spectrum.render(size=PICTURE)._repr_png_() or b""
        except GpuError:
            png = b""
        object.__setattr__(spectrum, "_picture", base64.b64encode(png).decode())
    width, height = PICTURE
    if not spectrum._picture:
        return ""
    return f'<img width="{width}" height="{height}" alt="{title}" title="{title}" src="data:image/png;base64,{spectrum._picture}">'


def _curve(x: Any, y: Any, title: str) -> str:
    """A line as SVG."""
    width, height = CURVE
    across = np.interp(x, [x[0], x[-1]], [0, width]) if x[-1] > x[0] else np.zeros(len(x))
    up = height - 1 - (height - 2) * y / max(float(np.max(y)), 1e-300)
    points = " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(across, up))
    line = f'<polyline points="{points}" fill="none" stroke="currentColor"/>'
    return f'<svg width="{width}" height="{height}" role="img" aria-label="{title}"><title>{title}</title>{line}</svg>'
