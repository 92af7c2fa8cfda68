"""Random maps, and slow and obvious evaluations of them: what the tests of the evaluation share."""

import numpy as np
from scipy import ndimage
from scipy.spatial import ConvexHull

from fv_exploration import MapConfig, OccupancyMap, ScanConfig

R = 0.1
LOW, HIGH = np.array([-1.2, -1.0, -0.7]), np.array([1.2, 1.1, 0.8])
FULL = np.ones((3, 3, 3))


def new_map(**options):
    options = {"resolution_m": R, **options}
    return OccupancyMap(MapConfig(bounds_min=tuple(LOW), bounds_max=tuple(HIGH), **options))


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


def covariance_ellipsoid(voxels, resolution):
    centres = (voxels + 0.5) * resolution
    covariance = np.cov(centres.T, bias=True).reshape(3, 3) + np.eye(3) * resolution**2 / 12
    values, vectors = np.linalg.eigh(covariance)
    return centres.mean(axis=0), np.sqrt(5 * values[::-1]), vectors[:, ::-1]
