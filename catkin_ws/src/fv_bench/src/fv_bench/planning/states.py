"""Real exploration states: the explorer runs in a simulated world, and what it asks of the planner is recorded.

No ROS and no physics: the depth camera is rendered with its noise, and the robot jumps to the end of each plan. The
explorer's own map has its default resolution; the planner's, made of the same scans, has 2 cm.
"""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass

import numpy as np
from ompl_planner import _core
from ompl_planner.trials import Bench, make_robot

from fv_exploration import (
    EvaluationConfig,
    Evaluator,
    MapConfig,
    OccupancyMap,
    PinholeCamera,
    ScanConfig,
)
from fv_exploration.exploration import Exploration
from fv_exploration.explore_config import ExploreConfig, StopSettings, ViewSettings
from fv_exploration.gain_judge import GainJudge
from fv_exploration.robot import Plan, PlanStatus, Scan
from fv_exploration.robot_body import clearance_voxels
from fv_exploration.strategy import load_strategy
from fv_exploration.view_worth import ViewWorth
from fv_robot_model import PointClass, RobotModel, SelfFilter, SelfFilterConfig, body_voxels
from hubo_description import load_robot
from hubo_sim.config import SimConfig
from hubo_sim.robot_source import load_robot_spec
from hubo_sim.simulator import Simulator
from hubo_sim.worlds import load_world

RESOLUTION_M = 0.02
CANDIDATES = 96  # per decision; each query draws some of them


@dataclass(frozen=True)
class State:
    """One decision: the map's payload, the robot's joints, and the candidate views with their scores."""

    payload: bytes
    start_all: np.ndarray
    poses: np.ndarray
    scores: np.ndarray


