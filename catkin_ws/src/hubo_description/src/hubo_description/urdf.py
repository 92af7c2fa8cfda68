"""URDF: from file, xacro or pybullet_data to one XML with absolute meshes, and its tree of joints."""

from __future__ import annotations

import importlib.util
import math
import xml.etree.ElementTree as ET
from dataclasses import dataclass
from pathlib import Path

import xacro

from hubo_description.errors import RobotDescriptionError

MOVING = ("revolute", "continuous", "prismatic")
PYBULLET_DATA = "pybullet_data:"
NEUTRAL = "0.72 0.73 0.75 1"  # colour of shapes that have none; RViz would draw them red, which means contact elsewhere
OWN_COLORS = (".dae", ".obj", ".glb", ".gltf", ".mesh")  # meshes that may bring their colours with them


@dataclass(frozen=True)
class Joint:
    """One joint of the URDF; rad, m where prismatic."""

    name: str
    type: str
    parent: str
    child: str
    lower: float
    upper: float
    velocity: float
    effort: float


@dataclass(frozen=True)
class UrdfModel:
    """The tree of a URDF."""

    root: str
    links: tuple[str, ...]
    joints: dict[str, Joint]  # all of them, fixed ones too, in the file's order

    @property
    def moving_joints(self) -> list[str]:
        """Names of the joints that move, in the file's order."""
        return [name for name, joint in self.joints.items() if joint.type in MOVING]

    def chain_joints(self, base: str, tip: str) -> list[str]:
        """Return the moving joints from base to tip.

        :raises RobotDescriptionError: tip does not hang below base.
        """
        by_child = {joint.child: joint for joint in self.joints.values()}
        names, link = [], tip
        while link != base:
            if link not in by_child:
                raise RobotDescriptionError(f"no chain from '{base}' to '{tip}': '{link}' has no parent")
            joint = by_child[link]
            names += [joint.name] if joint.type in MOVING else []
            link = joint.parent
        return names[::-1]


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
    try:
        if path.suffix == ".xacro":
            expanded = xacro.process_file(str(path), mappings={"common": str(common)})
            return ET.fromstring(expanded.toxml())
        return ET.fromstring(path.read_text(encoding="utf-8"))
    except Exception as err:  # xacro raises many unrelated types, some of them bare Exception
        raise RobotDescriptionError(f"{path}: cannot be expanded: {' '.join(str(err).split())}") from err


def _resolve_meshes(root: ET.Element, path: Path) -> None:
    """Make relative meshes absolute; ``package://`` in pybullet_data means the URDF's own folder."""
    in_pybullet = _is_below_pybullet_data(path)
    for mesh in root.iter("mesh"):
        name = mesh.get("filename", "")
        if in_pybullet:
            name = name.removeprefix("package://")
        elif name.startswith("package://"):
            continue
        target = Path(name.removeprefix("file://"))
        target = target if target.is_absolute() else (path.parent / target).resolve()
        if not target.is_file():
            raise RobotDescriptionError(f"{path}: no such mesh: {target}")
        mesh.set("filename", f"file://{target}")


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


def plain_mesh_paths(urdf_xml: str) -> str:
    """Return the URDF with ``file://`` meshes as plain absolute paths, as pybullet's loader wants them."""
    return urdf_xml.replace('"file://', '"')


def parse_urdf(urdf_xml: str, where: str) -> UrdfModel:
    """Return the tree of a URDF.

    :raises RobotDescriptionError: no XML, no single root, a joint between unknown links, a moving joint without
        usable limits.
    """
    try:
        root = ET.fromstring(urdf_xml)
    except ET.ParseError as err:
        raise RobotDescriptionError(f"{where}: no valid XML: {err}") from err
    links = tuple(link.get("name", "") for link in root.findall("link"))
    elements = root.findall("joint")
    joints = {element.get("name", ""): _joint(element, links, where) for element in elements}
    if len(set(links)) != len(links) or len(joints) != len(elements):
        raise RobotDescriptionError(f"{where}: two links or two joints have the same name")
    return UrdfModel(_root_link(links, joints, where), links, joints)


def _joint(element: ET.Element, links: tuple[str, ...], where: str) -> Joint:
    name = element.get("name", "")
    ends = [element.find(tag) for tag in ("parent", "child")]
    names = ["" if end is None else end.get("link", "") for end in ends]
    for link in names:
        if link not in links:
            raise RobotDescriptionError(f"{where}: joint '{name}': unknown link '{link}'")
    kind = element.get("type", "")
    lower, upper, velocity, effort = _limits(element, kind, f"{where}: joint '{name}'")
    return Joint(name, kind, names[0], names[1], lower, upper, velocity, effort)


def _limits(element: ET.Element, kind: str, where: str) -> tuple[float, float, float, float]:
    limit = element.find("limit")
    if kind not in MOVING:
        return 0.0, 0.0, 0.0, 0.0
    if limit is None and kind != "continuous":
        raise RobotDescriptionError(f"{where}: type {kind} without <limit>")
    keys = ("lower", "upper", "velocity", "effort")
    try:
        values = [float(limit.get(key, 0.0)) if limit is not None else 0.0 for key in keys]
    except ValueError as err:
        raise RobotDescriptionError(f"{where}: limit is no number: {err}") from err
    if kind == "continuous":
        values[:2] = -math.inf, math.inf
    if not values[0] < values[1]:
        raise RobotDescriptionError(f"{where}: lower limit {values[0]} is not below upper limit {values[1]}")
    return tuple(values)


def _root_link(links: tuple[str, ...], joints: dict[str, Joint], where: str) -> str:
    children = [joint.child for joint in joints.values()]
    roots = [link for link in links if link not in children]
    if len(roots) != 1 or len(set(children)) != len(children):
        raise RobotDescriptionError(
            f"{where}: not a tree with one root; links without parent: {', '.join(roots)}"
        )
    return roots[0]
