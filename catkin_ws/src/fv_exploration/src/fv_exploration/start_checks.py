"""What of the robot and of its clearance lies outside of the bounds, where all is unknown and counts as an obstacle."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from fv_exploration.bounds import Bounds, shown

Array = NDArray[np.float64]
ROUND_M = 0.05
"""Bounds that are proposed lie on whole multiples of this."""


def body_outside(balls: Mapping[str, Array], bounds: Bounds) -> str:
    """Says which links lie outside of the bounds, and which bounds would hold them; empty when none does.

    :param balls: by link, (S, 4) centre [m] and radius [m] in the map frame, of the links that are to move.
    """
    low, high = bounds
    outside = [link for link, rows in balls.items() if ((rows[:, :3] < low) | (rows[:, :3] > high)).any()]
    if not outside:
        return ""
    rows = np.concatenate([balls[link] for link in outside])
    lows = np.minimum((rows[:, :3] - rows[:, 3:]).min(axis=0), low)
    highs = np.maximum((rows[:, :3] + rows[:, 3:]).max(axis=0), high)
    wider = np.floor(lows / ROUND_M) * ROUND_M, np.ceil(highs / ROUND_M) * ROUND_M
    return (
        f"the bounds {shown(bounds)} leave {_links(outside)} outside, where all is unknown and counts as an obstacle; "
        f"bounds that hold the arm as it stands: {shown(wider)}"
    )


def camera_outside(position: Array, bounds: Bounds) -> str:
    """Says that the camera's optical centre (3,) [m] lies outside of the bounds; empty when it does not."""
    if ((position >= bounds[0]) & (position <= bounds[1])).all():
        return ""
    where = ", ".join(f"{value:.2f}" for value in position)
    return f"the camera stands at ({where}), outside of the bounds {shown(bounds)}"


def clearance_outside(voxels: Array, bounds: Bounds) -> str:
    """Says how much of the clearance, voxel centres (N, 3) [m], lies outside of the bounds; empty when none does."""
    outside = ((voxels < bounds[0]) | (voxels > bounds[1])).any(axis=1)
    if not outside.any():
        return ""
    share = 100 * outside.mean()
    return (
        f"{share:.0f} % of the clearance that robot.yaml vouches for lie outside of the bounds {shown(bounds)} and "
        "stay unknown"
    )


def _links(names: list[str]) -> str:
    quoted = ", ".join(f"'{name}'" for name in names[:6])
    more = f" and {len(names) - 6} more" if len(names) > 6 else ""
    return f"link{'s' if len(names) > 1 else ''} {quoted}{more}"
