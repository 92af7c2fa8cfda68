"""What the simulator needs to know of a robot, whoever tells it: parameter server or hubo_description."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from hubo_description import RobotDescriptionError
from hubo_description.sensors import Sensor, parse_sensors
from hubo_sim.errors import SimError
from hubo_sim.models import parse_xml, root_link


@dataclass(frozen=True)
class RobotSpec:
    """A robot as data, in the form of docs/interfaces.md, 'A robot is a folder'."""

    urdf_xml: str
    srdf_xml: str = ""
    config: dict[str, Any] = field(default_factory=dict)  # robot.yaml
    sensors: dict[str, dict[str, Any]] = field(default_factory=dict)  # sensors.yaml
    controllers: dict[str, dict[str, Any]] = field(default_factory=dict)  # full name -> parameters
    joint_limits: dict[str, dict[str, Any]] = field(default_factory=dict)
    groups: dict[str, tuple[str, ...]] = field(default_factory=dict)  # SRDF groups' joints

    @property
    def base_link(self) -> str:
        """Name of the link that is tied to the world; the URDF's root when robot.yaml names none."""
        return self.config.get("base_link") or root_link(self.urdf_xml)

    @property
    def base_height_m(self) -> float:
        """Height of the base link above the floor on which the robot stands."""
        return float(self.config.get("base_height_m", 0.0))

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
        for state in parse_xml(self.srdf_xml or "<robot/>", "SRDF").iter("group_state"):
            values = {j.get("name"): float(j.get("value", "0").split()[0]) for j in state.iter("joint")}
            states.setdefault(state.get("name"), {}).update(values)
        return states

    def disabled_pairs(self) -> list[tuple[str, str]]:
        """Link pairs that the SRDF takes out of self-collision."""
        pairs = parse_xml(self.srdf_xml or "<robot/>", "SRDF").iter("disable_collisions")
        return [(pair.get("link1"), pair.get("link2")) for pair in pairs]
