"""A robot's data from package hubo_description, for what runs without a parameter server."""

from __future__ import annotations

import dataclasses

from hubo_sim.errors import SimError
from hubo_sim.robot_spec import RobotSpec


def load_robot_spec(name_or_folder: str) -> RobotSpec:
    """The robot of that name or folder. Raises SimError with hubo_description's own words."""
    from hubo_description import RobotDescriptionError, load_robot

    try:
        robot = load_robot(name_or_folder)
    except RobotDescriptionError as err:
        raise SimError(str(err)) from err
    controllers = {}
    for entry in robot.controllers.get("controller_list", []):
        content = robot.controllers
        for part in entry["name"].split("/"):
            content = content[part]
        controllers[entry["name"]] = content
    return RobotSpec(
        urdf_xml=robot.urdf_xml,
        srdf_xml=robot.srdf_xml,
        config=robot.documents["robot"],
        sensors=robot.documents["sensors"],
        controllers=controllers,
        joint_limits={name: dataclasses.asdict(limit) for name, limit in robot.joint_limits.items()},
    )
