"""A camera that flies in a box with a shelf, on the real map and evaluation: what tests explore with, without ROS."""

import math

import numpy as np

from fv_common.schema import from_mapping
from fv_exploration import (
    EvaluationConfig,
    Evaluator,
    MapConfig,
    OccupancyMap,
    PinholeCamera,
    ScanConfig,
)
from fv_exploration.exploration import Exploration
from fv_exploration.explore_config import ExploreConfig
from fv_exploration.gain_judge import GainJudge
from fv_exploration.robot import Plan, PlanStatus, Scan, ScanError
from fv_exploration.strategy import load_strategy
from fv_exploration.strategy.reachable_views import ReachableViews
from fv_exploration.view_worth import ViewWorth

ROOM = (np.array([-1.0, -1.0, 0.0]), np.array([1.0, 1.0, 2.0]))
SHELF = (np.array([0.5, -0.4, 0.0]), np.array([0.9, 0.4, 1.0]))
RESOLUTION_M = 0.1
CAMERA = PinholeCamera(
    width=64,
    height=48,
    horizontal_fov_rad=math.radians(58),
    vertical_fov_rad=math.radians(45),
    min_range_m=0.05,
    max_range_m=3.0,
)


def ray_lengths(origin: np.ndarray, directions: np.ndarray) -> np.ndarray:
    """Distance [m] along unit rays to the shelf from outside or the room from inside."""
    with np.errstate(divide="ignore", invalid="ignore"):
        room = np.maximum((ROOM[0] - origin) / directions, (ROOM[1] - origin) / directions)
        near = np.minimum((SHELF[0] - origin) / directions, (SHELF[1] - origin) / directions)
        far = np.maximum((SHELF[0] - origin) / directions, (SHELF[1] - origin) / directions)
    enter, leave = near.max(axis=1), far.min(axis=1)
    shelf = np.where((enter <= leave) & (enter > 0), enter, np.inf)
    return np.minimum(room.min(axis=1), shelf)


def pixel_rays() -> np.ndarray:
    """Unit vectors of all pixel centres, optical frame."""
    u = (np.arange(CAMERA.width) + 0.5) / CAMERA.width * 2 - 1
    v = (np.arange(CAMERA.height) + 0.5) / CAMERA.height * 2 - 1
    x, y = np.meshgrid(u * math.tan(CAMERA.horizontal_fov_rad / 2), v * math.tan(CAMERA.vertical_fov_rad / 2))
    rays = np.stack([x.ravel(), y.ravel(), np.ones(x.size)], axis=1)
    return rays / np.linalg.norm(rays, axis=1, keepdims=True)


class FlyingCamera:
    """A robot that goes where it is sent, unless it is told to fail."""

    def __init__(
        self,
        plans_fail: bool = False,
        motions_fail: bool = False,
        blind: range = range(0),
        arm: bool = False,
    ) -> None:
        """:param blind: numbers of the scans that fail.
        :param arm: every second motion ends with an arm before the lens.
        """
        self.pose = np.eye(4)
        self.pose[:3, :3] = np.array([[0, 0, 1], [-1, 0, 0], [0, -1, 0]])
        self.pose[:3, 3] = [-0.4, 0.0, 1.0]
        self.plans_fail, self.motions_fail, self.blind = plans_fail, motions_fail, blind
        self.time_s, self.scans = 0.0, 0
        self.arm, self.plans, self.hidden_plans, self.turned = arm, 0, 0, []
        self.planned = self.pose
        self.visited, self.motions = [], []
        self.map_sequences = []

    def now_s(self) -> float:
        return self.time_s

    def scan(self) -> Scan:
        self.scans += 1
        if self.scans in self.blind:
            raise ScanError("no cloud")
        rays = pixel_rays()
        lengths = ray_lengths(self.pose[:3, 3], rays @ self.pose[:3, :3].T)
        return Scan(rays * lengths[:, None], self.pose)

    def plan(self, poses, scores, map_sequence, seed) -> Plan:
        self.map_sequences.append(map_sequence)
        if self.plans_fail:
            return Plan(PlanStatus.NO_PATH, "no path")
        self.plans += 1
        turned = float(self.arm and self.plans % 2)
        self.hidden_plans += int(turned)
        self.planned = poses[0]
        self.motions.append(poses[0])
        return Plan(PlanStatus.SUCCESS, "", 0, len(self.motions) - 1, 2.0, 1.0, {"elbow": turned})

    def camera_pose(self, joints):
        return self.planned if "elbow" in joints else self.pose

    def hides(self, rays_m, joints):
        return np.full(len(rays_m), joints.get("elbow", 0.0) > 0.5)

    def execute(self, plan) -> str:
        self.time_s += 2.0
        if self.motions_fail:
            return "stuck"
        self.pose = self.motions[plan.motion]
        self.turned.append(plan.joints["elbow"])
        self.visited.append(self.pose)
        return ""


class Listener:
    """Remembers what it was told."""

    def __init__(self) -> None:
        self.steps, self.chosen, self.warnings = [], [], []

    def activity(self, text):
        pass

    def warn(self, text):
        self.warnings.append(text)

    def map_changed(self, occupancy_map):
        pass

    def evaluated(self, occupancy_map, evaluation, utility):
        pass

    def decided(self, candidates, chosen, step):
        self.chosen.append(chosen)

    def view_done(self, step):
        self.steps.append(step)


class AnyPose:
    """A capability map of something that reaches every direction within 0.35 m."""

    radius = 0.05

    def __init__(self) -> None:
        grid = np.arange(-0.3, 0.31, 0.1)
        self.centres = np.stack(np.meshgrid(grid, grid, grid), -1).reshape(-1, 3)
        random = np.random.default_rng(0).normal(size=(40, 3))
        self.directions = random / np.linalg.norm(random, axis=1, keepdims=True)
        self.valid = np.ones((len(self.centres), 40), dtype=bool)

    def query(self, positions, directions, interpolate=True):
        return (np.linalg.norm(positions, axis=1) < 0.7).astype(np.float32)


class Rooted(AnyPose):
    """... of something that reaches nothing at all."""

    def query(self, positions, directions, interpolate=True):
        return np.zeros(len(positions), dtype=np.float32)


def make(robot: FlyingCamera, capability=None, min_gain_m3=0.05, strategy=None, **stop):
    config = from_mapping(
        ExploreConfig,
        {
            "map": {"resolution_m": RESOLUTION_M},
            "views": {"sampled": 300, "utility_voxels": 40, "min_gain_m3": min_gain_m3},
            "stop": {"max_views": 25, **stop},
        },
        "config",
    )
    occupancy_map = OccupancyMap(
        MapConfig(**vars(config.map), bounds_min=tuple(ROOM[0]), bounds_max=tuple(ROOM[1]))
    )
    evaluator = Evaluator(occupancy_map, EvaluationConfig())
    judge = GainJudge(occupancy_map, evaluator, CAMERA, RESOLUTION_M, robot if robot.arm else None)
    base = np.eye(4)
    base[:3, 3] = [-0.4, 0.0, 1.0]
    listener = Listener()
    exploration = Exploration(
        occupancy_map,
        evaluator,
        ScanConfig(min_range_m=0.05, max_range_m=3.0),
        strategy or load_strategy("frontier_void", {}),
        ReachableViews(capability or AnyPose(), base[None]),
        ViewWorth(judge, config.views),
        robot,
        listener,
        config,
        seed=3,
    )
    return exploration, occupancy_map, listener
