"""Void ellipsoids and their merging against numpy's principal axes and plain loops."""

import math

import numpy as np
import pytest
from evaluation_oracles import FULL, R, covariance_ellipsoid, insert_random, new_map, partition, voxels_of
from scipy import ndimage

from fv_exploration import EvaluationConfig, Evaluator, InputError, cluster_voids
from fv_exploration.reference import plain_clusters


def plain_seeding_labels(voxels, labels):
    """Every cluster of the fast result is 26-connected in the end; returns its voxels by label."""
    return [voxels[labels == k] for k in range(labels.max() + 1)]


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


def shape(name):
    """Voxels of a body of some 5,000 voxels, so many that candidates wait in buckets."""
    rng = np.random.default_rng(5)
    z, y, x = np.indices((20, 20, 20))
    masks = {
        "blobs": ndimage.gaussian_filter(rng.normal(size=(24, 24, 24)), 2) > 0.02,
        "solid": np.ones((17, 17, 17)),
        "plate": np.ones((1, 80, 60)),
        "noise": rng.random((24, 24, 24)) < 0.3,
        "lattice": (x + y + z) % 2 == 0,  # ties without end
        "shells": np.sqrt((x - 10) ** 2 + (y - 10) ** 2 + (z - 10) ** 2) % 6 < 2.5,
        # one long body, joined first, that sees all the dust merge around it
        "rod in dust": np.concatenate(
            [np.ones((1, 1, 3000)), rng.random((3, 3, 3000)).reshape(9, 1, -1) < 0.2]
        ),
    }
    return ordered(np.argwhere(masks[name])[:, ::-1])


@pytest.mark.parametrize("fit", [0.05, 0.5, 0.95])
@pytest.mark.parametrize("name", ["blobs", "solid", "plate", "noise", "lattice", "shells", "rod in dust"])
def test_merging_of_many_shapes_is_plain_merging(name, fit):
    voxels = shape(name)
    config = EvaluationConfig(min_fit=fit)
    _, expected = plain_clusters(voxels, config, R)
    labels, _ = cluster_voids(voxels, config, R)
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


@pytest.mark.parametrize(
    ("voxels", "resolution_m", "text"),
    [
        ([[0, 0, 0], [0, 0, 0]], R, "not in order at row 1"),
        ([[1, 0, 0], [0, 0, 0]], R, "not in order at row 1"),
        ([[32767, 0, 0], [32768, 0, 0]], R, "voxels is 32768; valid: -32768 to 32767"),
        ([[0, 0, 0], [2000, 2000, 2000]], R, r"volume of the box around the voxels is 8.03\d*e\+09"),
        ([[0, 0, 0]], 0.0, "resolution_m is 0"),
        ([[0, 0, 0]], math.nan, "resolution_m is nan"),
    ],
)
def test_voxels_that_cannot_be_clustered_are_named(voxels, resolution_m, text):
    with pytest.raises(InputError, match=text):
        cluster_voids(np.array(voxels, np.int32), EvaluationConfig(), resolution_m)
