"""Path lengths against the best of several RRT* runs."""

from __future__ import annotations

import numpy as np
from ompl_planner import _core
from ompl_planner.trials import Bench, row, spread

from hubo_description import load_robot


def best_of_rrtstar(planner: _core.MotionPlanner, request: _core.PlanRequest, runs: int) -> float:
    """Shortest path [rad] as RRT* leaves it (its time is all search, none left for shortcuts); infinite without one."""
    lengths = [np.inf]
    for seed in range(runs):
        request.seed = seed + 1
        plan = planner.solve(request)
        if plan["status"] == _core.PlanStatus.SUCCESS:
            lengths.append(plan["path_length"])
    return min(lengths)


def length_row(bench: Bench, count: int, runs: int, seconds: float) -> dict:
    """Random free joint states as goals that no straight line reaches, so that both planners have the same goal."""
    robot = load_robot(bench.name.split()[0])
    patient = _core.MotionPlanner(
        urdf=robot.urdf_xml, srdf=robot.srdf_xml, rates=bench.rates, config={"quality_rounds": 1e9}
    )
    states = bench.random_states(4000, np.random.default_rng(11))
    free = states[np.array(bench.fast.check_states(bench.request, states, checker="distance_field"))]
    request = bench.request
    request.goal_type = _core.GoalType.JOINTS
    ratios = []
    for goal in free:
        if len(ratios) == count:
            break
        request.goal_joints = list(zip(bench.joints, goal.tolist(), strict=True))
        request.planner, request.seed, request.time_budget_s = "", 1, 5.0
        ours = bench.fast.solve(request)
        if ours["status"] != _core.PlanStatus.SUCCESS or len(ours["waypoints"]) < 3:
            continue
        request.planner, request.time_budget_s = "RRTstar", seconds
        best = best_of_rrtstar(patient, request, runs)
        if not np.isfinite(best):
            continue  # RRT* found none in any run: nothing to compare with
        ratios.append(ours["path_length"] / best)
        print(f"  {len(ratios)} of {count}: {ratios[-1]:.3f} of RRT*'s length", flush=True)
    request.goal_type, request.planner = _core.GoalType.POSES, ""
    worst = float(np.max(ratios)) if ratios else float("nan")
    case = f"{bench.name}: path length by best of {runs} RRT*, largest"
    met = bool(worst <= 1.2)
    return row(case, worst, "x", runs=len(ratios), target=1.2, met=met, spread=spread(ratios))
