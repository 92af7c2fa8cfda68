"""Everything that nodes make of a robot, made once before they start, so that what they would refuse is said here."""

from __future__ import annotations

import importlib.util

from fv_robot_model import RobotModel, SelfCollision, SelfFilter
from fv_robot_model.ik import make_ik_solver
from hubo_description.collision import SelfCollision as InBullet
from hubo_description.disabled_pairs import start_pose
from hubo_description.errors import RobotDescriptionError
from hubo_description.robot import Robot


def check_robot(robot: Robot) -> list[str]:
    """Build what planner, explorer, capability map and simulator build of a loaded robot.

    :return: short notes on what was chosen, for the terminal.
    :raises RobotDescriptionError: something cannot be built; it names file and reason.
    """
    exploration, where = robot.config.exploration, f"{robot.folder}/robot.yaml"
    notes = []
    for name in dict.fromkeys((exploration.group, exploration.capability_group)):
        if name:
            notes.append(f"{name}: inverse kinematics {_solver_family(robot, name, where)}")
    try:
        SelfFilter(robot.model)
        SelfCollision(robot.model, group=exploration.group)
    except ValueError as err:
        raise RobotDescriptionError(
            f"{where}: urdf {robot.config.urdf}: {' '.join(str(err).split())}"
        ) from err
    if importlib.util.find_spec("pybullet") is None:
        return [*notes, "pybullet is not installed: the simulator's part is not checked"]
    with InBullet(robot):
        return notes


def check_explorer(robot: Robot) -> None:
    """Refuse, before any node starts, a robot that cannot explore. :raises RobotDescriptionError: it says why."""
    check_robot(robot)
    exploration = robot.config.exploration
    require_shapes(
        robot.model, exploration.group, exploration.links_without_shape, f"{robot.folder}/robot.yaml"
    )
    if contact := start_contact_text(robot):
        raise RobotDescriptionError(contact)


def start_contact_text(robot: Robot) -> str:
    """Return one line when the robot touches itself where exploring begins, with what helps; else ""."""
    body = SelfCollision(robot.model, group=robot.config.exploration.group)
    pair = body.first_contact(robot.model.configuration(start_pose(robot)))
    if pair is None:
        return ""
    return (
        f"{robot.folder / robot.config.srdf}: links '{pair[0]}' and '{pair[1]}' touch in the start pose "
        f"'{robot.config.exploration.start_pose}': no motion can begin there. If they always do, rosrun "
        f"hubo_description compute_disabled_pairs --robot {robot.folder} adds the pair; else choose another start_pose"
    )


def _solver_family(robot: Robot, group: str, where: str) -> str:
    try:
        return make_ik_solver(robot.model, group).family
    except ValueError as err:
        raise RobotDescriptionError(f"{where}: group '{group}': {' '.join(str(err).split())}") from err


def bare_links_text(robot: Robot) -> str:
    """Return one line on the links that are drawn but have no collision shape."""
    return (
        f"links without <collision>, unknown to planner and self-filter: {', '.join(robot.model.bare_links)}"
    )


def require_shapes(model: RobotModel, group: str, accepted: list[str], where: str) -> None:
    """Refuse to explore with an arm whose body is not known, unless its owner says yes to each such link.

    :param group: that explores. :param accepted: ``exploration: links_without_shape`` of robot.yaml.
    :raises RobotDescriptionError: it lists the links, ready to be copied.
    """
    bare = [link for link in model.bare_links if link not in accepted]
    moved = model.moved_links(model.group(group).joint_names)
    if not any(model.shapes(link) for link in moved):
        bare += [link for link in moved if link not in (*bare, *accepted)]
    if bare:
        names = ", ".join(bare)
        raise RobotDescriptionError(
            f"{where}: links without <collision>, which neither planner nor self-filter would know of: {names}; give "
            f"them shapes in the URDF, or accept this in robot.yaml: exploration: links_without_shape: [{names}]"
        )
