"""Shared: every robot by name, and forward kinematics read straight from the URDF (nothing of the package's own)."""

import xml.etree.ElementTree as ET

import numpy as np
import pytest

from hubo_description import list_robots, load_robot


def rotation(axis, angle_rad):
    """Rodrigues: (3, 3) rotation about a unit axis."""
    x, y, z = axis
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle_rad) * cross + (1 - np.cos(angle_rad)) * cross @ cross


class Kinematics:
    """T_base_link of every link, and joint axes in the base frame, for joint values in rad."""

    def __init__(self, urdf_xml):
        self._joints = list(ET.fromstring(urdf_xml).findall("joint"))

    def frames(self, pose):
        """Return ({link: (4, 4)}, {joint: (point, direction)}) in the root's frame."""
        children = {joint.find("child").get("link") for joint in self._joints}
        parents = [joint.find("parent").get("link") for joint in self._joints]
        frames = {next(link for link in parents if link not in children): np.eye(4)}
        axes, waiting = {}, list(self._joints)
        while waiting:
            joint = next(joint for joint in waiting if joint.find("parent").get("link") in frames)
            waiting.remove(joint)
            self._place(joint, pose, frames, axes)
        return frames, axes

    @staticmethod
    def _place(joint, pose, frames, axes):
        origin, axis = joint.find("origin"), joint.find("axis")
        values = {"xyz": "0 0 0", "rpy": "0 0 0"} | ({} if origin is None else origin.attrib)
        roll, pitch, yaw = (float(v) for v in values["rpy"].split())
        T = np.eye(4)
        T[:3, :3] = rotation((0, 0, 1), yaw) @ rotation((0, 1, 0), pitch) @ rotation((1, 0, 0), roll)
        T[:3, 3] = [float(v) for v in values["xyz"].split()]
        T = frames[joint.find("parent").get("link")] @ T
        if joint.get("type") != "fixed":
            direction = np.array([float(v) for v in axis.get("xyz").split()])
            axes[joint.get("name")] = (T[:3, 3].copy(), T[:3, :3] @ direction)
            value = pose.get(joint.get("name"), 0.0)
            if joint.get("type") == "prismatic":
                T[:3, 3] += T[:3, :3] @ direction * value
            else:
                T[:3, :3] = T[:3, :3] @ rotation(direction, value)
        frames[joint.find("child").get("link")] = T


@pytest.fixture(params=list_robots())
def robot(request):
    """Each robot of the package in turn."""
    return load_robot(request.param)


@pytest.fixture(scope="session")
def hubo():
    return load_robot("hubo")


@pytest.fixture(scope="session")
def hubo_kinematics(hubo):
    return Kinematics(hubo.urdf_xml)


@pytest.fixture
def kinematics(robot):
    return Kinematics(robot.urdf_xml)
