"""A script as a user writes it, which type checkers check in their strict modes. It also runs."""

from __future__ import annotations

import io
import pathlib
import tempfile

import isospectrum
import numpy as np
import numpy.typing as npt


def field(n: int) -> npt.NDArray[np.float32]:
    z, y, x = np.mgrid[-1 : 1 : n * 1j, -1 : 1 : n * 1j, -1 : 1 : n * 1j]
    a: npt.NDArray[np.float32] = (1 - np.sqrt(x**2 + y**2 + z**2)).astype(np.float32)
    return a


def report(done: float, stage: str) -> None:
    assert 0 <= done <= 1 and stage


def main() -> None:
    a = field(10)
    s = isospectrum.compute(
        a,
        spacing=np.full(3, 0.25),
        origin=(0, np.float64(1), 2.5),
        unit="mm",
        range=np.array([0.1, 0.8]),
        error=np.float32(0.3),
        persistence="2%",
        crop=((0, -1), None, slice(1, None)),
        threads=np.int64(2),
        backend="cpu",
        progress=report,
    )
    low, high = s.range
    m = s.mesh(np.float32(0.5), keep="largest", ids=True)
    several = s.mesh([0.2, "50%", np.float64(0.7)])
    numbers = [one.n_triangles for one in several] + [one.n_vertices for one in s.sweep(3, low, high, open=True)]
    vertices, faces, normals, values = m
    edges: npt.NDArray[np.int32] = m.faces[:, :2]
    ids: npt.NDArray[np.uint32] = m.triangle_ids
    box: npt.NDArray[np.float64] = m.bounds
    total: float = m.area + m.volume + m.isovalue + float(box.sum())
    print(len(vertices), len(faces), len(normals), len(values), len(edges), len(ids), numbers, round(total))
    heights: npt.NDArray[np.float64] = m.sample(a, spacing=0.25)
    curves = s.curves(5, range=("10%", "90%"))
    print(heights.shape, curves["area"].shape, s.events.dtype.names, s.components(0.5)["volume"])
    path = s.trajectory(int(m.vertex_ids[0]))
    lives = s.lifetimes("vertices")
    print(len(path), lives["birth"].min(), [x.reason for x in isospectrum.analyze(a).suggestions])
    out = (np.empty((5000, 3), np.float32), np.empty((9000, 3), np.int32), np.empty((5000, 3), np.float32))
    filled: npt.NDArray[np.int32] = s.mesh(0.5, out=out)[1]
    print(len(filled), sum(len(corners) for _, corners, _ in s.sweep(3, low, high, out=out, keep=1)))
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        table = s.extract(folder / "m-%d.ply", sweep=("20%", np.float64(0.7), 3), color_by=a, color_range=("p5", None), progress=False)
        s.film(folder / "f-%d.png", {0.5: (1.0, 0.0, 0.0)}, turntable=2, size=np.array([32, 32]), background="dark", progress=False)
        print(table["file"].tolist())
        m.save(folder / "m.stl")
        s.save(folder / "s.isp")
        again: isospectrum.Spectrum = isospectrum.open(folder / "s.isp")
        page = again.html(c={0.5: (1.0, 0.0, 0.0), "20%": "bone@0.5"}, marks={"half": "50%"}, still=False)
        assert page is not None and again.html(folder / "s.html", still=False) is None
    m.save(io.BytesIO(), format="ply")
    found: isospectrum.Report = s.verify(a, n=2, spacing=0.25, progress=False)
    try:
        found.check()
    except isospectrum.VerificationError as error:
        print(error)


if __name__ == "__main__":
    main()
