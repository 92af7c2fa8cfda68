"""A strategy: look at the frontier that takes the least time to look at."""

from dataclasses import dataclass

import numpy as np

from fv_exploration.strategy import Candidates, Ranking, Situation, Strategy
from fv_exploration.view_geometry import normalized


@dataclass
class NearestFrontier(Strategy):
    """Its fields are its parameters."""

    drawn: int = 2000  # positions of the camera that are tried
    near_m: float = 0.3  # from nearer a frontier is not looked at: a depth camera sees nothing there
    far_m: float = 1.5  # nor from farther

    def choose(self, situation: Situation) -> Ranking:
        """Drawn positions that the robot can hold, each looking at a drawn frontier voxel."""
        positions, _ = situation.reach.sample(self.drawn, situation.random)
        frontier = situation.evaluation.frontier
        if len(frontier) == 0:
            return Ranking()
        ahead = frontier[situation.random.integers(len(frontier), size=len(positions))] - positions
        distances = np.linalg.norm(ahead, axis=1)
        in_sight = (distances >= self.near_m) & (distances <= self.far_m)
        views = situation.held(positions[in_sight], normalized(ahead[in_sight]))
        worth = np.ones(len(views.poses))  # all alike: the cost alone ranks them
        return views.ranked(Candidates(views.poses, worth, situation.cost_s(views.poses)))
