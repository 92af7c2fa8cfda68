"""What a map looks like, as points, lines and triangles: for RViz and for pictures alike."""

from __future__ import annotations

import matplotlib
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from capability_map.capability_map import CapabilityMap

INDEX_SCALE = "viridis_r"  # of matplotlib: light for 0 to dark; its lightness alone keeps the order

INDEX_LABEL = "reachability index [%]"


def index_colors(index_percent: np.ndarray, alpha: float = 1.0) -> np.ndarray:
    """Return (S, 4) colours from light (0 %) to dark (the largest index given); the same in RViz and in pictures."""
    share = np.asarray(index_percent, float) / max(1e-9, float(np.max(index_percent, initial=0.0)))
    rgba = matplotlib.colormaps[INDEX_SCALE](np.clip(share, 0.0, 1.0))
    rgba[:, 3] = alpha
    return rgba


def index_scale(largest_percent: float) -> ScalarMappable:
    """Return the scale of index_colors as matplotlib's colour bars want it."""
    return ScalarMappable(Normalize(0.0, max(largest_percent, 1e-9)), INDEX_SCALE)


def index_legend(largest_percent: float, width_px: int = 420, height_px: int = 264) -> np.ndarray:
    """Return the scale of index_colors from 0 to the largest index as a picture, (height, width, 3) uint8."""
    figure = Figure(figsize=(width_px / 100, height_px / 100), dpi=100)
    place = figure.add_axes([0.05, 0.7, 0.9, 0.14])
    figure.colorbar(index_scale(largest_percent), cax=place, orientation="horizontal", label=INDEX_LABEL)
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    return np.asarray(canvas.buffer_rgba())[..., :3].copy()


def cut_rows(cap: CapabilityMap, axis: int, at_m: float | None = None) -> np.ndarray:
    """Return the rows of the spheres in the layer across an axis (0 x, 1 y, 2 z) at at_m (default: shoulder)."""
    at = cap.data.reach_center_m[axis] if at_m is None else at_m
    return np.flatnonzero(np.abs(cap.centres[:, axis] - at) <= cap.radius * (1.0 + 1e-9))


def two_rows(cap: CapabilityMap) -> np.ndarray:
    """Return the rows of the spheres along x at the shoulder's y: at its height and a quarter arm length below."""
    layer = cut_rows(cap, 1)
    heights = cap.data.reach_center_m[2] - np.array([0.0, 0.25 * cap.data.arm_length_m])
    near = [np.abs(cap.centres[layer, 2] - height) <= cap.radius * (1.0 + 1e-9) for height in heights]
    return layer[near[0] | near[1]]


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
