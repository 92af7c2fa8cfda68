"""What kinds of worlds share."""

from __future__ import annotations

from collections.abc import Iterable

ROBOT = {"position_m": [0.0, 0.0, 0.01], "yaw_deg": 0.0}
CLEAR_M = 0.8  # nothing is put nearer to the robot's vertical axis than this


def plain(values: Iterable[float]) -> list[float]:
    """Numbers as a world file has them."""
    return [round(float(v), 4) for v in values]
