"""Utility against a plain Algorithm 1, and the choice of its best voxels."""

import math

import numpy as np
import pytest
from evaluation_oracles import R, class_grid, insert_random, new_map, voxels_of
from scipy.spatial import ConvexHull

from fv_exploration import EvaluationConfig, Evaluator, InputError, best_views


def plain_algorithm_1(grid, evaluator, evaluation, s_r):
    """Algorithm 1 with dictionaries; directions summed beside."""
    classes, low = class_grid(grid)
    vertices, _ = evaluator.hull()
    hull = ConvexHull(vertices).equations
    frontier = voxels_of(evaluation.frontier)
    inside = np.all(frontier @ hull[:, :3].T + hull[:, 3] <= 1e-9, axis=1)
    utility, direction = {}, {}
    for index, clusters in evaluation.frontier_voids:
        e = evaluation.ellipsoids[index]
        arms = [s * e["semi_axes"][j] * e["axes"][:, j] for j in range(3) for s in (1, -1)]
        for corner in [e["center"]] + [e["center"] + arm for arm in arms]:
            for voxel in frontier[inside & np.isin(evaluation.frontier_cluster, clusters)]:
                away = (voxel + 0.5) * R - corner
                away = away / math.sqrt(away[0] ** 2 + away[1] ** 2 + away[2] ** 2)
                for visited in plain_free_ray(classes, low, voxel, away, s_r / R):
                    utility[visited] = utility.get(visited, 0.0) + e["volume"]
                    direction[visited] = direction.get(visited, 0.0) + e["volume"] * away
    return utility, direction


def plain_free_ray(classes, low, start, direction, reach):
    at = list(start)
    with np.errstate(divide="ignore"):
        delta = 1 / np.abs(direction)
    t = 0.5 * delta
    while True:
        cell = tuple(np.array(at) - low)
        outside = any(not 0 <= c < n for c, n in zip(cell, classes.shape, strict=True))
        if outside or classes[cell] != 0:
            return
        yield tuple(at)
        if t.min() > reach:
            return
        axis = 0 if t[0] < t[1] and t[0] < t[2] else 1 if not t[0] < t[1] and t[1] < t[2] else 2
        at[axis] += 1 if direction[axis] > 0 else -1
        t[axis] += delta[axis]


@pytest.mark.parametrize("s_r", [0.45, 1.5])
def test_utility_is_algorithm_1(s_r):
    rng = np.random.default_rng(8)
    grid = new_map()
    for _ in range(2):
        insert_random(grid, rng, 40)
    evaluator = Evaluator(grid, EvaluationConfig(min_fit=0.3))
    evaluation = evaluator.update()
    utility = evaluator.utility(s_r)
    expected, directions = plain_algorithm_1(grid, evaluator, evaluation, s_r)
    found = {tuple(v): i for i, v in enumerate(voxels_of(utility.points).tolist())}
    assert set(found) == set(expected)
    assert len(found) > 100
    for voxel, value in expected.items():
        i = found[voxel]
        assert utility.utility[i] == pytest.approx(value, rel=1e-6)
        away = directions[voxel]
        if np.linalg.norm(away) > 1e-3 * value:
            assert np.allclose(utility.direction[i], -away / np.linalg.norm(away), atol=1e-3)


def test_a_ray_budget_is_a_sample_of_algorithm_1():
    rng = np.random.default_rng(8)
    grid = new_map()
    for _ in range(3):
        insert_random(grid, rng, 100)
    evaluator = Evaluator(grid, EvaluationConfig())
    evaluator.update()
    whole, some = evaluator.utility(1.5), evaluator.utility(1.5, max_rays=20_000)
    assert whole.rays > 40_000
    assert 0.5 * 20_000 < some.rays <= 21_000
    assert some.utility.sum() == pytest.approx(whole.utility.sum(), rel=0.1)


def test_best_views_keep_their_distance():
    rng = np.random.default_rng(8)
    grid = new_map()
    for _ in range(3):
        insert_random(grid, rng, 60)
    evaluator = Evaluator(grid, EvaluationConfig())
    evaluator.update()
    utility = evaluator.utility(1.0)
    allowed = utility.points[:, 0] > 0
    best = best_views(utility, 8, 0.35, allowed)
    points, values = utility.points[best], utility.utility[best]
    assert np.all(np.diff(values) <= 0)
    assert np.all(points[:, 0] > 0)
    assert values[0] == utility.utility[allowed].max()
    gaps = np.linalg.norm(points[:, None] - points[None], axis=2)[np.triu_indices(len(points), 1)]
    assert np.all(gaps >= 0.35 - 1e-6)
    expected = []  # greedily, the plain way
    for i in np.lexsort((np.arange(len(utility.utility)), -utility.utility)):
        far = all(np.linalg.norm(utility.points[i] - utility.points[j]) >= 0.35 - 1e-6 for j in expected)
        if allowed[i] and far and len(expected) < 8:
            expected.append(i)
    assert best.tolist() == expected


@pytest.mark.parametrize("reach", [0.0, -1.0, math.inf, math.nan])
def test_a_utility_range_that_is_none_is_named(reach):
    evaluator = Evaluator(new_map(), EvaluationConfig())
    evaluator.update()
    with pytest.raises(InputError, match="max_range_m is"):
        evaluator.utility(reach)
