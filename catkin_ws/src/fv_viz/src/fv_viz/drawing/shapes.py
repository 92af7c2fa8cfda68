"""Ordinary markers: ellipsoids, camera pyramids, boxes, texts. All of them in the frame of the header given."""

from __future__ import annotations

import numpy as np
from geometry_msgs.msg import Point, Pose, Quaternion, Vector3
from std_msgs.msg import ColorRGBA, Header
from visualization_msgs.msg import Marker

from fv_viz.drawing import packing

# Corner order of a unit box and its edges.
_BOX_CORNERS = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=float)
_BOX_EDGES = [(0, 1), (0, 2), (0, 4), (1, 3), (1, 5), (2, 3), (2, 6), (3, 7), (4, 5), (4, 6), (5, 7), (6, 7)]
# Lines of a camera pyramid: apex 0, corners 1 (left up) 2 (right up) 3 (right down) 4 (left down), 5 the tip of the
# mark that says where up is.
_PYRAMID_EDGES = [(0, 1), (0, 2), (0, 3), (0, 4), (1, 2), (2, 3), (3, 4), (4, 1), (1, 5), (2, 5)]
_PYRAMID_FACES = [(0, 1, 2), (0, 2, 3), (0, 3, 4), (0, 4, 1)]


def marker(header: Header, namespace: str, kind: int, color, alpha: float = 1.0, number: int = 0) -> Marker:
    """An empty marker with identity pose and unit scale, drawn at the newest transform of its frame."""
    out = Marker(ns=namespace, id=number, type=kind, action=Marker.ADD)
    out.header = Header(frame_id=header.frame_id)
    out.pose.orientation.w = 1.0
    out.scale = Vector3(1.0, 1.0, 1.0)
    out.color = ColorRGBA(*(float(c) for c in color), float(alpha))
    return out


def clear(header: Header) -> bytes:
    """A marker that deletes everything of its display."""
    out = Marker(action=Marker.DELETEALL, header=Header(frame_id=header.frame_id))
    return packing.pack_marker(out)


def lines(
    header: Header, namespace: str, points: np.ndarray, color, width_m: float, number: int = 0
) -> bytes:
    """A LINE_LIST through points (2 N, 3) [m]; color (3,), or (2 N, 4) one for each point."""
    color = np.asarray(color, dtype=np.float32)
    single = color if color.ndim == 1 else color[0] if len(color) else np.zeros(4)
    out = marker(header, namespace, Marker.LINE_LIST, single[:3], 1.0, number)
    out.scale = Vector3(width_m, 0.0, 0.0)
    return packing.pack_marker(out, points, color if color.ndim == 2 else None)


def text(header: Header, namespace: str, at, words: str, height_m: float, color, number: int = 0) -> bytes:
    """Words that face the viewer, at a point (3,) [m]."""
    out = marker(header, namespace, Marker.TEXT_VIEW_FACING, color, 1.0, number)
    out.pose.position = Point(*(float(k) for k in at))
    out.scale = Vector3(0.0, 0.0, height_m)
    out.text = words
    return packing.pack_marker(out)


def box_edges(low, high) -> np.ndarray:
    """End points (24, 3) [m] of the edges of an axis-aligned box."""
    low, high = np.asarray(low, dtype=float), np.asarray(high, dtype=float)
    return (low + _BOX_CORNERS * (high - low))[np.array(_BOX_EDGES)].reshape(-1, 3)


def box(header: Header, namespace: str, low, high, color, alpha: float, number: int = 0) -> bytes:
    """A solid axis-aligned box."""
    low, high = np.asarray(low, dtype=float), np.asarray(high, dtype=float)
    out = marker(header, namespace, Marker.CUBE, color, alpha, number)
    out.pose.position = Point(*((low + high) / 2.0))
    out.scale = Vector3(*np.maximum(high - low, 1e-4))
    return packing.pack_marker(out)


def ellipsoid(
    header: Header,
    namespace: str,
    center: Point,
    turn: Quaternion,
    semi_axes,
    color,
    alpha: float,
    number: int,
) -> bytes:
    """A solid ellipsoid; semi-axes [m] of zero are drawn as a millimetre so that RViz accepts them."""
    out = marker(header, namespace, Marker.SPHERE, color, alpha, number)
    out.pose = Pose(center, turn)
    out.scale = Vector3(*(2.0 * max(float(k), 5e-4) for k in semi_axes))
    return packing.pack_marker(out)


def rotations(quaternions: np.ndarray) -> np.ndarray:
    """Rotation matrices (N, 3, 3) of quaternions (N, 4) in x y z w, which need not be of unit length.

    A quaternion of length zero (a message nobody filled in) gives a matrix of NaN.
    """
    with np.errstate(invalid="ignore", divide="ignore"):
        x, y, z, w = (quaternions / np.linalg.norm(quaternions, axis=1, keepdims=True)).T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), 2, 0)


def poses_to_arrays(poses: list[Pose]) -> tuple[np.ndarray, np.ndarray]:
    """Positions (N, 3) [m] and rotation matrices (N, 3, 3) of poses."""
    positions = np.array([[p.position.x, p.position.y, p.position.z] for p in poses]).reshape(-1, 3)
    turns = [[p.orientation.x, p.orientation.y, p.orientation.z, p.orientation.w] for p in poses]
    return positions, rotations(np.array(turns).reshape(-1, 4))


def pyramid_points(horizontal_fov: float, vertical_fov: float, length_m: float) -> np.ndarray:
    """Points (6, 3) of a camera pyramid in the optical frame (z forward, y down)."""
    half_x = length_m * np.tan(min(horizontal_fov, 3.0) / 2.0)
    half_y = length_m * np.tan(min(vertical_fov, 3.0) / 2.0)
    corners = [
        [-half_x, -half_y],
        [half_x, -half_y],
        [half_x, half_y],
        [-half_x, half_y],
        [0.0, -1.6 * half_y],
    ]
    return np.vstack([np.zeros(3), np.column_stack([corners, np.full(5, length_m)])])


def pyramid_edges(points: np.ndarray, positions: np.ndarray, matrices: np.ndarray) -> np.ndarray:
    """End points (N, 20, 3) of the pyramids' lines for camera poses in the header's frame."""
    placed = np.einsum("nij,pj->npi", matrices, points) + positions[:, None, :]
    return placed[:, np.array(_PYRAMID_EDGES).ravel()]


def pyramid_faces(points: np.ndarray, position: np.ndarray, matrix: np.ndarray) -> np.ndarray:
    """Vertices (12, 3) of the four sides of one pyramid."""
    return (points @ matrix.T + position)[np.array(_PYRAMID_FACES).ravel()]
