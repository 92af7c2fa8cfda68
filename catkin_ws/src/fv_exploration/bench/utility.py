"""Algorithm 1: voxel visits per second against the plain loop on the octree."""

from __future__ import annotations

from bench_scene import Room, camera_rays, row, scan, timed, tour
from evaluation import new_map

from fv_exploration import EvaluationConfig, Evaluator, ScanConfig
from fv_exploration.reference import plain_utility


def run(quick: bool) -> list[dict]:
    """Rows: nanoseconds a visit, ours and plain, on two threads and on one."""
    room, rays = Room(), camera_rays(160, 120)
    grid = new_map(room, 0.1)
    for k, pose in enumerate(tour(room, 6 if quick else 10)[:4]):
        grid.insert_scan(scan(room, pose, rays, 0.002, k), pose, ScanConfig(0.3, 3.0))
    evaluator = Evaluator(grid, EvaluationConfig(min_fit=0.5))
    evaluator.update()
    runs = 3 if quick else 7
    plain = []
    for _ in range(runs):
        seconds, visits, _ = plain_utility(evaluator, 3.0)
        plain.append(1e9 * seconds / visits)
    rows = []
    for threads, target in ((2, 6), (1, None)):
        ours = []
        for _ in range(runs):
            seconds, utility = timed(lambda threads=threads: evaluator.utility(3.0, threads=threads))
            ours.append(1e9 * seconds / utility.visits)
        case = f"a visit, {threads} threads, {utility.visits} visits"
        name = "plain loop on the octree"
        rows.append(row("utility", case, ours, plain, unit="ns", reference_name=name, target=target))
        rows.append(
            row("utility", f"visits a second, {threads} threads", [1e9 / t for t in ours], unit="1/s")
        )
    return rows
