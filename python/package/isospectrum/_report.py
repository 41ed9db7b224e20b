"""Results of a verification."""

from __future__ import annotations

import json
from typing import Any

import numpy as np

from ._errors import VerificationError


class Report:
    """Result of verifying a spectrum against its volume at random isovalues.

    Attributes
    ----------
    passed : bool
        True if every promise holds.
    failures : list of str
        A sentence for each broken promise.
    data : dict
        The full report, as ``isospectrum verify --json`` prints it.
    """

    def __init__(self, text: str) -> None:
        self.data: dict[str, Any] = json.loads(text)
        self.passed: bool = self.data["passed"]
        self.failures: list[str] = self.data["failures"]

    def __bool__(self) -> bool:
        return self.passed

    def __repr__(self) -> str:
        result = "passed" if self.passed else "failed: " + "; ".join(self.failures)
        return f"<isospectrum.Report of {self.data['volume']}: {result}>"

    def check(self) -> None:
        """Raise :class:`isospectrum.VerificationError` if a promise is broken."""
        if not self.passed:
            raise VerificationError(f"{self.data['volume']}: verification failed: {'; '.join(self.failures)}")

    @property
    def totals(self) -> dict[str, Any]:
        """Sums over all isovalues; distances in voxels."""
        totals: dict[str, Any] = self.data["totals"]
        return totals

    @property
    def rows(self) -> np.ndarray:
        """A structured array with one row per isovalue: expected and actual topology of the mesh."""
        of = [
            (row["isovalue"], row["at_event"], row["n_triangles"], row["expected_components"],
             row["topology"]["components"], row["expected_euler"], row["topology"]["euler"])
            for row in self.data["rows"]
        ]  # fmt: skip
        return np.array(
            of,
            dtype=[("isovalue", "f8"), ("at_event", "?"), ("triangles", "i8"), ("expected_components", "i8"),
                   ("components", "i8"), ("expected_euler", "i8"), ("euler", "i8")],
        )  # fmt: skip
