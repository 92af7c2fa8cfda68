"""Arms of one to five joints: poses that nothing reaches exactly are reached within the tolerances."""

import numpy as np
import pytest
from ompl_planner import _core
from planar_arm import RESOLUTION

Status = _core.PlanStatus
FREE = [[-1.1, -1.1, -0.8, 1.1, 1.1, 1.3]]
KINDS = {"r": "revolute", "p": "prismatic", "c": "continuous"}


def urdf_of(joints) -> str:
    """A chain with a small box at its end; joints: kind, axis, origin, lower, upper."""
    parts, parent = ['<robot name="few"><link name="base"/>'], "base"
    for i, (kind, axis, origin, lower, upper) in enumerate(joints):
        limits = "" if kind == "c" else f'lower="{lower}" upper="{upper}"'
        box = '<collision><geometry><box size="0.02 0.02 0.02"/></geometry></collision>'
        parts.append(
            f'<link name="l{i}">{box if i + 1 == len(joints) else ""}</link>'
            f'<joint name="j{i}" type="{KINDS[kind]}"><parent link="{parent}"/><child link="l{i}"/>'
            f'<origin xyz="{origin}"/><axis xyz="{axis}"/><limit {limits} velocity="1" effort="1"/></joint>'
        )
        parent = f"l{i}"
    tip = f'<link name="tip"/><joint name="t" type="fixed"><parent link="{parent}"/><child link="tip"/>'
    return "".join(parts) + tip + '<origin xyz="0.08 0 -0.02" rpy="0 1.9 0"/></joint></robot>'


ARMS = {
    "turntable": [("c", "0 0 1", "0 0 0", 0, 0)],
    "rail": [("p", "1 0 0", "0 0 0", -0.5, 0.8)],
    "pan_tilt": [("r", "0 0 1", "0 0 0.1", -2.8, 2.8), ("r", "0 1 0", "0 0 0.1", -1.2, 0.9)],
    "gantry": [("p", a, "0 0 0", -0.5, 0.5) for a in ("1 0 0", "0 1 0", "0 0 1")],
    "scara": [
        ("r", "0 0 1", "0 0 0.1", -2.3, 2.3),
        ("r", "0 0 1", "0.32 0 0.08", -2.4, 2.4),
        ("p", "0 0 -1", "0.27 0 0.1", 0.0, 0.25),
        ("r", "0 0 1", "0 0 -0.2", -3.1, 3.1),
    ],
    "five": [
        ("r", "0 0 1", "0 0 0.1", -2.9, 2.9),
        ("r", "0 1 0", "0.1 0 0.2", -1.6, 1.6),
        ("p", "1 0 0", "0.1 0 0", 0.0, 0.3),
        ("r", "1 0 0", "0.2 0.1 0", -2.0, 2.0),
        ("r", "0 1 0", "0.1 0 0", -2.0, 2.0),
    ],
}


class Bench:
    def __init__(self, joints) -> None:
        srdf = '<robot name="few"><group name="arm"><chain base_link="base" tip_link="tip"/></group></robot>'
        self.planner = _core.MotionPlanner(urdf=urdf_of(joints), srdf=srdf)
        self.limits = self.planner.limits()
        self.random = np.random.default_rng(0)
        self.free = self.map_of()

    def state(self):
        return self.random.uniform(self.limits[:, 0], self.limits[:, 1])

    def map_of(self, occupied=(), unknown=()):
        boxes = {"free": FREE, "occupied": occupied, "unknown": unknown}
        rows = {kind: np.reshape(rows, (-1, 6)).astype(float) for kind, rows in boxes.items()}
        payload = _core.octree_payload(resolution_m=RESOLUTION, **rows)
        return self.planner.snapshot(
            payload=payload, resolution_m=RESOLUTION, sequence=1, T_map_root=np.eye(4)
        )

    def request(self, poses, **fields):
        request = _core.PlanRequest()
        request.group, request.seed = "arm", 1
        request.start_all = np.clip(np.zeros(len(self.limits)), self.limits[:, 0], self.limits[:, 1])
        request.map = self.free
        request.goal_type = _core.GoalType.POSES
        request.set_goal_poses(list(poses))
        for name, value in fields.items():
            setattr(request, name, value)
        return request

    def end_pose(self, request):
        result = self.planner.solve(request)
        assert result["status"] == Status.SUCCESS, result["message"]
        return self.planner.tip_pose("arm", result["trajectory"]["positions"][-1])


