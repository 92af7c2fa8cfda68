"""Time parameterisation against toppra, the reference implementation of the same method."""

import numpy as np
import pytest
from ompl_planner import _core
from ompl_planner.trials import toppra_duration

pytest.importorskip("toppra")
VELOCITY = np.array([1.0, 2.0, 2.0, 2.5, 2.5, 3.0, 3.0])
ACCELERATION = np.array([2.0, 4.0, 4.0, 5.0, 5.0, 8.0, 8.0])


@pytest.mark.parametrize("seed", range(8))
def test_duration_is_within_five_percent_of_toppras_optimum(seed):
    rng = np.random.default_rng(seed)
    waypoints = np.cumsum(rng.normal(scale=0.5, size=(2 + seed % 4, 7)), axis=0)
    path = {"waypoints": waypoints, "radii": [0.25] * len(waypoints)}
    ours = _core.time_optimal_trajectory(**path, velocity=VELOCITY, acceleration=ACCELERATION)["times"][-1]
    optimum = toppra_duration(**path, velocity=VELOCITY, acceleration=ACCELERATION)
    assert 0.99 * optimum <= ours <= 1.05 * optimum + 0.02  # 0.02 s: one acceleration ramp and one sample


def test_limits_are_needed():
    path = {"waypoints": np.array([[0.0], [1.0]]), "radii": [0.0, 0.0]}
    with pytest.raises(ValueError, match="velocity"):
        _core.time_optimal_trajectory(**path, velocity=np.array([-1.0]), acceleration=np.array([1.0]))
