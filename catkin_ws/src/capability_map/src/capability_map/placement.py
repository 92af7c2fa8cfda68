"""Inverse query: where must the base stand so that a set of views can be held?"""

from __future__ import annotations

import numpy as np

from capability_map.capability_map import CapabilityMap
from capability_map.errors import CapabilityMapError


def placements(
    cap: CapabilityMap, T_world_bases: np.ndarray, positions: np.ndarray, directions: np.ndarray
) -> np.ndarray:
    """Return how surely each view can be held from each base pose, (B, V) float32 in 0..1.

    :param T_world_bases: (B, 4, 4) candidate poses of the map's base frame.
    :param positions: (V, 3) tip positions in the world [m]. :param directions: (V, 3) viewing directions in the world.
    """
    T = np.asarray(T_world_bases, float)
    if T.ndim != 3 or T.shape[1:] != (4, 4):
        raise CapabilityMapError(f"base poses must be (B, 4, 4), not {T.shape}")
    rotations = T[:, :3, :3]
    local_positions = np.einsum("bji,bvj->bvi", rotations, positions[None] - T[:, None, :3, 3])
    local_directions = np.einsum("bji,vj->bvi", rotations, directions)
    answers = cap.query(local_positions.reshape(-1, 3), local_directions.reshape(-1, 3))
    return answers.reshape(len(T), len(positions))


def base_poses_for(
    cap: CapabilityMap, T_world_bases: np.ndarray, positions: np.ndarray, directions: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the base poses from which every view can be held, best first.

    :return: (K,) rows of T_world_bases, and (K,) the answer for the worst view of each; K = 0 when there is none.
    """
    worst = placements(cap, T_world_bases, positions, directions).min(axis=1, initial=1.0)
    rows = np.flatnonzero(worst >= cap.threshold)
    rows = rows[np.argsort(-worst[rows], kind="stable")]
    return rows, worst[rows]


def base_grid(x_m: np.ndarray, y_m: np.ndarray, yaw_rad: np.ndarray, z_m: float = 0.0) -> np.ndarray:
    """Return (B, 4, 4) upright base poses for all combinations, x slowest."""
    x, y, yaw = (values.ravel() for values in np.meshgrid(x_m, y_m, yaw_rad, indexing="ij"))
    T = np.tile(np.eye(4), (len(x), 1, 1))
    T[:, 0, 0] = T[:, 1, 1] = np.cos(yaw)
    T[:, 1, 0] = np.sin(yaw)
    T[:, 0, 1] = -T[:, 1, 0]
    T[:, :3, 3] = np.stack([x, y, np.full_like(x, z_m)], axis=1)
    return T
