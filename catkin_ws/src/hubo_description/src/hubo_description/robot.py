"""A robot is a folder: load it, check its files against each other."""

from __future__ import annotations

import functools
from dataclasses import dataclass
from pathlib import Path

from fv_common.errors import told_as
from fv_common.schema import from_mapping, read_mapping
from fv_robot_model import Group, RobotModel, package_file
from hubo_description.config import JointLimit, RobotConfig, parse_joint_limits
from hubo_description.controllers import check_controllers
from hubo_description.errors import RobotDescriptionError
from hubo_description.files import read_xml
from hubo_description.sensors import DepthCamera, ForceTorque, Sensor, parse_sensors
from hubo_description.urdf import load_urdf

MAP_FRAME = "world"  # of maps, goals and simulated worlds, unless a user says otherwise
LARGEST_LIMIT = 50.0  # of a joint's position, eight turns or 50 m


@dataclass(frozen=True)
class Robot:
    """One robot's files, expanded and checked. SI units, radians."""

    name: str
    folder: Path
    config: RobotConfig
    urdf_xml: str  # expanded; meshes as absolute file:// or package:// URIs
    srdf_xml: str
    model: RobotModel  # links, joints, limits, groups and poses of both
    controllers: dict  # controllers.yaml: {<namespace>: {<controller>: ...}, controller_list: [...]}
    joint_limits: dict[str, JointLimit]
    sensors: dict[str, Sensor]
    documents: dict[
        str, dict
    ]  # robot.yaml, joint_limits.yaml, sensors.yaml as read, for the parameter server

    @property
    def groups(self) -> dict[str, Group]:
        """The SRDF's groups by name."""
        return {name: self.model.group(name) for name in self.model.group_names}

    @property
    def group_states(self) -> dict[str, dict[str, dict[str, float]]]:
        """Named poses: group -> pose -> joint -> rad (m where prismatic)."""
        return named_poses(self.model)

    @property
    def disabled_pairs(self) -> frozenset[tuple[str, str]]:
        """Link names of the SRDF's disabled pairs, each pair sorted."""
        return frozenset(self.model.disabled_pairs)

    @property
    def moving_joints(self) -> list[str]:
        """Names of the joints that move, mimics too."""
        return [joint.name for joint in self.model.joints if joint.type != "fixed"]


def named_poses(model: RobotModel) -> dict[str, dict[str, dict[str, float]]]:
    """Return the SRDF's named poses: group -> pose -> joint -> rad (m where prismatic)."""
    poses = {}
    for name in model.group_names:
        joints = model.group(name).joint_names
        states = model.named_states(name).items()
        poses[name] = {state: dict(zip(joints, map(float, values), strict=True)) for state, values in states}
    return poses


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


@told_as(RobotDescriptionError)
def load_robot(name_or_folder: str | Path) -> Robot:
    """Load a robot by its name, or from a folder of the same form.

    :raises RobotDescriptionError: no such robot (lists the valid names), or one of its files is missing, broken, or
        does not fit the others.
    """
    folder = _find_folder(name_or_folder)
    documents = {stem: read_mapping(folder / f"{stem}.yaml") for stem in ("robot", "joint_limits", "sensors")}
    robot = _assemble(
        folder, documents, from_mapping(RobotConfig, documents["robot"], f"{folder}/robot.yaml")
    )
    check_controllers(robot.controllers, robot.config.namespace, robot.model, f"{folder}/controllers.yaml")
    _check_references(robot)
    _check_map_frame(robot)
    _check_joint_ranges(robot)
    return robot


