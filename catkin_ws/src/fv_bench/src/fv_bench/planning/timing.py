"""Do plans keep the limits, and how far are they from toppra's optimum?"""

from __future__ import annotations

import numpy as np
from ompl_planner import _core
from ompl_planner.trials import Bench, row, spread, toppra_duration


def limit_excess(bench: Bench, plan: dict) -> float:
    """Largest share of a position, velocity or acceleration limit that the interpolated plan uses; 1 is all."""
    trajectory = plan["trajectory"]
    times = np.arange(0.0, trajectory["times"][-1], 0.002)
    if len(times) == 0:
        return 0.0
    q, dq, ddq = _core.interpolate(trajectory=trajectory, times=times)
    velocity, acceleration = np.array([bench.rates[joint] for joint in plan["joint_names"]]).T
    names, limits = bench.fast.joint_names, bench.fast.limits()
    low, high = np.array([limits[names.index(joint)] for joint in plan["joint_names"]]).T
    position = np.abs(q - (low + high) / 2) / ((high - low) / 2 + 1e-6)
    return float(max(position.max(), (np.abs(dq) / velocity).max(), (np.abs(ddq) / acceleration).max()))


def timing_rows(bench: Bench, plans: list[dict]) -> list[dict]:
    """Limits of all plans, and durations against toppra's on the paths of 40 (corners rounded by 0.2 rad)."""
    excess = max((limit_excess(bench, plan) for plan in plans), default=0.0)
    case = f"{bench.name}: largest share of a limit"
    rows = [row(case, excess, "", target=1.0, met=excess <= 1.0, runs=len(plans))]
    ratios = []
    for plan in [plan for plan in plans if plan["path_length"] > 0.5][:40]:
        velocity, acceleration = np.array([bench.rates[joint] for joint in plan["joint_names"]]).T
        path = {"waypoints": plan["waypoints"], "radii": [0.2] * len(plan["waypoints"])}
        limits = {"velocity": velocity, "acceleration": acceleration}
        ours = _core.time_optimal_trajectory(**path, **limits)["times"][-1]
        ratios.append(ours / toppra_duration(**path, **limits))
    if ratios:
        worst = float(np.max(ratios))
        case = f"{bench.name}: duration by toppra's, largest"
        met = worst <= 1.05
        rows.append(row(case, worst, "x", target=1.05, met=met, spread=spread(ratios), runs=len(ratios)))
    return rows
