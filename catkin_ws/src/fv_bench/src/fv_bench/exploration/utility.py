"""Algorithm 1: voxel visits per second against the plain loop on the octree."""

from __future__ import annotations

from fv_bench.exploration.evaluation import new_map
from fv_bench.exploration.scene import Room, camera_rays, row, scan, timed, tour
from fv_exploration import EvaluationConfig, Evaluator, ScanConfig
from fv_exploration.reference import plain_utility


def scene(resolution_m: float, scans: int) -> Evaluator:
    """A room of which some scans have been seen, evaluated."""
    room, rays = Room(), camera_rays(160, 120)
    grid = new_map(room, resolution_m)
    for k, pose in enumerate(tour(room, 10)[:scans]):
        grid.insert_scan(scan(room, pose, rays, 0.002, k), pose, ScanConfig(0.3, 3.0))
    evaluator = Evaluator(grid, EvaluationConfig(min_fit=0.5))
    evaluator.update()
    return evaluator


def compare(evaluator: Evaluator, name: str, runs: int) -> list[dict]:
    """Rows of nanoseconds a visit, all overhead included: ours and plain, with two threads allowed and with one.

    A second thread is used only where there are rays enough to be worth sums of its own.
    """
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
        case = f"{name}: a visit, at most {threads} threads, {utility.visits} visits"
        reference = "plain loop on the octree"
        rows.append(row("utility", case, ours, plain, unit="ns", reference_name=reference, target=target))
        case = f"{name}: visits a second, at most {threads} threads"
        rows.append(row("utility", case, [1e9 / t for t in ours], unit="1/s"))
    return rows


def run(quick: bool) -> list[dict]:
    """Rows for an early map at 10 cm, where overhead counts, and for a larger one at 5 cm."""
    runs = 3 if quick else 7
    rows = compare(scene(0.1, 4), "10 cm", runs)
    if not quick:
        rows += compare(scene(0.05, 3), "5 cm", runs)
    return rows
