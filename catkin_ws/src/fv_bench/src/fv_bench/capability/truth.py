"""Independent truth: EAIK for HUBO's arm, many starts for others; limits by hand, the robot model's self-collision."""

from __future__ import annotations

import numpy as np


class EaikArm:
    """EAIK fed with the axes and offsets of a SerialChain. EAIK knows no limits and no collisions."""

    def __init__(self, chain) -> None:
        from eaik.IK_HP import HPRobot

        points = chain.points
        offsets = np.vstack([points[0], np.diff(points, axis=0), chain.T_zero[:3, 3] - points[-1]])
        self._robot = HPRobot(chain.axes, offsets)
        self._R_zero = chain.T_zero[:3, :3]
        self._limits = chain.limits

    def prepare(self, poses: np.ndarray) -> list[np.ndarray]:
        """Poses (N, 4, 4) in EAIK's convention, as the list that its batch call takes."""
        turned = poses.copy()
        turned[:, :3, :3] = poses[:, :3, :3] @ self._R_zero.T
        return list(turned)

    def batch(self, prepared: list[np.ndarray], threads: int):
        """EAIK's own batch call."""
        return self._robot.IK_batched(prepared, threads)

    def within_limits(self, answer) -> np.ndarray:
        """Exact solutions of one answer that respect the limits, (K, 6)."""
        q = np.asarray(answer.Q, float).reshape(-1, 6)
        q = q[~np.asarray(answer.is_LS, bool).reshape(-1)[: len(q)]]
        lower, upper = self._limits.T
        q = q + 2.0 * np.pi * np.ceil(
            (lower - 1e-9 - q) / (2.0 * np.pi)
        )  # the first copy above the lower limit
        return q[(q <= upper + 1e-9).all(axis=1)]


def rolled(positions: np.ndarray, directions: np.ndarray, roll_rad: float) -> np.ndarray:
    """Tip poses (N, 4, 4) with z along the directions, rolled about it."""
    helper = np.eye(3)[np.argmin(np.abs(directions), axis=1)]
    x = np.cross(helper, directions)
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    y = np.cross(directions, x)
    T = np.tile(np.eye(4), (len(positions), 1, 1))
    T[:, :3, 0] = np.cos(roll_rad) * x + np.sin(roll_rad) * y
    T[:, :3, 1] = np.cross(directions, T[:, :3, 0])
    T[:, :3, 2] = directions
    T[:, :3, 3] = positions
    return T


class Contact:
    """Does the robot touch itself when the group's joints are q (B, J) and the others rest?"""

    def __init__(self, arm, model) -> None:
        from fv_robot_model._core import SelfCollision

        self._collision = SelfCollision(model, group=arm.group)
        self._rest = np.array([np.clip(0.0, limit.lower, limit.upper) for limit in model.limits])
        self._places = model.group(arm.group).joint_indices

    def __call__(self, q: np.ndarray) -> np.ndarray:
        """(B, J) to (B,) bool."""
        q_all = np.tile(self._rest, (len(q), 1))
        q_all[:, self._places] = q
        return self._collision.in_contact(q_all)


def eaik_truth(arm, positions: np.ndarray, directions: np.ndarray, roll_step_deg: float) -> np.ndarray:
    """Which views can HUBO's arm hold? (N,) bool by a roll sweep, limits and self-collision."""
    from fv_robot_model.ik import SerialChain

    model = arm.model()
    eaik, in_contact = EaikArm(SerialChain.of_group(model, arm.group)), Contact(arm, model)
    held = np.zeros(len(positions), bool)
    for roll in np.deg2rad(np.arange(0.0, 360.0, roll_step_deg)):
        rows = np.flatnonzero(~held)
        answers = eaik.batch(eaik.prepare(rolled(positions[rows], directions[rows], roll)), 2)
        solutions = [eaik.within_limits(answer) for answer in answers]
        owners = np.repeat(rows, [len(q) for q in solutions])
        held[owners[~in_contact(np.concatenate(solutions))]] = True
    return held


def many_start_truth(arm, positions: np.ndarray, directions: np.ndarray, starts: int) -> np.ndarray:
    """Which views can an arm of revolute joints hold, to 1 mm and 1 degree? (N,) bool."""
    from fv_bench.capability.many_starts import Arm, many_start_truth
    from fv_robot_model.ik import SerialChain

    model = arm.model()
    chain = SerialChain.of_group(model, arm.group)
    arrays = Arm(chain.axes, chain.points, chain.limits, chain.T_zero)
    return many_start_truth(
        arrays, Contact(arm, model), chain.reach_bound(), positions, directions, starts, seed=1
    )
