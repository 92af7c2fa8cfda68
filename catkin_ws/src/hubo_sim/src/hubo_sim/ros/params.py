"""Configuration from the parameter server."""

from __future__ import annotations

import dataclasses
import time
from typing import Any

import rospy

from hubo_sim.config import SimConfig, from_mapping
from hubo_sim.errors import SimError
from hubo_sim.robot_spec import RobotSpec

_UPLOAD_HINT = "run `rosrun hubo_description upload_robot --robot NAME` first"


def sim_config() -> SimConfig:
    """The node's private parameters. Raises SimError naming an unknown or bad one."""
    given = rospy.get_param("~", {})
    known = {field.name: field.type for field in dataclasses.fields(SimConfig)}
    values = {key: _as_number(value, str(known.get(key, ""))) for key, value in given.items()}
    return from_mapping(SimConfig, values, "sim_node")


def _as_number(value: Any, declared: str) -> Any:
    """The command line's `_real_time_factor:=0` arrives as an int and `_world:=1` as a number."""
    if declared == "float" and isinstance(value, int) and not isinstance(value, bool):
        return float(value)
    return str(value) if declared == "str" else value


def robot_spec(timeout_s: float = 0.0) -> RobotSpec:
    """The robot that upload_robot put on the parameter server. Raises SimError saying what lacks after timeout_s."""
    end_s = time.monotonic() + timeout_s
    while time.monotonic() < end_s and not rospy.has_param("/controller_list"):
        time.sleep(0.1)
    if not rospy.has_param("/robot_description"):
        raise SimError(f"no robot: /robot_description is not set; {_UPLOAD_HINT}")
    controllers = {}
    for entry in rospy.get_param("/controller_list", []):
        name = entry["name"]
        content = rospy.get_param(f"/{name}", None)
        if content is None:
            raise SimError(f"/controller_list names {name}, but /{name} is not set; {_UPLOAD_HINT}")
        controllers[name] = content
    return RobotSpec(
        urdf_xml=rospy.get_param("/robot_description"),
        srdf_xml=rospy.get_param("/robot_description_semantic", ""),
        config=rospy.get_param("/robot", {}),
        sensors=rospy.get_param("/sensors", {}),
        controllers=controllers,
        joint_limits=_joint_limits(),
    )


def _joint_limits() -> dict[str, Any]:
    limits = rospy.get_param("/robot_description_planning/joint_limits", {})
    return limits.get("joint_limits", limits)
