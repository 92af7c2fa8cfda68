"""The search's checker, the judge and FCL's own octree on HUBO, and on an arm of hulls, in half-known scenes."""

import numpy as np
import pytest
from ompl_planner import _core
from ompl_planner.trials import make_bench, random_views


@pytest.fixture(scope="module", params=["hubo shelf", "hubo office", "kuka_iiwa office"])
def bench(request):
    return make_bench(*request.param.split())


def answers(bench, states, checker):
    return np.array(bench.fast.check_states(bench.request, states, checker=checker, with_self=False))


def test_the_fast_check_never_accepts_what_the_judge_refuses(bench):
    states = bench.random_states(50_000, np.random.default_rng(3))  # in each of the scenes
    fast, judge = answers(bench, states, "distance_field"), answers(bench, states, "judge")
    assert judge.any() and not judge.all()
    assert not (fast & ~judge).any()
    assert (~fast & judge).mean() < 0.001


def test_the_judge_agrees_with_fcl_on_an_octree_where_unknown_is_occupied(bench):
    states = bench.random_states(3000, np.random.default_rng(4))
    differ = answers(bench, states, "judge") != answers(bench, states, "fcl_octree")
    assert differ.mean() < 0.001  # FCL's solvers differ where shapes touch


def test_equal_requests_give_equal_plans(bench):
    poses, scores = random_views(np.random.default_rng(8), 10)
    bench.request.set_goal_poses(poses)
    bench.request.goal_scores = scores
    first, second = (bench.fast.solve(bench.request) for _ in range(2))
    assert first["status"] == _core.PlanStatus.SUCCESS, first["message"]
    np.testing.assert_array_equal(first["trajectory"]["positions"], second["trajectory"]["positions"])
    assert bench.fast.judge(bench.request, first["trajectory"]) == ""
    assert first["clearance_m"] > 0.005
