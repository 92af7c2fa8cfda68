"""Configuration of the simulator node; the defaults live here and config/sim.yaml documents them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, TypeVar

from hubo_description import schema
from hubo_sim.errors import SimError

T = TypeVar("T")
RENDERERS = ("auto", "egl", "tiny")


def from_mapping(cls: type[T], values: Any, where: str) -> T:
    """hubo_description's reader of mappings into dataclasses; what it refuses is a SimError here."""
    try:
        return schema.from_mapping(cls, values, where)
    except schema.RobotDescriptionError as err:
        raise SimError(str(err)) from err


def number(value: Any, name: str, low: float = -math.inf, high: float = math.inf) -> float:
    """`value` as a finite float within [low, high], else SimError."""
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value):
        raise SimError(f"{name} must be a finite number, got {value!r}")
    if not low <= value <= high:
        raise SimError(f"{name} must be within [{low}, {high}], got {value!r}")
    return float(value)


@dataclass(frozen=True)
class SimConfig:
    """Parameters of sim_node; meanings and units are in config/sim.yaml."""

    world: str = "empty"
    seed: int = 0
    lockstep: bool = False
    real_time_factor: float = 1.0
    physics_rate_hz: float = 240.0
    clock_rate_hz: float = 100.0
    joint_state_rate_hz: float = 50.0
    renderer: str = "auto"
    gui: bool = False
    noise: bool = True
    free_running_sensors: bool | None = None
    self_collision: bool = True
    start_pose: str = ""
    world_frame: str = "world"
    goal_grace_s: float = 0.1
    rest_speed_rad_s: float = 0.02
    rest_time_s: float = 0.1
    settle_timeout_s: float = 5.0
    robot_timeout_s: float = 0.0
    video: str = ""
    video_rate_hz: float = 10.0

    def __post_init__(self) -> None:
        number(self.real_time_factor, "real_time_factor", 0.0, 1e4)
        for name in ("physics_rate_hz", "clock_rate_hz", "joint_state_rate_hz", "video_rate_hz"):
            number(getattr(self, name), name, 1.0, 1e4)
        for name in (
            "goal_grace_s",
            "rest_speed_rad_s",
            "rest_time_s",
            "settle_timeout_s",
            "robot_timeout_s",
        ):
            number(getattr(self, name), name, 0.0, 1e3)
        if self.renderer not in RENDERERS:
            raise SimError(f"renderer must be one of {', '.join(RENDERERS)}, got {self.renderer!r}")
        if isinstance(self.seed, bool) or not isinstance(self.seed, int) or self.seed < 0:
            raise SimError(f"seed must be a non-negative integer, got {self.seed!r}")
        for name in ("lockstep", "gui", "noise", "self_collision"):
            if not isinstance(getattr(self, name), bool):
                raise SimError(f"{name} must be true or false, got {getattr(self, name)!r}")

    @property
    def scans_run_free(self) -> bool:
        """Whether sensors publish at their own rate: always, except in lockstep unless asked for."""
        return not self.lockstep if self.free_running_sensors is None else self.free_running_sensors
