"""Planning against the plain pipeline: `run(quick)` gives the rows of scripts/bench."""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np

from hubo_description import load_robot
from ompl_planner import _core
from ompl_planner.bench.scenes import SCENES

VIEWS_PER_QUERY = 20
PLAIN = "RRTConnect + FCL octree, one view at a time"


def row(case: str, ours: float, unit: str, **others: object) -> dict:
    """One row of the table; what is not given is null."""
    empty = dict.fromkeys(("reference", "reference_name", "ratio", "spread", "target", "met"))
    return {"bench": "planning", "case": case, "ours": ours, **empty, "unit": unit, "runs": 1, **others}


@dataclass
class Bench:
    """One robot in one scene, for the fast and the plain planner."""

    name: str
    fast: _core.MotionPlanner
    plain: _core.MotionPlanner
    request: _core.PlanRequest
    rates: dict[str, tuple[float, float]]
    T_map_root: np.ndarray
    payload: bytes
    resolution_m: float

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


def make_bench(robot_name: str, scene_name: str) -> Bench:
    """Load a robot and put it in front of a scene, at the height its robot.yaml gives."""
    robot = load_robot(robot_name)
    exploration = robot.config.exploration
    rates = {
        name: (limit["max_velocity"], limit["max_acceleration"])
        for name, limit in robot.documents["joint_limits"]["joint_limits"].items()
    }
    model = {"urdf": robot.urdf_xml, "srdf": robot.srdf_xml, "rates": rates}
    fast = _core.MotionPlanner(**model)
    # one checker for all: FCL at the judge's step, so nothing has to be checked again
    plain = _core.MotionPlanner(**model, config={"world_check": "fcl_octree", "search_step_rad": 0.0087})
    T_map_root = np.eye(4)
    T_map_root[2, 3] = robot.documents["robot"]["base_height_m"]
    scene = SCENES[scene_name]()
    payload = _core.octree_payload(**scene.arrays())
    request = _core.PlanRequest()
    request.group = exploration.group
    request.set_T_map_root(T_map_root)
    request.map = fast.snapshot(
        payload=payload, resolution_m=scene.resolution_m, sequence=1, T_map_root=T_map_root
    )
    limits = fast.limits()
    start = np.clip(np.zeros(len(limits)), limits[:, 0], limits[:, 1])
    states = robot.group_states[exploration.group][exploration.start_pose]
    for states_of in [*robot.group_states.values(), {"": states}]:
        home = states_of.get("home", states_of.get("", {}))
        for joint, value in home.items():
            start[fast.joint_names.index(joint)] = value
    request.start_all = start
    request.goal_type = _core.GoalType.POSES
    request.free_roll = True
    name = f"{robot_name} {scene_name}"
    return Bench(name, fast, plain, request, rates, T_map_root, payload, scene.resolution_m)


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


def solve_plain(bench: Bench, poses: list[np.ndarray], scores: list[float]) -> tuple[bool, float]:
    """Candidate views one at a time, best first; whether one was reached, and the seconds without the judge's."""
    begin = time.perf_counter()
    for index in np.argsort(scores)[::-1]:
        bench.request.set_goal_poses([poses[index]])
        bench.request.goal_scores = []
        plan = bench.plain.solve(bench.request)
        if plan["status"] == 0:
            return True, time.perf_counter() - begin - dict(plan["stages"]).get("judge", 0.0)
    return False, time.perf_counter() - begin


@dataclass
class Outcome:
    """What the queries of one bench gave."""

    fast_s: list[float]
    plain_s: list[float]
    exists: int
    solved: int
    refused: int
    plans: list[dict]


def run_queries(bench: Bench, queries: int, seed: int, with_plain: bool) -> Outcome:
    """Chain of queries, each from where the last plan ended, as exploration makes them."""
    rng = np.random.default_rng(seed)
    outcome = Outcome([], [], 0, 0, 0, [])
    bench.fast.warm(bench.request)
    bench.plain.warm(bench.request)
    for query in range(queries):
        poses, scores = random_views(rng, VIEWS_PER_QUERY)
        bench.request.seed = query + 1
        bench.request.time_budget_s = 5.0
        plain_found = False
        if with_plain:
            plain_found, seconds = solve_plain(bench, poses, scores)
            outcome.plain_s.append(seconds)
        bench.request.set_goal_poses(poses)
        bench.request.goal_scores = scores
        begin = time.perf_counter()
        plan = bench.fast.solve(bench.request)
        outcome.fast_s.append(time.perf_counter() - begin)
        found = plan["status"] == 0
        if not found and not plain_found and plan["goal_states"] > 0:
            bench.request.time_budget_s = 60.0
            plain_found = bench.fast.solve(bench.request)["status"] == 0
        outcome.exists += found or plain_found
        outcome.solved += found
        if not found:
            continue
        outcome.refused += bool(bench.fast.judge(bench.request, plan["trajectory"]))
        outcome.plans.append(plan)
        bench.request.start_all = bench.with_group(plan["trajectory"]["positions"][-1])
    return outcome


