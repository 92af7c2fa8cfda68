"""The robot's shapes at given joint positions, from its URDF text alone: what the ghosts along a path are made of."""

from __future__ import annotations

import dataclasses
import xml.etree.ElementTree as ElementTree

import numpy as np
from geometry_msgs.msg import Point, Pose, Quaternion, Vector3
from std_msgs.msg import Header
from visualization_msgs.msg import Marker

from fv_viz import packing, shapes


@dataclasses.dataclass(frozen=True)
class Visual:
    """One shape of a link: its pose in the link frame, marker type, size [m] and mesh (empty: primitive)."""

    link: str
    T_link_shape: np.ndarray
    kind: int
    size: tuple[float, float, float]
    mesh: str


@dataclasses.dataclass(frozen=True)
class Joint:
    """A joint: T_parent_joint at zero, axis in the joint frame, and what it mimics (name, factor, offset)."""

    name: str
    kind: str
    parent: str
    child: str
    T_parent_joint: np.ndarray
    axis: np.ndarray
    mimic: tuple[str, float, float] | None


class RobotShapes:
    """Forward kinematics and shapes of a URDF.

    Raises ValueError for XML that cannot be read or has no single root link.
    """

    def __init__(self, urdf_xml: str) -> None:
        try:
            root = ElementTree.fromstring(urdf_xml)
        except ElementTree.ParseError as error:
            raise ValueError(f"robot description is not valid XML: {error}") from error
        links = [link.get("name") for link in root.findall("link")]
        joints = [_joint(element) for element in root.findall("joint")]
        children = {joint.child for joint in joints}
        tops = [name for name in links if name not in children]
        if len(tops) != 1:
            raise ValueError(f"robot description needs one root link, found {tops}")
        self.root = tops[0]
        self._ordered = _in_order(self.root, joints)
        self.joint_names = [
            joint.name for joint in self._ordered if joint.kind != "fixed" and not joint.mimic
        ]
        self.visuals = [v for link in root.findall("link") for v in _visuals(link)]

    def link_poses(self, positions: dict[str, float]) -> dict[str, np.ndarray]:
        """T_root_link (4, 4) of every link; joints not named stand at zero."""
        poses = {self.root: np.eye(4)}
        for joint in self._ordered:
            value = positions.get(joint.name, 0.0)
            if joint.mimic:
                value = positions.get(joint.mimic[0], 0.0) * joint.mimic[1] + joint.mimic[2]
            poses[joint.child] = poses[joint.parent] @ joint.T_parent_joint @ _motion(joint, value)
        return poses

    def markers(
        self,
        namespace: str,
        positions: dict[str, float],
        color,
        alpha: float,
        number: int,
        links: set[str] | None = None,
    ) -> list[bytes]:
        """The robot, or some links of it, as markers in the frame of its root link, numbered from `number`."""
        poses, out = self.link_poses(positions), []
        for visual in self.visuals:
            if links is None or visual.link in links:
                one = shapes.marker(
                    Header(frame_id=self.root), namespace, visual.kind, color, alpha, number + len(out)
                )
                one.frame_locked = True  # else RViz drops for good what comes before the first transform
                one.pose = pose_message(poses[visual.link] @ visual.T_link_shape)
                one.scale, one.mesh_resource = Vector3(*visual.size), visual.mesh
                out.append(packing.pack_marker(one))
        return out

    def moved_by(self, joint_names: list[str]) -> set[str]:
        """Links whose pose depends on one of these joints."""
        moved: set[str] = set()
        for joint in self._ordered:
            if (
                joint.name in joint_names
                or joint.parent in moved
                or (joint.mimic and joint.mimic[0] in joint_names)
            ):
                moved.add(joint.child)
        return moved


def pose_message(T: np.ndarray) -> Pose:
    """Pose message of a transform (4, 4)."""
    return Pose(Point(*T[:3, 3]), Quaternion(*quaternion(T[:3, :3])))


