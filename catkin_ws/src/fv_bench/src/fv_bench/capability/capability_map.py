"""Building maps at the thesis's parameters: seconds, calls, memory; and the symmetry of KUKA's index map."""

from __future__ import annotations

import resource
import tempfile
from pathlib import Path

import numpy as np

from capability_map import BuildParameters, CapabilityMap, default_map_path
from capability_map._core import ViewProbe
from capability_map.building.build import build_map, local_executor
from capability_map.building.plan import plan_build, probe_options
from capability_map.errors import CapabilityMapError
from capability_map.robots import load_arm
from fv_bench.capability.rows import row

BARS_S = {"hubo": 120.0, "kuka_iiwa": 1200.0}


def run(quick: bool) -> list[dict]:
    """One build a robot on two cores; quick: spheres of four times the radius."""
    rows = []
    for robot in ("hubo", "kuka_iiwa"):
        arm = load_arm(robot)
        plan = plan_build(arm, BuildParameters(radii_per_arm_length=7.5 if quick else 30.0))
        with tempfile.TemporaryDirectory() as folder:
            data = build_map(plan, Path(folder) / "map.h5", local_executor(2))
            megabytes = (Path(folder) / "map.h5").stat().st_size / 1e6
        counts = data.statistics
        case = f"{robot} {arm.group}, {len(data.outward)} points, {counts['cells']} cells"
        bar = None if quick else BARS_S[robot]
        rows += [
            row("capability_map", case, counts["seconds"], "s", target=bar,
                met=None if bar is None else counts["seconds"] <= bar),
            row("capability_map", f"{robot}: processor time", counts["cpu_seconds"], "s"),
            row("capability_map", f"{robot}: calls of inverse kinematics", counts["ik_calls"], "calls"),
            row("capability_map", f"{robot}: collision checks", counts["collision_checks"], "checks"),
            row("capability_map", f"{robot}: file", megabytes, "MB", target=25.0, met=megabytes <= 25.0),
        ]  # fmt: skip
        if robot == "kuka_iiwa":
            rows += symmetry_rows(CapabilityMap(data), arm, 20 if quick else 200)
    peak = (
        resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        + 2 * resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss
    ) / 1e3
    rows.append(
        row(
            "capability_map",
            "peak memory, this process and two workers",
            peak,
            "MB",
            target=2000.0,
            met=peak <= 2000.0,
        )
    )
    return rows


def symmetry_rows(cap: CapabilityMap, arm, spheres: int) -> list[dict]:
    """How far the index of a sphere changes when the sphere and its directions turn about the first axis.

    The map's own grid turns onto itself by quarter turns, but its spiral of directions does not turn along, which
    moves the count at the rim of a cone by some points: that row has no bar.
    """
    volume = np.zeros(int(np.prod(cap.data.grid_size)))
    volume[cap.data.cells] = cap.index()
    volume = volume.reshape(cap.data.grid_size)
    apart = np.concatenate([np.abs(np.rot90(volume, k, axes=(0, 1)) - volume)[volume > 0] for k in (1, 2, 3)])
    change = turned_index_change(cap, arm, spheres)
    return [
        row("capability_map", f"kuka_iiwa: largest change of D in {spheres} spheres turned about axis 1", change,
            "% of N", target=1.0, met=change <= 1.0),
        row("capability_map", "kuka_iiwa: D against cells a quarter turn away, 95th percentile",
            float(np.percentile(apart, 95)), "% of N"),
    ]  # fmt: skip


def turned_index_change(cap: CapabilityMap, arm, spheres: int) -> float:
    """Largest change of D [% of N] over random spheres and four angles; the base's z is the first axis."""
    probe = ViewProbe(arm.model(), arm.group, probe_options(BuildParameters(), len(cap.data.joint_names)))
    random = np.random.default_rng(0)
    largest = 0.0
    for center in cap.centres[random.integers(len(cap.centres), size=spheres)]:
        counts = []
        for angle in (0.0, 0.7, 1.9, 2.6):
            c, s = np.cos(angle), np.sin(angle)
            turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
            outward = cap.directions @ turn.T
            held, _ = probe.decide(turn @ center + cap.radius * outward, -outward)
            counts.append(held.sum())
        largest = max(largest, 100.0 * (max(counts) - min(counts)) / len(cap.directions))
    return float(largest)


def default_map(robot: str) -> CapabilityMap:
    """The robot's map from the data folder, built at the default resolution when it is missing or coarser."""
    arm = load_arm(robot)
    plan = plan_build(arm, BuildParameters())
    path = default_map_path(arm.robot, arm.group)
    try:
        cap = CapabilityMap.load(path, arm.urdf_xml)
        if cap.data.parameters.get("key") == plan.key:
            return cap
    except CapabilityMapError:
        pass
    return CapabilityMap(build_map(plan, path, local_executor(2)))
