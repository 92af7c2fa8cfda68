"""Configuration from the parameter server."""

from __future__ import annotations

import dataclasses
import time
from typing import Any

import rospy

from fv_common.errors import told_as
from fv_common.schema import from_mapping
from hubo_sim.config import SimConfig
from hubo_sim.errors import SimError
from hubo_sim.robot_spec import RobotSpec

_UPLOAD_HINT = "run `rosrun hubo_description upload_robot --robot NAME` first"


@told_as(SimError)
def sim_config() -> SimConfig:
    """The node's private parameters. Raises SimError naming an unknown or bad one."""
    given = rospy.get_param("~", {})
    texts = [field.name for field in dataclasses.fields(SimConfig) if field.type == "str"]
    values = {
        key: str(value) if key in texts else value for key, value in given.items()
    }  # _world:=1 is a number
    return from_mapping(SimConfig, values, "sim_node")


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
