"""Since which view each voxel of a bounded map has been known."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

NEVER = -1


class KnownSince:
    """A dense grid over the exploration volume that remembers the view at which each voxel became known.

    :param bounds_min, bounds_max: corners (3,) [m] of the volume.
    :param resolution_m: edge of a voxel; voxel k of an axis spans k * resolution to (k + 1) * resolution.
    """

    def __init__(self, bounds_min: Array, bounds_max: Array, resolution_m: float) -> None:
        self._first = np.floor(np.asarray(bounds_min) / resolution_m + 1e-6).astype(int)
        last = np.ceil(np.asarray(bounds_max) / resolution_m - 1e-6).astype(int)
        axes = [np.arange(a, b) for a, b in zip(self._first, last, strict=True)]
        self._resolution_m = resolution_m
        self._centres = (np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 3) + 0.5) * resolution_m
        self._shape = tuple(last - self._first)
        self._views = np.full(len(self._centres), NEVER, dtype=np.int16)

    def update(self, view: int, classify: Callable[[Array], NDArray[np.int8]]) -> None:
        """Note what is known after a view; ``classify`` gives -1 for unknown centres (N, 3)."""
        open_rows = np.nonzero(self._views == NEVER)[0]
        known = classify(self._centres[open_rows]) >= 0
        self._views[open_rows[known]] = view

    def write(self, path: Path) -> None:
        """An npz with ``first_key`` (3,), ``resolution`` and ``view`` (X, Y, Z) int16, -1 where never known."""
        np.savez_compressed(
            path,
            first_key=self._first,
            resolution=self._resolution_m,
            view=self._views.reshape(self._shape),
        )