def spread(values: list[float]) -> float:
    """Interquartile range."""
    return float(np.subtract(*np.percentile(values, [75, 25])))


def query_rows(bench: Bench, queries: int, seed: int) -> tuple[list[dict], list[dict]]:
    """Rows of times and success, and the plans."""
    out = run_queries(bench, queries, seed, with_plain=True)
    fast_ms, plain_ms = 1e3 * np.array(out.fast_s), 1e3 * np.array(out.plain_s)
    fast, plain, p95 = np.median(fast_ms), np.median(plain_ms), np.percentile(fast_ms, 95)
    share = 100.0 * out.solved / max(1, out.exists)
    common = {"runs": queries}
    rows = [
        row(
            f"{bench.name}: plan, median",
            float(fast),
            "ms",
            reference=float(plain),
            reference_name=PLAIN,
            ratio=float(plain / fast),
            spread=spread(fast_ms),
            target=30.0,
            met=bool(fast <= 30.0),
            **common,
        ),
        row(
            f"{bench.name}: speed-up at the median",
            float(plain / fast),
            "x",
            target=5.0,
            met=bool(plain >= 5.0 * fast),
        ),
        row(
            f"{bench.name}: plan, 95th percentile",
            float(p95),
            "ms",
            target=300.0,
            met=bool(p95 <= 300.0),
            **common,
        ),
        row(
            f"{bench.name}: solved where a path exists",
            share,
            "%",
            target=99.0,
            met=share >= 99.0,
            runs=out.exists,
        ),
        row(
            f"{bench.name}: plans that the judge refuses",
            out.refused,
            "plans",
            target=0,
            met=out.refused == 0,
            **common,
        ),
    ]
    return rows, out.plans


def checker_rows(bench: Bench, states: int) -> list[dict]:
    """Free-state checks per second, and states on which the checkers differ."""
    q = bench.random_states(states, np.random.default_rng(5))
    answers = {
        name: np.array(bench.fast.check_states(bench.request, q, checker=name, with_self=False))
        for name in ("distance_field", "judge")
    }
    accepted = int((answers["distance_field"] & ~answers["judge"]).sum())
    refused = 100.0 * float((~answers["distance_field"] & answers["judge"]).mean())
    free = q[answers["judge"]]
    seconds = {}
    for name, count in (("distance_field", len(free)), ("fcl_octree", min(len(free), 2000))):
        times = []
        for size in (1, count):  # the first call's time is the set-up
            begin = time.perf_counter()
            bench.fast.check_states(bench.request, free[:size], checker=name, with_self=False)
            times.append(time.perf_counter() - begin)
        seconds[name] = (times[1] - times[0]) / (count - 1)
    fast, slow = 1e6 * seconds["distance_field"], 1e6 * seconds["fcl_octree"]
    return [
        row(
            f"{bench.name}: free state against the map",
            fast,
            "us",
            reference=slow,
            reference_name="FCL octree",
            ratio=slow / fast,
            runs=len(free),
            target=slow / 10.0,
            met=slow >= 10.0 * fast,
        ),
        row(
            f"{bench.name}: accepted, judge refuses",
            accepted,
            "states",
            runs=states,
            target=0,
            met=accepted == 0,
        ),
        row(f"{bench.name}: refused, judge accepts", refused, "%", runs=states),
    ]


def limit_excess(bench: Bench, plan: dict) -> float:
    """Largest share of a velocity or acceleration limit that the interpolated plan uses."""
    trajectory = plan["trajectory"]
    times = np.arange(0.0, trajectory["times"][-1], 0.002)
    if len(times) == 0:
        return 0.0
    _, dq, ddq = _core.interpolate(trajectory=trajectory, times=times)
    velocity, acceleration = np.array([bench.rates[joint] for joint in plan["joint_names"]]).T
    return float(max((np.abs(dq) / velocity).max(), (np.abs(ddq) / acceleration).max()))


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
    trajectory = instance.compute_trajectory()
    return float(trajectory.duration)


