"""Measurements of the simulator: real-time factor, scan time, tracking, depth error, a session of random goals.

Run by scripts/bench sim; rows have the keys of design.md. What a user meets over ROS is measured over ROS (real-time
factor, cloud, goals: session.py, a process of its own for each); the parts of a step, tracking and depth in here.
"""

from __future__ import annotations

import json
import statistics
import subprocess
import sys
import time
from collections.abc import Callable

import numpy as np
from rospy import Time
from scipy.spatial.transform import Rotation

from fv_common.conversions import cloud_msg
from hubo_sim.config import SimConfig
from hubo_sim.control.trajectory_goal import TrajectoryGoal
from hubo_sim.ground_truth.analytic import away_from_edges, box_depth
from hubo_sim.robot_source import load_robot_spec
from hubo_sim.ros.conversions import header
from hubo_sim.sensors.render import Pinhole, take_picture
from hubo_sim.simulator import Simulator
from hubo_sim.worlds import load_world, parse_object
from hubo_sim.worlds.scene import Scene

ARM = "huboplus/right_hand_controller"


def row(
    case: str,
    values: list[float],
    unit: str,
    target: float | None,
    smaller: bool = True,
    of: Callable = statistics.median,
) -> dict:
    """A row of the table: `of` (median or the worst) and spread (largest minus smallest) of the runs."""
    ours = of(values)
    return {
        "bench": "sim",
        "case": case,
        "ours": ours,
        "reference": None,
        "reference_name": "",
        "unit": unit,
        "ratio": None,
        "spread": max(values) - min(values),
        "runs": len(values),
        "target": target,
        "met": None if target is None else bool(ours <= target if smaller else ours >= target),
    }


def office(**config) -> Simulator:
    """HUBO in the office."""
    return Simulator(load_robot_spec("hubo"), load_world("office"), SimConfig(**config))


def sway(sim: Simulator, seconds: float) -> None:
    """Start a rest-to-rest motion there and back of the right arm."""
    arm = sim.controllers[ARM]
    here = arm.set_point.position
    there = np.clip(here + 0.3, [j.lower for j in arm.joints], [j.upper for j in arm.joints])
    points = [list(there), list(here)]
    goal = TrajectoryGoal(arm.names, [seconds / 2, seconds], points, [[0.0] * 6] * 2, [[]] * 2)
    arm.start(goal, sim.now_s, "sway")


def session(kind: str, count: int) -> dict:
    """What session.py measures."""
    command = [sys.executable, "-m", "fv_bench.simulation.session", kind, str(count)]
    run = subprocess.run(command, capture_output=True, text=True, check=False)
    lines = [line for line in run.stdout.splitlines() if line.startswith("{")]  # GL says things of its own
    if run.returncode or not lines:
        raise RuntimeError(f"session {kind} failed: {run.stderr.strip()[-500:]}")
    return json.loads(lines[-1])


def over_ros(runs: int) -> list[dict]:
    """The node with HUBO in the office, arm in motion, 240 Hz, a 320x240 cloud at 5 Hz; and a 640x480 cloud."""
    found = session("office", runs)
    renderer = "EGL" if found["egl"] else "TinyRenderer"
    return [
        row(
            "real-time factor of the node, office, cloud at 5 Hz", found["factors"], "s/s", 2.0, smaller=False
        ),
        row("processor use in that, of 2 cores", found["cpu"], "cores", None),
        row(f"640x480 cloud from render to message sent, {renderer}", found["cloud_ms"], "ms", 25.0),
    ]


class Shares:
    """Time spent in functions, by part; what one of them calls of another counts for the other."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}
        self._open: list[float] = []  # time that the calls within each open one took

    def watch(self, owner: object, name: str, part: str) -> None:
        """Time owner.name as `part` from now on."""
        function = getattr(owner, name)

        def timed(*args, **kwargs):
            start = time.perf_counter()
            self._open.append(0.0)
            try:
                return function(*args, **kwargs)
            finally:
                took = time.perf_counter() - start
                self.seconds[part] = self.seconds.get(part, 0.0) + took - self._open.pop()
                if self._open:
                    self._open[-1] += took

        setattr(owner, name, timed)


def step_shares(runs: int) -> list[dict]:
    """Where the time of a step goes, without ROS: the parts' shares of the whole, scans of 320x240 at 5 Hz included."""
    sim, shares = office(), Shares()
    camera = sim.cameras["hand_camera"]
    shares.watch(sim.scene.client, "stepSimulation", "physics engine")
    shares.watch(sim.robot, "state", "reading the joints")
    shares.watch(sim, "_count_contacts", "contacts")
    for name, controller in sim.controllers.items():
        shares.watch(controller, "update", "trajectories")
        shares.watch(sim._drives[name], "drive", "effort and position control")
    shares.watch(sim.robot, "apply", "effort and position control")
    shares.watch(camera, "scan", "scans: drawing and noise")
    start = time.perf_counter()
    for i in range(480 * runs):
        if i % 480 == 0:
            sway(sim, 2.0)
        sim.step()
        if i % 48 == 0:
            scan = camera.scan(sim.scene, i)
            cloud_msg(camera.points(scan.depth), header(Time(1), "f"), scan.rgba)
    whole = time.perf_counter() - start
    sim.close()
    shares.seconds["the rest"] = whole - sum(shares.seconds.values())
    rows = [row("real-time factor without ROS", [2.0 * runs / whole], "s/s", None)]
    for part, seconds in sorted(shares.seconds.items(), key=lambda item: -item[1]):
        rows.append(row(f"share of a step: {part}", [seconds / whole], "1", None))
    return rows


