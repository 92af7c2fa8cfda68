"""Lidars, inertial units and force-torque sensors on the robot: what they would measure now."""

from __future__ import annotations

import numpy as np

import hubo_description.sensors as description
from fv_common.transforms import apply, inverse
from hubo_sim.sim_robot import SimRobot
from hubo_sim.worlds.scene import GRAVITY_M_S2, Scene

_RAYS_AT_ONCE = 8192  # Bullet's limit is 16384
_THREADS = 1  # more would change nothing in the answer and take the other nodes' cores


class Lidar:
    """Casts rays against the collision shapes; the robot's own link that carries it is transparent."""

    def __init__(self, config: description.Lidar, robot: SimRobot) -> None:
        self.config = config
        self._robot = robot
        for link in config.links:
            robot.link_pose(link)  # fail at start when it does not exist
        self._directions = self._make_directions()

    @property
    def azimuths_rad(self) -> np.ndarray:
        """(samples,) angles of the rays; a full circle does not repeat its first ray."""
        half = np.radians(self.config.horizontal_fov_deg) / 2.0
        closed = self.config.horizontal_fov_deg >= 360.0
        return np.linspace(-half, half, self.config.samples, endpoint=not closed)

    def scan(self, scene: Scene, scan_number: int) -> np.ndarray:
        """(layers, samples) ranges [m], NaN = no return; noise by seed and scan_number."""
        config, T = self.config, self._robot.link_pose(self.config.frame)
        directions = self._directions.reshape(-1, 3)
        start = apply(T, directions * config.min_range_m)
        end = apply(T, directions * config.max_range_m)
        fractions = np.concatenate(
            [
                self._cast(scene, start[i : i + _RAYS_AT_ONCE], end[i : i + _RAYS_AT_ONCE])
                for i in range(0, len(start), _RAYS_AT_ONCE)
            ]
        )
        ranges = config.min_range_m + fractions * (config.max_range_m - config.min_range_m)
        rng = np.random.default_rng([config.seed, scan_number])
        ranges += config.sigma_m * rng.standard_normal(len(ranges))
        within = (ranges >= config.min_range_m) & (ranges <= config.max_range_m)
        ranges = np.where(within, ranges, np.nan)  # as a driver does with what noise carries past the limits
        return ranges.reshape(self._directions.shape[:2])

    def points(self, ranges: np.ndarray) -> np.ndarray:
        """(layers, samples, 3) float32 points in the sensor's frame of ranges (layers, samples)."""
        return (self._directions * ranges[..., None]).astype(np.float32)

    def _cast(self, scene: Scene, start: np.ndarray, end: np.ndarray) -> np.ndarray:
        """(R,) fractions of the way at which rays hit, NaN where they do not."""
        hits = scene.client.rayTestBatch(start.tolist(), end.tolist(), numThreads=_THREADS)
        return np.array([hit[2] if hit[0] >= 0 else np.nan for hit in hits])

    def _make_directions(self) -> np.ndarray:
        half = np.radians(self.config.vertical_fov_deg) / 2.0
        elevation = np.linspace(-half, half, self.config.layers) if self.config.layers > 1 else np.zeros(1)
        a, e = np.meshgrid(self.azimuths_rad, elevation)
        return np.stack([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)], axis=-1)


class Imu:
    """Differentiates the link's velocity over a physics step; call `update` after every step."""

    def __init__(self, config: description.Imu, robot: SimRobot) -> None:
        self.config = config
        self._robot = robot
        self.reset()

    def reset(self) -> None:
        """Forget the motion so far: the robot was put somewhere."""
        self._velocity = self._robot.link_velocity(self.config.link)[0]
        self._acceleration = np.zeros(3)

    def update(self, step_s: float) -> None:
        """Take note of the velocity after a step."""
        velocity = self._robot.link_velocity(self.config.link)[0]
        self._acceleration = (velocity - self._velocity) / step_s
        self._velocity = velocity

    def measure(self, reading_number: int) -> tuple[np.ndarray, np.ndarray]:
        """Angular velocity (3,) [rad/s] and specific force (3,) [m/s^2] in the link's frame."""
        turn = inverse(self._robot.link_pose(self.config.link))[:3, :3]
        force = self._acceleration + np.array([0.0, 0.0, GRAVITY_M_S2])
        rng = np.random.default_rng([self.config.seed, reading_number])
        angular = turn @ self._robot.link_velocity(self.config.link)[1]
        return (
            angular + self.config.sigma_rad_s * rng.standard_normal(3),
            turn @ force + self.config.sigma_m_s2 * rng.standard_normal(3),
        )


class ForceTorque:
    """Bullet's joint reaction, of the last physics step."""

    def __init__(self, config: description.ForceTorque, robot: SimRobot) -> None:
        self.config = config
        self._robot = robot
        self.frame = robot.enable_force_torque(self.config.joint)

    def measure(self, reading_number: int) -> tuple[np.ndarray, np.ndarray]:
        """Force (3,) [N] and torque (3,) [N m] in the frame of the joint's child link."""
        force, torque = self._robot.joint_reaction(self.config.joint)
        rng = np.random.default_rng([self.config.seed, reading_number])
        return (
            force + self.config.sigma_n * rng.standard_normal(3),
            torque + self.config.sigma_nm * rng.standard_normal(3),
        )


OTHER_SENSORS = {description.Lidar: Lidar, description.Imu: Imu, description.ForceTorque: ForceTorque}
