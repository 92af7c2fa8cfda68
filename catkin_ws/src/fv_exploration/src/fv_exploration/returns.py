"""What of scans a map could not use, in words: for recorded scans and live ones alike."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from fv_exploration._core import FARTHEST_RETURN_M, NEAREST_RETURN_M, ScanConfig

SENSIBLE_M = (NEAREST_RETURN_M, FARTHEST_RETURN_M)
"""Between which two magnitudes a coordinate lies that a sensor gives, unless it is 0."""

MILLIMETRES = (300.0, 20_000.0)
"""Where the middle of a depth camera's or a room scanner's ranges lies when they are in millimetres."""


class Returns:
    """Counts of scans as ``insert_scan`` gives them, and the ranges of their returns.

    :param limits: the ``ScanConfig`` that the scans were inserted with.
    """

    def __init__(self, limits: ScanConfig) -> None:
        self._limits = limits
        self._scans = 0
        self._counts: Counter[str] = Counter()
        self._ranges: list[NDArray[np.float64]] = []  # nearest, middle and farthest [m] of scans

    def add(self, points: NDArray[np.float64], counts: Mapping[str, int]) -> None:
        """A scan: its points (N, 3), sensor frame [m], and what became of them."""
        self._scans += 1
        self._counts.update(counts)
        if counts["hits"] >= max(1, counts["far"]):
            return  # the ranges are of interest only where most of them are wrong
        with np.errstate(over="ignore", invalid="ignore"):
            ranges = np.linalg.norm(points, axis=1)
        ranges = ranges[np.isfinite(ranges)]
        if len(ranges):
            self._ranges.append(np.array([ranges.min(), np.median(ranges), ranges.max()]))

    def counts(self) -> dict[str, int]:
        """Points by what became of them, over all scans."""
        names = ("points", "hits", "no_return", "absurd", "near", "far", "outside", "filtered")
        return {name: self._counts[name] for name in names}

    def problem(self) -> str:
        """Why there is no usable return; empty when there is one."""
        if self._counts["hits"]:
            return ""
        scans = f"{self._scans} scans" if self._scans != 1 else "a scan"
        text = f"no usable return in {scans} of {self._counts['points']} points"
        reasons = [
            f"{self._counts[name]} {why}" for name, why in self._reasons().items() if self._counts[name]
        ]
        text += f": {', '.join(reasons)}" if reasons else ""
        if self._ranges:
            near, middle, far = self._range()
            text += f"; ranges are {near:.4g} to {far:.4g} m, half of them below {middle:.4g} m"
        low, high = self._limits.min_range_m, self._limits.max_range_m
        return f"{text}; valid: {low:g} to {high:g} m{self._suspicion()}"

    def warnings(self) -> list[str]:
        """What was left out although the sensor gave it: a line each."""
        names = ("absurd", "outside", "filtered")
        return [self._line(name, "left out") for name in names if self._counts[name]]

    def clipped(self) -> list[str]:
        """A line if most of the returns lie beyond the range that is mapped."""
        far = self._counts["far"]
        if 2 * far <= far + self._counts["hits"]:
            return []
        return [self._line("far", "they clear space up to there, no more") + self._suspicion()]

    def _line(self, name: str, done: str) -> str:
        count, points = self._counts[name], self._counts["points"]
        return (
            f"{count} of {points} points ({100 * count / points:.3g} %) are {self._reasons()[name]}: {done}"
        )

    def _reasons(self) -> dict[str, str]:
        return {
            "no_return": "without return",
            "absurd": f"nearer than {NEAREST_RETURN_M:g} m or farther than {FARTHEST_RETURN_M:g} m, as no sensor sees",
            "near": f"nearer than {self._limits.min_range_m:g} m",
            "far": f"farther than {self._limits.max_range_m:g} m",
            "outside": "beyond what an octree of this resolution can hold",
            "filtered": "outliers",
        }

    def _range(self) -> NDArray[np.float64]:
        """Nearest, middle and farthest [m]; the middle is that of the scans' middles."""
        every = np.array(self._ranges)
        return np.array([every[:, 0].min(), np.median(every[:, 1]), every[:, 2].max()])

    def _suspicion(self) -> str:
        if not self._ranges or not MILLIMETRES[0] <= self._range()[1] <= MILLIMETRES[1]:
            return ""
        return "; they look like millimetres: valid are metres"
