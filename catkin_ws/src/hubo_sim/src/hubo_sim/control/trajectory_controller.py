"""A joint trajectory controller that behaves as ros_control's joint_trajectory_controller does, without ROS.

Behaviour after the documentation at wiki.ros.org/joint_trajectory_controller (and its page on trajectory
replacement). Three things are this project's choice: a stop always takes at least the time that the joints'
acceleration limits ask for; set-points never leave position limits nor move faster than velocity limits; and what
replaces a trajectory, a stop or a new goal, begins where the trajectory is for joints that follow it, and where the
joint is, as fast as it is, for one that has strayed from it.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated, Any

import numpy as np

from fv_common.schema import (
    Config,
    Name,
    NotEmpty,
    NotNegative,
    OneOf,
    Range,
    from_mapping,
    number,
    reject_unknown,
)
from hubo_sim.control.spline import JointSample, Spline
from hubo_sim.control.trajectory_goal import Code, Tolerance, TrajectoryGoal, check_goal, named_twice
from hubo_sim.errors import SimError
from hubo_sim.sim_robot import JointInfo

TYPES = ("position_controllers/JointTrajectoryController", "effort_controllers/JointTrajectoryController")
_DEFAULT_DECELERATION = 5.0  # [rad/s^2] for stops of joints without an acceleration limit
_NOTEWORTHY_RAD = 1e-4  # limits that change a set-point by less are not worth telling
_STRAYED_RAD = 0.02  # a joint this far from its trajectory does not follow it; drives sag less [rad or m]
_STRAYED_RAD_S = 0.2  # ... or whose velocity differs so much [rad/s or m/s]


@dataclass(frozen=True)
class Gains(Config):
    """Of one effort-controlled joint, each >= 0."""

    p: NotNegative = 0.0
    i: NotNegative = 0.0
    d: NotNegative = 0.0
    i_clamp: NotNegative = 0.0


@dataclass(frozen=True)
class _JointConstraints(Config):
    """Tolerances of one joint, under ros_control's names; 0: not checked."""

    trajectory: float = 0.0
    goal: float = 0.0


@dataclass(frozen=True)
class ControllerConfig(Config):
    """Parameters of one controller, under ros_control's names."""

    type: Annotated[str, OneOf(*TYPES)]
    joints: Annotated[list[Name], NotEmpty()]
    gains: dict[str, Gains] = field(default_factory=dict)
    constraints: dict[str, Any] = field(default_factory=dict)
    state_publish_rate: Annotated[float, Range(0.1, 1000)] = 50.0  # [Hz]
    action_monitor_rate: Annotated[float, Range(0.1, 1000)] = 20.0  # [Hz] of feedback
    stop_trajectory_duration: NotNegative = 0.0  # [s]
    allow_partial_joints_goal: bool = False

    def __post_init__(self) -> None:
        super().__post_init__()
        twice = named_twice(self.joints)
        if twice:
            raise SimError(f"joints: {', '.join(twice)} is there more than once")
        valid = ["goal_time", "stopped_velocity_tolerance", *self.joints]
        reject_unknown(self.constraints, valid, "constraints")
        for name, value in self.constraints.items():
            if name in self.joints:
                from_mapping(_JointConstraints, value or {}, f"constraints: {name}")
            else:
                number(value, f"constraints: {name}")

    @property
    def uses_effort(self) -> bool:
        """Whether it drives efforts rather than positions."""
        return self.type.startswith("effort")

    def path_tolerance(self, joint: str) -> Tolerance:
        """Allowed error on the way."""
        return Tolerance(float((self.constraints.get(joint) or {}).get("trajectory", 0.0)))

    def goal_tolerance(self, joint: str) -> Tolerance:
        """Allowed error at the end; the velocity is the controller's stopped_velocity_tolerance."""
        stopped = float(self.constraints.get("stopped_velocity_tolerance", 0.01))
        return Tolerance(float((self.constraints.get(joint) or {}).get("goal", 0.0)), stopped)


@dataclass
class ActiveGoal:
    """An accepted goal while it is executed; `handle` is whatever the owner knows it by."""

    handle: Any
    end_s: float
    path: np.ndarray  # (J,) [rad], inf: unlimited
    path_velocity: np.ndarray  # (J,) [rad/s]
    final: np.ndarray  # (J,) [rad]
    final_velocity: np.ndarray  # (J,) [rad/s]
    goal_time_s: float


