"""What a strategy is: it is given a situation and ranks the views that the robot could take next."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from fv_exploration import Evaluation, OccupancyMap, Utility
from fv_exploration.explore_config import ViewSettings
from fv_exploration.strategy.ranking import Candidates, Ranking
from fv_exploration.strategy.reachable_views import FREE
from fv_exploration.view_geometry import angles_between, upright_poses
from fv_exploration.view_worth import ViewWorth

Array = NDArray[np.float64]


class Reach(Protocol):
    """Which views the robot can hold. Positions (N, 3) [m] and unit directions (N, 3) are those of the map frame."""

    def reachability(self, positions: Array, directions: Array) -> Array:
        """(N,) 0..1."""

    def within_reach(self, positions: Array) -> NDArray[np.bool_]:
        """(N,) which positions are worth being asked about: none beyond the reach is."""

    def sample(self, count: int, random: np.random.Generator) -> tuple[Array, Array]:
        """Positions and directions drawn from what the robot can hold; up to ``count``."""


@dataclass(frozen=True)
class HeldViews:
    """The proposed views that lie in free space and that the robot can hold.

    :param rows: (N,) which of the proposed ones they are.
    :param poses: (N, 4, 4) camera poses, map frame, the image upright.
    :param reachability: (N,) 0..1.
    """

    rows: NDArray[np.int64]
    poses: Array
    reachability: Array
    proposed: int
    in_free_space: int

    def ranked(self, candidates: Candidates) -> Ranking:
        """The answer of a strategy that made candidates of these views."""
        return Ranking(candidates, self.proposed, self.in_free_space)


@dataclass(frozen=True)
class Situation:
    """What a strategy is given for one decision; all of it in the map frame, none of it to be changed.

    :param map: the occupancy map: ``classify``, ``voxels``, bounds, resolution.
    :param evaluation: of that map: frontier and void voxels, void ellipsoids, frontier-voids.
    :param utility: of the free voxels (Algorithm 1); None for a strategy without ``uses_utility``.
    :param reach: which views the robot can hold.
    :param judge: what views are expected to show.
    :param T_map_sensor: (4, 4) where the camera is.
    :param joints: the robot's [rad or m], by name.
    :param settings: ``views`` of the configuration.
    :param random: seeded for this decision: equal seeds give equal choices.
    """

    map: OccupancyMap
    evaluation: Evaluation
    utility: Utility | None
    reach: Reach
    judge: ViewWorth
    T_map_sensor: Array
    joints: Mapping[str, float]
    settings: ViewSettings
    random: np.random.Generator

    def held(self, positions: Array, directions: Array) -> HeldViews:
        """Which views, positions (N, 3) [m] and unit directions (N, 3), are free and can be held."""
        free = np.nonzero(self.map.classify(positions) == FREE)[0]
        reachability = self.reach.reachability(positions[free], directions[free])
        holds = reachability >= self.settings.min_reachability
        rows = free[holds]
        poses = upright_poses(positions[rows], directions[rows])
        return HeldViews(rows, poses, reachability[holds], len(positions), len(free))

    def cost_s(self, poses: Array) -> Array:
        """(N,) seconds that views (N, 4, 4) cost: the scan, and a motion as long as the distance suggests."""
        distance = np.linalg.norm(poses[:, :3, 3] - self.T_map_sensor[:3, 3], axis=1)
        angle = angles_between(poses[:, :3, 2], self.T_map_sensor[:3, 2])
        motion = np.maximum(
            distance / self.settings.linear_m_s, angle / math.radians(self.settings.angular_deg_s)
        )
        return self.settings.scan_s + motion


class Strategy(Protocol):
    """Chooses where to look next. One object serves one exploration and may remember what it likes.

    Whatever needs a motion is the loop's (``motion_choice.py``): it plans to the best views that differ from each
    other, judges them where their motions end, drops what shows too little (``views/min_gain_m3``) or cannot be
    reached, and comes back after the next scan.
    """

    uses_utility: bool = False
    """Whether ``choose`` reads ``situation.utility``: where it does not, Algorithm 1 is not run."""

    def choose(self, situation: Situation) -> Ranking:
        """The views worth a motion, with their worth and cost; none: there is nothing left to see."""
