"""FV_INSTRUCTION_SET: results do not depend on it, and a name that it cannot have is refused."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

from fv_exploration.reference import lane_times

# A scan of a wall with a hole, its utility, and what views would gain: all three inner loops.
DECISION = """
import hashlib
import numpy as np
import fv_exploration as fv
from fv_exploration.reference import instruction_set

rng = np.random.default_rng(5)
points = np.column_stack([rng.uniform(-1, 1, (4000, 2)), 2 + rng.uniform(0, 0.5, 4000)])
points = points[np.hypot(points[:, 0], points[:, 1]) > 0.4]
grid = fv.OccupancyMap(fv.MapConfig(resolution_m=0.05, bounds_min=(-2, -2, -0.5), bounds_max=(2, 2, 4)))
grid.insert_scan(points, np.eye(4), fv.ScanConfig(max_range_m=4.0))
evaluator = fv.Evaluator(grid, fv.EvaluationConfig())
evaluator.update()
utility = evaluator.utility(3.0)
poses = np.tile(np.eye(4), (300, 1, 1))
poses[:, :3, 3] = rng.uniform([-1, -1, 0], [1, 1, 1.5], (300, 3))
camera = fv.PinholeCamera(16, 12, 1.0, 0.8, 0.3, 3.0)
gain = fv.view_gain(grid, evaluator, poses, camera)
results = [grid.voxels("free"), utility.utility, utility.direction, gain.void_volume_m3, gain.occupied_share]
assert all(np.any(result) for result in results)
print(instruction_set(), hashlib.sha256(b"".join(np.ascontiguousarray(r).tobytes() for r in results)).hexdigest())
"""


def decide(cap: str) -> subprocess.CompletedProcess[str]:
    environment = {**os.environ, "FV_INSTRUCTION_SET": cap}
    command = [sys.executable, "-c", DECISION]
    return subprocess.run(command, env=environment, capture_output=True, text=True, check=False)


def test_a_decision_is_the_same_with_every_instruction_set() -> None:
    digests = set()
    for cap in lane_times(1):
        done = decide(cap)
        assert done.returncode == 0, done.stderr
        used, digest = done.stdout.split()
        assert used == cap
        digests.add(digest)
    assert len(digests) == 1


@pytest.mark.parametrize("cap", ["sse9", "AVX2"])
def test_an_unknown_cap_is_refused_with_the_valid_ones(cap: str) -> None:
    done = decide(cap)
    assert done.returncode != 0
    last = done.stderr.strip().splitlines()[-1]
    assert f"FV_INSTRUCTION_SET is '{cap}'; valid: " in last and "plain" in last
