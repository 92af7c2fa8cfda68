"""Incremental evaluation while 60 scans fill a room; memory; a whole decision at several resolutions."""

from __future__ import annotations

import ctypes
import json
import statistics
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np

from fv_bench.exploration.scene import Room, camera_rays, row, scan, timed, tour
from fv_exploration import (
    EvaluationConfig,
    Evaluator,
    MapConfig,
    OccupancyMap,
    PinholeCamera,
    ScanConfig,
    best_views,
    view_gain,
)

CAMERA = PinholeCamera(32, 24, 1.0123, 0.7854, 0.3, 3.0)


def new_map(room: Room, resolution_m: float) -> OccupancyMap:
    """A map of the room and a little more, so that its walls are inside."""
    low, high = room.low - 2 * resolution_m, room.high + 2 * resolution_m
    return OccupancyMap(MapConfig(resolution_m=resolution_m, bounds_min=tuple(low), bounds_max=tuple(high)))


def resident_bytes(field: str) -> int:
    """VmRSS, or its peak VmHWM, of this process; getrusage's peak would be that of a larger parent."""
    status = Path("/proc/self/status").read_text(encoding="ascii")
    return next(int(line.split()[1]) for line in status.splitlines() if line.startswith(field)) * 1024


def forget_peak() -> int:
    """Let the peak begin anew, with nothing kept that could be used again; returns the bytes resident now."""
    ctypes.CDLL(None).malloc_trim(0)
    Path("/proc/self/clear_refs").write_text("5", encoding="ascii")
    return resident_bytes("VmRSS")


def sixty_scans(resolution_m: float, count: int) -> dict[str, Any]:
    """Update times of each scan, and what became of the map; in a process of its own for its memory."""
    room = Room()
    rays = camera_rays(320, 240)
    scans = [(scan(room, pose, rays, 0.002, k), pose) for k, pose in enumerate(tour(room, count))]
    before = forget_peak()
    grid = new_map(room, resolution_m)
    evaluator = Evaluator(grid, EvaluationConfig())
    updates, known = [], []
    for points, pose in scans:
        grid.insert_scan(points, pose, ScanConfig(0.3, 3.0))
        updates.append(timed(evaluator.update)[0])
        counts = grid.counts()
        known.append(counts["free"] + counts["occupied"])
    peak = resident_bytes("VmHWM") - before
    octree = grid.octree_memory_bytes

    def anew(config: EvaluationConfig) -> list[float]:
        """From scratch; each time after a scan, as the updates are, which leaves other things in the caches."""
        seconds = []
        for _ in range(7):
            grid.insert_scan(*scans[-1], ScanConfig(0.3, 3.0))
            seconds.append(timed(lambda: Evaluator(grid, config).update())[0])
        return seconds

    return {
        "updates": updates,
        "known": known,
        "batches": anew(EvaluationConfig()),
        "whole": anew(EvaluationConfig(tiled=False)),
        "peak": peak,
        "octree": octree,
    }


def in_own_process(resolution_m: float, count: int) -> dict[str, Any]:
    """`sixty_scans` where nothing else has taken memory."""
    command = [sys.executable, "-m", "fv_bench.exploration.evaluation", str(resolution_m), str(count)]
    return json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)


def growth(quick: bool) -> list[dict]:
    """Updates at the end against those at the begin and against batch evaluation; memory."""
    resolution, count = (0.05, 20) if quick else (0.02, 60)
    r = in_own_process(resolution, count)
    share = max(3, count // 6)
    first, last = r["updates"][:share], r["updates"][-share:]
    case = f"{count} scans, {resolution * 100:.0f} cm"
    slower = [statistics.median(last) / statistics.median(first)]
    return [
        row("evaluation", f"{case}: last updates", last, first, reference_name="first updates"),
        row("evaluation", f"{case}: last / first", slower, unit="ratio", target=1.5, at_most=True),
        row(
            "evaluation",
            f"{case}: growth of the map",
            [r["known"][-1] / r["known"][0]],
            unit="ratio",
            target=4,
        ),
        row(
            "evaluation", f"{case}: update", last, r["batches"], reference_name="batch evaluation", target=20
        ),
        row(
            "evaluation",
            f"{case}: update",
            last,
            r["whole"],
            reference_name="batch evaluation, voids merged as a whole (thesis)",
        ),
        row(
            "evaluation",
            f"{case}: peak RSS / octree",
            [r["peak"] / r["octree"]],
            unit="ratio",
            target=3,
            at_most=True,
        ),
    ]


def decision(room: Room, resolution_m: float, count: int) -> list[float]:
    """Seconds of insert, evaluate, utility and candidates with gain, for each scan but the first."""
    grid = new_map(room, resolution_m)
    evaluator = Evaluator(grid, EvaluationConfig())
    rays = camera_rays(320, 240)
    seconds = []
    for k, pose in enumerate(tour(room, count)):
        points = scan(room, pose, rays, 0.002, k)
        seconds.append(timed(lambda points=points, pose=pose: decide(grid, evaluator, points, pose))[0])
    return seconds[1:]


def decide(grid: OccupancyMap, evaluator: Evaluator, points: np.ndarray, pose: np.ndarray) -> np.ndarray:
    """One decision: gains of the best views."""
    grid.insert_scan(points, pose, ScanConfig(0.3, 3.0))
    evaluator.update()
    utility = evaluator.utility(3.0, max_rays=100_000)
    best = best_views(utility, 50, 0.3)
    poses = np.tile(np.eye(4), (len(best), 1, 1))
    for target, i in zip(poses, best, strict=True):
        z = utility.direction[i].astype(float)
        x = np.cross(np.eye(3)[np.argmin(np.abs(z))], z)
        x /= np.linalg.norm(x)
        target[:3, :3] = np.column_stack([x, np.cross(z, x), z])
        target[:3, 3] = utility.points[i]
    return view_gain(grid, evaluator, poses, CAMERA).void_volume_m3


def run(quick: bool) -> list[dict]:
    """Rows; FUEL (Zhou et al. 2021) reports 24-36 ms for a decision at 10 cm."""
    rows = growth(quick)
    for resolution, target in ((0.1, 0.036), (0.05, None), (0.02, None)):
        if quick and resolution < 0.05:
            continue
        seconds = decision(Room(), resolution, 8 if quick else 20)
        case = f"whole decision, {resolution * 100:.0f} cm"
        rows.append(row("evaluation", case, seconds, target=target, at_most=True))
    return rows


if __name__ == "__main__":
    print(json.dumps(sixty_scans(float(sys.argv[1]), int(sys.argv[2]))))
