"""Rigid transforms as 4x4 matrices; quaternions are x y z w throughout, as ROS's and pybullet's are."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

Array = NDArray[np.float64]
UNIT_TOLERANCE = 1e-2
"""A quaternion whose length is this far from 1 was not meant as it stands; rounding stays far below."""


def transform(position_m: ArrayLike, quaternion: ArrayLike) -> Array:
    """(4, 4) transform from a position (3,) [m] and a quaternion (4,) x y z w; (N, 4, 4) from N of both.

    :raises ValueError: a quaternion of length zero.
    """
    return _joined(position_m, Rotation.from_quat(np.asarray(quaternion, float)))


def from_rpy(position_m: ArrayLike, rpy_rad: ArrayLike) -> Array:
    """(4, 4) transform from a position (3,) [m] and URDF's fixed-axis roll, pitch, yaw (3,) [rad]."""
    return _joined(position_m, Rotation.from_euler("xyz", rpy_rad))


def _joined(position_m: ArrayLike, rotation: Rotation) -> Array:
    matrices = rotation.as_matrix()
    T = np.zeros((*matrices.shape[:-2], 4, 4))
    T[..., :3, :3], T[..., :3, 3], T[..., 3, 3] = matrices, position_m, 1.0
    return T


def require_poses(positions: Array, quaternions: Array) -> None:
    """Check that positions (N, 3) and quaternions (N, 4) are poses.

    :raises ValueError: one is not finite, or its quaternion not of unit length; the text says which.
    """
    lengths = np.linalg.norm(quaternions, axis=1)
    good = np.isfinite(positions).all(axis=1) & (np.abs(lengths - 1.0) <= UNIT_TOLERANCE)
    if not good.all():
        i = int(np.argmin(good))
        raise ValueError(
            f"pose {i}: position {positions[i].tolist()}, quaternion x y z w {quaternions[i].tolist()}; valid: finite, "
            "of unit length"
        )


def quaternion_of(T: Array) -> Array:
    """Quaternion (4,) x y z w of a transform's rotation."""
    return np.asarray(Rotation.from_matrix(T[:3, :3]).as_quat())


def inverse(T: Array) -> Array:
    """Inverse of a rigid (4, 4) transform."""
    out = np.eye(4)
    out[:3, :3] = T[:3, :3].T
    out[:3, 3] = -T[:3, :3].T @ T[:3, 3]
    return out


def apply(T: Array, points: NDArray[np.floating[Any]]) -> Array:
    """Points (..., 3) taken through a (4, 4) transform."""
    return np.asarray(points @ T[:3, :3].T + T[:3, 3])


def look_at(eye_m: ArrayLike, target_m: ArrayLike) -> Array:
    """T_world_optical (4, 4) of a camera at `eye_m` whose z axis meets `target_m`; image up is world up.

    Looking straight up or down, image up is world +y. Raises ValueError when eye and target coincide.
    """
    forward = np.asarray(target_m, float) - np.asarray(eye_m, float)
    length = np.linalg.norm(forward)
    if not length > 1e-9:
        raise ValueError("look_at: eye and target coincide")
    forward = forward / length
    up = np.array([0.0, 0.0, 1.0]) if abs(forward[2]) < 0.999 else np.array([0.0, 1.0, 0.0])
    right = np.cross(forward, up)
    right /= np.linalg.norm(right)
    T = np.eye(4)
    T[:3, :3] = np.column_stack([right, np.cross(forward, right), forward])
    T[:3, 3] = eye_m
    return T
