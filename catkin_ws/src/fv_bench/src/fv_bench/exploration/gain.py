"""View gain: thousands of views of 32 x 24 rays on a map of a room."""

from __future__ import annotations

import math

import numpy as np

from fv_bench.exploration.evaluation import CAMERA, new_map
from fv_bench.exploration.scene import Room, camera_rays, look, row, scan, timed, tour
from fv_exploration import EvaluationConfig, Evaluator, ScanConfig, view_gain


def run(quick: bool) -> list[dict]:
    """Rows: seconds for 3000 views at 5 cm, with two threads and with one."""
    room, rays = Room(), camera_rays(320, 240)
    grid = new_map(room, 0.05)
    for k, pose in enumerate(tour(room, 20)[:6]):
        grid.insert_scan(scan(room, pose, rays, 0.002, k), pose, ScanConfig(0.3, 3.0))
    evaluator = Evaluator(grid, EvaluationConfig())
    evaluator.update()
    rng = np.random.default_rng(0)
    free = grid.voxels("free")
    count = 500 if quick else 3000
    places = free[rng.integers(len(free), size=count)]
    angles = rng.uniform([-math.pi, -1.2], [math.pi, 1.2], (count, 2))
    poses = np.array([look(p, yaw, pitch) for p, (yaw, pitch) in zip(places, angles, strict=True)])
    rows = []
    for threads in (2, 1):
        seconds = [
            timed(lambda threads=threads: view_gain(grid, evaluator, poses, CAMERA, threads=threads))[0]
            for _ in range(3 if quick else 7)
        ]
        target = 1.0 if threads == 2 and not quick else None
        case = f"{count} views of 32x24 rays, 5 cm, {threads} threads"
        rows.append(row("gain", case, seconds, target=target, at_most=True))
    return rows
