"""From a controller's set-point to the engine: position motors, or efforts by a PID law."""

from __future__ import annotations

import numpy as np

from hubo_sim.bullet import BulletClient
from hubo_sim.control.spline import JointSample
from hubo_sim.control.trajectory_controller import ControllerConfig
from hubo_sim.errors import SimError
from hubo_sim.sim_robot import SimRobot


class PositionDrive:
    """Position joints: Bullet's own motors follow the set-point, within the joints' efforts."""

    def __init__(self, robot: SimRobot, rows: np.ndarray) -> None:
        self._robot = robot
        self._rows = rows

    def drive(self, set_point: JointSample) -> None:
        """Command the next step; set_point is where the joints shall be at its end."""
        self._robot.command_positions(self._rows, set_point.position, set_point.velocity)

    def reset(self) -> None:
        """Forget nothing: there is no state."""


class EffortDrive:
    """Effort joints: torque = P e + I integral(e) + D de/dt, clipped to the joints' efforts.

    P and D act on the state predicted for the end of the step (Tan, Liu, Turk, "Stable Proportional-Derivative
    Controllers", IEEE CG&A 2011): with wrists of a few g m^2, explicit PID at 240 Hz would diverge with any gain
    that tracks. The joints' own damping is treated alike, Bullet's explicit one is off. The integral part is
    bounded by i_clamp [N m] (0: unbounded) and starts from the torque that holds the pose against gravity, as a
    real arm that is already standing does.
    """

    def __init__(
        self, robot: SimRobot, client: BulletClient, rows: np.ndarray, config: ControllerConfig, step_s: float
    ) -> None:
        self._robot, self._client, self._rows, self._step_s = robot, client, rows, step_s
        missing = [name for name in config.joints if name not in config.gains]
        if missing:
            raise SimError(f"gains: missing for {', '.join(missing)}")
        gains = [config.gains[name] for name in config.joints]
        self._p, self._i, self._d, clamp = (
            np.array([getattr(g, k) for g in gains]) for k in ("p", "i", "d", "i_clamp")
        )
        self._clamp = np.where(clamp > 0.0, clamp, np.inf)
        self._damping = np.array([robot.joints[row].damping for row in rows])
        self._max_effort = np.array([robot.joints[row].max_effort for row in rows])
        robot.use_effort(config.joints)
        self.reset()

    def reset(self) -> None:
        """Start the integral from what gravity asks for in this pose, within the clamp."""
        positions = self._robot.state()[0]
        zero = np.zeros_like(positions)
        gravity = self._inverse_dynamics(positions, zero)[self._rows]
        self._integral = np.where(self._i > 0.0, np.clip(gravity, -self._clamp, self._clamp), 0.0)

    def drive(self, set_point: JointSample) -> None:
        """Command the next step; set_point is where the joints shall be at its end."""
        positions, velocities, _ = self._robot.state()
        q, v, dt = positions[self._rows], velocities[self._rows], self._step_s
        self._integral = self._integrate(set_point.position - q)
        spring = self._p * (set_point.position - q - dt * v)
        damper = self._d * (set_point.velocity - v)
        mass = self._robot.fold(
            np.array(self._client.calculateMassMatrix(self._robot.body, positions.tolist()))
        )
        mass = mass[np.ix_(self._rows, self._rows)]
        bias = self._inverse_dynamics(positions, velocities)[self._rows] + self._damping * v
        # The acceleration over the step if springs, dampers and the joints' own damping act on its end.
        stiff = mass + np.diag(dt * (self._d + self._damping) + dt * dt * self._p)
        acceleration = np.linalg.solve(stiff, spring + damper + self._integral - bias)
        effort = spring + damper + self._integral - (dt * self._d + dt * dt * self._p) * acceleration
        friction = self._damping * (v + dt * acceleration)
        self._robot.command_efforts(
            self._rows, np.clip(effort, -self._max_effort, self._max_effort), friction
        )

    def _integrate(self, error: np.ndarray) -> np.ndarray:
        return np.clip(self._integral + self._i * error * self._step_s, -self._clamp, self._clamp)

    def _inverse_dynamics(self, positions: np.ndarray, velocities: np.ndarray) -> np.ndarray:
        """Torques [N m] (all joints, mimics' added to their leaders') of gravity and velocity terms."""
        accelerations = [0.0] * len(positions)
        out = self._client.calculateInverseDynamics(
            self._robot.body, positions.tolist(), velocities.tolist(), accelerations
        )
        return self._robot.fold(np.array(out))


def make_drive(
    robot: SimRobot, client: BulletClient, config: ControllerConfig, step_s: float
) -> PositionDrive | EffortDrive:
    """The drive that a controller's type asks for."""
    rows = robot.joint_rows(config.joints)
    if config.uses_effort:
        return EffortDrive(robot, client, rows, config, step_s)
    return PositionDrive(robot, rows)
