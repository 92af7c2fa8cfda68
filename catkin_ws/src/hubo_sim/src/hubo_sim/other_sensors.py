"""Lidars, inertial units and force-torque sensors on the robot: what they would measure now."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from hubo_sim.config import from_mapping, number
from hubo_sim.errors import SimError
from hubo_sim.scene import GRAVITY_M_S2, Scene
from hubo_sim.sim_robot import SimRobot
from hubo_sim.transforms import apply, inverse

_RAYS_AT_ONCE = 8192  # Bullet's limit is 16384
_THREADS = 1  # more would change nothing in the answer and take the other nodes' cores


@dataclass(frozen=True)
class LidarConfig:
    """`type: lidar`: rays over azimuth, about z from x to y of `frame`, in `layers` of elevation; 1 layer: planar."""

    type: str
    link: str
    frame: str
    topic: str
    samples: int
    min_range_m: float
    max_range_m: float
    layers: int = 1
    horizontal_fov_deg: float = 360.0
    vertical_fov_deg: float = 0.0
    rate_hz: float = 10.0
    sigma_m: float = 0.0
    seed: int = 0

    def __post_init__(self) -> None:
        for name in ("samples", "layers"):
            value = getattr(self, name)
            if isinstance(value, bool) or not isinstance(value, int) or not 1 <= value <= 100_000:
                raise SimError(f"{name} must be a whole number within [1, 100000], got {value!r}")
        number(self.horizontal_fov_deg, "horizontal_fov_deg", 0.0, 360.0)
        number(self.vertical_fov_deg, "vertical_fov_deg", 0.0, 180.0)
        number(self.min_range_m, "min_range_m", 0.0)
        number(self.max_range_m, "max_range_m", self.min_range_m)
        number(self.rate_hz, "rate_hz", 0.01, 1000.0)
        number(self.sigma_m, "sigma_m", 0.0)


@dataclass(frozen=True)
class ImuConfig:
    """`type: imu`: angular velocity and specific force (gravity at rest: +9.81 upwards) of a link, in its frame."""

    type: str
    link: str
    topic: str
    rate_hz: float = 100.0
    sigma_rad_s: float = 0.0
    sigma_m_s2: float = 0.0
    seed: int = 0

    def __post_init__(self) -> None:
        number(self.rate_hz, "rate_hz", 0.01, 1000.0)
        number(self.sigma_rad_s, "sigma_rad_s", 0.0)
        number(self.sigma_m_s2, "sigma_m_s2", 0.0)


@dataclass(frozen=True)
class ForceTorqueConfig:
    """`type: force_torque`: Bullet's reaction in a joint, in the frame of the joint's child link."""

    type: str
    joint: str
    topic: str
    rate_hz: float = 100.0
    sigma_n: float = 0.0
    sigma_nm: float = 0.0
    seed: int = 0

    def __post_init__(self) -> None:
        number(self.rate_hz, "rate_hz", 0.01, 1000.0)
        number(self.sigma_n, "sigma_n", 0.0)
        number(self.sigma_nm, "sigma_nm", 0.0)


class Lidar:
    """Casts rays against the collision shapes; the robot's own link that carries it is transparent."""

    def __init__(self, name: str, content: dict[str, Any], robot: SimRobot) -> None:
        self.config: LidarConfig = from_mapping(LidarConfig, content, f"sensors.yaml: {name}")
        self._robot = robot
        for link in (self.config.link, self.config.frame):
            robot.link_pose(link)
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

    def __init__(self, name: str, content: dict[str, Any], robot: SimRobot) -> None:
        self.config: ImuConfig = from_mapping(ImuConfig, content, f"sensors.yaml: {name}")
        self._robot = robot
        self._velocity = robot.link_velocity(self.config.link)[0]
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

    def __init__(self, name: str, content: dict[str, Any], robot: SimRobot) -> None:
        self.config: ForceTorqueConfig = from_mapping(ForceTorqueConfig, content, f"sensors.yaml: {name}")
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


SENSOR_TYPES = {"lidar": Lidar, "imu": Imu, "force_torque": ForceTorque}
