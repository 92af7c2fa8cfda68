"""The candidates of the frontier-void strategy."""

import numpy as np
import pytest
from small_world import Utility, situation

from fv_exploration.strategy import Candidates
from fv_exploration.strategy.frontier_void import FrontierVoid


def choose(utility=None, seed=0, kind=0, **changes):
    return FrontierVoid().choose(situation(utility, seed, kind, **changes))


def test_the_voxel_of_highest_utility_is_a_candidate_along_its_direction():
    utility = Utility([[0.2, 0, 0], [9, 9, 9]], [3.0, 5.0], [[1, 0, 0], [1, 0, 0]])
    ranking = choose(utility, sampled=0)
    found = ranking.candidates
    assert len(found) == 1, "the voxel out of reach must not be proposed"
    assert np.allclose(found.poses[0][:3, 3], [0.2, 0, 0])
    assert np.allclose(found.poses[0][:3, 2], [1, 0, 0])
    assert found.utility[0] == 3.0
    assert (ranking.proposed, ranking.in_free_space) == (1, 1)


def test_the_worth_is_the_expected_gain_and_the_cost_a_scan_and_the_way_there():
    found = choose(
        Utility([[0.5, 0, 0]], [3.0], [[0, 0, 1]]), sampled=0, scan_s=2.0, linear_m_s=0.25
    ).candidates
    assert found.cost_s[0] == pytest.approx(2.0 + 0.5 / 0.25)
    found = choose(
        Utility([[0.2, 0, 0]], [3.0], [[1, 0, 0]]), sampled=0, scan_s=2.0, angular_deg_s=30.0
    ).candidates
    assert found.cost_s[0] == pytest.approx(2.0 + 3.0), "a quarter turn"
    assert found.worth[0] == found.gain_m3[0]
    assert found.scores[0] == found.worth[0] / found.cost_s[0]


def test_drawn_views_are_candidates_beside_them_and_equal_seeds_draw_the_same():
    found = choose(seed=4).candidates
    assert len(found) == 400
    assert (found.reachability >= 0.5).all()
    assert np.array_equal(found.poses, choose(seed=4).candidates.poses)
    assert not np.array_equal(found.poses, choose(seed=5).candidates.poses)


def test_without_any_proposal_there_is_no_candidate():
    ranking = choose(sampled=0)
    assert len(ranking.candidates) == ranking.proposed == 0


def test_voxels_that_are_not_free_are_no_candidates():
    ranking = choose(kind=-1)
    assert (len(ranking.candidates), ranking.proposed, ranking.in_free_space) == (0, 400, 0)


def test_candidates_are_taken_row_by_row():
    found = choose().candidates
    part = found.take(np.array([1, 0]))
    assert isinstance(part, Candidates)
    assert np.array_equal(part.scores, found.scores[[1, 0]])
    assert np.array_equal(part.poses, found.poses[[1, 0]])
