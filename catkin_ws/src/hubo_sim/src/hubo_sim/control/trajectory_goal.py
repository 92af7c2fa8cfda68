"""A goal for a trajectory controller as plain data, and the checks that come before it is accepted."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import IntEnum

import numpy as np

from hubo_sim.sim_robot import JointInfo


class Code(IntEnum):
    """Result codes of control_msgs/FollowJointTrajectory."""

    SUCCESSFUL = 0
    INVALID_GOAL = -1
    INVALID_JOINTS = -2
    OLD_HEADER_TIMESTAMP = -3
    PATH_TOLERANCE_VIOLATED = -4
    GOAL_TOLERANCE_VIOLATED = -5


class Refusal(Exception):
    """A goal that is not accepted: `code` and one line of text."""

    def __init__(self, code: Code, text: str) -> None:
        super().__init__(text)
        self.code = code


@dataclass(frozen=True)
class Tolerance:
    """How far a joint may be off; 0: not set, negative: unlimited, as in control_msgs/JointTolerance."""

    position: float = 0.0
    velocity: float = 0.0
    acceleration: float = 0.0


@dataclass(frozen=True)
class TrajectoryGoal:
    """P points for the joints named; velocities and accelerations [] where a point carries none."""

    joint_names: list[str]
    times_s: list[float]  # (P,) from the start
    positions: list[list[float]]  # (P, J)
    velocities: list[list[float]]
    accelerations: list[list[float]]
    stamp_s: float = 0.0  # when to start; 0: now
    path_tolerance: dict[str, Tolerance] = field(default_factory=dict)
    goal_tolerance: dict[str, Tolerance] = field(default_factory=dict)
    goal_time_tolerance_s: float = 0.0  # 0: the controller's own


# How far beyond a position limit a point may lie: rounding in the sender, not intent [rad].
_LIMIT_MARGIN = 1e-4
# No joint is that fast or turns that far; splines through larger values lose all digits [rad], [rad/s], [rad/s^2].
_ABSURD = 1e6


def named_twice(names: list[str]) -> list[str]:
    """The names that are there more than once, in their order."""
    return [name for i, name in enumerate(names) if name in names[i + 1 :] and name not in names[:i]]


def check_goal(goal: TrajectoryGoal, joints: list[JointInfo], now_s: float, allow_partial: bool) -> None:
    """Raise Refusal unless a controller of these joints may accept the goal; one without points means stop."""
    _check_joints(goal, [joint.name for joint in joints], allow_partial)
    _check_tolerances(goal, [joint.name for joint in joints])
    if not goal.times_s:
        return
    _check_sizes(goal)
    _check_times(goal)
    if goal.stamp_s > 0.0 and goal.stamp_s + goal.times_s[-1] < now_s:
        late = now_s - goal.stamp_s - goal.times_s[-1]
        raise Refusal(
            Code.OLD_HEADER_TIMESTAMP, f"the whole trajectory is in the past: it ended {late:.3f} s ago"
        )
    _check_limits(goal, {joint.name: joint for joint in joints})


def _check_joints(goal: TrajectoryGoal, joints: list[str], allow_partial: bool) -> None:
    names = goal.joint_names
    twice = named_twice(names)
    if twice:
        raise Refusal(Code.INVALID_JOINTS, f"the goal names joint {', '.join(twice)} more than once")
    unknown = [name for name in names if name not in joints]
    missing = [name for name in joints if name not in names]
    wrong = bool(unknown) or not names or (bool(missing) and not allow_partial)
    if wrong and (names or goal.times_s):
        raise Refusal(
            Code.INVALID_JOINTS,
            f"joints of the goal do not match the controller's: unknown {unknown}, missing {missing}",
        )


def _check_tolerances(goal: TrajectoryGoal, joints: list[str]) -> None:
    """A tolerance of no joint, or one that is no number, would never be violated."""
    for kind in ("path_tolerance", "goal_tolerance"):
        for name, tolerance in getattr(goal, kind).items():
            if name not in joints:
                raise Refusal(
                    Code.INVALID_JOINTS, f"{kind} names joint {name!r}; the controller's: {', '.join(joints)}"
                )
            if np.isnan([tolerance.position, tolerance.velocity, tolerance.acceleration]).any():
                raise Refusal(Code.INVALID_GOAL, f"{kind} of {name} is not a number")


def _check_sizes(goal: TrajectoryGoal) -> None:
    count = len(goal.joint_names)
    for name in ("positions", "velocities", "accelerations"):
        rows = getattr(goal, name)
        optional = name != "positions"
        for i, row in enumerate(rows):
            if len(row) != count and not (optional and len(row) == 0):
                raise Refusal(Code.INVALID_GOAL, f"point {i} has {len(row)} {name} for {count} joints")
            if not np.all(np.isfinite(row)):
                raise Refusal(Code.INVALID_GOAL, f"point {i} has {name} that are not finite")
            if np.abs(row).max(initial=0.0) > _ABSURD:
                worst = max(row, key=abs)
                raise Refusal(
                    Code.INVALID_GOAL, f"point {i} has {name} of {worst:g}, allowed are +-{_ABSURD:g}"
                )


def _check_times(goal: TrajectoryGoal) -> None:
    times = np.asarray(goal.times_s, float)
    if not np.all(np.isfinite(times)) or times[0] < 0.0:
        raise Refusal(Code.INVALID_GOAL, "time_from_start must be finite and not negative")
    falling = np.flatnonzero(np.diff(times) <= 0.0)
    if falling.size:
        i = int(falling[0]) + 1
        raise Refusal(
            Code.INVALID_GOAL, f"time_from_start must grow strictly: point {i} is not after point {i - 1}"
        )


def _check_limits(goal: TrajectoryGoal, joints: dict[str, JointInfo]) -> None:
    lower = np.array([joints[name].lower for name in goal.joint_names]) - _LIMIT_MARGIN
    upper = np.array([joints[name].upper for name in goal.joint_names]) + _LIMIT_MARGIN
    positions = np.asarray(goal.positions, float)
    outside = np.argwhere((positions < lower) | (positions > upper))
    if outside.size:
        point, joint = outside[0]
        name = goal.joint_names[joint]
        raise Refusal(
            Code.INVALID_GOAL,
            f"point {point}: {name} at {positions[point, joint]:.4f} is outside of its limits "
            f"[{joints[name].lower:.4f}, {joints[name].upper:.4f}]",
        )
