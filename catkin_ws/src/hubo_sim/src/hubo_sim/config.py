"""Configuration of the simulator node; the defaults live here and config/sim.yaml documents them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from fv_common.schema import Config, OneOf, Range, Seed

Rate = Annotated[float, Range(1, 1e4)]
Seconds = Annotated[float, Range(0, 1e3)]


@dataclass(frozen=True)
class SimConfig(Config):
    """Parameters of sim_node; meanings and units are in config/sim.yaml."""

    world: str = "empty"
    seed: Seed = 0
    lockstep: bool = False
    real_time_factor: Annotated[float, Range(0, 1e4)] = 1.0
    physics_rate_hz: Rate = 240.0
    clock_rate_hz: Rate = 100.0
    joint_state_rate_hz: Rate = 50.0
    renderer: Annotated[str, OneOf("auto", "egl", "tiny")] = "auto"
    gui: bool = False
    noise: bool = True
    free_running_sensors: bool | None = None
    self_collision: bool = True
    start_pose: str = ""
    world_frame: str = "world"
    goal_grace_s: Seconds = 0.1
    rest_speed_rad_s: Annotated[float, Range(0, 1e3)] = 0.02
    rest_time_s: Seconds = 0.1
    settle_timeout_s: Seconds = 5.0
    robot_timeout_s: Seconds = 0.0
    video: str = ""
    video_rate_hz: Rate = 10.0

    @property
    def scans_run_free(self) -> bool:
        """Whether sensors publish at their own rate: always, except in lockstep unless asked for."""
        return not self.lockstep if self.free_running_sensors is None else self.free_running_sensors
