"""The frontier-void strategy: views by the volume that ray casting expects to see anew, for the time that they cost."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from fv_exploration.strategy.protocol import Situation, Strategy
from fv_exploration.strategy.ranking import Candidates, Ranking
from fv_exploration.view_geometry import spread_out

Array = NDArray[np.float64]
Proposals = tuple[Array, Array, Array]
"""Positions (N, 3) [m], unit directions (N, 3), utilities (N,)."""


class FrontierVoid(Strategy):
    """Dornhege and Kleiner's candidates, and views drawn from the robot's reach, judged alike.

    The candidates of Algorithm 1 are the free voxels of highest utility, looking along the direction accumulated there.
    Drawn views compete with them, so that the exploration does not end only because utility gathers where the arm
    cannot reach.
    """

    uses_utility = True

    def choose(self, situation: Situation) -> Ranking:
        """See ``Strategy``; the worth is the judge's expected gain [m^3]."""
        positions, directions, utility = _proposals(situation)
        held = situation.held(positions, directions)
        expected = situation.judge.expect(held.poses)
        candidates = Candidates(
            poses=held.poses,
            worth=expected.gain_m3,
            cost_s=situation.cost_s(held.poses),
            gain_m3=expected.gain_m3,
            reachability=held.reachability,
            utility=utility[held.rows],
            void_gain=expected.void_m3,
            unknown_gain=expected.unknown_m3,
            frontier_gain=expected.frontier_m2,
        )
        return held.ranked(candidates)


def _proposals(situation: Situation) -> Proposals:
    by_utility = _by_utility(situation)
    positions, directions = situation.reach.sample(situation.settings.sampled, situation.random)
    return (
        np.concatenate([by_utility[0], positions]),
        np.concatenate([by_utility[1], directions]),
        np.concatenate([by_utility[2], np.zeros(len(positions))]),
    )


def _by_utility(situation: Situation) -> Proposals:
    """The free voxels of highest utility within reach, no two nearer than the suppression radius."""
    utility, settings = situation.utility, situation.settings
    assert utility is not None, "uses_utility says so"
    near = situation.reach.within_reach(utility.points)
    points = np.asarray(utility.points, dtype=float)[near]
    values = np.asarray(utility.utility, dtype=float)[near]
    directions = np.asarray(utility.direction, dtype=float)[near]
    poses = np.tile(np.eye(4), (len(points), 1, 1))
    poses[:, :3, 3] = points
    best = spread_out(values, poses, settings.utility_voxels, settings.suppression_radius_m, math.pi)
    return points[best], directions[best], values[best]
