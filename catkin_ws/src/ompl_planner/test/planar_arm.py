"""A two-joint arm that turns in a plane: problems whose answer is known by construction."""

from __future__ import annotations

import numpy as np
from ompl_planner import _core

RESOLUTION = 0.02
LINK = """
  <link name="{name}"><collision><origin xyz="0.2 0 0"/>
    <geometry><box size="0.4 0.04 0.04"/></geometry></collision></link>
  <joint name="{joint}" type="revolute"><parent link="{parent}"/><child link="{name}"/><origin xyz="{x} 0 {z}"/>
    <axis xyz="0 0 1"/><limit lower="-2.9" upper="2.9" velocity="1" effort="1"/></joint>"""
URDF = (
    '<robot name="planar"><link name="base"/>'
    + LINK.format(name="upper", joint="shoulder", parent="base", x=0, z=0.5)
    + LINK.format(name="fore", joint="elbow", parent="upper", x=0.4, z=0.05)
    + '<link name="tip"/><joint name="tip_joint" type="fixed"><parent link="fore"/><child link="tip"/>'
    '<origin xyz="0.4 0 0"/></joint></robot>'
)
SRDF = """<robot name="planar"><group name="arm"><chain base_link="base" tip_link="tip"/></group>
  <group_state name="folded" group="arm">
    <joint name="shoulder" value="0"/><joint name="elbow" value="2.8"/></group_state>
  <disable_collisions link1="upper" link2="fore" reason="Adjacent"/></robot>"""
FREE = [[-1.0, -1.0, 0.3, 1.0, 1.0, 0.8]]


def make_planner(urdf: str = URDF, **config) -> _core.MotionPlanner:
    return _core.MotionPlanner(
        urdf=urdf, srdf=SRDF, rates={"shoulder": (1.0, 2.0), "elbow": (1.5, 3.0)}, config=config
    )


def pillar(angle: float, inner: float, outer: float = 0.95) -> list[list[float]]:
    """A radial wall, as high as the arm's space, from one radius to another."""
    rows = []
    for radius in np.arange(inner, outer, 0.01):
        x, y = radius * np.cos(angle), radius * np.sin(angle)
        rows.append([x - 0.015, y - 0.015, 0.3, x + 0.015, y + 0.015, 0.8])
    return rows


def make_request(
    planner, occupied=(), unknown=(), free=FREE, start=(0.0, 0.0), goal=None
) -> _core.PlanRequest:
    """A request of joint goals in a scene of boxes."""
    boxes = {"free": free, "occupied": occupied, "unknown": unknown}
    payload = _core.octree_payload(
        resolution_m=RESOLUTION,
        **{name: np.reshape(rows, (-1, 6)).astype(float) for name, rows in boxes.items()},
    )
    request = _core.PlanRequest()
    request.group = "arm"
    request.seed = 1
    request.start_all = np.array(start, dtype=float)
    request.map = planner.snapshot(payload=payload, resolution_m=RESOLUTION, sequence=1, T_map_root=np.eye(4))
    if goal is not None:
        request.goal_type = _core.GoalType.JOINTS
        request.goal_joints = [("shoulder", goal[0]), ("elbow", goal[1])]
    return request
