"""What robot.yaml and joint_limits.yaml may hold."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass, field
from typing import Annotated

from fv_common.schema import Config, Range, Vector3, from_mapping, reject_unknown, require_mapping
from fv_robot_model import RobotModel
from hubo_description.errors import RobotDescriptionError

Edge = Annotated[float, Range(above=0, high=20)]  # [m] of a clearance: nobody vouches for halls


@dataclass(frozen=True)
class ClearanceBox(Config):
    """A box, parallel to the axes of its frame, that the operator vouches for as free."""

    frame: str  # a link
    center_m: Vector3
    size_m: tuple[Edge, Edge, Edge]  # full edge lengths


@dataclass(frozen=True)
class ClearanceSphere(Config):
    """A sphere that the operator vouches for as free."""

    frame: str  # a link
    center_m: Vector3
    radius_m: Edge


@dataclass(frozen=True)
class Clearance:
    """Space known free before the first scan, fixed to the links' pose at the start."""

    boxes: list[ClearanceBox] = field(default_factory=list)
    spheres: list[ClearanceSphere] = field(default_factory=list)


@dataclass(frozen=True)
class Exploration:
    """How the robot explores."""

    group: str  # SRDF group that moves
    capability_group: str  # SRDF group whose capability map filters the views; empty: every view in reach
    camera: str  # a depth camera of sensors.yaml
    start_pose: str  # group_state of the group
    clearance: Clearance = field(default_factory=Clearance)
    links_without_shape: list[str] = field(
        default_factory=list
    )  # drawn links without <collision>, accepted by name


@dataclass(frozen=True)
class RobotConfig:
    """robot.yaml."""

    name: str
    description: str  # one line
    urdf: str  # .urdf or .urdf.xacro in the robot's folder, or pybullet_data:<path>
    srdf: str  # file in the robot's folder
    namespace: str  # of the controllers
    base_link: str  # root link, z up
    exploration: Exploration
    base_height_m: float = 0.0  # of base_link over the floor the robot stands on
    attach: str | None = None  # xacro in the robot's folder whose links and joints are added to the URDF

    def __post_init__(self) -> None:
        if "/" in self.name or not self.name.strip(". "):
            raise ValueError(f"name must be one that a file can have, got '{self.name}'")
        if not self.urdf.startswith("pybullet_data:") and not self.urdf.endswith((".urdf", ".urdf.xacro")):
            raise ValueError(f"urdf must be *.urdf, *.urdf.xacro or pybullet_data:<path>, got '{self.urdf}'")


@dataclass(frozen=True)
class JointLimit(Config):
    """Limits of one joint that planning obeys: rad/s and rad/s^2 (m/s and m/s^2 where prismatic)."""

    has_velocity_limits: bool
    max_velocity: Annotated[float, Range(above=0, high=50, unit="rad/s or m/s")]
    has_acceleration_limits: bool
    max_acceleration: Annotated[float, Range(above=0, high=1000, unit="rad/s^2 or m/s^2")]

    def narrowed(self, mimic: JointLimit, rate: float) -> JointLimit:
        """Return these limits such that a joint that moves ``rate`` times as fast keeps its own as well."""
        kept = dataclasses.asdict(self)
        for kind in ("velocity", "acceleration"):
            if getattr(mimic, f"has_{kind}_limits"):
                bound = getattr(mimic, f"max_{kind}") / rate
                own = kept[f"max_{kind}"] if kept[f"has_{kind}_limits"] else bound
                kept |= {f"has_{kind}_limits": True, f"max_{kind}": min(own, bound)}
        return JointLimit(**kept)


def parse_joint_limits(data: object, model: RobotModel, where: str) -> dict[str, JointLimit]:
    """Return the limits by joint name, those of leaders narrowed by the rows that their mimics have.

    Every joint that moves by itself needs a row; passive joints and mimics may have one.

    :raises RobotDescriptionError: unknown joint or key, a joint without limits, a value out of range.
    """
    mapping = require_mapping(data, where)
    reject_unknown(mapping, ["joint_limits"], where)
    table = require_mapping(mapping.get("joint_limits"), f"{where}: joint_limits")
    moving = {joint.name: joint for joint in model.joints if joint.type != "fixed"}
    for name in table:
        if name not in moving:
            raise RobotDescriptionError(
                f"{where}: unknown joint '{name}'; the robot's joints: {', '.join(moving)}"
            )
    for name in model.joint_names:
        if name not in table and name not in model.passive_joints:
            raise RobotDescriptionError(f"{where}: no limits for joint '{name}'")
    limits = {name: from_mapping(JointLimit, row, f"{where}: {name}") for name, row in table.items()}
    for name in limits:
        leader, rate = moving[name].leader, abs(moving[name].multiplier)
        if leader in limits and rate > 0.0:
            limits[leader] = limits[leader].narrowed(limits[name], rate)
    return limits