@dataclass(frozen=True)
class Outcome:
    """How a goal ended: `status` is one of succeeded, aborted, canceled."""

    handle: Any
    status: str
    code: Code
    text: str


class TrajectoryController:
    """Holds its joints or moves them along a spline; times are absolute seconds of the caller's clock."""

    def __init__(
        self,
        config: ControllerConfig,
        joints: list[JointInfo],
        position: np.ndarray,
        deceleration: np.ndarray | None = None,
    ) -> None:
        """joints: those of config.joints, in order; position (J,): where to hold; deceleration (J,) [rad/s^2]."""
        self.config = config
        self.joints = joints
        self.names = [joint.name for joint in joints]
        self._lower = np.array([joint.lower for joint in joints])
        self._upper = np.array([joint.upper for joint in joints])
        self._max_velocity = np.array([joint.max_velocity for joint in joints])
        self._continuous = np.array([joint.continuous for joint in joints])
        self._deceleration = (
            np.full(len(joints), _DEFAULT_DECELERATION) if deceleration is None else deceleration
        )
        self.active: ActiveGoal | None = None
        self._ended: list[Outcome] = []
        self._held_back: set[str] = set()  # what limits did to the trajectory so far, in words
        self.reset(position)

    def reset(self, position: np.ndarray) -> None:
        """Hold at positions (J,) from now on; a goal that was active is aborted."""
        self._finish("aborted", Code.INVALID_GOAL, "the controller was reset")
        self._held_back.clear()
        self._spline = Spline.hold(0.0, np.asarray(position, float))
        zero = np.zeros(len(self.joints))
        self.desired = JointSample(np.asarray(position, float), zero, zero)
        self.set_point = self._measured = self.desired
        self._measured_s, self._step_s = 0.0, 0.0
        self.error = JointSample(zero, zero, zero)

    def check(self, goal: TrajectoryGoal, now_s: float) -> None:
        """Raise Refusal unless `goal` may be started."""
        check_goal(goal, self.joints, now_s, self.config.allow_partial_joints_goal)

    def start(self, goal: TrajectoryGoal, now_s: float, handle: Any = None) -> None:
        """Follow a checked goal from now on (or from its stamp on); the active goal, if any, is preempted.

        Without a handle (the `command` topic) nobody is told how it ends.
        """
        self._finish("canceled", Code.SUCCESSFUL, "replaced by a newer trajectory")
        if not goal.times_s:
            self._stop(now_s)
        else:
            self._spline = self._spline.followed_by(self._spline_of(goal, now_s))
        self._held_back.clear()
        if handle is not None:
            self.active = self._active_goal(goal, now_s, handle)

    def cancel(self, now_s: float, handle: Any = None) -> None:
        """Come to rest and hold; with a handle only if that goal is the active one."""
        if handle is not None and (self.active is None or self.active.handle != handle):
            return
        self._finish("canceled", Code.SUCCESSFUL, "cancelled")
        self._stop(now_s)

    def update(self, now_s: float, step_s: float, position: np.ndarray, velocity: np.ndarray) -> JointSample:
        """The set-point for the end of the step that begins now.

        position, velocity (J,) are the measured ones of now. Goals that end are in `ended`.
        """
        self.desired = self._spline.sample(now_s)
        zero = np.zeros(len(self.joints))
        self._measured, self._measured_s, self._step_s = JointSample(position, velocity, zero), now_s, step_s
        self.error = JointSample(self.desired.position - position, self.desired.velocity - velocity, zero)
        if self.active is not None:
            self._check_progress(now_s)
        self.set_point = self._within_limits(self._spline.sample(now_s + step_s), step_s)
        return self.set_point

    def ended(self) -> list[Outcome]:
        """Goals that ended since the last call."""
        out, self._ended = self._ended, []
        return out

    def is_moving(self, now_s: float) -> bool:
        """Whether a goal is active or the spline has not come to its end."""
        return self.active is not None or now_s < self._spline.end_s

    def sample(self, t_s: float) -> JointSample:
        """What the trajectory wants at a time [s]: query_state."""
        return self._spline.sample(t_s)

    def _spline_of(self, goal: TrajectoryGoal, now_s: float) -> Spline:
        """The goal's points, bridged from the current trajectory; points that are over by then are dropped."""
        start_s = max(goal.stamp_s, now_s) if goal.stamp_s > 0.0 else now_s
        times = np.asarray(goal.times_s, float) + (goal.stamp_s if goal.stamp_s > 0.0 else now_s)
        ahead = times > start_s + 1e-9
        if not ahead.any():
            ahead[-1] = True
            times[-1] = start_s
        at_start = self._state_now(now_s) if start_s == now_s else self._spline.sample(start_s)
        points = {kind: rows[ahead] for kind, rows in self._points(goal, times).items()}
        times = times[ahead]
        turns = np.rint((points["position"][0] - at_start.position) / (2.0 * np.pi))
        points["position"] = points["position"] - np.where(self._continuous, turns, 0.0) * 2.0 * np.pi
        if len(goal.joint_names) < len(self.names) and self._spline.end_s > times[-1]:
            points, times = self._until_others_end(goal, points), np.append(times, self._spline.end_s)
        if "velocity" in points or np.all(at_start.velocity == 0.0):
            return Spline.through(start_s, at_start, times, points)
        # Lines through positions alone begin at rest: a joint that moves is slowed down first.
        braking_s = min(self._braking_s(at_start.velocity), 0.5 * (times[0] - start_s))
        braking = Spline.stop(start_s, at_start, braking_s, (self._lower, self._upper))
        rest = braking.sample(braking.end_s)
        return braking.followed_by(Spline.through(braking.end_s, rest, times, points))

    def _points(self, goal: TrajectoryGoal, times: np.ndarray) -> dict[str, np.ndarray]:
        """(P, J) positions, and velocities and accelerations if the goal carries them, in the controller's order.

        Joints that a partial goal leaves out go on along their present trajectory.
        """
        rows = {"position": goal.positions}
        if all(len(row) for row in goal.velocities):
            rows["velocity"] = goal.velocities
            if all(len(row) for row in goal.accelerations):
                rows["acceleration"] = goal.accelerations
        named = [self.names.index(name) for name in goal.joint_names]
        present = [self._spline.sample(t) for t in times]
        out = {}
        for kind, values in rows.items():
            out[kind] = np.array([getattr(sample, kind) for sample in present])
            out[kind][:, named] = np.asarray(values, float)
        return out

    def _until_others_end(self, goal: TrajectoryGoal, points: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
        """The points and one more, where the joints that the goal leaves out come to their end and the others wait."""
        end = self._spline.sample(self._spline.end_s)
        position = end.position.copy()
        named = [self.names.index(name) for name in goal.joint_names]
        position[named] = points["position"][-1, named]
        last = {"position": position, "velocity": end.velocity, "acceleration": end.acceleration}
        return {kind: np.vstack([values, last[kind]]) for kind, values in points.items()}

    def _active_goal(self, goal: TrajectoryGoal, now_s: float, handle: Any) -> ActiveGoal:
        path = [_merged(goal.path_tolerance, self.config.path_tolerance(n), n) for n in self.names]
        final = [_merged(goal.goal_tolerance, self.config.goal_tolerance(n), n) for n in self.names]
        own_end_s = (goal.stamp_s or now_s) + goal.times_s[-1] if goal.times_s else self._spline.end_s
        goal_time = goal.goal_time_tolerance_s or float(self.config.constraints.get("goal_time", 0.0))
        return ActiveGoal(
            handle=handle,
            end_s=max(own_end_s, now_s),
            path=_bound([t.position for t in path]),
            path_velocity=_bound([t.velocity for t in path]),
            final=_bound([t.position for t in final]),
            final_velocity=_bound([t.velocity for t in final]),
            goal_time_s=goal_time if goal_time >= 0.0 else np.inf,
        )

    def _stop(self, now_s: float) -> None:
        state = self._state_now(now_s)
        duration = max(self.config.stop_trajectory_duration, self._braking_s(state.velocity))
        if np.all(state.velocity == 0.0):
            duration = 0.0
        self._spline = Spline.stop(now_s, state, duration, (self._lower, self._upper))

    def _braking_s(self, velocity: np.ndarray) -> float:
        """How long all joints take to come to rest within their acceleration limits [s]."""
        return float(np.max(np.abs(velocity) / self._deceleration, initial=0.0))

    def _state_now(self, now_s: float) -> JointSample:
        """What the trajectory wants now, but for joints that have strayed from it: their own state.

        The set-points of these are taken back to where the joints are: else the drives would go on to pull there.
        """
        wanted, velocity = self._spline.sample(now_s), self._measured.velocity
        since_s = float(np.clip(now_s - self._measured_s, 0.0, self._step_s))
        position = np.clip(self._measured.position + velocity * since_s, self._lower, self._upper)
        far = np.abs(wanted.position - position) > _STRAYED_RAD
        strayed = far | (np.abs(wanted.velocity - velocity) > _STRAYED_RAD_S)
        if not strayed.any():
            return wanted
        given = self.set_point
        self.set_point = JointSample(
            np.where(strayed, position, given.position),
            np.where(strayed, velocity, given.velocity),
            np.where(strayed, 0.0, given.acceleration),
        )
        return JointSample(
            np.where(strayed, position, wanted.position),
            np.where(strayed, velocity, wanted.velocity),
            np.where(strayed, 0.0, wanted.acceleration),
        )

    def _check_progress(self, now_s: float) -> None:
        """End the active goal when it is reached, or when it cannot be within tolerance any more."""
        goal, error = self.active, np.abs(self.error.position)
        if now_s < goal.end_s:
            off = np.flatnonzero((error > goal.path) | (np.abs(self.error.velocity) > goal.path_velocity))
            if off.size:
                self._fail(now_s, Code.PATH_TOLERANCE_VIOLATED, "path", off[0], error, goal.path)
            return
        off = np.flatnonzero((error > goal.final) | (np.abs(self.error.velocity) > goal.final_velocity))
        if not off.size:
            self._finish("succeeded", Code.SUCCESSFUL, "")
        elif now_s > goal.end_s + goal.goal_time_s:
            self._fail(now_s, Code.GOAL_TOLERANCE_VIOLATED, "goal", off[0], error, goal.final)

    def _fail(
        self, now_s: float, code: Code, what: str, joint: int, error: np.ndarray, bound: np.ndarray
    ) -> None:
        speed = abs(self.error.velocity[joint])
        text = (
            f"{what} tolerance: {self.names[joint]} is off by {error[joint]:.4f} rad, "
            f"{speed:.4f} rad/s (allowed {bound[joint]:.4f} rad)"
        )
        self._finish("aborted", code, text)
        self._stop(now_s)

    def _finish(self, status: str, code: Code, text: str) -> None:
        if self.active is not None:
            held = f"held back by: {', '.join(self.held_back)}" if self._held_back else ""
            told = "; ".join(part for part in (text, held) if part)
            self._ended.append(Outcome(self.active.handle, status, code, told))
            self.active = None

    @property
    def held_back(self) -> list[str]:
        """Which limits have held back the trajectory that was started last: "velocity limit of RSP", sorted."""
        return sorted(self._held_back)

    def _within_limits(self, wanted: JointSample, step_s: float) -> JointSample:
        """The wanted set-point, no further from the last one than the velocity limits allow, within the limits."""
        reach = self._max_velocity * step_s
        last = self.set_point.position
        reached = np.clip(wanted.position, last - reach, last + reach)
        position = np.clip(reached, self._lower, self._upper)
        # One that a limit holds back moves as fast as its positions say.
        held_back = np.abs(position - wanted.position) > _NOTEWORTHY_RAD
        velocity = np.where(held_back, (position - last) / step_s, wanted.velocity)
        velocity = np.clip(velocity, -self._max_velocity, self._max_velocity)
        self._note_limits("velocity", np.abs(reached - wanted.position))
        self._note_limits("position", np.abs(position - reached))
        return JointSample(position, velocity, wanted.acceleration)

    def _note_limits(self, kind: str, off: np.ndarray) -> None:
        for joint in np.flatnonzero(off > _NOTEWORTHY_RAD):
            self._held_back.add(f"{kind} limit of {self.names[joint]}")


def _merged(given: dict[str, Tolerance], default: Tolerance, name: str) -> Tolerance:
    """A goal's tolerance for a joint where it sets one (not 0), the controller's elsewhere."""
    own = given.get(name, Tolerance())
    return Tolerance(own.position or default.position, own.velocity or default.velocity)


def _bound(values: list[float]) -> np.ndarray:
    """Tolerances with 0 (not set) and negative (unlimited) as inf."""
    out = np.asarray(values, float)
    return np.where(out > 0.0, out, np.inf)