def quaternion(R: np.ndarray) -> np.ndarray:
    """Quaternion (4,) x y z w of a rotation matrix, by the largest of its four components (Shepperd)."""
    trace = np.array([R[0, 0], R[1, 1], R[2, 2], R.trace()])
    k = int(np.argmax(trace))
    if k == 3:
        q = np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1], 1.0 + trace[3]])
    else:
        i, j = (k + 1) % 3, (k + 2) % 3
        q = np.zeros(4)
        q[k] = 1.0 - trace[3] + 2.0 * R[k, k]
        q[i], q[j], q[3] = R[i, k] + R[k, i], R[j, k] + R[k, j], R[j, i] - R[i, j]
    return q / np.linalg.norm(q)


def _numbers(text: str | None, default: tuple[float, ...]) -> np.ndarray:
    return np.array([float(k) for k in text.split()] if text else default)


def _origin(element: ElementTree.Element) -> np.ndarray:
    origin = element.find("origin")
    T = np.eye(4)
    if origin is not None:
        roll, pitch, yaw = _numbers(origin.get("rpy"), (0.0, 0.0, 0.0))
        T[:3, :3] = _turn([0, 0, 1], yaw) @ _turn([0, 1, 0], pitch) @ _turn([1, 0, 0], roll)
        T[:3, 3] = _numbers(origin.get("xyz"), (0.0, 0.0, 0.0))
    return T


def _turn(axis, angle: float) -> np.ndarray:
    """Rotation matrix (3, 3) about a unit axis (Rodrigues)."""
    x, y, z = axis
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * K + (1.0 - np.cos(angle)) * (K @ K)


def _motion(joint: Joint, value: float) -> np.ndarray:
    T = np.eye(4)
    if joint.kind in ("revolute", "continuous"):
        T[:3, :3] = _turn(joint.axis, value)
    elif joint.kind == "prismatic":
        T[:3, 3] = joint.axis * value
    return T


def _joint(element: ElementTree.Element) -> Joint:
    axis, mimic = element.find("axis"), element.find("mimic")
    direction = _numbers(axis.get("xyz") if axis is not None else None, (1.0, 0.0, 0.0))
    return Joint(
        name=element.get("name"),
        kind=element.get("type"),
        parent=element.find("parent").get("link"),
        child=element.find("child").get("link"),
        T_parent_joint=_origin(element),
        axis=direction / max(np.linalg.norm(direction), 1e-12),
        mimic=None
        if mimic is None
        else (mimic.get("joint"), float(mimic.get("multiplier", 1)), float(mimic.get("offset", 0))),
    )


def _in_order(root: str, joints: list[Joint]) -> list[Joint]:
    """Joints, parents before children."""
    ordered, known, rest = [], {root}, joints
    while rest:
        ready = [joint for joint in rest if joint.parent in known]
        if not ready:
            raise ValueError(f"robot description has joints that hang on nothing: {[j.name for j in rest]}")
        ordered += ready
        known |= {joint.child for joint in ready}
        rest = [joint for joint in rest if joint.child not in known]
    return ordered


def _visuals(link: ElementTree.Element) -> list[Visual]:
    out = []
    for element in link.findall("visual"):
        for shape in element.find("geometry") if element.find("geometry") is not None else []:
            found = _shape(shape)
            if found:
                out.append(Visual(link.get("name"), _origin(element), *found))
    return out


def _shape(shape: ElementTree.Element) -> tuple[int, tuple[float, float, float], str] | None:
    if shape.tag == "box":
        return Marker.CUBE, tuple(_numbers(shape.get("size"), (0.0, 0.0, 0.0))), ""
    if shape.tag == "cylinder":
        diameter = 2.0 * float(shape.get("radius"))
        return Marker.CYLINDER, (diameter, diameter, float(shape.get("length"))), ""
    if shape.tag == "sphere":
        return Marker.SPHERE, (2.0 * float(shape.get("radius")),) * 3, ""
    if shape.tag == "mesh":
        size = tuple(_numbers(shape.get("scale"), (1.0, 1.0, 1.0)))
        return Marker.MESH_RESOURCE, size, shape.get("filename", "")
    return None
