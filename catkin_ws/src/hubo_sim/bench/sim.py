"""Measurements of the simulator: real-time factor, scan time, tracking, depth error, a session of random goals.

Run by scripts/bench sim; rows have the keys of design.md. Everything runs in this process, without ROS, but for the
messages of the scan time.
"""

from __future__ import annotations

import dataclasses
import resource
import statistics
import time
from collections.abc import Callable

import numpy as np
from rospy import Time
from scipy.spatial.transform import Rotation

from hubo_sim.config import SimConfig
from hubo_sim.conversions import cloud_msg, header
from hubo_sim.depth_camera import DepthCamera
from hubo_sim.render import Pinhole, take_picture
from hubo_sim.robot_source import load_robot_spec
from hubo_sim.scene import Scene
from hubo_sim.simulator import Simulator
from hubo_sim.trajectory_goal import Code, Refusal, TrajectoryGoal
from hubo_sim.worlds import load_world, parse_object

ARM = "huboplus/right_hand_controller"


def row(case: str, values: list[float], unit: str, target: float, smaller: bool = True) -> dict:
    """A row of the table: median and spread (largest minus smallest) of the runs against a target."""
    ours = statistics.median(values)
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
        "met": bool(ours <= target if smaller else ours >= target),
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


def real_time_factor(runs: int) -> list[dict]:
    """HUBO in the office, arm in motion, 240 Hz, a 320x240 cloud at 5 Hz; and the share of each part of a step."""
    sim, factors, scan_shares, cpu = office(), [], [], []
    camera = sim.cameras["hand_camera"]
    for _ in range(runs):
        sway(sim, 2.0)
        scan_s, start, cpu_start = 0.0, time.perf_counter(), time.process_time()
        for i in range(480):
            sim.step()
            if i % 48 == 0:
                before = time.perf_counter()
                scan = camera.scan(sim.scene, i)
                cloud_msg(camera.points(scan.depth), header(Time(1), "f"), scan.rgba)
                scan_s += time.perf_counter() - before
        wall = time.perf_counter() - start
        factors.append(2.0 / wall)
        scan_shares.append(scan_s / wall)
        cpu.append((time.process_time() - cpu_start) / wall)
    sim.close()
    return [
        row("real-time factor, office, cloud at 5 Hz", factors, "s/s", 2.0, smaller=False),
        row("share of the scans in that", scan_shares, "1", 1.0),
        row("processor use in that (2 cores: 2)", cpu, "cores", 2.0),
    ]


def scan_time(runs: int) -> list[dict]:
    """A 640x480 cloud with the robot's noise from render to message."""
    sim, times = office(), []
    config = dataclasses.replace(sim.cameras["hand_camera"].config, width=640, height=480)
    camera = DepthCamera(config, sim.robot)
    sim.step()
    for i in range(10 * runs):
        start = time.perf_counter()
        scan = camera.scan(sim.scene, i)
        cloud_msg(camera.points(scan.depth), header(Time(1), "f"), scan.rgba)
        times.append(1e3 * (time.perf_counter() - start))
    name = "EGL" if sim.scene.uses_egl else "TinyRenderer"
    sim.close()
    return [row(f"640x480 cloud, {name}", times, "ms", 25.0)]


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
        row("tracking of the effort arm, RMS of the worst joint", rms, "rad", 0.01),
        row("overshoot at the goal, worst joint", over, "rad", 0.02),
    ]


def depth_error(runs: int) -> list[dict]:
    """Planes over the range and every wrist roll, noise off: median and 99th percentile of the error."""
    camera, errors = Pinhole(320, 240, np.radians(58.0), np.radians(45.0)), []
    with Scene() as scene:
        scene.add_object(
            parse_object({"name": "wall", "box": {"size_m": [20, 20, 0.1]}, "position_m": [0, 0, -0.05]}, "")
        )
        for distance in np.linspace(0.3, 3.0, 4 * runs):
            for roll in range(0, 360, 45):
                T = np.eye(4)
                T[:3, :3] = Rotation.from_euler("xz", [180, roll], degrees=True).as_matrix()
                T[2, 3] = distance
                errors.append(np.abs(take_picture(scene, camera, T, 0.1, 3.5).depth - distance).ravel())
    errors = 1e3 * np.concatenate(errors)
    return [
        row("depth error on planes, median", [float(np.median(errors))], "mm", 1.0),
        row("depth error on planes, 99th percentile", [float(np.percentile(errors, 99))], "mm", 5.0),
    ]


