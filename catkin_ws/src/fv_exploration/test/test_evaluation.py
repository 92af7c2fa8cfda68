"""Frontiers, voids and their neighbourhoods against SciPy's hull and labels, and updates against batch results."""

import math

import numpy as np
import pytest
from evaluation_oracles import (
    FULL,
    HIGH,
    LOW,
    R,
    as_set,
    assert_same,
    check_against_oracles,
    insert_random,
    new_map,
    voxels_of,
)
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from fv_exploration import EvaluationConfig, Evaluator, InputError, MapConfig, OccupancyMap


@settings(max_examples=50, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(
    seed=st.integers(0, 10**6),
    scans=st.integers(1, 6),
    tiled=st.booleans(),
    fit=st.sampled_from([0.2, 0.5, 0.9]),
)
def test_after_any_scans_the_update_is_the_batch_result(seed, scans, tiled, fit):
    rng = np.random.default_rng(seed)
    grid = new_map(prob_hit=0.8, prob_miss=0.2)
    config = EvaluationConfig(min_fit=fit, tiled=tiled, seed=seed)
    evaluator = Evaluator(grid, config)
    for _ in range(scans):
        insert_random(grid, rng)
        if rng.random() < 0.3:
            grid.mark_free(rng.uniform(LOW, HIGH, size=(5, 3)))
        evaluation = evaluator.update()
        assert_same(evaluation, Evaluator(grid, config).update())
    check_against_oracles(grid, evaluation)


def test_the_update_is_the_batch_result_over_many_tiles():
    """Several groups of 4x4x4 tiles; links, hull and ellipsoids that an update may keep or not."""
    rng = np.random.default_rng(21)
    grid = new_map(resolution_m=0.025, prob_hit=0.8, prob_miss=0.2)
    evaluator = Evaluator(grid, EvaluationConfig())
    for k in range(8):
        if k == 4:
            grid.mark_free(grid.voxels("occupied")[:50])  # the hull shrinks, and two changes come at once
        insert_random(grid, rng, 40 if k % 2 else 400)
        evaluation = evaluator.update()
        assert_same(evaluation, Evaluator(grid, EvaluationConfig(threads=1)).update())
    assert len(evaluation.ellipsoids) > 1


def test_without_bounds_the_update_is_the_batch_result_while_the_grid_grows():
    rng = np.random.default_rng(5)
    grid = OccupancyMap(MapConfig(resolution_m=R))
    evaluator = Evaluator(grid, EvaluationConfig())
    for k in range(5):
        T = np.eye(4)
        T[:3, 3] = [1.5 * k, -k, 0.3 * k]
        points = rng.normal(size=(80, 3))
        grid.insert_scan(points, T)
        evaluation = evaluator.update()
        assert_same(evaluation, Evaluator(grid, EvaluationConfig()).update())
    free = voxels_of(grid.voxels("free"))
    known = as_set(free) | as_set(voxels_of(grid.voxels("occupied")))
    steps = np.argwhere(FULL) - 1
    expected = {tuple(v) for v in free.tolist() if any(tuple(s) not in known for s in (steps + v).tolist())}
    assert as_set(voxels_of(evaluation.frontier)) == expected


def test_threads_do_not_change_anything():
    results = []
    for threads in (1, 3):
        rng = np.random.default_rng(11)
        grid = new_map(threads=threads)
        for _ in range(4):
            insert_random(grid, rng, 200)
        evaluator = Evaluator(grid, EvaluationConfig(threads=threads))
        results.append((evaluator.update(), evaluator.utility(2.0, threads=threads)))
    assert_same(results[0][0], results[1][0])
    assert np.array_equal(results[0][1].utility, results[1][1].utility)
    assert np.array_equal(results[0][1].direction, results[1][1].direction)


@pytest.mark.parametrize(
    "points",
    [
        np.zeros((0, 3)),
        [[1, 0, 0], [0, 1, 0], [0, 0, 0.5]],
        [[1, 0, 0], [1, 0.5, 0], [1, 0, 0.5], [1, -0.6, -0.4], [1, 0.2, 0.3]],
    ],
    ids=["empty", "three points", "a plane"],
)
def test_a_degenerate_hull_has_no_voids(points):
    grid = new_map()
    grid.insert_scan(np.asarray(points, float), np.eye(4))
    evaluation = Evaluator(grid, EvaluationConfig()).update()
    assert len(evaluation.void) == 0
    assert len(evaluation.ellipsoids) == 0


def test_the_hull_grows_and_shrinks_with_the_occupied_voxels():
    grid = new_map(prob_miss=0.1, clamp_max=0.75)
    evaluator = Evaluator(grid, EvaluationConfig())
    corners = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)]) + 0.05
    sizes = []
    for extra in (np.zeros((0, 3)), np.array([[1.05, 0.05, 0.05]])):
        grid.insert_scan(np.concatenate([corners, extra]) - [0.05, 0.05, 0.05], shift(0.05))
        sizes.append(len(evaluator.update().void))
    grid.insert_scan(np.array([[1.15, 0.0, 0.0]]), shift(0.05))  # passes the voxel that made it grow
    evaluation = evaluator.update()
    sizes.append(len(evaluation.void))
    assert sizes[1] > sizes[0]
    check_against_oracles(grid, evaluation)
    assert_same(evaluation, Evaluator(grid, EvaluationConfig()).update())


def shift(x):
    T = np.eye(4)
    T[:3, 3] = x
    return T


@pytest.mark.parametrize("fit", [0.0, -0.1, 1.01, math.nan])
def test_a_threshold_outside_its_range_is_named(fit):
    with pytest.raises(InputError, match="min_fit is"):
        EvaluationConfig(min_fit=fit)


def test_unknown_parameters_are_named():
    with pytest.raises(TypeError, match="min_fitt"):
        EvaluationConfig(min_fitt=0.5)


def test_a_stale_evaluation_says_so():
    grid = new_map()
    evaluator = Evaluator(grid, EvaluationConfig())
    old = evaluator.update()
    evaluator.update()
    with pytest.raises(InputError, match="update 1"):
        _ = old.frontier
