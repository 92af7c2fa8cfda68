"""A small arm of a known family, and its map, for all tests of this package."""

from __future__ import annotations

import pytest

from capability_map import BuildParameters, CapabilityMap
from capability_map.building.build import build_map, local_executor
from capability_map.building.plan import plan_build
from capability_map.robots import Arm

JOINTS = (  # name, axis, offset from the joint before [m], lower, upper: a wrist of three axes in one point
    ("j1", "0 0 1", "0 0 0.1", -3.0, 3.0),
    ("j2", "0 1 0", "0 0 0.1", -2.0, 2.0),
    ("j3", "0 1 0", "0 0 0.3", -2.4, 2.4),
    ("j4", "0 0 1", "0 0 0.25", -3.0, 3.0),
    ("j5", "0 1 0", "0 0 0", -1.8, 1.8),
    ("j6", "0 0 1", "0 0 0", -3.0, 3.0),
)


def urdf_text(tip_offset: str = "0 0 0.1", kind: str = "revolute", extra: str = "") -> str:
    """A 6R arm with boxes for links; `kind` is the type of its third joint."""
    parts = ['<robot name="small"><link name="base"/>']
    parent = "base"
    for name, axis, xyz, lower, upper in JOINTS:
        link = f"link_{name}"
        geometry = '<geometry><box size="0.04 0.04 0.04"/></geometry>'
        joint_type = kind if name == "j3" else "revolute"
        parts.append(f'<link name="{link}"><collision><origin xyz="0 0 0.05"/>{geometry}</collision></link>')
        parts.append(
            f'<joint name="{name}" type="{joint_type}"><parent link="{parent}"/><child link="{link}"/>'
            f'<origin xyz="{xyz}"/><axis xyz="{axis}"/>'
            f'<limit lower="{lower}" upper="{upper}" effort="1" velocity="1"/></joint>'
        )
        parent = link
    parts.append(
        f'<link name="tip"/><joint name="tip_joint" type="fixed"><parent link="{parent}"/><child link="tip"/>'
        f'<origin xyz="{tip_offset}" rpy="0 0.6 0"/></joint>{extra}</robot>'
    )
    return "".join(parts)


def srdf_text(base: str = "base", tip: str = "tip") -> str:
    """One group and the pairs of the wrist's links, which overlap by construction."""
    pairs = "".join(
        f'<disable_collisions link1="link_j{a}" link2="link_j{b}" reason="Adjacent"/>'
        for a in range(1, 7)
        for b in range(a + 1, min(7, a + 4))
    )
    return f'<robot name="small"><group name="arm"><chain base_link="{base}" tip_link="{tip}"/></group>{pairs}</robot>'


@pytest.fixture(scope="session")
def arm() -> Arm:
    """The small arm."""
    return Arm("small", "arm", urdf_text(), srdf_text())


@pytest.fixture(scope="session")
def map_path(arm, tmp_path_factory):
    """A coarse map of it."""
    path = tmp_path_factory.mktemp("maps") / "small.h5"
    plan = plan_build(arm, BuildParameters(radii_per_arm_length=8.0, points=60, roll_step_deg=15.0))
    build_map(plan, path, local_executor(1))
    return path


@pytest.fixture(scope="session")
def cap(map_path, arm) -> CapabilityMap:
    """The map, loaded."""
    return CapabilityMap.load(map_path, urdf_xml=arm.urdf_xml)