def timing_rows(bench: Bench, plans: list[dict]) -> list[dict]:
    """Limits, and durations against toppra's on the same paths (corners rounded by 0.2 rad)."""
    excess = max((limit_excess(bench, plan) for plan in plans), default=0.0)
    ratios = []
    for plan in [p for p in plans if p["path_length"] > 0.5][:40]:
        velocity, acceleration = np.array([bench.rates[joint] for joint in plan["joint_names"]]).T
        path = {"waypoints": plan["waypoints"], "radii": [0.2] * len(plan["waypoints"])}
        ours = _core.time_optimal_trajectory(**path, velocity=velocity, acceleration=acceleration)["times"][
            -1
        ]
        ratios.append(ours / toppra_duration(**path, velocity=velocity, acceleration=acceleration))
    rows = [
        row(
            f"{bench.name}: largest share of a limit",
            excess,
            "",
            target=1.0,
            met=excess <= 1.0,
            runs=len(plans),
        )
    ]
    if ratios:
        worst = float(np.percentile(ratios, 95))
        case = f"{bench.name}: duration by toppra's, 95th percentile"
        rows.append(
            row(case, worst, "x", target=1.05, met=worst <= 1.05, spread=spread(ratios), runs=len(ratios))
        )
    return rows


def map_row(bench: Bench, runs: int) -> dict:
    """From the message's payload to a usable collision world."""
    times = []
    for sequence in range(runs):
        begin = time.perf_counter()
        bench.request.map = bench.fast.snapshot(
            payload=bench.payload,
            resolution_m=bench.resolution_m,
            sequence=sequence + 2,
            T_map_root=bench.T_map_root,
        )
        bench.fast.warm(bench.request)
        times.append(1e3 * (time.perf_counter() - begin))
    median = float(np.median(times))
    case = f"{bench.name}: map to collision world"
    return row(case, median, "ms", spread=spread(times), runs=runs, target=50.0, met=median <= 50.0)


def length_row(bench: Bench, queries: int, runs: int, budget_rounds: int) -> dict:
    """Path length against the best of several RRT* runs, on single joint goals that both reach."""
    rng = np.random.default_rng(11)
    ratios = []
    states = bench.random_states(4000, rng)
    free = states[np.array(bench.fast.check_states(bench.request, states, checker="distance_field"))]
    bench.request.goal_type = _core.GoalType.JOINTS
    for goal in free[:queries]:
        bench.request.goal_joints = list(zip(bench.joints, goal.tolist(), strict=True))
        bench.request.planner = ""
        ours = bench.fast.solve(bench.request)
        best = np.inf
        bench.request.planner = "RRTstar"
        for seed in range(runs):
            bench.request.seed = seed + 1
            bench.request.time_budget_s = budget_rounds
            plan = bench.fast.solve(bench.request)
            best = min(best, plan["path_length"] if plan["status"] == 0 else np.inf)
        if ours["status"] == 0 and np.isfinite(best):
            ratios.append(ours["path_length"] / best)
    bench.request.goal_type, bench.request.planner = _core.GoalType.POSES, ""
    median = float(np.median(ratios)) if ratios else float("nan")
    case = f"{bench.name}: path length by best of {runs} RRT*, median"
    return row(case, median, "x", runs=len(ratios), target=1.2, met=bool(median <= 1.2))


def run(quick: bool) -> list[dict]:
    """All rows; quick: HUBO in both scenes with few queries, no RRT*."""
    cases = [("hubo", scene) for scene in SCENES]
    if not quick:
        cases += [(robot, scene) for robot in ("kuka_iiwa", "franka_panda") for scene in SCENES]
    rows = []
    for number, (robot, scene) in enumerate(cases):
        bench = make_bench(robot, scene)
        found, plans = query_rows(bench, 20 if quick else 200, seed=100 + number)
        rows += [*found, *timing_rows(bench, plans), *checker_rows(bench, 5000 if quick else 100000)]
        rows.append(map_row(bench, 5 if quick else 20))
        if not quick and robot == "hubo":
            rows.append(length_row(bench, queries=20, runs=10, budget_rounds=10))
    return rows
