"""Queries in batches of 100000 on one core, through Python."""

from __future__ import annotations

import statistics
import tempfile
from pathlib import Path

from capability_map import BuildParameters, CapabilityMap, check
from capability_map.building.build import build_map, local_executor
from capability_map.building.plan import plan_build
from capability_map.robots import load_arm
from fv_bench.capability.rows import row, timed

BATCH = 100_000


def run(quick: bool) -> list[dict]:
    """Microseconds a view. References are what others publish for their own maps, not runs on this machine."""
    arm = load_arm("hubo")
    plan = plan_build(arm, BuildParameters(radii_per_arm_length=7.5 if quick else 15.0))
    with tempfile.TemporaryDirectory() as folder:
        cap = CapabilityMap(build_map(plan, Path(folder) / "map.h5", local_executor(2)))
    positions, directions = check.random_views(cap, BATCH, 0)
    rows = []
    for name, interpolate in (("interpolated over cells and directions", True), ("nearest", False)):
        seconds = timed(lambda mode=interpolate: cap.query(positions, directions, mode), 3 if quick else 15)
        each = 1e6 * statistics.median(seconds) / BATCH
        rows.append(row("capability_query", name, each, "us/pose", target=1.0, met=each <= 1.0, runs=seconds))
    return rows
