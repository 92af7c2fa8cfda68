"""Where RViz's orbit camera must stand so that given points fill the picture."""

from __future__ import annotations

import numpy as np

HALF_VIEW = np.tan(np.deg2rad(45.0) / 2.0)  # of the height; Ogre's camera, which RViz leaves as it is
MARGIN = 0.94  # share of the picture that the points may take


def orbit(points: np.ndarray, yaw: float, pitch: float, aspect: float, cut_m: float = np.inf) -> list[float]:
    """The nearest orbit camera that sees all points: distance, yaw, pitch, focal point x y z, near clip distance.

    points (N, 3) [m], N > 0; yaw, pitch [rad] as RViz names them; aspect: width over height of the picture;
    cut_m: what lies further than this in front of the middle of the points is left out.

    With the axes of the camera a point (a, b, c) is inside when |a - a0| <= t (c0 - c), and so for b: each side of
    the picture gives one linear bound of the camera's place (a0, b0, c0).
    """
    cy, sy, cp, sp = np.cos(yaw), np.sin(yaw), np.cos(pitch), np.sin(pitch)
    axes = np.array([[-sy, cy, 0.0], [-cy * sp, -sy * sp, cp], [cy * cp, sy * cp, sp]])  # right, up, back
    a, b, c = axes @ np.asarray(points, dtype=float).reshape(-1, 3).T
    place, back = np.zeros(3), []
    for row, (values, half) in enumerate(((a, HALF_VIEW * MARGIN * aspect), (b, HALF_VIEW * MARGIN))):
        upper, lower = (values + half * c).max(), (-values + half * c).max()
        place[row] = (upper - lower) / 2.0
        back.append((upper + lower) / (2.0 * half))
    place[2] = (c.min() + c.max()) / 2.0
    distance = max(*back, c.max() + 0.05) - place[2]
    near = max(distance - cut_m, 0.01)
    return [float(distance), yaw, pitch, *(float(k) for k in axes.T @ place), float(near)]


def corners(low, high) -> np.ndarray:
    """Corners (8, 3) of the box from low (3,) to high (3,)."""
    return np.array(np.meshgrid(*zip(low, high, strict=True))).reshape(3, -1).T
