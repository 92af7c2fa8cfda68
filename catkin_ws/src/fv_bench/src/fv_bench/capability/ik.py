"""Inverse kinematics: closed forms against KDL with several starts and against EAIK's own batch call."""

from __future__ import annotations

import statistics
import time

import numpy as np
from scipy.spatial.transform import Rotation

from capability_map.robots import load_arm
from fv_bench.capability.rows import row, timed
from fv_bench.capability.truth import EaikArm
from fv_robot_model.ik import IkOptions, SerialChain, make_ik_solver, make_numerical_ik_solver

KDL_POSES = 100  # of each half
ROBOTS = ("hubo", "kuka_iiwa", "franka_panda", "youbot_arm")


def poses_of(chain: SerialChain, count: int, seed: int) -> np.ndarray:
    """(count, 4, 4): the first half made by forward kinematics, the others anywhere in the ball's cube."""
    random = np.random.default_rng(seed)
    half = count // 2
    center, radius = chain.reach_bound()
    reachable = chain.forward(random.uniform(*chain.limits.T, (half, chain.dof)))
    anywhere = np.tile(np.eye(4), (count - half, 1, 1))
    anywhere[:, :3, :3] = Rotation.random(count - half, random_state=seed).as_matrix()
    anywhere[:, :3, 3] = center + random.uniform(-radius, radius, (count - half, 3))
    return np.concatenate([reachable, anywhere])


def run(quick: bool) -> list[dict]:
    """Microseconds a pose, and how many poses known to be reachable are missed."""
    count, runs = (2000, 3) if quick else (20000, 7)
    rows = []
    for robot in ROBOTS:
        arm = load_arm(robot)
        chain = SerialChain.of_group(arm.model(), arm.group)
        rows += _robot_rows(robot, chain, poses_of(chain, count, 1), runs)
    return rows


def _robot_rows(robot: str, chain: SerialChain, poses: np.ndarray, runs: int) -> list[dict]:
    solver = make_ik_solver(chain)
    seconds = timed(lambda: solver.solve(poses), runs)
    ours = 1e6 * statistics.median(seconds) / len(poses)
    found = np.diff(solver.solve(poses)[0]) > 0
    half = len(poses) // 2
    reachable = poses_of(chain, 2 * len(poses), 2)[: len(poses)]
    missed = int((np.diff(solver.solve(reachable)[0]) == 0).sum())
    # KDL takes tens of milliseconds a pose: its share of the same poses.
    few = np.r_[0:KDL_POSES, half : half + KDL_POSES]
    numerical = make_numerical_ik_solver(chain)
    started = time.perf_counter()
    kdl_found = np.diff(numerical.solve(poses[few])[0]) > 0
    kdl = 1e6 * (time.perf_counter() - started) / len(few)
    plain_6r = solver.family.endswith("6R") and not solver.family.startswith("sweep")
    bar = 200.0 if plain_6r else None
    name = f"KDL, {IkOptions().numerical_starts} starts"
    union = int((found[few] | kdl_found).sum())
    rows = [
        row("ik", f"{robot} {solver.family}", ours, "us/pose", kdl, name, bar,
            None if bar is None else kdl / ours >= bar, seconds),
        row("ik", f"{robot}: reachable poses missed of {len(reachable)}", missed, "poses",
            target=0 if solver.exact else None, met=missed == 0 if solver.exact else None),
        row("ik", f"{robot}: solved of the union's {union} of {len(few)}", 100.0 * found[few].sum() / union, "%",
            100.0 * kdl_found.sum() / union, name),
    ]  # fmt: skip
    if solver.family == "spherical-shoulder-6R":
        rows += _eaik_rows(robot, chain, poses, found, seconds, runs)
    return rows


def _eaik_rows(
    robot: str, chain: SerialChain, poses: np.ndarray, found: np.ndarray, seconds: list[float], runs: int
) -> list[dict]:
    eaik = EaikArm(chain)
    prepared = eaik.prepare(poses)
    ours = 1e6 * statistics.median(seconds) / len(poses)
    theirs = 1e6 * statistics.median(timed(lambda: eaik.batch(prepared, 1), runs)) / len(poses)
    eaik_found = np.array([len(eaik.within_limits(answer)) > 0 for answer in eaik.batch(prepared, 1)])
    union = int((found | eaik_found).sum())
    return [
        row("ik", f"{robot} against EAIK", ours, "us/pose", theirs, "EAIK's batch call, one thread as ours", 3.0,
            theirs / ours >= 3.0, seconds),
        row("ik", f"{robot}: solved of the union's {union} of {len(poses)}", 100.0 * found.sum() / union, "%",
            100.0 * eaik_found.sum() / union, "EAIK"),
    ]  # fmt: skip
