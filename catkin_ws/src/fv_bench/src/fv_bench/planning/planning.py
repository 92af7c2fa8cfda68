"""Planning against the plain pipeline, from real exploration states: `run(quick)` gives the rows of scripts/bench.

The plain pipeline is the same code with the same parameters, but FCL on an octree for every check of the search, and
one candidate view at a time in order of score. Its judge's time is left out: a plain pipeline has none.
With FV_BENCH_SLOW=1 the paths are compared with RRT*'s too (half an hour).
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from ompl_planner import _core
from ompl_planner.trials import PLAIN, Bench, row, spread

from fv_bench.planning.lengths import length_row
from fv_bench.planning.states import State, place, queries, record
from fv_bench.planning.timing import timing_rows

VIEWS_PER_QUERY = 24
"""As many as the explorer asks for at once."""


@dataclass
class Outcome:
    """What the queries of one bench gave."""

    fast_s: list[float] = field(default_factory=list)
    plain_s: list[float] = field(default_factory=list)
    exists: int = 0
    solved: int = 0
    plain_solved: int = 0
    refused: int = 0
    older_map: int = 0
    plans: list[dict] = field(default_factory=list)


def solve_plain(bench: Bench, poses: list[np.ndarray], scores: list[float]) -> tuple[bool, float]:
    """Candidate views one at a time, best first; whether one was reached, and the seconds without the judge's."""
    seconds = 0.0
    for index in np.argsort(scores)[::-1]:
        bench.request.set_goal_poses([poses[index]])
        bench.request.goal_scores = []
        begin = time.perf_counter()
        plan = bench.plain.solve(bench.request)
        seconds += time.perf_counter() - begin - dict(plan["stages"]).get("judge", 0.0)
        if plan["status"] == _core.PlanStatus.SUCCESS:
            return True, seconds
    return False, seconds


def solve_fast(bench: Bench, poses: list[np.ndarray], scores: list[float]) -> tuple[dict, float]:
    """All views at once; the plan and the seconds of all stages."""
    bench.request.set_goal_poses(poses)
    bench.request.goal_scores = scores
    begin = time.perf_counter()
    plan = bench.fast.solve(bench.request)
    return plan, time.perf_counter() - begin


def path_exists(bench: Bench) -> bool:
    """Does the fast planner find a path for the request with a budget of 60 s?"""
    bench.request.time_budget_s = 60.0
    found = bench.fast.solve(bench.request)["status"] == _core.PlanStatus.SUCCESS
    bench.request.time_budget_s = 5.0
    return found


def run_queries(bench: Bench, states: list[State], count: int, seed: int) -> Outcome:
    """Ask both planners the same queries."""
    out = Outcome()
    last = -1
    for query, (index, poses, scores) in enumerate(queries(states, count, VIEWS_PER_QUERY, seed)):
        if index != last:  # as the node does when a map comes
            sequence = place(bench, states[index], index + 1).sequence
            bench.fast.warm(bench.request)
            bench.plain.warm(bench.request)
            last = index
        bench.request.seed = query + 1
        bench.request.time_budget_s = 5.0
        plain_found, seconds = solve_plain(bench, poses, scores)
        out.plain_s.append(seconds)
        plan, seconds = solve_fast(bench, poses, scores)
        out.fast_s.append(seconds)
        found = plan["status"] == _core.PlanStatus.SUCCESS
        out.solved += found
        out.plain_solved += plain_found
        out.exists += found or plain_found or (plan["goal_states"] > 0 and path_exists(bench))
        out.older_map += plan["map_sequence"] != sequence
        if found:
            out.refused += bool(bench.fast.judge(bench.request, plan["trajectory"]))
            out.plans.append(plan)
    return out


def at_most(case: str, value: float, unit: str, target: float, runs: int, **others: object) -> dict:
    """A row whose target is an upper bound."""
    return row(case, value, unit, target=target, met=bool(value <= target), runs=runs, **others)


