"""What the simulator needs to know of a robot, whoever tells it: parameter server or hubo_description."""

from __future__ import annotations

import functools
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from fv_robot_model import RobotModel, package_file
from hubo_description import RobotDescriptionError
from hubo_description.robot import named_poses
from hubo_description.sensors import Sensor, parse_sensors
from hubo_sim.errors import SimError
from hubo_sim.worlds import RobotPlace

_HOVER_M = 0.02  # robots stand so little above the floor that they do not touch it


@dataclass(frozen=True)
class RobotSpec:
    """A robot as data, in the form of docs/interfaces.md, 'A robot is a folder'."""

    urdf_xml: str
    srdf_xml: str = ""
    config: dict[str, Any] = field(default_factory=dict)  # robot.yaml
    sensors: dict[str, dict[str, Any]] = field(default_factory=dict)  # sensors.yaml
    controllers: dict[str, dict[str, Any]] = field(default_factory=dict)  # full name -> parameters
    joint_limits: dict[str, dict[str, Any]] = field(default_factory=dict)

    @functools.cached_property
    def model(self) -> RobotModel:
        """URDF and SRDF, read. Raises SimError when they are broken or do not fit."""
        try:
            return RobotModel.from_xml(self.urdf_xml, self.srdf_xml, package_file)
        except ValueError as err:
            raise SimError(f"robot: {' '.join(str(err).split())}") from err

    def __getstate__(self) -> dict[str, Any]:
        """What a process apart gets: it reads the model itself, which cannot be sent."""
        return {name: value for name, value in vars(self).items() if name != "model"}

    @property
    def groups(self) -> dict[str, list[str]]:
        """The joints of the SRDF's groups."""
        return {name: self.model.group(name).joint_names for name in self.model.group_names}

    @property
    def base_link(self) -> str:
        """Name of the link that is tied to the world; the URDF's root when robot.yaml names none."""
        return self.config.get("base_link") or self.model.root_link

    @property
    def base_height_m(self) -> float:
        """Height of the base link above the floor on which the robot stands."""
        return float(self.config.get("base_height_m", 0.0))

    def base_pose(self, place: RobotPlace, world_frame: str = "world") -> np.ndarray:
        """T_world_base (4, 4) in a world that has such a place for a robot.

        A base link that is named as the world's frame is that frame: it stands at the origin. Raises SimError where
        the place is another one, and for another link of that name.
        """
        T = place.base_pose(self.base_height_m)
        if world_frame not in self.model.link_names:
            return T
        if world_frame != self.base_link:
            raise SimError(
                f"the robot has a link named {world_frame!r}, as the world's frame is; rename the link"
            )
        if not np.allclose(T, np.eye(4), atol=_HOVER_M):
            raise SimError(
                f"the robot's base link is named {world_frame!r}, as the world's frame is, but would stand at "
                f"({', '.join(f'{value:g}' for value in T[:3, 3])}) m, yaw {place.yaw_deg:g} deg; rename the link, or "
                "set base_height_m: 0 and take a world with its robot at the origin"
            )
        return np.eye(4)

    def group_state(self, name: str) -> dict[str, float]:
        """Joint positions [rad, m] of a named SRDF pose. Raises SimError listing the names."""
        states = self._group_states()
        if name not in states:
            raise SimError(f"unknown pose {name!r}; the SRDF has: {', '.join(sorted(states)) or 'none'}")
        return states[name]

    def start_positions(self, start_pose: str = "") -> dict[str, float]:
        """Joint positions at the start: of `start_pose`, else of robot.yaml's exploration.start_pose, else none.

        Groups without that pose start at `home`, if they have one: at zero HUBO's left hand would rest on its thigh.
        """
        name = start_pose or (self.config.get("exploration") or {}).get("start_pose", "")
        home = self._group_states().get("home", {})
        return home | (self.group_state(name) if name else {})

    def parsed_sensors(self) -> dict[str, Sensor]:
        """The sensors by name, checked. Raises SimError naming sensor and key."""
        try:
            return parse_sensors(self.sensors)
        except RobotDescriptionError as err:
            raise SimError(str(err)) from err

    def _group_states(self) -> dict[str, dict[str, float]]:
        """Joint positions [rad, m] of every named SRDF pose, over all groups that have one of that name."""
        states: dict[str, dict[str, float]] = {}
        for poses in named_poses(self.model).values():
            for name, positions in poses.items():
                states.setdefault(name, {}).update(positions)
        return states
