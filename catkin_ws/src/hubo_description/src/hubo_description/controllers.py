"""What controllers.yaml may hold (ros_control's names; thesis, listings 4.1 and 4.2)."""

from __future__ import annotations

from fv_common.schema import Range, number, reject_unknown, require_mapping, require_ros_name
from fv_robot_model import RobotModel
from hubo_description.errors import RobotDescriptionError

JOINT_STATE = "joint_state_controller/JointStateController"
POSITION = "position_controllers/JointTrajectoryController"
EFFORT = "effort_controllers/JointTrajectoryController"
KEYS = {
    JOINT_STATE: ["type", "publish_rate"],
    POSITION: ["type", "joints", "constraints", "state_publish_rate", "action_monitor_rate",
               "allow_partial_joints_goal", "stop_trajectory_duration"],
}  # fmt: skip
KEYS[EFFORT] = [*KEYS[POSITION], "gains", "velocity_ff"]
GAINS = ["p", "i", "d", "i_clamp"]


def check_controllers(data: dict, namespace: str, model: RobotModel, where: str) -> None:
    """Check controllers.yaml.

    :raises RobotDescriptionError: unknown key, type or joint, missing gains, a controller_list that does not fit.
    """
    reject_unknown(data, [namespace, "controller_list"], where)
    controllers = require_mapping(data.get(namespace), f"{where}: {namespace}")
    require_ros_name(namespace, f"{where}: namespace of robot.yaml")
    for name, entry in controllers.items():
        require_ros_name(name, f"{where}: {namespace}")
        _check_controller(require_mapping(entry, f"{where}: {name}"), model, f"{where}: {name}")
    listed = data.get("controller_list")
    if not isinstance(listed, list):
        raise RobotDescriptionError(f"{where}: controller_list: expected a list, got {listed!r}")
    for k, entry in enumerate(listed):
        _check_listed(require_mapping(entry, f"{where}: controller_list[{k}]"), namespace, controllers, where)


def _check_controller(entry: dict, model: RobotModel, where: str) -> None:
    kind = entry.get("type")
    if kind not in KEYS:
        raise RobotDescriptionError(f"{where}: unknown type {kind!r}; valid types: {', '.join(KEYS)}")
    reject_unknown(entry, KEYS[kind], where)
    if kind == JOINT_STATE:
        number(entry.get("publish_rate"), f"{where}: publish_rate", Range(above=0))
        return
    own = entry.get("joints")
    if not isinstance(own, list) or not own:
        raise RobotDescriptionError(f"{where}: joints: expected a list of names, got {own!r}")
    leaders = {joint.name: joint.leader for joint in model.joints if joint.leader}
    for joint in own:
        if joint in leaders and leaders[joint] not in own:
            raise RobotDescriptionError(
                f"{where}: joint '{joint}' mimics '{leaders[joint]}', which this controller does not drive; "
                f"name '{leaders[joint]}', with or without '{joint}'"
            )
        if joint not in model.joint_names and joint not in leaders:
            raise RobotDescriptionError(
                f"{where}: unknown joint '{joint}'; the robot's joints: {', '.join(model.joint_names)}"
            )
        if own.count(joint) > 1:
            raise RobotDescriptionError(f"{where}: joint '{joint}' is named twice")
    _check_constraints(entry.get("constraints", {}), own, f"{where}: constraints")
    if kind == EFFORT:
        _check_gains(entry.get("gains"), own, f"{where}: gains")


def _check_constraints(data: object, joints: list[str], where: str) -> None:
    mapping = require_mapping(data, where)
    reject_unknown(mapping, ["goal_time", "stopped_velocity_tolerance", *joints], where)
    for key, value in mapping.items():
        if key in joints:
            reject_unknown(
                require_mapping(value, f"{where}: {key}"), ["trajectory", "goal"], f"{where}: {key}"
            )
            for name, tolerance in value.items():
                number(tolerance, f"{where}: {key}: {name}", Range(0))
        else:
            number(value, f"{where}: {key}", Range(0))


def _check_gains(data: object, joints: list[str], where: str) -> None:
    mapping = require_mapping(data, where)
    reject_unknown(mapping, joints, where)
    for joint in joints:
        gains = require_mapping(mapping.get(joint), f"{where}: {joint}")
        reject_unknown(gains, GAINS, f"{where}: {joint}")
        for key, value in gains.items():
            number(value, f"{where}: {joint}: {key}", Range(0))


def _check_listed(entry: dict, namespace: str, controllers: dict, where: str) -> None:
    where = f"{where}: controller_list: {entry.get('name')}"
    reject_unknown(entry, ["name", "action_ns", "type", "joints", "default"], where)
    valid = [f"{namespace}/{name}" for name in controllers]
    if entry.get("name") not in valid:
        raise RobotDescriptionError(f"{where}: no such controller; valid: {', '.join(valid)}")
    own = controllers[entry["name"].removeprefix(f"{namespace}/")].get("joints")
    if entry.get("joints") != own:
        raise RobotDescriptionError(
            f"{where}: joints {entry.get('joints')} differ from the controller's {own}"
        )
