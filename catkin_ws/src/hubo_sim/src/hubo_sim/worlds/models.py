"""URDF and SDF made ready for Bullet, which warns where it should refuse."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from pathlib import Path

from hubo_description.bullet_urdf import add_inertias
from hubo_sim.errors import SimError
from hubo_sim.paths import resolve_file


def parse_xml(xml: str, what: str) -> ET.Element:
    """The root element. Raises SimError, beginning with "broken" and `what`, unless it is XML."""
    try:
        return ET.fromstring(xml)
    except ET.ParseError as err:
        raise SimError(f"broken {what}: {err}") from err


def urdf_for_bullet(urdf_xml: str, folder: Path | None = None) -> str:
    """The URDF of an object with absolute paths of meshes and textures and an inertia on each link.

    folder: what relative paths are relative to. Raises SimError on broken XML and on files that are not there.
    """
    robot = parse_xml(urdf_xml, "URDF")
    children = {child.get("link") for child in robot.iterfind("joint/child")}
    roots = [link.get("name") for link in robot.findall("link") if link.get("name") not in children]
    if len(roots) != 1:
        raise SimError(f"broken URDF: one root link is needed, found {roots or 'none'}")
    for kind in ("mesh", "texture"):
        for element in robot.iter(kind):
            element.set("filename", resolve_file(element.get("filename"), f"URDF {kind}", folder))
    add_inertias(robot)
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
