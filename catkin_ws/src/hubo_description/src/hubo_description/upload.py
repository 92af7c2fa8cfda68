"""Put a robot on the parameter server, as docs/interfaces.md says."""

from __future__ import annotations

import dataclasses
import sys

import rosgraph

from fv_common.command import Parser
from hubo_description.check import bare_links_text, check_robot, start_contact_text
from hubo_description.errors import RobotDescriptionError
from hubo_description.robot import Robot, list_robots, load_robot


def parameters(robot: Robot) -> dict[str, object]:
    """Return everything that the parameter server holds about a robot, by absolute name."""
    namespace = robot.config.namespace
    values: dict[str, object] = {
        "/robot_description": robot.urdf_xml,
        "/robot_description_semantic": robot.srdf_xml,
        "/robot_description_planning/joint_limits": {
            name: dataclasses.asdict(limit) for name, limit in robot.joint_limits.items()
        },
        "/robot": robot.documents["robot"],
        "/sensors": robot.documents["sensors"],
        "/controller_list": robot.controllers["controller_list"],
    }
    for name, controller in robot.controllers[namespace].items():
        values[f"/{namespace}/{name}"] = controller
    return values


def upload(robot: Robot) -> None:
    """Set all parameters of the robot on the running master.

    :raises OSError: no master answers.
    """
    master = rosgraph.Master("/upload_robot")
    master.getPid()  # fail before the first parameter, not in the middle
    for name, value in parameters(robot).items():
        master.setParam(name, value)


def main(argv: list[str] | None = None) -> int:
    """Command line: ``upload_robot --robot NAME [--check]``; 0 on success."""
    parser = Parser(description="Put a robot's description on the parameter server.")
    parser.add_argument("--robot", default="hubo", help=f"name or folder; one of {', '.join(list_robots())}")
    parser.add_argument(
        "--check",
        action="store_true",
        help="only check the robot: its files, and all that nodes make of them; needs no ROS master",
    )
    args = parser.parse_args(rosgraph.myargv(sys.argv if argv is None else ["", *argv])[1:])
    try:
        robot = load_robot(args.robot)
        notes = check_robot(robot)
        if not args.check:
            upload(robot)
    except RobotDescriptionError as err:
        print(f"upload_robot: {err}", file=sys.stderr)
        return 1
    except OSError as err:
        print(
            f"upload_robot: no ROS master answers (roscore starts one; --check needs none): {err}",
            file=sys.stderr,
        )
        return 1
    print(
        f"upload_robot: {robot.name}: {len(robot.moving_joints)} joints, {len(robot.sensors)} sensors",
        *notes,
        sep="; ",
    )
    for text in (robot.model.bare_links and bare_links_text(robot), start_contact_text(robot)):
        if text:
            print(f"upload_robot: warning: {text}", file=sys.stderr)
    return 0
