"""What a map looks like, as points, lines and triangles: for RViz and for pictures alike."""

from __future__ import annotations

import numpy as np

from capability_map.capability_map import CapabilityMap


def index_colors(index_percent: np.ndarray, alpha: float = 1.0) -> np.ndarray:
    """Return (S, 4) colours from red (0 %) over yellow and green to blue (the largest index given)."""
    share = np.asarray(index_percent, float) / max(1e-9, float(np.max(index_percent, initial=0.0)))
    hue = 4.0 * np.clip(share, 0.0, 1.0)  # 0 red, 1 yellow, 2 green, 3 cyan, 4 blue
    red = np.clip(2.0 - hue, 0.0, 1.0)
    green = np.clip(np.minimum(hue, 4.0 - hue), 0.0, 1.0)
    blue = np.clip(hue - 2.0, 0.0, 1.0)
    return np.stack([red, green, blue, np.full_like(red, alpha)], axis=1)


def cut_rows(cap: CapabilityMap, axis: int, at_m: float | None = None) -> np.ndarray:
    """Return the rows of the spheres in the layer across an axis (0 x, 1 y, 2 z) at at_m (default: shoulder)."""
    at = cap.data.reach_center_m[axis] if at_m is None else at_m
    return np.flatnonzero(np.abs(cap.centres[:, axis] - at) <= cap.radius * (1.0 + 1e-9))


def spikes(cap: CapabilityMap, rows: np.ndarray, length: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
    """Return line ends (2 M, 3) from the centre of each sphere towards its valid points, and the row of each line (M,).

    :param length: of a line in radii.
    """
    sphere, point = np.nonzero(cap.valid[rows])
    centers = cap.centres[rows][sphere]
    ends = centers + length * cap.radius * cap.directions[point]
    return np.stack([centers, ends], axis=1).reshape(-1, 3), rows[sphere]


def shape_triangles(
    cap: CapabilityMap, rows: np.ndarray, rule: str = "least_error", segments: int = 16
) -> tuple[np.ndarray, np.ndarray]:
    """Return the surfaces of the shapes of some spheres as triangles (3 M, 3) and the row of each triangle (M,).

    A cone and each half of a double cone is a mantle from the centre; a ring is the band that it covers.
    """
    pieces, owners = [np.zeros((0, 3))], [np.zeros(0, np.int64)]
    for row in rows:
        kind = int(cap.data.shapes[f"{rule}_type"][row])
        axis = cap.data.shapes[f"{rule}_axis"][row].astype(float)
        opening = float(cap.data.shapes[f"{rule}_opening_rad"][row])
        surface = _ring(axis, opening, segments) if kind == 3 else _mantle(axis, opening, segments)
        if kind == 2:
            surface = np.concatenate([surface, -surface])
        pieces.append(cap.centres[row] + cap.radius * surface)
        owners.append(np.full(len(surface) // 3, row))
    return np.concatenate(pieces), np.concatenate(owners)


def _circle(axis: np.ndarray, angle: float, segments: int) -> np.ndarray:
    across = np.cross(axis, np.eye(3)[int(np.argmin(np.abs(axis)))])
    across /= np.linalg.norm(across)
    turn = 2.0 * np.pi * np.arange(segments + 1) / segments
    around = np.cos(turn)[:, None] * across + np.sin(turn)[:, None] * np.cross(axis, across)
    return np.cos(angle) * axis + np.sin(angle) * around


def _mantle(axis: np.ndarray, opening: float, segments: int) -> np.ndarray:
    rim = _circle(axis, opening, segments)
    return np.stack([np.zeros((segments, 3)), rim[:-1], rim[1:]], axis=1).reshape(-1, 3)


def _ring(axis: np.ndarray, opening: float, segments: int) -> np.ndarray:
    upper, lower = _circle(axis, opening, segments), _circle(axis, np.pi - opening, segments)
    first = np.stack([upper[:-1], lower[:-1], lower[1:]], axis=1)
    second = np.stack([upper[:-1], lower[1:], upper[1:]], axis=1)
    return np.concatenate([first, second]).reshape(-1, 3)
