"""A robot is a folder: load it, check its files against each other."""

from __future__ import annotations

import functools
from dataclasses import dataclass
from pathlib import Path

from hubo_description.config import JointLimit, RobotConfig, parse_joint_limits
from hubo_description.controllers import check_controllers
from hubo_description.errors import RobotDescriptionError
from hubo_description.schema import from_mapping, read_yaml
from hubo_description.sensors import DepthCamera, ForceTorque, Sensor, parse_sensors
from hubo_description.srdf import Group, parse_srdf, read_srdf
from hubo_description.urdf import UrdfModel, load_urdf, parse_urdf


@dataclass(frozen=True)
class Robot:
    """One robot's files, expanded and checked. SI units, radians."""

    name: str
    folder: Path
    config: RobotConfig
    urdf_xml: str  # expanded; meshes as absolute file:// or package:// URIs
    srdf_xml: str
    model: UrdfModel  # links, joints and their limits
    controllers: dict  # controllers.yaml: {<namespace>: {<controller>: ...}, controller_list: [...]}
    joint_limits: dict[str, JointLimit]
    sensors: dict[str, Sensor]
    groups: dict[str, Group]
    group_states: dict[str, dict[str, dict[str, float]]]  # group -> pose -> joint -> rad
    disabled_pairs: frozenset[tuple[str, str]]  # link names, each pair sorted
    documents: dict[
        str, dict
    ]  # robot.yaml, joint_limits.yaml, sensors.yaml as read, for the parameter server


def robots_folder() -> Path:
    """Return the folder that holds the robots: the package's own, as catkin finds it.

    :raises RobotDescriptionError: neither beside this source tree nor in a sourced workspace.
    """
    beside = Path(__file__).resolve().parents[2] / "robots"
    return beside if beside.is_dir() else _robots_from_workspace()


@functools.cache
def _robots_from_workspace() -> Path:
    import rospkg  # only an installed package needs to look for its own share folder

    try:
        return Path(rospkg.RosPack().get_path("hubo_description")) / "robots"
    except rospkg.ResourceNotFound as err:
        raise RobotDescriptionError("hubo_description/robots not found: is the workspace sourced?") from err


def list_robots() -> list[str]:
    """Return the names of the robots that come with this package, sorted."""
    return sorted(path.parent.name for path in robots_folder().glob("*/robot.yaml"))


def load_robot(name_or_folder: str | Path) -> Robot:
    """Load a robot by its name, or from a folder of the same form.

    :raises RobotDescriptionError: no such robot (lists the valid names), or one of its files is missing, broken, or
        does not fit the others.
    """
    folder = _find_folder(name_or_folder)
    documents = {stem: read_yaml(folder / f"{stem}.yaml") for stem in ("robot", "joint_limits", "sensors")}
    robot = _assemble(
        folder, documents, from_mapping(RobotConfig, documents["robot"], f"{folder}/robot.yaml")
    )
    check_controllers(
        robot.controllers, robot.config.namespace, robot.model.moving_joints, f"{folder}/controllers.yaml"
    )
    _check_references(robot)
    return robot


def _assemble(folder: Path, documents: dict[str, dict], config: RobotConfig) -> Robot:
    """Expand and parse what robot.yaml points to; each part is checked against the URDF."""
    urdf_xml = load_urdf(config.urdf, config.attach, folder, robots_folder() / "common")
    model = parse_urdf(urdf_xml, f"{folder}/robot.yaml: urdf {config.urdf}")
    srdf_xml = read_srdf(folder / config.srdf)
    srdf = parse_srdf(srdf_xml, model, str(folder / config.srdf))
    limits = parse_joint_limits(documents["joint_limits"], model.moving_joints, f"{folder}/joint_limits.yaml")
    return Robot(
        name=config.name,
        folder=folder,
        config=config,
        urdf_xml=urdf_xml,
        srdf_xml=srdf_xml,
        model=model,
        controllers=read_yaml(folder / "controllers.yaml"),
        joint_limits=limits,
        sensors=parse_sensors(documents["sensors"], f"{folder}/sensors.yaml"),
        groups=srdf.groups,
        group_states=srdf.group_states,
        disabled_pairs=srdf.disabled_pairs,
        documents=documents,
    )


def _find_folder(name_or_folder: str | Path) -> Path:
    for folder in (robots_folder() / name_or_folder, Path(name_or_folder).expanduser()):
        if (folder / "robot.yaml").is_file():
            return folder.resolve()
    raise RobotDescriptionError(
        f"unknown robot '{name_or_folder}'; valid: {', '.join(list_robots())}, or a folder with a robot.yaml"
    )


def _check_references(robot: Robot) -> None:
    """Check that robot.yaml and sensors.yaml name links, groups, poses and cameras that exist."""
    exploration, where = robot.config.exploration, str(robot.folder / "robot.yaml")
    _require(robot.config.base_link, [robot.model.root], "base_link (the URDF's root)", where)
    _require(exploration.group, robot.groups, "exploration group", where)
    if exploration.capability_group:
        _require(exploration.capability_group, robot.groups, "capability_group", where)
    _require(exploration.start_pose, robot.group_states[exploration.group], "start_pose", where)
    cameras = [name for name, sensor in robot.sensors.items() if isinstance(sensor, DepthCamera)]
    _require(exploration.camera, cameras, "camera", where)
    for shape in [*exploration.clearance.boxes, *exploration.clearance.spheres]:
        _require(shape.frame, robot.model.links, "clearance frame", where)
    for name, sensor in robot.sensors.items():
        _check_sensor(name, sensor, robot.model, str(robot.folder / "sensors.yaml"))


def _check_sensor(name: str, sensor: Sensor, model: UrdfModel, where: str) -> None:
    """Check that the links, or the joint, that a sensor names exist."""
    if isinstance(sensor, ForceTorque):
        _require(sensor.joint, model.joints, f"joint of sensor {name}", where)
    for link in sensor.links:
        _require(link, model.links, f"link of sensor {name}", where)


def _require(value: str, valid, what: str, where: str) -> None:
    if value not in valid:
        raise RobotDescriptionError(f"{where}: unknown {what} '{value}'; valid: {', '.join(valid)}")
