"""Camera poses as positions and viewing directions: the roll about the direction is free."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

Array = NDArray[np.float64]


def normalized(vectors: Array) -> Array:
    """Unit vectors of (..., 3) vectors; a zero vector stays zero."""
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.divide(vectors, length, out=np.zeros_like(vectors), where=length > 0)


def upright_poses(positions: Array, directions: Array, up: Array | None = None) -> Array:
    """Optical frames (x right, y down, z along the direction) that keep the image upright.

    :param positions: (N, 3) [m].
    :param directions: (N, 3) unit vectors.
    :param up: (3,) unit vector; world z by default. A camera that looks along it takes the frame's x axis instead,
        so that the pose is defined for every direction.
    :return: (N, 4, 4) camera poses in the frame of the positions.
    """
    up = np.array([0.0, 0.0, 1.0]) if up is None else up
    right = np.cross(directions, up)
    vertical = np.linalg.norm(right, axis=1) < 1e-3
    right[vertical] = np.cross(directions[vertical], np.array([1.0, 0.0, 0.0]))
    right = normalized(right)
    poses = np.tile(np.eye(4), (len(positions), 1, 1))
    poses[:, :3, 0] = right
    poses[:, :3, 1] = np.cross(directions, right)
    poses[:, :3, 2] = directions
    poses[:, :3, 3] = positions
    return poses


def angles_between(directions: Array, direction: Array) -> Array:
    """Angles [rad] between (N, 3) unit vectors and one unit vector (3,)."""
    return np.arccos(np.clip(directions @ direction, -1.0, 1.0))


def spread_out(
    scores: Array, poses: Array, count: int, spread_m: float, spread_rad: float
) -> NDArray[np.int64]:
    """Greedy non-maximum suppression: the best views of which no two are alike.

    Two views are alike when both their positions are nearer than ``spread_m`` and their directions than
    ``spread_rad``. Equal scores keep their order.

    :param scores: (N,), higher is better.
    :param poses: (N, 4, 4).
    :return: up to ``count`` indices, best first.
    """
    order = np.argsort(-scores, kind="stable")
    positions, directions = poses[order, :3, 3], poses[order, :3, 2]  # contiguous: gathered once
    nearby = cKDTree(positions, balanced_tree=False, compact_nodes=False)
    left = np.ones(len(order), dtype=bool)
    chosen: list[int] = []
    for row in range(len(order)):
        if len(chosen) == count:
            break
        if left[row]:
            chosen.append(int(order[row]))
            near = np.array(nearby.query_ball_point(positions[row], spread_m))
            left[near[angles_between(directions[near], directions[row]) <= spread_rad]] = False
    return np.array(chosen, dtype=np.int64)


def are_alike(poses: Array, pose: Array, spread_m: float, spread_rad: float) -> NDArray[np.bool_]:
    """Which of (N, 4, 4) poses are as near to one pose as the spreads, in position and in viewing direction."""
    near = np.linalg.norm(poses[:, :3, 3] - pose[:3, 3], axis=1) <= spread_m
    alike: NDArray[np.bool_] = near & (angles_between(poses[:, :3, 2], pose[:3, 2]) <= spread_rad)
    return alike
