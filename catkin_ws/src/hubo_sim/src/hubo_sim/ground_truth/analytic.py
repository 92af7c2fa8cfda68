"""What a camera must see of a plane or a box, by formula: the truth for tests and measurements of the renderers."""

from __future__ import annotations

import numpy as np

from fv_common.transforms import inverse
from hubo_sim.sensors.render import Pinhole


def box_depth(
    camera: Pinhole, T_world_optical: np.ndarray, T_world_box: np.ndarray, size_m: np.ndarray
) -> np.ndarray:
    """(H, W) depth [m] along the optical axis of a box of edge lengths size_m (3,), NaN where the ray misses.

    Slab method: Kay, Kajiya, "Ray Tracing Complex Scenes", SIGGRAPH 1986.
    """
    T = inverse(T_world_box) @ T_world_optical
    rays = camera.rays().reshape(-1, 3)
    origin, direction = T[:3, 3], rays @ T[:3, :3].T
    with np.errstate(divide="ignore"):
        a, b = (-size_m / 2 - origin) / direction, (size_m / 2 - origin) / direction
    near, far = np.minimum(a, b).max(1), np.maximum(a, b).min(1)
    return np.where((near <= far) & (near > 0), near, np.nan).reshape(camera.height, camera.width)


def away_from_edges(depth: np.ndarray, step: float = 0.1) -> np.ndarray:
    """(H, W) whether none of a pixel's eight neighbours misses or differs by more than `step` of its depth."""
    pad = np.pad(depth, 1, mode="edge")
    h, w = depth.shape
    neighbours = np.stack([pad[i : i + h, j : j + w] for i in range(3) for j in range(3)])
    return np.isfinite(neighbours).all(0) & (
        np.ptp(neighbours, axis=0) < step * np.nan_to_num(depth, nan=1.0)
    )
