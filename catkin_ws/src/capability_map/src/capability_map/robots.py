"""The robot a map is built for, from hubo_description."""

from __future__ import annotations

from dataclasses import dataclass

from capability_map.errors import CapabilityMapError
from capability_map.identity import urdf_hash


@dataclass(frozen=True)
class Arm:
    """A group of a robot, as text: what a worker process needs to build the model again."""

    robot: str
    group: str
    urdf_xml: str
    srdf_xml: str

    @property
    def urdf_sha256(self) -> str:
        """Hash of what the map depends on in the URDF."""
        return urdf_hash(self.urdf_xml)

    def model(self):
        """Return the RobotModel. :raises CapabilityMapError: the description is broken."""
        from fv_robot_model import RobotModel, package_file

        try:
            return RobotModel.from_xml(self.urdf_xml, self.srdf_xml, package_file)
        except ValueError as err:
            raise CapabilityMapError(f"robot {self.robot}: {err}") from err


def load_arm(robot: str, group: str | None = None) -> Arm:
    """Load a robot of hubo_description; without a group, the one its robot.yaml names for capability maps.

    :raises CapabilityMapError: unknown robot or group; lists the valid ones.
    """
    from hubo_description import RobotDescriptionError, load_robot

    try:
        loaded = load_robot(robot)
    except RobotDescriptionError as err:
        raise CapabilityMapError(str(err)) from err
    group = group or loaded.config.exploration.capability_group or loaded.config.exploration.group
    if group not in loaded.groups:
        raise CapabilityMapError(
            f"robot {loaded.name} has no group '{group}'; valid: {', '.join(sorted(loaded.groups))}"
        )
    return Arm(loaded.name, group, loaded.urdf_xml, loaded.srdf_xml)
