"""Rigid transforms as 4x4 matrices; quaternions are x y z w throughout, as pybullet's and ROS's are."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation


def transform(position_m: np.ndarray, quaternion: np.ndarray) -> np.ndarray:
    """(4, 4) transform from a position (3,) [m] and a quaternion (4,) x y z w."""
    T = np.eye(4)
    T[:3, :3] = Rotation.from_quat(quaternion).as_matrix()
    T[:3, 3] = position_m
    return T


def from_rpy(position_m: np.ndarray, rpy_rad: np.ndarray) -> np.ndarray:
    """(4, 4) transform from a position (3,) [m] and URDF's fixed-axis roll, pitch, yaw (3,) [rad]."""
    T = np.eye(4)
    T[:3, :3] = Rotation.from_euler("xyz", rpy_rad).as_matrix()
    T[:3, 3] = position_m
    return T


def quaternion_of(T: np.ndarray) -> np.ndarray:
    """Quaternion (4,) x y z w of a transform's rotation."""
    return Rotation.from_matrix(T[:3, :3]).as_quat()


def inverse(T: np.ndarray) -> np.ndarray:
    """Inverse of a rigid (4, 4) transform."""
    out = np.eye(4)
    out[:3, :3] = T[:3, :3].T
    out[:3, 3] = -T[:3, :3].T @ T[:3, 3]
    return out


def apply(T: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Points (..., 3) taken through a (4, 4) transform."""
    return points @ T[:3, :3].T + T[:3, 3]


def look_at(eye_m: np.ndarray, target_m: np.ndarray) -> np.ndarray:
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
