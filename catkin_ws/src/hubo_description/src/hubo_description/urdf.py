"""URDF: from file, xacro or pybullet_data to one XML with absolute meshes. ``fv_robot_model`` reads what it says."""

from __future__ import annotations

import importlib.util
import xml.etree.ElementTree as ET
from pathlib import Path

import xacro

from fv_robot_model import package_file
from hubo_description.errors import RobotDescriptionError
from hubo_description.files import read_xml

PYBULLET_DATA = "pybullet_data:"
NEUTRAL = "0.72 0.73 0.75 1"  # colour of shapes that have none; RViz would draw them red, which means contact elsewhere
OWN_COLORS = (".dae", ".obj", ".glb", ".gltf", ".mesh")  # meshes that may bring their colours with them


def load_urdf(urdf: str, attach: str | None, folder: Path, common: Path) -> str:
    """Return the expanded URDF with meshes as absolute ``file://`` URIs.

    :param urdf: file in folder (``.urdf``, ``.urdf.xacro``) or ``pybullet_data:<path>``.
    :param attach: xacro in folder whose children are added to the URDF's root element.
    :param common: folder of the xacro files for every robot; a xacro finds it as ``$(arg common)``.
    :raises RobotDescriptionError: a file is missing or broken, or a mesh does not exist.
    """
    path = _pybullet_data() / urdf[len(PYBULLET_DATA) :] if urdf.startswith(PYBULLET_DATA) else folder / urdf
    root = _expand(path, common)
    _resolve_meshes(root, path)
    if attach:
        extra = _expand(folder / attach, common)
        _resolve_meshes(extra, folder / attach)
        root.extend(list(extra))
    _color_the_colorless(root)
    ET.indent(root)  # pybullet reads at most 1 kB a line
    return ET.tostring(root, encoding="unicode")


def _pybullet_data() -> Path:
    spec = importlib.util.find_spec("pybullet_data")  # found, not imported: the folder is all we need
    if spec is None or spec.origin is None:
        raise RobotDescriptionError("pybullet_data is not installed, but the robot's urdf lies in it")
    return Path(spec.origin).parent


def _expand(path: Path, common: Path) -> ET.Element:
    """Return the root element of a URDF or xacro file."""
    if not path.is_file():
        raise RobotDescriptionError(f"{path}: no such URDF file")
    source = read_xml(path)
    try:
        if path.suffix == ".xacro":
            xacro.init_stacks(str(path))  # as xacro.process_file does it, which knows UTF-8 only
            expanded = xacro.parse(source)
            xacro.process_doc(expanded, mappings={"common": str(common)})
            source = expanded.toxml()
        return ET.fromstring(source)
    except Exception as err:  # xacro raises many unrelated types, some of them bare Exception
        raise RobotDescriptionError(f"{path}: cannot be expanded: {' '.join(str(err).split())}") from err


def _resolve_meshes(root: ET.Element, path: Path) -> None:
    """Make relative meshes absolute; ``package://`` in pybullet_data means the URDF's own folder."""
    in_pybullet = _is_below_pybullet_data(path)
    for mesh in root.iter("mesh"):
        name = mesh.get("filename", "")
        if in_pybullet:
            name = name.removeprefix("package://")
        target = path.parent / mesh_file(name, path)  # an absolute one stays
        if not target.is_file():
            raise RobotDescriptionError(f"{path}: no such mesh: {target}")
        if not name.startswith("package://"):
            mesh.set("filename", f"file://{target.resolve()}")


def mesh_file(name: str, where: Path | str) -> Path:
    """Return the file that a mesh's name means; a relative one stays relative.

    :raises RobotDescriptionError: it lies in a ROS package that is not there.
    """
    if not name.startswith("package://"):
        return Path(name.removeprefix("file://"))
    try:
        return Path(package_file(name))
    except ValueError as err:
        raise RobotDescriptionError(f"{where}: {err}") from err


def _color_the_colorless(root: ET.Element) -> None:
    """Give visuals without a material, and materials that nobody defines, a neutral grey."""
    materials = [visual.find("material") for visual in root.iter("visual")]
    named = [m for m in (*materials, *root.findall("material")) if m is not None]
    defined = {m.get("name") for m in named if m.find("color") is not None or m.find("texture") is not None}
    for name in sorted({m.get("name", "") for m in named} - defined):
        root.append(_neutral(name))
    for visual in root.iter("visual"):
        mesh = visual.find("geometry/mesh")
        own = mesh is not None and Path(mesh.get("filename", "")).suffix.lower() in OWN_COLORS
        if visual.find("material") is None and not own:
            visual.append(_neutral("default_neutral"))


def _neutral(name: str) -> ET.Element:
    material = ET.Element("material", {"name": name})
    ET.SubElement(material, "color", {"rgba": NEUTRAL})
    return material


def _is_below_pybullet_data(path: Path) -> bool:
    spec = importlib.util.find_spec("pybullet_data")
    return spec is not None and spec.origin is not None and Path(spec.origin).parent in path.parents