def random_goals(count: int) -> list[dict]:
    """Valid, invalid, replaced and cancelled goals in one session: wrong codes, limits exceeded, memory growth."""
    sim, rng = Simulator(load_robot_spec("hubo"), load_world("empty"), SimConfig(self_collision=False)), None
    rng = np.random.default_rng(7)
    arm, rows = sim.controllers[ARM], sim.robot.joint_rows(sim.controllers[ARM].names)
    wrong, exceeded, memory = 0, 0, []
    for i in range(count):
        kind = rng.choice(["valid", "late", "names", "nan", "limits", "cancelled", "replaced"])
        wrong += not _goal_ends_right(sim, arm, str(kind), i, rng)
        state = sim.robot.state()
        exceeded += _beyond_limits(arm, state[0][rows], state[1][rows])
        if i >= count // 5:  # after warming up
            memory.append(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
    sim.close()
    growth = 100.0 * (memory[-1] / memory[0] - 1.0)
    return [
        row(f"wrong result codes of {count} random goals", [float(wrong)], "1", 0.0),
        row("limits exceeded meanwhile", [float(exceeded)], "1", 0.0),
        row("growth in memory meanwhile", [growth], "%", 5.0),
    ]


def _goal_ends_right(sim: Simulator, arm, kind: str, number: int, rng: np.random.Generator) -> bool:
    """Send one goal of a kind and run it to its end; whether the outcome is what the kind asks for."""
    low = np.array([max(j.lower, -1.5) for j in arm.joints])
    high = np.array([min(j.upper, 1.5) for j in arm.joints])
    target = rng.uniform(low, high)
    speed = np.array([j.max_velocity for j in arm.joints])
    seconds = float(np.max(1.5 * np.abs(target - arm.set_point.position) / speed)) + 0.2
    change = {
        "nan": {"positions": [[float("nan")] * 6]},
        "limits": {"positions": [[9.0] * 6]},
        "names": {"joint_names": [*arm.names[:5], "NOPE"]},
        "late": {"stamp_s": max(sim.now_s - seconds - 1.0, 1e-6)},
    }.get(kind, {})
    entries = {"joint_names": arm.names, "times_s": [seconds], "positions": [target.tolist()]}
    goal = TrajectoryGoal(**(entries | {"velocities": [[0.0] * 6], "accelerations": [[]]} | change))
    refused = {"nan": Code.INVALID_GOAL, "limits": Code.INVALID_GOAL, "names": Code.INVALID_JOINTS}
    refused["late"] = Code.OLD_HEADER_TIMESTAMP
    try:
        arm.check(goal, sim.now_s)
    except Refusal as err:
        return refused.get(kind) == err.code or (kind == "late" and sim.now_s < seconds + 1.0)
    arm.start(goal, sim.now_s, number)
    outcomes = _run(sim, arm, 0.5 * seconds if kind in ("cancelled", "replaced") else seconds + 1.0)
    if kind == "cancelled":
        arm.cancel(sim.now_s, number)
    if kind == "replaced":
        arm.start(TrajectoryGoal(arm.names, [], [], [], []), sim.now_s, -number - 1)
    outcomes += _run(sim, arm, 0.6) if kind in ("cancelled", "replaced") else []
    wanted = "canceled" if kind in ("cancelled", "replaced") else "succeeded"
    return [o.status for o in outcomes if o.handle == number] == [wanted] and kind not in refused


def _run(sim: Simulator, arm, seconds: float) -> list:
    outcomes = []
    for _ in range(int(240 * seconds)):
        sim.step()
        outcomes += arm.ended()
    return outcomes


def _beyond_limits(arm, position: np.ndarray, velocity: np.ndarray) -> bool:
    """Whether measured joints exceed a limit by more than the tracking bar allows (0.01 rad, 5 %)."""
    low = np.array([j.lower for j in arm.joints]) - 0.01
    high = np.array([j.upper for j in arm.joints]) + 0.01
    speed = 1.05 * np.array([j.max_velocity for j in arm.joints])
    return bool(((position < low) | (position > high) | (np.abs(velocity) > speed)).any())


def run(quick: bool) -> list[dict]:
    """All rows; quick: fewer runs and 100 instead of 1000 random goals."""
    runs = 3 if quick else 7
    parts: list[Callable[[], list[dict]]] = [
        lambda: real_time_factor(runs),
        lambda: scan_time(runs),
        lambda: tracking(runs),
        lambda: depth_error(runs),
        lambda: random_goals(100 if quick else 1000),
    ]
    return [entry for part in parts for entry in part()]