def tracking(runs: int) -> list[dict]:
    """Effort-controlled arm, random rest-to-rest quintics at half of the maximum speed."""
    sim, rng = office(self_collision=False), np.random.default_rng(1)
    arm, rows = sim.controllers[ARM], sim.robot.joint_rows(sim.controllers[ARM].names)
    low = np.array([joint.lower for joint in arm.joints])
    high = np.array([joint.upper for joint in arm.joints])
    rms, over = [], []
    for _ in range(3 * runs):
        start = arm.set_point.position
        goal = np.clip(start + rng.uniform(-1.0, 1.0, 6), low, high)
        speed = np.array([joint.max_velocity for joint in arm.joints]) / 2.0
        duration = float(np.max(1.875 * np.abs(goal - start) / speed))
        points = ([goal.tolist()], [[0.0] * 6], [[0.0] * 6])
        arm.start(TrajectoryGoal(arm.names, [duration], *points), sim.now_s, "goal")
        errors, beyond = [], 0.0
        for _ in range(int(duration * 240) + 120):
            sim.step()
            position = sim.robot.state()[0][rows]
            errors.append(arm.sample(sim.now_s).position - position)
            beyond = max(beyond, float(np.max((position - goal) * np.sign(goal - start))))
        rms.append(float(np.sqrt(np.mean(np.square(errors), axis=0)).max()))
        over.append(beyond)
    sim.close()
    return [
        row("tracking of the effort arm, RMS, worst joint of all runs", rms, "rad", 0.01, of=max),
        row("overshoot at the goal, worst joint of all runs", over, "rad", 0.02, of=max),
    ]


def depth_error(runs: int) -> list[dict]:
    """Planes and boxes, tilted, over the whole range and every wrist roll, noise off, away from edges."""
    camera, rng = Pinhole(320, 240, np.radians(58.0), np.radians(45.0)), np.random.default_rng(3)
    cases = {"planes": np.array([30.0, 30.0, 0.1]), "boxes": np.array([0.5, 0.4, 0.3])}
    rows = []
    for name, size in cases.items():
        errors = []
        with Scene() as scene:
            scene.add_object(parse_object({"name": name, "box": {"size_m": size.tolist()}}, ""))
            for distance in np.linspace(0.4, 2.9, 4 * runs):
                for roll in range(0, 360, 30):
                    T = _pose_towards(rng, name == "planes", distance, roll)
                    truth = box_depth(camera, T, np.eye(4), size)
                    use = away_from_edges(truth) & (truth >= 0.3) & (truth <= 3.0)
                    errors.append(np.abs(take_picture(scene, camera, T, 0.1, 3.5).depth - truth)[use])
        errors = 1e3 * np.nan_to_num(np.concatenate(errors), nan=np.inf)  # a pixel that misses what is there
        for what, share, target in (("median", 50, 1.0), ("99th percentile", 99, 5.0)):
            value = float(np.percentile(errors, share))
            rows.append(row(f"depth error on {name}, {what} of {len(errors)} pixels", [value], "mm", target))
    return rows


def _pose_towards(rng: np.random.Generator, plane: bool, distance: float, roll_deg: float) -> np.ndarray:
    """T_world_optical of a camera that looks at the origin from a random side (a plane: at up to 50 degrees)."""
    tilt = np.degrees(np.arccos(rng.uniform(-1.0, 1.0))) if not plane else rng.uniform(0.0, 50.0)
    T = np.eye(4)
    turn = Rotation.from_euler("zyz", [rng.uniform(0.0, 360.0), tilt, 0.0], degrees=True)
    turn = turn * Rotation.from_euler("xz", [180.0, roll_deg], degrees=True)
    T[:3, :3] = turn.as_matrix()
    T[:3, 3] = -distance * T[:3, 2]
    return T


def random_goals(count: int) -> list[dict]:
    """Goals of every kind over ROS in one session: wrong ends, limits exceeded at any step, memory growth."""
    found = session("goals", count)
    growth = 100.0 * (found["memory_end_mb"] / found["memory_begin_mb"] - 1.0)
    for end in found["wrong_ends"]:
        print(f"wrong end: {end}", file=sys.stderr)
    steps = found["steps"]
    return [
        row(f"wrong ends of {count} random goals", [float(found["wrong"])], "1", 0.0),
        row(f"set-points beyond a limit in {steps} steps", [float(found["beyond_set_points"])], "1", 0.0),
        row(
            "joints beyond a limit by > 0.01 rad, 5 %, meanwhile", [float(found["beyond_measured"])], "1", 0.0
        ),
        row("growth in memory meanwhile", [growth], "%", 5.0),
    ]


def run(quick: bool) -> list[dict]:
    """All rows; quick: fewer runs and 100 instead of 1000 random goals."""
    runs = 3 if quick else 7
    parts: list[Callable[[], list[dict]]] = [
        lambda: over_ros(runs),
        lambda: step_shares(runs),
        lambda: tracking(runs),
        lambda: depth_error(runs),
        lambda: random_goals(100 if quick else 1000),
    ]
    return [entry for part in parts for entry in part()]
