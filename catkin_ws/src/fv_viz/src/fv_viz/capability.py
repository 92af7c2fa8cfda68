"""Drawing of a capability map: spheres as spikes, reachability index in cuts, fitted shapes. Arrays in, markers out."""

from __future__ import annotations

import itertools

import numpy as np
from std_msgs.msg import Header
from visualization_msgs.msg import Marker

from fv_viz import colors, packing, shapes

SCALE = "green_red"  # of the reachability index: red is reachable from everywhere, as in the thesis (3.3)


def index_colors(valid: np.ndarray) -> np.ndarray:
    """Colours (S, 3) of spheres by their reachability index D, from their valid points (S, N)."""
    return colors.scale(SCALE, valid.mean(axis=1))


def spikes(
    header: Header, centers, valid, directions, radius: float, namespace: str = "spheres"
) -> list[bytes]:
    """A line for each valid point of each sphere.

    centers (S, 3) [m], valid (S, N) bool, directions (N, 3) outward unit vectors, radius [m].
    """
    rows, columns = np.nonzero(valid)
    ends = np.stack([centers[rows], centers[rows] + 0.9 * radius * directions[columns]], axis=1).reshape(
        -1, 3
    )
    rgba = np.column_stack([index_colors(valid), np.ones(len(valid))])[np.repeat(rows, 2)]
    return [shapes.lines(header, namespace, ends, rgba, 0.06 * radius)]


def balls(header: Header, centers, valid, radius: float, namespace: str = "index") -> list[bytes]:
    """A ball for each sphere, coloured by its reachability index."""
    out = shapes.marker(header, namespace, Marker.SPHERE_LIST, (1, 1, 1))
    out.scale.x = out.scale.y = out.scale.z = 1.6 * radius
    rgba = np.column_stack([index_colors(valid), np.ones(len(valid))])
    return [packing.pack_marker(out, centers, rgba)]


def structure(
    header: Header, center, axis, opening: float, kind: str, radius: float, color, number: int = 0
) -> bytes:
    """The structure of one sphere as translucent triangles: a cone, or two that bound a double cone or a ring.

    center (3,) [m], axis (3,) of unit length, opening: angle between axis and sheet [rad].
    """
    side = np.cross(axis, [1.0, 0.0, 0.0] if abs(axis[0]) < 0.9 else [0.0, 1.0, 0.0])
    side /= np.linalg.norm(side)
    turn = np.linspace(0.0, 2.0 * np.pi, 37)[:, None]
    rim = np.cos(opening) * axis + np.sin(opening) * (
        np.cos(turn) * side + np.sin(turn) * np.cross(axis, side)
    )
    sheets = [rim] if kind == "cone" else [rim, -rim]
    zero = np.zeros(3)
    triangles = [[zero, a, b] for sheet in sheets for a, b in itertools.pairwise(sheet)]
    out = shapes.marker(header, "shapes", Marker.TRIANGLE_LIST, color, 0.35, number)
    return packing.pack_marker(out, np.asarray(center) + 1.25 * radius * np.array(triangles).reshape(-1, 3))


def near_rows(centers: np.ndarray, origin: np.ndarray, radius: float, count: int = 2) -> np.ndarray:
    """Mask (S,) of `count` rows of spheres along x: those nearest to the origin in y and z."""
    rows = np.round((centers[:, 1:] - origin[1:]) / (2.0 * radius)).astype(int)
    keys, inverse = np.unique(rows, axis=0, return_inverse=True)
    sizes = np.bincount(inverse.ravel())
    order = np.lexsort((-sizes, np.abs(keys[:, 0]) + np.abs(keys[:, 1])))
    return np.isin(inverse.ravel(), order[:count])
