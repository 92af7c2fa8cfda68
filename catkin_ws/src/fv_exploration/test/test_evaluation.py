"""The evaluation against slow and obvious ones: SciPy's hull and labels, plain merging, plain Algorithm 1."""

import math

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scipy import ndimage
from scipy.spatial import ConvexHull

from fv_exploration import (
    EvaluationConfig,
    Evaluator,
    InputError,
    MapConfig,
    OccupancyMap,
    ScanConfig,
    best_views,
    cluster_voids,
)

R = 0.1
LOW, HIGH = np.array([-1.2, -1.0, -0.7]), np.array([1.2, 1.1, 0.8])
FULL = np.ones((3, 3, 3))


def new_map(**options):
    return OccupancyMap(MapConfig(resolution_m=R, bounds_min=tuple(LOW), bounds_max=tuple(HIGH), **options))


def insert_random(grid, rng, count=60, spread=1.5):
    """A scan from a random place; points to all sides, so that voxels flip between free and occupied."""
    T = np.eye(4)
    T[:3, 3] = rng.uniform(LOW * 0.6, HIGH * 0.6)
    directions = rng.normal(size=(count, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    points = directions * rng.uniform(0.2, spread, size=(count, 1))
    grid.insert_scan(points, T, ScanConfig(max_range_m=1.2))


def voxels_of(points):
    return np.floor(np.asarray(points, float) / R).astype(int)


def class_grid(grid):
    """(nx, ny, nz) of -1, 0, 1 and the lowest voxel."""
    low = np.round(LOW / R).astype(int)
    shape = np.round(HIGH / R).astype(int) - low
    cells = np.stack(np.meshgrid(*(np.arange(n) for n in shape), indexing="ij"), -1).reshape(-1, 3)
    classes = grid.classify((cells + low + 0.5) * R).reshape(shape)
    return classes, low


def as_set(voxels):
    return set(map(tuple, np.asarray(voxels).tolist()))


def oracle_frontier(classes):
    near_unknown = ndimage.binary_dilation(classes == -1, FULL)
    return (classes == 0) & near_unknown


def oracle_void(classes):
    occupied = np.argwhere(classes == 1)
    if len(occupied) < 4 or np.linalg.matrix_rank(occupied - occupied[0]) < 3:
        return np.zeros_like(classes, dtype=bool)
    hull = ConvexHull(occupied)
    cells = np.argwhere(classes == -1)
    inside = np.all(cells @ hull.equations[:, :3].T + hull.equations[:, 3] <= 1e-9, axis=1)
    out = np.zeros_like(classes, dtype=bool)
    out[tuple(cells[inside].T)] = True
    return out


def partition(labels):
    """Which entries are together, whatever the labels are called."""
    groups = {}
    for i, label in enumerate(labels):
        groups.setdefault(label, []).append(i)
    return sorted(groups.values())


def check_against_oracles(grid, evaluation):
    classes, low = class_grid(grid)
    frontier = voxels_of(evaluation.frontier) - low
    assert as_set(frontier) == as_set(np.argwhere(oracle_frontier(classes)))
    void = voxels_of(evaluation.void) - low
    assert as_set(void) == as_set(np.argwhere(oracle_void(classes)))
    labels, _ = ndimage.label(oracle_frontier(classes), FULL)
    assert partition(labels[tuple(frontier.T)]) == partition(evaluation.frontier_cluster)
    pairs = {(e, c) for e, clusters in evaluation.frontier_voids for c in clusters}
    assert pairs == oracle_pairs(frontier, evaluation.frontier_cluster, void, evaluation.void_ellipsoid)
    counts = np.bincount(evaluation.void_ellipsoid, minlength=len(evaluation.ellipsoids))
    assert np.array_equal(counts, evaluation.ellipsoids["count"])


def oracle_pairs(frontier, clusters, void, ellipsoids):
    where = {tuple(v): e for v, e in zip(void.tolist(), ellipsoids, strict=True)}
    pairs = set()
    for voxel, cluster in zip(frontier, clusters, strict=True):
        for step in np.argwhere(FULL) - 1:
            ellipsoid = where.get(tuple((voxel + step).tolist()))
            if ellipsoid is not None:
                pairs.add((int(ellipsoid), int(cluster)))
    return pairs


def assert_same(a, b):
    """Two evaluations are the same bit by bit."""
    assert np.array_equal(a.frontier, b.frontier)
    assert np.array_equal(a.frontier_cluster, b.frontier_cluster)
    assert np.array_equal(a.void, b.void)
    assert np.array_equal(a.void_ellipsoid, b.void_ellipsoid)
    assert np.array_equal(a.ellipsoids, b.ellipsoids)
    assert [(e, c.tolist()) for e, c in a.frontier_voids] == [(e, c.tolist()) for e, c in b.frontier_voids]


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


# -- ellipsoids -------------------------------------------------------------------------------------------------------


def plain_seeding_labels(voxels, labels):
    """Every cluster of the fast result is 26-connected in the end; returns its voxels by label."""
    return [voxels[labels == k] for k in range(labels.max() + 1)]


def covariance_ellipsoid(voxels, resolution):
    centres = (voxels + 0.5) * resolution
    covariance = np.cov(centres.T, bias=True).reshape(3, 3) + np.eye(3) * resolution**2 / 12
    values, vectors = np.linalg.eigh(covariance)
    return centres.mean(axis=0), np.sqrt(5 * values[::-1]), vectors[:, ::-1]


def ordered(voxels):
    voxels = np.unique(np.asarray(voxels, np.int32), axis=0)
    return voxels[np.lexsort((voxels[:, 0], voxels[:, 1], voxels[:, 2]))]


def test_ellipsoids_are_the_principal_axes_of_their_voxels():
    rng = np.random.default_rng(2)
    voxels = ordered(np.argwhere(ndimage.binary_dilation(rng.random((14, 12, 10)) > 0.97, FULL)))
    labels, ellipsoids = cluster_voids(voxels, EvaluationConfig(min_fit=0.4), R)
    for members, e in zip(plain_seeding_labels(voxels, labels), ellipsoids, strict=True):
        center, semi_axes, axes = covariance_ellipsoid(members, R)
        assert np.allclose(e["center"], center)
        assert np.allclose(e["semi_axes"], semi_axes)
        assert e["count"] == len(members)
        assert np.isclose(e["fit"], len(members) * R**3 / (4 / 3 * math.pi * semi_axes.prod()))
        assert np.allclose(
            e["axes"] @ np.diag(semi_axes**2) @ e["axes"].T, axes @ np.diag(semi_axes**2) @ axes.T
        )
        assert np.isclose(np.linalg.det(e["axes"]), 1)


def test_a_solid_ellipsoid_fits_itself():
    radii = np.array([17.0, 11.0, 8.0])
    cells = np.stack(np.meshgrid(*(np.arange(-18, 19),) * 3, indexing="ij"), -1).reshape(-1, 3)
    voxels = ordered(cells[((cells / radii) ** 2).sum(axis=1) <= 1])
    _, ellipsoids = cluster_voids(voxels, EvaluationConfig(min_fit=0.05), R)
    assert len(ellipsoids) == 1
    assert ellipsoids[0]["fit"] == pytest.approx(1.0, abs=0.01)
    assert ellipsoids[0]["semi_axes"] == pytest.approx(radii * R, rel=0.02)


def test_the_literal_formula_takes_eigenvalues_for_axes():
    voxels = ordered(np.argwhere(np.ones((5, 4, 3))))
    config = EvaluationConfig(min_fit=0.01, literal_formula=True)
    _, ellipsoids = cluster_voids(voxels, config, R)
    values = np.linalg.eigvalsh(np.cov(((voxels + 0.5) * R).T, bias=True))[::-1]
    assert len(ellipsoids) == 1
    assert np.allclose(ellipsoids[0]["semi_axes"], values)
    assert np.isclose(ellipsoids[0]["fit"], len(voxels) * R**3 / (4 / 3 * math.pi * values.prod()))


class PlainCluster:
    """Thesis formulas 3.3-3.5 with numpy, in voxels."""

    def __init__(self, n, mean, covariance, first):
        self.n, self.mean, self.covariance, self.first = n, mean, covariance, first

    def merged(self, other):
        n = self.n + other.n
        d = self.mean - other.mean
        covariance = (
            self.n * self.covariance + other.n * other.covariance + np.outer(d, d) * self.n * other.n / n
        ) / n
        mean = (self.n * self.mean + other.n * other.mean) / n
        return PlainCluster(n, mean, covariance, min(self.first, other.first))

    def fit(self):
        axes = np.sqrt(5 * np.linalg.eigvalsh(self.covariance + np.eye(3) / 12))
        return self.n / (4 / 3 * math.pi * axes.prod())


def plain_merging(voxels, labels, min_fit):
    """Nearest neighbouring pair first, looking at all pairs each time; ties by first voxel."""
    where = {tuple(v): i for i, v in enumerate(voxels.tolist())}
    clusters = {}
    for k in np.unique(labels):
        members = voxels[labels == k]
        covariance = np.cov(members.T, bias=True).reshape(3, 3) if len(members) > 1 else np.zeros((3, 3))
        clusters[k] = PlainCluster(
            len(members), members.mean(axis=0), covariance, np.flatnonzero(labels == k)[0]
        )
    edges = set()
    for i, v in enumerate(voxels):
        for step in np.argwhere(FULL) - 1:
            j = where.get(tuple((v + step).tolist()))
            if j is not None and labels[i] != labels[j]:
                edges.add(frozenset((labels[i], labels[j])))
    labels = labels.copy()
    while True:
        ranked = []
        for a, b in map(tuple, edges):
            p, q = sorted((clusters[a], clusters[b]), key=lambda c: c.first)
            distance = round(float(((p.mean - q.mean) ** 2).sum()), 9)
            ranked.append((distance, p.first, q.first, a, b))
        for _, _, _, a, b in sorted(ranked):
            both = clusters[a].merged(clusters[b])
            if both.fit() >= min_fit:
                break
        else:
            return labels
        clusters[a] = both
        del clusters[b]
        labels[labels == b] = a
        edges = {frozenset(a if k == b else k for k in edge) for edge in edges}
        edges = {edge for edge in edges if len(edge) == 2}


@pytest.mark.parametrize("seed", range(4))
def test_merging_with_a_heap_is_plain_merging(seed):
    rng = np.random.default_rng(seed)
    voxels = ordered(np.argwhere(rng.random((9, 8, 7)) > 0.5))
    # nothing merges at S = 1 but what fits perfectly: that leaves the seeds
    seeds = plain_seeds(voxels, EvaluationConfig(seed=seed))
    expected = plain_merging(voxels, seeds, 0.55)
    labels, _ = cluster_voids(voxels, EvaluationConfig(seed=seed, min_fit=0.55), R)
    assert partition(labels) == partition(expected)


def plain_seeds(voxels, config):
    """Seeds in random order, then the rest, each with its unattached neighbours (thesis 3.1.1)."""

    def mix(x):
        x = (x + 0x9E3779B97F4A7C15) % 2**64
        x = (x ^ (x >> 30)) * 0xBF58476D1CE4E5B9 % 2**64
        x = (x ^ (x >> 27)) * 0x94D049BB133111EB % 2**64
        return x ^ (x >> 31)

    def number(v):
        x, y, z = (int(c) + 32768 for c in v)
        return z << 32 | y << 16 | x

    where = {tuple(v): i for i, v in enumerate(voxels.tolist())}
    labels = np.full(len(voxels), -1)
    count = 0
    for random in (True, False):
        for i, v in enumerate(voxels):
            lucky = mix(number(v) ^ mix(config.seed)) < config.seed_share * 2**64
            if labels[i] >= 0 or (random and not lucky):
                continue
            for step in np.argwhere(FULL) - 1:
                j = where.get(tuple((v + step).tolist()))
                if j is not None and labels[j] < 0:
                    labels[j] = count
            count += 1
    return labels


def test_every_cluster_keeps_the_fit_and_no_neighbours_could_still_merge():
    rng = np.random.default_rng(9)
    grid = new_map()
    for _ in range(5):
        insert_random(grid, rng, 150)
    for tiled in (True, False):
        evaluation = Evaluator(grid, EvaluationConfig(min_fit=0.6, tiled=tiled)).update()
        several = evaluation.ellipsoids[evaluation.ellipsoids["count"] > 27]
        assert np.all(several["fit"] >= 0.6)
        void, labels = voxels_of(evaluation.void), evaluation.void_ellipsoid
        by_label = [void[labels == k] for k in range(len(evaluation.ellipsoids))]
        where = {tuple(v): k for v, k in zip(void.tolist(), labels, strict=True)}
        pairs = set()
        for v, k in zip(void, labels, strict=True):
            for s in np.argwhere(FULL) - 1:
                other = where.get(tuple((v + s).tolist()), k)
                if other > k:
                    pairs.add((k, other))
        for a, b in pairs:
            both = np.concatenate([by_label[a], by_label[b]])
            _, axes, _ = covariance_ellipsoid(both, R)
            assert len(both) * R**3 / (4 / 3 * math.pi * axes.prod()) < 0.6 + 1e-9


def test_tiles_cost_little_quality():
    rng = np.random.default_rng(4)
    grid = new_map()
    for _ in range(4):
        insert_random(grid, rng, 120)
    quality, numbers = [], []
    for tiled in (True, False):
        ellipsoids = Evaluator(grid, EvaluationConfig(min_fit=0.5, tiled=tiled)).update().ellipsoids
        quality.append(np.average(np.minimum(ellipsoids["fit"], 1), weights=ellipsoids["count"]))
        numbers.append(len(ellipsoids))
    assert quality[0] > quality[1] - 0.05
    assert numbers[0] < 1.3 * numbers[1] + 3


# -- utility ----------------------------------------------------------------------------------------------------------


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


# -- bad input --------------------------------------------------------------------------------------------------------


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


@pytest.mark.parametrize("reach", [0.0, -1.0, math.inf, math.nan])
def test_a_utility_range_that_is_none_is_named(reach):
    evaluator = Evaluator(new_map(), EvaluationConfig())
    evaluator.update()
    with pytest.raises(InputError, match="max_range_m is"):
        evaluator.utility(reach)
