"""URDF and SDF made ready for Bullet, which warns where it should refuse."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from pathlib import Path

from hubo_sim.errors import SimError
from hubo_sim.paths import resolve_file

# Links without inertia (optical frames and the like) get this one: Bullet would give them 1 kg otherwise.
_TINY_MASS_KG = 1e-3
_TINY_INERTIA = 1e-6


def parse_xml(xml: str, what: str) -> ET.Element:
    """The root element. Raises SimError, beginning with "broken" and `what`, unless it is XML."""
    try:
        return ET.fromstring(xml)
    except ET.ParseError as err:
        raise SimError(f"broken {what}: {err}") from err


def root_link(urdf_xml: str) -> str:
    """The link that is nobody's child. Raises SimError unless there is exactly one."""
    robot = parse_xml(urdf_xml, "URDF")
    children = {child.get("link") for child in robot.iterfind("joint/child")}
    roots = [link.get("name") for link in robot.findall("link") if link.get("name") not in children]
    if len(roots) != 1:
        raise SimError(f"broken URDF: one root link is needed, found {roots or 'none'}")
    return roots[0]


def urdf_for_bullet(urdf_xml: str, folder: Path | None = None) -> str:
    """The URDF with absolute paths of meshes and textures and an inertia on each link.

    folder: what relative paths are relative to. Raises SimError on broken XML and on files that are not there.
    """
    robot = parse_xml(urdf_xml, "URDF")
    root_link(urdf_xml)
    for kind in ("mesh", "texture"):
        for element in robot.iter(kind):
            element.set("filename", resolve_file(element.get("filename"), f"URDF {kind}", folder))
    for link in robot.findall("link"):
        if link.find("inertial") is None:
            link.append(_tiny_inertial())
    return ET.tostring(robot, encoding="unicode")


def sdf_for_bullet(sdf_xml: str, folder: Path | None = None) -> str:
    """The SDF with absolute paths of meshes; folder: what relative ones are relative to.

    Raises SimError on broken XML, on meshes that are not there, and unless it holds exactly one model with links.
    """
    sdf = parse_xml(sdf_xml, "SDF")
    models = list(sdf.iter("model"))
    if len(models) != 1 or models[0].find("link") is None:
        raise SimError(f"broken SDF: one model with links is needed, found {len(models)} models")
    for uri in sdf.iterfind(".//mesh/uri"):
        uri.text = resolve_file((uri.text or "").strip(), "SDF mesh", folder)
    return ET.tostring(sdf, encoding="unicode")


def _tiny_inertial() -> ET.Element:
    inertial = ET.Element("inertial")
    ET.SubElement(inertial, "mass", value=str(_TINY_MASS_KG))
    diagonal = {axis: str(_TINY_INERTIA) for axis in ("ixx", "iyy", "izz")}
    ET.SubElement(inertial, "inertia", ixy="0", ixz="0", iyz="0", **diagonal)
    return inertial
