"""A robot in front of a map, with the planner that is measured and the plain pipeline beside it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hubo_description import load_robot
from ompl_planner import _core
from ompl_planner.scenes import SCENES

PLAIN = "RRTConnect + FCL octree, one view at a time"


def row(case: str, ours: float, unit: str, **others: object) -> dict:
    """One row of the table; what is not given is null."""
    empty = dict.fromkeys(("reference", "reference_name", "ratio", "spread", "target", "met"))
    return {"bench": "planning", "case": case, "ours": ours, **empty, "unit": unit, "runs": 1, **others}


def spread(values: list[float]) -> float:
    """Interquartile range."""
    return float(np.subtract(*np.percentile(values, [75, 25])))


@dataclass
class Bench:
    """One robot, planned for by both planners; the request holds start, map and pose goals with free roll."""

    name: str
    fast: _core.MotionPlanner
    plain: _core.MotionPlanner
    request: _core.PlanRequest
    rates: dict[str, tuple[float, float]]
    T_map_root: np.ndarray

    @property
    def joints(self) -> list[str]:
        return self.fast.group_joints(self.request.group)

    def start(self) -> np.ndarray:
        return np.array(self.request.start_all)

    def with_group(self, q_group: np.ndarray) -> np.ndarray:
        """All joints, the group's replaced."""
        q = self.start()
        names = self.fast.joint_names
        for joint, value in zip(self.joints, q_group, strict=True):
            q[names.index(joint)] = value
        return q

    def random_states(self, count: int, rng: np.random.Generator) -> np.ndarray:
        """(count, J) uniform within the limits."""
        names, limits = self.fast.joint_names, self.fast.limits()
        rows = np.array([limits[names.index(joint)] for joint in self.joints])
        return rng.uniform(rows[:, 0], rows[:, 1], (count, len(rows)))

    def snapshot(self, payload: bytes, resolution_m: float, sequence: int) -> _core.MapSnapshot:
        """The part of a map that the robot can reach."""
        return self.fast.snapshot(
            payload=payload, resolution_m=resolution_m, sequence=sequence, T_map_root=self.T_map_root
        )


def start_positions(robot: object) -> dict[str, float]:
    """Joint positions [rad]: every group at home, the exploring group at its start pose."""
    positions: dict[str, float] = {}
    for states in robot.group_states.values():
        positions |= states.get("home", {})
    exploration = robot.config.exploration
    return positions | robot.group_states[exploration.group][exploration.start_pose]


def make_robot(robot_name: str, T_map_root: np.ndarray | None = None) -> Bench:
    """Load a robot; without T_map_root it stands at the origin, at the height that its robot.yaml gives."""
    robot = load_robot(robot_name)
    rates = {
        name: (limit["max_velocity"], limit["max_acceleration"])
        for name, limit in robot.documents["joint_limits"]["joint_limits"].items()
    }
    model = {"urdf": robot.urdf_xml, "srdf": robot.srdf_xml, "rates": rates}
    fast = _core.MotionPlanner(**model)
    plain = _core.MotionPlanner(**model, config={"world_check": "fcl_octree", "detour_searches": 0.0})
    if T_map_root is None:
        T_map_root = np.eye(4)
        T_map_root[2, 3] = robot.documents["robot"]["base_height_m"]
    request = _core.PlanRequest()
    request.group = robot.config.exploration.group
    request.set_T_map_root(T_map_root)
    limits = fast.limits()
    start = np.clip(np.zeros(len(limits)), limits[:, 0], limits[:, 1])
    for joint, value in start_positions(robot).items():
        start[fast.joint_names.index(joint)] = value
    request.start_all = start
    request.goal_type = _core.GoalType.POSES
    request.free_roll = True
    return Bench(robot_name, fast, plain, request, rates, T_map_root)


def make_bench(robot_name: str, scene_name: str) -> Bench:
    """A robot in front of one of the scenes of boxes."""
    bench = make_robot(robot_name)
    bench.name = f"{robot_name} {scene_name}"
    scene = SCENES[scene_name]()
    bench.request.map = bench.snapshot(_core.octree_payload(**scene.arrays()), scene.resolution_m, 1)
    return bench


def random_views(rng: np.random.Generator, count: int) -> tuple[list[np.ndarray], list[float]]:
    """Poses (4, 4) in front of the robot, z looking forwards or to the sides, and scores."""
    poses = []
    for _ in range(count):
        z = np.array([rng.uniform(0.0, 1.0), rng.uniform(-1.0, 0.7), rng.uniform(-0.8, 0.5)])
        z /= np.linalg.norm(z)
        x = np.cross(z, [0.0, 0.0, 1.0])
        x /= np.linalg.norm(x)
        T = np.eye(4)
        T[:3, 0], T[:3, 1], T[:3, 2] = x, np.cross(z, x), z
        T[:3, 3] = rng.uniform([0.15, -0.75, 0.65], [0.80, 0.35, 1.55])
        poses.append(T)
    return poses, rng.uniform(0.0, 1.0, count).tolist()


def toppra_duration(waypoints: np.ndarray, radii: list[float], velocity, acceleration) -> float:
    """Duration of toppra's optimum on the same rounded path [s]."""
    import toppra

    grid = np.linspace(0.0, 1.0, 400)
    points = _core.sample_blended_path(waypoints=waypoints, radii=radii, parameters=grid)
    path = toppra.SplineInterpolator(grid, points)
    limits = [
        toppra.constraint.JointVelocityConstraint(np.stack([-velocity, velocity], axis=1)),
        toppra.constraint.JointAccelerationConstraint(np.stack([-acceleration, acceleration], axis=1)),
    ]
    instance = toppra.algorithm.TOPPRA(limits, path, gridpoints=grid, parametrizer="ParametrizeConstAccel")
    return float(instance.compute_trajectory().duration)
