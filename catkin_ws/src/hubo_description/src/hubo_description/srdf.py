"""The part of the SRDF that this project uses: groups, named poses, disabled collision pairs."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from dataclasses import dataclass
from pathlib import Path

from hubo_description.errors import RobotDescriptionError
from hubo_description.urdf import UrdfModel


@dataclass(frozen=True)
class Group:
    """A planning group."""

    name: str
    joints: tuple[str, ...]  # moving joints, from base to tip where the group is a chain
    base_link: str | None  # of the chain; None where the group is a list of joints
    tip_link: str | None


@dataclass(frozen=True)
class Srdf:
    """Groups, named poses and pairs of links that are never checked against each other."""

    groups: dict[str, Group]
    group_states: dict[str, dict[str, dict[str, float]]]  # group -> pose -> joint -> rad (m where prismatic)
    disabled_pairs: frozenset[tuple[str, str]]  # names of each pair sorted


def parse_srdf(srdf_xml: str, model: UrdfModel, where: str) -> Srdf:
    """Parse and check an SRDF against the robot's links and joints.

    :raises RobotDescriptionError: no XML, or it names a link, joint or group that does not exist, or a pose lies
        outside the joint limits.
    """
    try:
        root = ET.fromstring(srdf_xml)
    except ET.ParseError as err:
        raise RobotDescriptionError(f"{where}: no valid XML: {err}") from err
    groups = {element.get("name", ""): _group(element, model, where) for element in root.findall("group")}
    states: dict[str, dict[str, dict[str, float]]] = {name: {} for name in groups}
    for element in root.findall("group_state"):
        group = _known(element.get("group"), groups, "group", where)
        states[group][element.get("name", "")] = _pose(element, groups[group], model, where)
    pairs = frozenset(_pair(element, model, where) for element in root.findall("disable_collisions"))
    return Srdf(groups, states, pairs)


def _known(name: str | None, valid, what: str, where: str) -> str:
    if name not in valid:
        raise RobotDescriptionError(f"{where}: unknown {what} '{name}'; valid: {', '.join(valid)}")
    return name


def _group(element: ET.Element, model: UrdfModel, where: str) -> Group:
    name = element.get("name", "")
    chain = element.find("chain")
    if chain is None:
        joints = [
            _known(joint.get("name"), model.joints, "joint", where) for joint in element.findall("joint")
        ]
        return Group(name, tuple(joints), None, None)
    base = _known(chain.get("base_link"), model.links, "link", where)
    tip = _known(chain.get("tip_link"), model.links, "link", where)
    return Group(name, tuple(model.chain_joints(base, tip)), base, tip)


def _pose(element: ET.Element, group: Group, model: UrdfModel, where: str) -> dict[str, float]:
    where = f"{where}: group_state {group.name}/{element.get('name')}"
    pose = {}
    for entry in element.findall("joint"):
        name = _known(entry.get("name"), group.joints, "joint", where)
        try:
            value = float(entry.get("value", ""))
        except ValueError as err:
            raise RobotDescriptionError(f"{where}: joint {name}: no number: {entry.get('value')!r}") from err
        joint = model.joints[name]
        if not joint.lower <= value <= joint.upper:
            raise RobotDescriptionError(f"{where}: {name} = {value} outside {joint.lower}..{joint.upper}")
        pose[name] = value
    missing = [name for name in group.joints if name not in pose]
    if missing:
        raise RobotDescriptionError(f"{where}: no value for joint '{missing[0]}'")
    return pose


def _pair(element: ET.Element, model: UrdfModel, where: str) -> tuple[str, str]:
    names = [_known(element.get(key), model.links, "link", where) for key in ("link1", "link2")]
    return tuple(sorted(names))


def read_srdf(path: Path) -> str:
    """Return the text of an SRDF file.

    :raises RobotDescriptionError: it cannot be read.
    """
    try:
        return path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as err:
        raise RobotDescriptionError(f"{path}: cannot be read: {err}") from err
