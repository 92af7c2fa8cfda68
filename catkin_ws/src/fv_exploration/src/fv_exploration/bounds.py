"""The volume to explore: in another frame, and whether it can be explored at all. Free of ROS."""

from __future__ import annotations

import os
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fv_exploration.explore_config import ExploreConfig

Array = NDArray[np.float64]
Bounds = tuple[Array, Array]
"""Corners (3,) [m]: minimum, maximum."""

VOXEL_BYTES = 16
"""That a voxel of the bounds costs in the map and its evaluation: measured, 0.1 to 100 million of them."""
MEMORY_SHARE = 0.5
"""Of the machine's memory, that the bounds may cost."""
AXES_TOLERANCE = 1e-6
"""Of the entries of a rotation matrix that is to map axes to axes."""


@dataclass(frozen=True)
class Volume:
    """The volume to explore: corners (3,) [m] of the map frame, and what was changed to get it, in words."""

    bounds: Bounds
    warnings: tuple[str, ...] = ()


def enclosing_box(bounds: Bounds, T_map_frame: Array, frame: str, map_frame: str) -> Volume:
    """The smallest box along the map frame's axes that holds the bounds of another frame.

    That is the same box when its axes fall on those of the map frame; else it is larger, which is said.
    """
    rotation = T_map_frame[:3, :3]
    whole = np.rint(rotation)
    aligned = bool(np.abs(rotation - whole).max() <= AXES_TOLERANCE)
    turn = whole if aligned else rotation
    centre = turn @ (bounds[0] + bounds[1]) / 2 + T_map_frame[:3, 3]
    half = np.abs(turn) @ (bounds[1] - bounds[0]) / 2
    box = centre - half, centre + half
    if aligned:
        return Volume(box)
    growth = float(np.prod(box[1] - box[0]) / np.prod(bounds[1] - bounds[0]))
    return Volume(
        box,
        (
            f"the bounds are given in frame '{frame}', which is turned against '{map_frame}': the box around them, "
            f"{shown(box)} in '{map_frame}', is explored; it is {growth:.2f} times as large",
        ),
    )


def require_sensible_size(bounds: Bounds, config: ExploreConfig) -> None:
    """ValueError for bounds that no memory holds, or in which no view can be worth a motion."""
    with np.errstate(over="ignore", invalid="ignore"):
        sides = bounds[1] - bounds[0]
        voxels, volume_m3 = float(np.prod(sides / config.map.resolution_m)), float(np.prod(sides))
    size = " x ".join(f"{side:g}" for side in sides)
    memory = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    if not voxels * VOXEL_BYTES <= memory * MEMORY_SHARE:  # NaN, too: from corners whose distance overflows
        raise ValueError(
            f"bounds of {size} m hold {voxels:.2g} voxels of {config.map.resolution_m:g} m, which cost some "
            f"{voxels * VOXEL_BYTES / 2**30:.3g} GiB; valid: at most half of this machine's {memory / 2**30:.3g} GiB. "
            "Are the bounds in metres? Larger voxels (map/resolution_m) cost less"
        )
    if volume_m3 < config.views.min_gain_m3:
        raise ValueError(
            f"bounds of {size} m hold {volume_m3:.2g} m^3, less than a view must show anew to be worth a motion "
            f"(views/min_gain_m3 is {config.views.min_gain_m3:g}); valid: larger bounds, in metres"
        )


def shown(bounds: Bounds) -> str:
    """Corners as people write them."""
    return " to ".join(f"({', '.join(f'{value:.4g}' for value in corner)})" for corner in bounds)