def query_rows(bench: Bench, states: list[State], count: int, seed: int) -> tuple[list[dict], list[dict]]:
    """Rows of times and success, and the plans."""
    out = run_queries(bench, states, count, seed)
    fast_ms, plain_ms = 1e3 * np.array(out.fast_s), 1e3 * np.array(out.plain_s)
    fast, plain = float(np.median(fast_ms)), float(np.median(plain_ms))
    share = 100.0 * out.solved / max(1, out.exists)
    reference = {"reference": plain, "reference_name": PLAIN, "ratio": plain / fast}
    name, ratio = bench.name, plain / fast
    rows = [
        at_most(f"{name}: plan, median", fast, "ms", 30.0, count, spread=spread(fast_ms), **reference),
        row(f"{name}: speed-up at the median", ratio, "x", target=5.0, met=ratio >= 5.0, runs=count),
        at_most(
            f"{name}: plan, 95th percentile",
            float(np.percentile(fast_ms, 95)),
            "ms",
            300.0,
            count,
            reference=float(np.percentile(plain_ms, 95)),
            reference_name=PLAIN,
        ),
        row(
            f"{name}: solved where a path exists",
            share,
            "%",
            reference=100.0 * out.plain_solved / max(1, out.exists),
            reference_name=PLAIN,
            target=99.0,
            met=share >= 99.0,
            runs=out.exists,
        ),
        at_most(f"{name}: plans that the judge refuses", out.refused, "plans", 0, len(out.plans)),
        at_most(f"{name}: plans on another map than named", out.older_map, "plans", 0, count),
    ]
    return rows, out.plans


def seconds_per_state(check: Callable[[np.ndarray], object], states: np.ndarray) -> float:
    """Without the call's own set-up, which a call for one state measures."""
    times = []
    for size in (1, len(states)):
        begin = time.perf_counter()
        check(states[:size])
        times.append(time.perf_counter() - begin)
    return (times[1] - times[0]) / (len(states) - 1)


def checker_rows(bench: Bench, count: int) -> list[dict]:
    """Free-state checks per second, and states on which the checkers differ."""
    q = bench.random_states(count, np.random.default_rng(5))

    def answers(checker: str, states: np.ndarray) -> np.ndarray:
        checked = bench.fast.check_states(bench.request, states, checker=checker, with_self=False)
        return np.array(checked)

    fast_free, judge_free = answers("distance_field", q), answers("judge", q)
    accepted = int((fast_free & ~judge_free).sum())
    refused = 100.0 * float((~fast_free & judge_free).mean())
    free = q[judge_free]
    fast = 1e6 * seconds_per_state(lambda states: answers("distance_field", states), free)
    slow = 1e6 * seconds_per_state(lambda states: answers("fcl_octree", states), free[:2000])
    name = bench.name
    return [
        row(
            f"{name}: free state against the map",
            fast,
            "us",
            reference=slow,
            reference_name="FCL octree",
            ratio=slow / fast,
            runs=len(free),
            target=slow / 10.0,
            met=slow >= 10.0 * fast,
        ),
        row(f"{name}: free-state checks per second", 1e6 / fast, "1/s", reference=1e6 / slow, runs=len(free)),
        at_most(f"{name}: accepted, judge refuses", accepted, "states", 0, count),
        row(f"{name}: refused, judge accepts", refused, "%", runs=count),
    ]


def map_row(bench: Bench, states: list[State]) -> dict:
    """From each scan's payload to a usable collision world."""
    times = []
    for sequence, state in enumerate(states):
        begin = time.perf_counter()
        place(bench, state, sequence + 1000)
        bench.fast.warm(bench.request)
        times.append(1e3 * (time.perf_counter() - begin))
    case = f"{bench.name}: map to collision world"
    return at_most(case, float(np.median(times)), "ms", 50.0, len(times), spread=spread(times))


def case_rows(robot: str, world: str, quick: bool, number: int = 0) -> list[dict]:
    """All rows of one robot in one world."""
    bench, states = record(robot, world, views=4 if quick else 20)
    found, plans = query_rows(bench, states, 20 if quick else 200, seed=100 + number)
    rows = [*found, *timing_rows(bench, plans), *checker_rows(bench, 5000 if quick else 100_000)]
    rows.append(map_row(bench, states))
    if os.environ.get("FV_BENCH_SLOW") and robot == "hubo":
        place(bench, states[-1], 1)
        rows.append(length_row(bench, count=10, runs=10, seconds=10.0))  # 20 queries in both worlds
    return rows


def run(quick: bool) -> list[dict]:
    """All rows; quick: HUBO in front of the shelf with few queries."""
    robots = ["hubo"] if quick else ["hubo", "kuka_iiwa", "franka_panda"]
    cases = [(robot, world) for robot in robots for world in ("shelf", "office")]
    rows = []
    for number, (robot, world) in enumerate(cases[:1] if quick else cases):
        rows += case_rows(robot, world, quick, number)
    return rows
