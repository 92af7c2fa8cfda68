"""Independent truth for redundant arms: Newton's method from many random starts, written for this purpose alone."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

POSITION_M = 1e-3  # a view counts as held within these
ANGLE_RAD = np.deg2rad(1.0)
ITERATIONS = 30
LARGEST_STEP_RAD = 0.5
NEAR = 20.0  # a miss below so many tolerances is worth more starts


@dataclass
class Arm:
    """A chain of revolute joints as arrays: axes and points of the axes at zero (J, 3), limits (J, 2), tip (4, 4)."""

    axes: np.ndarray
    points: np.ndarray
    limits: np.ndarray
    T_zero: np.ndarray


def rotations(axis: np.ndarray, angles: np.ndarray) -> np.ndarray:
    """Rodrigues' formula: (3,) unit axis and (B,) angles to (B, 3, 3)."""
    cross = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    return (
        np.eye(3)
        + np.sin(angles)[:, None, None] * cross
        + (1.0 - np.cos(angles))[:, None, None] * (cross @ cross)
    )


def tip_and_jacobian(arm: Arm, q: np.ndarray):
    """Tip positions and z axes (B, 3), and how both move: (B, 3, J) linear and (B, 3, J) angular."""
    count, joints = q.shape
    R, t = np.tile(np.eye(3), (count, 1, 1)), np.zeros((count, 3))
    axes, points = np.empty((count, joints, 3)), np.empty((count, joints, 3))
    for j in range(joints):
        axes[:, j] = R @ arm.axes[j]
        points[:, j] = R @ arm.points[j] + t
        R = R @ rotations(arm.axes[j], q[:, j])
        t = points[:, j] - R @ arm.points[j]
    tip = R @ arm.T_zero[:3, 3] + t
    linear = np.cross(axes, tip[:, None] - points)
    return tip, R @ arm.T_zero[:3, 2], linear.transpose(0, 2, 1), axes.transpose(0, 2, 1)


def errors(tip, z, positions, directions) -> tuple[np.ndarray, np.ndarray]:
    """Distance [m] and angle [rad] to the views, (B,) each."""
    angle = np.arctan2(np.linalg.norm(np.cross(z, directions), axis=1), np.einsum("bi,bi->b", z, directions))
    return np.linalg.norm(positions - tip, axis=1), angle


def step(arm: Arm, q: np.ndarray, positions: np.ndarray, directions: np.ndarray):
    """One damped Newton step of position and direction, joints kept within limits: q, and the miss in tolerances."""
    tip, z, linear, angular = tip_and_jacobian(arm, q)
    distance, angle = errors(tip, z, positions, directions)
    turn = np.cross(z, directions)
    norm = np.linalg.norm(turn, axis=1, keepdims=True)
    away = np.where(norm > 1e-9, turn / np.maximum(norm, 1e-9), np.roll(z, 1, axis=1)) * angle[:, None]
    across = angular - z[:, :, None] * np.einsum("bi,bij->bj", z, angular)[:, None]  # roll is free
    J = np.concatenate([linear, across], axis=1)
    # A joint on its limit that would go beyond it stands still in the second try.
    error = np.concatenate([positions - tip, away], axis=1)
    for _ in range(2):
        square = J @ J.transpose(0, 2, 1) + 1e-5 * np.eye(6)
        dq = np.einsum("bij,bi->bj", J, np.linalg.solve(square, error[:, :, None])[:, :, 0])
        blocked = ((q + dq) < arm.limits[:, 0]) & (q <= arm.limits[:, 0] + 1e-9)
        blocked |= ((q + dq) > arm.limits[:, 1]) & (q >= arm.limits[:, 1] - 1e-9)
        J = np.where(blocked[:, None], 0.0, J)
    dq *= np.minimum(1.0, LARGEST_STEP_RAD / np.maximum(np.abs(dq).max(axis=1, keepdims=True), 1e-9))
    return np.clip(q + dq, *arm.limits.T), np.maximum(distance / POSITION_M, angle / ANGLE_RAD)


def descend(arm: Arm, q: np.ndarray, positions: np.ndarray, directions: np.ndarray):
    """Newton steps from starts q (B, J): where they end, and the miss there in tolerances (B,)."""
    miss = np.full(len(q), np.inf)
    open_rows = np.arange(len(q))
    for _ in range(ITERATIONS):
        moved, missed = step(arm, q[open_rows], positions[open_rows], directions[open_rows])
        miss[open_rows] = missed
        going_on = missed > 0.1
        q[open_rows[going_on]] = moved[going_on]
        open_rows = open_rows[going_on]
        if len(open_rows) == 0:
            break
    return q, miss


def many_start_truth(
    arm: Arm, in_contact, reach, positions: np.ndarray, directions: np.ndarray, starts: int, seed: int
) -> np.ndarray:
    """Which views can be held to 1 mm and 1 degree? (N,) bool.

    :param in_contact: (B, J) to (B,) bool: does the robot touch itself?
    :param reach: centre (3,) and radius [m] of a ball that the tip cannot leave.
    :param starts: per view; three times more where a start ended near the view or in a configuration that touches.
    """
    random = np.random.default_rng(seed)
    held = np.zeros(len(positions), bool)
    near = np.zeros(len(positions), bool)
    possible = np.linalg.norm(positions - reach[0], axis=1) <= reach[1] + POSITION_M
    for attempt in range(4 * starts):
        rows = np.flatnonzero(possible & ~held & (near if attempt >= starts else True))
        if len(rows) == 0:
            break
        q, miss = descend(
            arm,
            random.uniform(*arm.limits.T, (len(rows), len(arm.limits))),
            positions[rows],
            directions[rows],
        )
        near[rows] |= miss <= NEAR
        there = np.flatnonzero(miss <= 1.0)
        held[rows[there[~in_contact(q[there])]]] = True
    return held