class SampledReach:
    """Views that random joint states hold: what ``ReachableViews`` draws from a capability map, for any robot."""

    def __init__(self, bench: Bench, T_map_base: np.ndarray) -> None:
        self._bench = bench
        self._T_map_base = T_map_base
        tips = self._tips(2000, np.random.default_rng(0))[:, :3, 3]
        self._centre = tips.mean(axis=0)
        self._reach_m = float(np.linalg.norm(tips - self._centre, axis=1).max())

    def _tips(self, count: int, rng: np.random.Generator) -> np.ndarray:
        group = self._bench.request.group
        states = self._bench.random_states(count, rng)
        return np.array([self._T_map_base @ self._bench.fast.tip_pose(group, q) for q in states])

    def reachability(self, positions: np.ndarray, directions: np.ndarray) -> np.ndarray:
        """1 within the reach: the planner's inverse kinematics finds out."""
        return self.within_reach(positions).astype(float)

    def within_reach(self, positions: np.ndarray) -> np.ndarray:
        return np.linalg.norm(positions - self._centre, axis=1) <= self._reach_m

    def sample(self, count: int, random: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
        tips = self._tips(count, random)
        return tips[:, :3, 3], tips[:, :3, 2]


class Audience:
    """Nobody listens."""

    def __getattr__(self, name: str):
        return lambda *_: None


class Recorder:
    """The robot of an exploration, in the simulator's scene; keeps each planning request."""

    def __init__(
        self, bench: Bench, simulator: Simulator, self_filter: SelfFilter, fine_map: OccupancyMap
    ) -> None:
        self.states: list[State] = []
        self._bench = bench
        self._simulator = simulator
        self._filter = self_filter
        self._map = fine_map
        self._camera = next(iter(simulator.cameras.values()))
        limits = self._camera.config
        self.scan_config = ScanConfig(min_range_m=limits.min_range_m, max_range_m=limits.max_range_m)
        self._scans = 0
        self._ends: list[np.ndarray] = []  # of the motions that were planned

    def positions(self) -> dict[str, float]:
        return dict(zip(self._bench.fast.joint_names, self._bench.start().tolist(), strict=True))

    def now_s(self) -> float:
        return 0.0

    def scan(self) -> Scan:
        self._simulator.robot.set_positions(self.positions())
        T_map_sensor = self._camera.pose()
        depth = self._camera.scan(self._simulator.scene, self._scans).depth
        self._scans += 1
        points = self._camera.points(depth).reshape(-1, 3).astype(float)
        T_root_sensor = np.linalg.inv(self._bench.T_map_root) @ T_map_sensor
        labels = self._filter.classify(points, T_root_sensor, self._bench.start())
        robots = np.isin(labels, [int(PointClass.ROBOT), int(PointClass.SHADOW)])
        scan = Scan(points[~robots], T_map_sensor)
        self._map.insert_scan(scan.points, scan.T_map_sensor, self.scan_config)
        return scan

    def plan(self, poses: np.ndarray, scores: np.ndarray, map_sequence: int, seed: int) -> Plan:
        payload = self._map.binary_data()
        self.states.append(State(payload, self._bench.start(), np.array(poses), np.array(scores)))
        request = self._bench.request
        request.map = self._bench.snapshot(payload, RESOLUTION_M, self._map.sequence)
        request.set_goal_poses(list(poses))
        request.goal_scores = list(map(float, scores))
        request.seed = seed % 2**32
        plan = self._bench.fast.solve(request)
        if plan["status"] == _core.PlanStatus.SUCCESS:
            self._ends.append(plan["trajectory"]["positions"][-1])
        motion = len(self._ends) - 1
        return Plan(PlanStatus(int(plan["status"])), plan["message"], plan["goal_index"], motion)

    def execute(self, plan: Plan) -> str:
        self._bench.request.start_all = self._bench.with_group(self._ends[plan.motion])
        return ""


def new_map(resolution_m: float, bounds: object, known_free: object) -> OccupancyMap:
    """A map in which only what ``known_free(resolution)`` lists is known."""
    occupancy_map = OccupancyMap(
        MapConfig(resolution_m=resolution_m, bounds_min=tuple(bounds.min_m), bounds_max=tuple(bounds.max_m))
    )
    occupancy_map.mark_free(known_free(resolution_m))
    return occupancy_map


def ray_camera(simulator: Simulator, views: ViewSettings) -> PinholeCamera:
    """The robot's camera, with as many rays as expected gains are cast with."""
    config = next(iter(simulator.cameras.values())).config
    return PinholeCamera(
        width=views.ray_columns,
        height=views.ray_rows,
        horizontal_fov_rad=math.radians(config.horizontal_fov_deg),
        vertical_fov_rad=math.radians(config.vertical_fov_deg),
        min_range_m=config.min_range_m,
        max_range_m=config.max_range_m,
    )


def record(robot_name: str, world_name: str, views: int, seed: int = 1) -> tuple[Bench, list[State]]:
    """Explore a world for so many views; the bench, and what the planner was asked at each decision."""
    robot, world = load_robot(robot_name), load_world(world_name)
    simulator = Simulator(load_robot_spec(robot_name), world, SimConfig(seed=seed))
    try:
        base_height_m = robot.documents["robot"]["base_height_m"]
        bench = make_robot(robot_name, world.robot.base_pose(base_height_m))
        bench.name = f"{robot_name} {world_name}"
        return bench, _explore(bench, robot, simulator, views, seed)
    finally:
        simulator.close()


def _explore(bench: Bench, robot: object, simulator: Simulator, views: int, seed: int) -> list[State]:
    config = ExploreConfig()
    config = dataclasses.replace(
        config,
        views=dataclasses.replace(config.views, shortlist=CANDIDATES),
        stop=StopSettings(max_views=views),
    )
    model = RobotModel.from_xml(robot.urdf_xml, robot.srdf_xml)
    start = bench.start()
    simulator.robot.set_positions(dict(zip(bench.fast.joint_names, start.tolist(), strict=True)))

    def known_free(resolution_m: float) -> np.ndarray:
        padding_m = config.start.body_padding_m
        own = body_voxels(model, start, resolution_m, padding_m, T_map_root=bench.T_map_root)
        clearance = robot.documents["robot"]["exploration"].get("clearance", {})
        return np.concatenate([own, clearance_voxels(clearance, simulator.robot.link_pose, resolution_m)])

    bounds = simulator.world.bounds
    occupancy_map = new_map(config.map.resolution_m, bounds, known_free)
    self_filter = SelfFilter(model, SelfFilterConfig(padding_m=config.scan.self_filter_padding_m))
    recorder = Recorder(bench, simulator, self_filter, new_map(RESOLUTION_M, bounds, known_free))
    evaluator = Evaluator(occupancy_map, EvaluationConfig())
    cell_m = max(config.views.return_cell_m, config.map.resolution_m)
    judge = GainJudge(occupancy_map, evaluator, ray_camera(simulator, config.views), cell_m)
    base = model.link_names.index(model.group(bench.request.group).base_link)
    reach = SampledReach(bench, bench.T_map_root @ model.forward(start)[base])
    Exploration(
        occupancy_map,
        evaluator,
        recorder.scan_config,
        load_strategy(config.policy, config.policy_parameters),
        reach,
        ViewWorth(judge, config.views),
        recorder,
        Audience(),
        config,
        seed,
    ).run()
    return recorder.states


def queries(states: list[State], count: int, views: int, seed: int):
    """``count`` queries spread evenly over the states: (state's index, poses, scores of ``views`` drawn views)."""
    rng = np.random.default_rng(seed)
    for query in range(count):
        index = query * len(states) // count
        state = states[index]
        drawn = rng.permutation(len(state.poses))[:views]
        yield index, [state.poses[i] for i in drawn], state.scores[drawn].tolist()


def place(bench: Bench, state: State, sequence: int) -> _core.MapSnapshot:
    """Put the bench's request into a state; returns the map."""
    bench.request.start_all = state.start_all
    bench.request.map = bench.snapshot(state.payload, RESOLUTION_M, sequence)
    return bench.request.map
