"""Scenes of boxes for tests and benchmarks, in the world frame [m]: rows are min x y z, max x y z."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np


@dataclass(frozen=True)
class Scene:
    """Boxes that are known free, occupied, or unknown; later lists overwrite earlier ones."""

    free: list[list[float]]
    occupied: list[list[float]]
    unknown: list[list[float]] = field(default_factory=list)
    resolution_m: float = 0.02

    def arrays(self) -> dict[str, np.ndarray]:
        """Arguments of ``_core.octree_payload``."""
        rows = {
            name: np.reshape(getattr(self, name), (-1, 6)).astype(float)
            for name in ("free", "occupied", "unknown")
        }
        return {"resolution_m": self.resolution_m, **rows}


def shelf() -> Scene:
    """A shelf with four compartments in reach; two of them, and all behind it, were never seen."""
    boards = [[0.50, -0.80, z, 0.90, 0.30, z + 0.02] for z in (0.60, 0.92, 1.24, 1.56)]
    sides = [[0.50, y, 0.60, 0.90, y + 0.02, 1.58] for y in (-0.82, -0.26, 0.30)]
    back = [[0.90, -0.82, 0.60, 0.92, 0.32, 1.58]]
    objects = [[0.62, -0.60, 0.94, 0.74, -0.48, 1.06], [0.65, 0.00, 0.94, 0.80, 0.12, 1.12]]
    unknown = [[0.60, -0.80, 0.62, 0.90, -0.26, 0.92], [0.60, -0.24, 1.26, 0.90, 0.30, 1.56]]
    free = [[-1.00, -1.20, 0.20, 0.90, 1.20, 1.90]]
    return Scene(free, [*boards, *sides, *back, *objects], unknown)


def office() -> Scene:
    """A desk with a monitor and a box on it, and a cabinet whose door stands open, half seen."""
    desk = [[0.45, -0.60, 0.58, 1.00, 0.70, 0.62]]
    things = [[0.75, -0.10, 0.62, 0.80, 0.45, 1.00], [0.50, -0.45, 0.62, 0.65, -0.30, 0.80]]
    cabinet = [
        [0.10, -1.00, 0.30, 0.60, -0.98, 1.60],
        [0.10, -1.00, 0.30, 0.12, -0.72, 1.60],
        [0.58, -1.00, 0.30, 0.60, -0.72, 1.60],
        [0.12, -0.98, 1.00, 0.58, -0.72, 1.02],
        [0.60, -0.74, 0.70, 0.98, -0.72, 1.60],
    ]
    unknown = [[0.12, -0.98, 1.02, 0.34, -0.80, 1.60], [0.82, -0.30, 0.62, 1.20, 0.70, 1.20]]
    free = [[-1.00, -1.20, 0.20, 1.00, 1.20, 1.90]]
    return Scene(free, [*desk, *things, *cabinet], unknown)


SCENES = {"shelf": shelf, "office": office}