@pytest.fixture(scope="module", params=ARMS)
def bench(request):
    return Bench(ARMS[request.param])


def rounded(pose):
    """A pose as a human types it: three decimals, also of the quaternion."""
    out = np.eye(4)
    out[:3, 3] = np.round(pose[:3, 3], 3)
    w = np.sqrt(max(0.0, 1.0 + np.trace(pose[:3, :3]))) / 2.0
    axis = np.array([pose[2, 1] - pose[1, 2], pose[0, 2] - pose[2, 0], pose[1, 0] - pose[0, 1]])
    if w < 0.1:
        return None  # near half turns this formula loses digits
    q = np.round(np.append(axis / (4.0 * w), w), 3)
    x, y, z, w = q / np.linalg.norm(q)
    out[:3, :3] = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    return out


def angle_between(a, b):
    return np.arccos(np.clip((np.trace(a[:3, :3].T @ b[:3, :3]) - 1.0) / 2.0, -1.0, 1.0))


def test_poses_rounded_to_three_decimals_are_reached_within_the_default_tolerances(bench):
    tried = 0
    while tried < 10:
        pose = rounded(bench.planner.tip_pose("arm", bench.state()))
        if pose is None:
            continue
        end = bench.end_pose(bench.request([pose]))
        assert np.linalg.norm(end[:3, 3] - pose[:3, 3]) <= 0.005 + 1e-5
        assert angle_between(end, pose) <= 0.02 + 1e-5
        tried += 1


def test_a_view_with_free_roll_is_reached_within_the_tolerances_that_are_asked_for(bench):
    for _ in range(10):
        pose = bench.planner.tip_pose("arm", bench.state())
        c, s = np.cos(2.0), np.sin(2.0)
        wanted = pose @ np.array([[c, -s, 0, 0], [s, c, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])
        wanted[:3, 3] += bench.random.uniform(-1, 1, 3) * 0.008
        tolerances = {"position_tolerance_m": 0.02, "angle_tolerance_rad": 0.087, "free_roll": True}
        end = bench.end_pose(bench.request([wanted], **tolerances))
        assert np.linalg.norm(end[:3, 3] - wanted[:3, 3]) <= 0.02 + 1e-5
        assert np.arccos(np.clip(end[:3, 2] @ wanted[:3, 2], -1, 1)) <= 0.087 + 1e-5


def test_what_is_beyond_the_tolerances_is_said_with_them(bench):
    poses = [bench.planner.tip_pose("arm", bench.state()) for _ in range(3)]
    for pose in poses:
        pose[:3, 3] += [0.0, 0.0, 3.0]
    result = bench.planner.solve(bench.request(poses, position_tolerance_m=0.03))
    assert result["status"] == Status.NO_IK_SOLUTION
    assert "of 3 poses 3 have no solution for group 'arm' within 0.03 m and 0.02 rad" in result["message"]


def test_a_failed_goal_set_says_how_many_failed_for_which_reason():
    bench = Bench(ARMS["scara"])
    states = [[0.5, 0.3, 0.1, 0.0], [-0.5, -0.3, 0.1, 0.0], [0.5, 0.3, 0.1, 1.0], [0.0, 0.0, 0.1, 0.0]]
    poses = [bench.planner.tip_pose("arm", np.array(q)) for q in states]
    poses[3][2, 3] += 2.0
    occupied = [[0.4, 0.2, 0.0, 0.7, 0.8, 0.2]]
    unknown = [[0.4, -0.8, 0.0, 0.7, -0.2, 0.2]]
    result = bench.planner.solve(bench.request(poses, map=bench.map_of(occupied, unknown)))
    assert result["status"] == Status.GOALS_IN_COLLISION
    for words in (
        "of 4 poses 1 has no solution",
        "2 are blocked by obstacles (pose 0: link 'l",
        "meets the occupied voxel at (",
        "1 is blocked by unknown space (pose 1: link 'l",
    ):
        assert words in result["message"]
