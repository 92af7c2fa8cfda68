"""Which robot is a map for? A hash of what the map depends on."""

from __future__ import annotations

import hashlib
import xml.etree.ElementTree as ElementTree

from capability_map.errors import CapabilityMapError

# What neither kinematics nor self-collision depends on: a new colour must not make a map stale.
_IRRELEVANT = {"visual", "inertial", "material", "dynamics", "transmission", "gazebo"}


def urdf_hash(urdf_xml: str) -> str:
    """Return the SHA-256 (hex) of a URDF's kinematics and collision geometry.

    Comments, whitespace, the order of attributes, colours and masses do not count, nor do the folders of mesh files.

    :raises CapabilityMapError: not XML.
    """
    try:
        root = ElementTree.fromstring(urdf_xml)
    except ElementTree.ParseError as err:
        raise CapabilityMapError(f"URDF is no XML: {err}") from err
    return hashlib.sha256("\n".join(_lines(root, 0)).encode()).hexdigest()


def _lines(element: ElementTree.Element, depth: int) -> list[str]:
    if element.tag in _IRRELEVANT:
        return []
    attributes = {
        key: value.rsplit("/", 1)[-1] if key == "filename" else " ".join(value.split())
        for key, value in element.attrib.items()
    }
    lines = [f"{depth} {element.tag} {sorted(attributes.items())}"]
    for child in element:
        lines += _lines(child, depth + 1)
    return lines
