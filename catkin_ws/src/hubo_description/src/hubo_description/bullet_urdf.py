"""A robot's URDF for Bullet, with the shapes that the planner has: ``fv_robot_model`` reads the meshes for both."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from fv_robot_model import RobotModel, load_mesh
from hubo_description.urdf import mesh_file

# Links without inertia (optical frames and the like) get this one: Bullet would give them 1 kg otherwise.
_TINY_MASS_KG = 1e-3
_TINY_INERTIA = 1e-6


def urdf_for_bullet(urdf_xml: str, model: RobotModel, folder: Path) -> str:
    """Return the URDF with plain paths of meshes; those that Bullet would read otherwise, or not at all, lie in folder.

    A mesh to collide with becomes the model's convex hull. A mesh to look at stays as it is where Bullet knows the
    format (OBJ, and STL unless it is text), else its triangles are written out, without colours.

    :param model: of this URDF, with shapes.
    :raises RobotDescriptionError: a mesh of a ROS package that is not there. :raises ModelError: one that is broken.
    """
    robot = ET.fromstring(urdf_xml)
    for link in robot.findall("link"):
        name = link.get("name", "")
        shapes = zip(link.findall("collision"), model.shapes(name), strict=True)
        for number, (collision, shape) in enumerate(shapes):
            mesh = collision.find("geometry/mesh")
            if mesh is not None:
                _refer_to(
                    mesh, folder / f"{len(list(folder.iterdir()))}_{number}.obj", shape.vertices, shape.faces
                )
        for mesh in link.iterfind("visual/geometry/mesh"):
            _make_visible(mesh, folder)
    add_inertias(robot)
    return ET.tostring(robot, encoding="unicode")


def add_inertias(robot: ET.Element) -> None:
    """Give links without an inertia a small one: Bullet would make it 1 kg."""
    for link in robot.findall("link"):
        if link.find("inertial") is None:
            link.append(_tiny_inertial())


def mimic_positions(model: RobotModel, positions: Mapping[str, float]) -> dict[str, float]:
    """Return where mimic joints stand [rad, m] while their leaders stand at ``positions``; absent leaders: at 0."""
    return {
        joint.name: joint.multiplier * positions.get(joint.leader, 0.0) + joint.offset
        for joint in model.joints
        if joint.leader
    }


def _make_visible(mesh: ET.Element, folder: Path) -> None:
    file = mesh_file(mesh.get("filename", ""), "URDF")
    if file.suffix.lower() == ".obj" or (file.suffix.lower() == ".stl" and not _is_text(file)):
        mesh.set("filename", str(file))
    else:
        scale = [float(number) for number in mesh.get("scale", "1 1 1").split()]
        _refer_to(mesh, folder / f"{len(list(folder.iterdir()))}.obj", *load_mesh(str(file), scale))


def _is_text(stl: Path) -> bool:
    """A binary STL says how many triangles of 50 bytes follow its header of 84, whatever that begins with."""
    with stl.open("rb") as file:
        header = file.read(84)
    count = int.from_bytes(header[80:84], "little")
    return stl.stat().st_size != 84 + 50 * count


def _refer_to(mesh: ET.Element, file: Path, vertices: np.ndarray, triangles: np.ndarray) -> None:
    """Write triangles as OBJ and let the mesh be that file, in metres."""
    lines = [f"v {x:.9g} {y:.9g} {z:.9g}" for x, y, z in vertices]
    lines += [f"f {a} {b} {c}" for a, b, c in triangles + 1]
    file.write_text("\n".join(lines) + "\n")
    mesh.attrib = {"filename": str(file)}


def _tiny_inertial() -> ET.Element:
    inertial = ET.Element("inertial")
    ET.SubElement(inertial, "mass", value=str(_TINY_MASS_KG))
    diagonal = {axis: str(_TINY_INERTIA) for axis in ("ixx", "iyy", "izz")}
    ET.SubElement(inertial, "inertia", ixy="0", ixz="0", iyz="0", **diagonal)
    return inertial
