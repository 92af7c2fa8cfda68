"""Seeding and merging of void ellipsoids: how the time grows, and against looking at all pairs."""

from __future__ import annotations

import itertools

import numpy as np
from scipy import ndimage

from fv_bench.exploration.scene import row, timed
from fv_exploration import EvaluationConfig, cluster_voids
from fv_exploration.reference import plain_clusters


def blobs(count: int, seed: int = 0) -> np.ndarray:
    """About `count` voxels of smooth random shapes, ascending with z, y, x."""
    edge = round((count / 0.35) ** (1 / 3))
    noise = ndimage.gaussian_filter(np.random.default_rng(seed).normal(size=(edge,) * 3), 3)
    voxels = np.argwhere(noise > np.quantile(noise, 0.65))[:, ::-1]
    return np.ascontiguousarray(voxels, dtype=np.int32)


def run(quick: bool) -> list[dict]:
    """Rows: each size, its growth over the size before, and the plain loop up to what it can bear."""
    runs = 3 if quick else 7
    config = EvaluationConfig(min_fit=0.5)
    rows, medians = [], []
    for count in (10_000, 100_000) if quick else (10_000, 100_000, 1_000_000):
        voxels = blobs(count)
        seconds = [timed(lambda voxels=voxels: cluster_voids(voxels, config, 0.05))[0] for _ in range(runs)]
        plain, same = None, None
        if count <= 10_000:
            small = blobs(2_000 if quick else 5_000)
            results = [plain_clusters(small, config, 0.05) for _ in range(runs)]
            plain = [seconds for seconds, _ in results]
            fast = [timed(lambda small=small: cluster_voids(small, config, 0.05)) for _ in range(runs)]
            same = (
                len(np.unique(np.stack([results[0][1], fast[0][1][0]]), axis=1).T) == fast[0][1][0].max() + 1
            )
            rows.append(
                row(
                    "void_clusters",
                    f"{len(small)} voxels",
                    [s for s, _ in fast],
                    plain,
                    reference_name="all pairs",
                )
            )
            rows.append(
                row("void_clusters", "same clusters as all pairs", [float(same)], unit="bool", target=1)
            )
        rows.append(row("void_clusters", f"{len(voxels)} voxels", seconds))
        medians.append(rows[-1]["ours"] / len(voxels))
    for small, large in itertools.pairwise(medians):
        rows.append(
            row(
                "void_clusters",
                "time for 10x the voxels",
                [10 * large / small],
                unit="ratio",
                target=13,
                at_most=True,
            )
        )
    return rows