def _assemble(folder: Path, documents: dict[str, dict], config: RobotConfig) -> Robot:
    """Expand and parse what robot.yaml points to; each part is checked against the URDF."""
    urdf_xml = load_urdf(config.urdf, config.attach, folder, robots_folder() / "common")
    srdf_xml = read_xml(folder / config.srdf)
    try:
        model = RobotModel.from_xml(urdf_xml, srdf_xml, package_file)
    except ValueError as err:
        where = folder / config.srdf if "SRDF" in str(err) else f"{folder}/robot.yaml: urdf {config.urdf}"
        raise RobotDescriptionError(f"{where}: {' '.join(str(err).split())}") from err
    limits = parse_joint_limits(documents["joint_limits"], model, f"{folder}/joint_limits.yaml")
    return Robot(
        name=config.name,
        folder=folder,
        config=config,
        urdf_xml=urdf_xml,
        srdf_xml=srdf_xml,
        model=model,
        controllers=read_mapping(folder / "controllers.yaml"),
        joint_limits=limits,
        sensors=parse_sensors(documents["sensors"], f"{folder}/sensors.yaml"),
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
    _require(robot.config.base_link, [robot.model.root_link], "base_link (the URDF's root)", where)
    groups = {"group": exploration.group, "capability_group": exploration.capability_group}
    for key, name in groups.items():
        if name or key == "group":
            _require(name, robot.groups, f"exploration {key}", where)
            _require_arm(robot.groups[name], key, where)
    _require(exploration.start_pose, robot.group_states[exploration.group], "start_pose", where)
    cameras = [name for name, sensor in robot.sensors.items() if isinstance(sensor, DepthCamera)]
    _require(exploration.camera, cameras, "camera", where)
    for key, name in groups.items():
        if name:
            _require_camera_at_tip(robot, key, where)
    for shape in [*exploration.clearance.boxes, *exploration.clearance.spheres]:
        _require(shape.frame, robot.model.link_names, "clearance frame", where)
    for link in exploration.links_without_shape:
        _require(link, robot.model.link_names, "link of links_without_shape", where)
    for name, sensor in robot.sensors.items():
        _check_sensor(name, sensor, robot.model, str(robot.folder / "sensors.yaml"))


def _require_arm(group: Group, key: str, where: str) -> None:
    """Check that a group can carry a camera about: a chain with joints that move."""
    if not group.is_chain or not group.joint_names:
        lacks = "has no joint that moves" if group.is_chain else "is not one <chain>"
        raise RobotDescriptionError(f"{where}: {key} '{group.name}' {lacks} in the SRDF")


def _require_camera_at_tip(robot: Robot, key: str, where: str) -> None:
    """Check that a group's chain ends where the exploring camera looks from: views are poses of that link."""
    group = robot.groups[getattr(robot.config.exploration, key)]
    camera = robot.config.exploration.camera
    optical_frame = robot.sensors[camera].optical_frame
    if group.tip_link != optical_frame:
        raise RobotDescriptionError(
            f"{where}: {key} '{group.name}' ends in link '{group.tip_link}', but camera '{camera}' looks from "
            f"'{optical_frame}'; valid: a <chain> in the SRDF whose tip_link is the optical_frame of sensors.yaml"
        )


def _check_map_frame(robot: Robot) -> None:
    """Check that every link can be a frame; the map's own only the root can, where it stands at the map's origin."""
    config, where = robot.config, str(robot.folder / "robot.yaml")
    slashed = [name for name in robot.model.link_names if name.startswith("/")]
    if slashed:
        raise RobotDescriptionError(
            f"{where}: urdf {config.urdf}: link '{slashed[0]}' begins with /, which no frame of TF may; rename the link"
        )
    if MAP_FRAME not in robot.model.link_names:
        return
    if robot.model.root_link != MAP_FRAME:
        raise RobotDescriptionError(
            f"{where}: urdf {config.urdf}: a link below the root has the name of the map's frame, '{MAP_FRAME}'; "
            "rename the link"
        )
    if config.base_height_m != 0.0:
        raise RobotDescriptionError(
            f"{where}: base_height_m is {config.base_height_m:g}, but base_link '{MAP_FRAME}' is the map's own frame, "
            f"whose floor is at 0: rename the link, or set base_height_m: 0 and put the height into the URDF"
        )


def _check_joint_ranges(robot: Robot) -> None:
    """Check that no limit is one in degrees or millimetres, which would be no limit at all."""
    for name, limits in zip(robot.model.joint_names, robot.model.limits, strict=True):
        if max(-limits.lower, limits.upper) > LARGEST_LIMIT:
            raise RobotDescriptionError(
                f"{robot.folder}/robot.yaml: urdf {robot.config.urdf}: joint '{name}' may move from {limits.lower:g} "
                f"to {limits.upper:g}; valid: radians or metres, up to {LARGEST_LIMIT:g}, or a continuous joint"
            )


def _check_sensor(name: str, sensor: Sensor, model: RobotModel, where: str) -> None:
    """Check that the links, or the joint, that a sensor names exist."""
    if isinstance(sensor, ForceTorque):
        _require(sensor.joint, [joint.name for joint in model.joints], f"joint of sensor {name}", where)
    for link in sensor.links:
        _require(link, model.link_names, f"link of sensor {name}", where)


def _require(value: str, valid, what: str, where: str) -> None:
    if value not in valid:
        raise RobotDescriptionError(f"{where}: unknown {what} '{value}'; valid: {', '.join(valid)}")
